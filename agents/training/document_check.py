"""Check of the document of a checkpoint, before anything is restored from it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from rigid_envs.checks import require

from ..config.by_algorithm import Config

__all__ = ["check_document"]

_FREE = ("config", "manifest")  # compared elsewhere, where it is told how they differ
_SIGNED = ("_current_progress_remaining",)


def check_document(found: Mapping[str, Any], fresh: Mapping[str, Any], config: Config) -> None:
    """Refuse a document that a run cannot have written.

    Args:
        found: Document of the checkpoint.
        fresh: That of a checkpoint of a run that has not begun.
        config: Config of the run.

    Raises:
        ValueError: "member = value; expected ...".
    """
    _check_alike(found, fresh, "document")
    updates, most = found["iterations"], -(-config.total_timesteps // config.steps_per_update)
    require(0 <= updates <= most, updates, "iterations", f"an integer in [0, {most}]")
    counters, age = found["counters"], updates * config.steps_per_update
    ages = {
        "counters.num_timesteps": (counters["num_timesteps"], age),
        "counters._current_progress_remaining": (
            counters["_current_progress_remaining"],
            1.0 - age / config.total_timesteps,
        ),
        "logs.timesteps": (found["logs"]["timesteps"], age),
    }
    for name, (value, expected) in ages.items():
        require(value == expected, value, name, f"{expected} after {updates} updates")
    amounts = {f"counters.{key}": counters[key] for key in counters if key not in _SIGNED}
    amounts |= {f"spent[{k}]": value for k, value in enumerate(found["spent"])}
    amounts |= {f"learning_rates.{key}": min(each) for key, each in found["learning_rates"].items()}
    for name, value in (amounts | {"logs.seconds": found["logs"]["seconds"]}).items():
        require(value >= 0, value, name, "a number of at least 0")
    rate = counters.get("exploration_rate", 0.0)
    require(rate <= 1.0, rate, "counters.exploration_rate", "a number of at most 1")


def _check_alike(found: Any, like: Any, name: str) -> None:
    """Compare names and types of JSON values with those of others."""
    if isinstance(like, Mapping):
        require(isinstance(found, dict), found, name, "a mapping")
        keys = () if name.removeprefix("document.") in _FREE else like.keys()
        require(not keys or found.keys() == keys, sorted(found), name, f"entries {sorted(keys)}")
        for key in keys:
            _check_alike(found[key], like[key], f"{name}.{key}")
    elif isinstance(like, list):
        fits = isinstance(found, list) and len(found) == len(like)
        require(fits, found, name, f"a list of {len(like)}")
        for k, (value, each) in enumerate(zip(found, like, strict=True)):
            _check_alike(value, each, f"{name}[{k}]")
    elif isinstance(like, str):
        require(found == like, found, name, repr(like))
    else:
        _check_number(found, like, name)


def _check_number(found: Any, like: Any, name: str) -> None:
    if like is None:
        require(found is None or isinstance(found, float), found, name, "a number or null")
    elif isinstance(like, float):
        is_number = isinstance(found, int | float) and not isinstance(found, bool)
        require(is_number and math.isfinite(found), found, name, "a finite number")
    else:
        require(type(found) is type(like), found, name, "an integer")
