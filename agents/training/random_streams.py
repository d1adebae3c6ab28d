"""The random streams of a training: captured, checked and restored.

They are the global ones of Python, NumPy and torch (SB3 permutes batches with NumPy's and explores
with torch's), and that of the first, random actions and of DQN's exploration.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from rigid_envs.checks import require

__all__ = ["capture_random", "check_random", "restore_random"]

Arrays = Mapping[str, NDArray[Any]]
Stream = np.random.BitGenerator


def capture_random(actions: Stream) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """States of all streams.

    Args:
        actions: Stream of the actions.

    Returns:
        Arrays and JSON values that `restore_random` takes.
    """
    version, words, next_gauss = random.getstate()
    kind, key, position, has_gauss, gauss = np.random.get_state()  # noqa: NPY002
    arrays = {
        "python": np.array(words, dtype=np.uint64),
        "numpy": np.asarray(key),
        "torch": torch.get_rng_state().numpy(),
    }
    document = {
        "python": [version, next_gauss],
        "numpy": [kind, position, has_gauss, gauss],
        "actions": actions.state,
    }
    return arrays, document


def restore_random(actions: Stream, arrays: Arrays, document: Mapping[str, Any]) -> None:
    """Bring all streams to captured states.

    Args:
        actions: Stream of the actions.
        arrays: From `capture_random`.
        document: From `capture_random`.
    """
    random.setstate(_python(arrays, document))
    np.random.set_state(_numpy(arrays, document))  # noqa: NPY002
    torch.set_rng_state(torch.tensor(arrays["torch"]))
    actions.state = document["actions"]


def check_random(actions: Stream, arrays: Arrays, document: Mapping[str, Any]) -> None:
    """Refuse states that streams of their kind do not take, or do not give back.

    Args:
        actions: Stream of the actions.
        arrays: From `capture_random`.
        document: From `capture_random`.

    Raises:
        ValueError: "member = value; expected ...".
    """
    python, numpy = random.Random(), np.random.RandomState()
    generator, other = torch.Generator(), type(actions)()
    _check(
        "python",
        lambda: python.setstate(_python(arrays, document)),
        lambda: python.getstate() == _python(arrays, document),
    )
    _check(
        "numpy",
        lambda: numpy.set_state(_numpy(arrays, document)),
        lambda: _equal(numpy.get_state(), _numpy(arrays, document)),
    )
    position, has_gauss = document["numpy"][1:3]  # which NumPy does not check
    require(
        0 <= position <= len(arrays["numpy"]) and has_gauss in (0, 1),
        document["numpy"],
        "random.numpy",
        "a position in [0, 624], and whether a number is kept",
    )
    _check(
        "torch",
        lambda: generator.set_state(torch.tensor(arrays["torch"])),
        lambda: np.array_equal(generator.get_state().numpy(), arrays["torch"]),
    )
    _check(
        "actions",
        lambda: setattr(other, "state", document["actions"]),
        lambda: other.state == document["actions"],
    )


def _check(name: str, give: Callable[[], object], is_back: Callable[[], bool]) -> None:
    try:
        give()
        same, why = is_back(), "another state"
    except (ValueError, TypeError, OverflowError, LookupError, RuntimeError) as error:
        same, why = False, f"{error}"
    require(same, why.splitlines()[:1], f"random/{name}", "a state of its random stream")


def _equal(state: Any, other: Any) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(state, other, strict=True))


def _python(arrays: Arrays, document: Mapping[str, Any]) -> tuple[Any, ...]:
    version, next_gauss = document["python"]
    return version, tuple(arrays["python"].tolist()), next_gauss


def _numpy(arrays: Arrays, document: Mapping[str, Any]) -> tuple[Any, ...]:
    kind, *rest = document["numpy"]
    return kind, arrays["numpy"], *rest
