"""Rows of the leaderboard, read again: every figure must follow from the starts."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rigid_envs.catalogue import id_in_file, task_of
from rigid_envs.checks import Array, require
from rigid_envs.documents import checked_values, column, read_document
from rigid_envs.provenance import KINDS
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.scores.efficiency import Cost, cost_of
from rigid_envs.scores.result import FORMAT, Evaluation
from rigid_envs.scores.standing import (
    best_of,
    bounds_of,
    objection,
    other_task,
    refuse_impossible,
)
from rigid_envs.scores.starts import VERSION

__all__ = ["evaluation_of", "read_evaluation", "up_to_date"]

_LIMIT = 2**24  # bytes
_KINDS = {
    **{"env_id": str, "algo": str, "config": dict, "policy": dict, "starts": dict},
    **{"evaluation_version": int, "test_seed": int, "cost": list | None, "unranked": str | None},
}
_LEAST = ("success", "return", "length", "cost")


def read_evaluation(path: str | Path, *, anew: bool = False) -> Evaluation:
    """Read a row of the leaderboard, and compute its figures again.

    Args:
        path: A file that `Evaluation.save` wrote, or one with more entries beside.
        anew: Set it beside what is best known and what theory says now, not what was then.

    Raises:
        DamagedFileError: Another format, something else than was written, or figures that do not
            follow from the starts.
        FileNotFoundError: No such file.
    """
    mend = "write it anew: rigid-envs evaluate --out"
    with read_document(Path(path), FORMAT, _LIMIT, mend) as row:
        found = evaluation_of(row)
        return up_to_date(found) if anew else found


def evaluation_of(row: Mapping[str, Any]) -> Evaluation:
    """The evaluation that a row was made of.

    Args:
        row: JSON values.

    Raises:
        KeyError: An entry that is not there.
        ValueError: One that is not what it must be, or figures that do not follow from the starts.
    """
    own, where = checked_values(row, _KINDS), checked_values(row, KINDS)
    version, n = own["evaluation_version"], row["policy"]["episodes"]
    require(version == VERSION, version, "evaluation_version", str(VERSION))
    starts = {
        name: None if values is None else _of_starts(values, f"starts.{name}", n)
        for name, values in own["starts"].items()
    }
    best, bounds = starts.pop("best"), starts.pop("bound")
    known = {name: values for name, values in starts.items() if values is not None}
    for name in _LEAST:
        require(bool(np.isfinite(known[name]).all()), known[name], f"starts.{name}", "numbers")
    won = known["success"]
    require((won == 0.0) | (won == 1.0), won, "starts.success", "0 or 1")
    found = Evaluation(
        env_id=id_in_file(own["env_id"]),
        policy=own["algo"],
        config=own["config"],
        seed=own["test_seed"],
        cost=None if own["cost"] is None else _cost(own["cost"], known),
        values=known,
        best=best,
        bounds=bounds,
        provenance=where,
        unranked=own["unranked"],
    )
    for name, value in json.loads(json.dumps(found.summary())).items():
        told = own["policy"][name]
        if told != value and not _close(told, value):
            raise ValueError(f"policy.{name} = {told!r}; expected {value!r}, as the starts have it")
    return found


def up_to_date(found: Evaluation) -> Evaluation:
    """An evaluation beside what is best known and what theory says now; its file is not believed.

    Args:
        found: As it was read; one of an id that is not registered stays as it is.

    Raises:
        ValueError: Another cost than that of its id, or a success that costs less than theory
            allows.
    """
    env_id, config = found.env_id, found.config
    if env_id not in ENVIRONMENTS:
        return found
    cost = cost_of(env_id, task_of(env_id, config))
    if found.cost != cost:
        raise ValueError(f"cost = {found.cost}; expected {cost}")
    bounds = bounds_of(env_id, found.n, found.seed, config)
    if other_task(env_id, config) is None:
        refuse_impossible(cost, found.successes, found.costs, bounds)
    unranked = found.unranked or objection(env_id, config, found.seed, found.n)
    best = None if unranked else best_of(env_id, found.n)
    return replace(found, bounds=bounds, best=best, unranked=unranked)


def _close(told: Any, value: Any) -> bool:
    """Whether numbers, or lists or mappings of them, agree but for rounding."""
    if isinstance(value, dict):
        return (
            isinstance(told, dict)
            and told.keys() == value.keys()
            and all(_close(told[key], value[key]) for key in value)
        )
    if told is None or value is None:
        return told is value
    try:
        return bool(np.allclose(told, value, rtol=1e-9, atol=1e-12))
    except (TypeError, ValueError):
        return False


def _of_starts(values: Any, name: str, n: int) -> Array:
    found = column(values, name)
    require(len(found) == n, len(found), f"number of {name}", f"{n}, as there are episodes")
    return found


def _cost(entries: list[Any], known: Mapping[str, Array]) -> Cost:
    """The cost of an episode, one of the known quantities."""
    cost = Cost(*entries)
    checked_values(cost._asdict(), {"name": str, "unit": str, "floor": float})
    require(cost.name in known, cost.name, "cost", f"one of {sorted(known)}")
    return cost
