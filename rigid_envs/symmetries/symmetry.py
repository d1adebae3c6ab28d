"""A symmetry of a task, and the data on which it acts."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

__all__ = [
    "Point",
    "Symmetry",
    "angles",
    "offsets",
    "quarter_turns",
    "rotations",
    "signs",
]

Array = npt.NDArray[np.float64]


class Point(NamedTuple):
    """N states with all that the next step depends on; each number is an array of shape (N,).

    Attributes:
        y: physical state, the `State` of the system.
        aux: auxiliary state, the `Auxiliary` of the task.
        parameters: physical parameters by the names of the system.
        action: action in the frame of the task, its `Action`.
    """

    y: Any
    aux: Any
    parameters: Mapping[str, Array]
    action: Any


@dataclass(frozen=True)
class Symmetry:
    """A symmetry, or a group of symmetries with one parameter.

    Attributes:
        name: what its elements do.
        apply: ``apply(point, elements) -> point``, with one element for each of N states.
        draw: ``draw(rng, n) -> elements``, shape (n, ...), at random.
    """

    name: str
    apply: Callable[[Point, Array], Point]
    draw: Callable[[np.random.Generator, int], Array]


def angles(rng: np.random.Generator, n: int) -> Array:
    """Angles of turns [rad]: the group SO(2)."""
    return rng.uniform(-math.pi, math.pi, n)


def quarter_turns(rng: np.random.Generator, n: int) -> Array:
    """Numbers of quarter turns, 0 to 3: the cyclic group of order 4."""
    return rng.integers(0, 4, n).astype(np.float64)


def rotations(rng: np.random.Generator, n: int) -> Array:
    """Unit quaternions, shape (n, 4): the group SO(3)."""
    q = rng.standard_normal((n, 4))
    return np.asarray(q / np.linalg.norm(q, axis=-1, keepdims=True))


def offsets(rng: np.random.Generator, n: int) -> Array:
    """Translations by up to 3 m along each axis of the plane, shape (n, 2)."""
    return rng.uniform(-3.0, 3.0, (n, 2))


def signs(rng: np.random.Generator, n: int) -> Array:
    """1 for no change, -1 for a reflection or half turn: a group of order 2."""
    return rng.choice([-1.0, 1.0], n)
