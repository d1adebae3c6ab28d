"""Symmetries of tasks: changes of states and actions under which a task is the same."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rigid_envs.base.checks import Array

# A symmetry of a task, and the data on which it acts.


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


# Changes of rows of numbers by their names: vectors turned, components reversed, attitudes.

Quaternions = Iterable[Array]
"""Components w, x, y, z, each of shape (N,)."""
Pairs = Iterable[tuple[str, str]]
"""Names of the components of horizontal vectors."""

_PREFIXES = ("", "goal_", "reference_", "pass_")


def turned(row: Any, pairs: Pairs, angle: Array) -> Any:
    """A row with those of its vectors turned that are among the pairs of names."""
    c, s = np.cos(angle), np.sin(angle)
    new: dict[str, Array] = {}
    for a, b in pairs:
        if a in row._fields:
            x, y = getattr(row, a), getattr(row, b)
            new |= {a: c * x - s * y, b: s * x + c * y}
    return row._replace(**new)


def reversed_in(row: Any, names: Iterable[str], sign: Array) -> Any:
    """A row with those of its numbers that are among the names times a sign."""
    return row._replace(
        **{name: sign * getattr(row, name) for name in names if name in row._fields}
    )


def where_still(parameters: Mapping[str, Array], sign: Array) -> Array:
    """The sign; 1 on a turntable, which turns in one sense, so that no reflection is a symmetry."""
    return np.where(np.asarray(parameters.get("turntable_rate", 0.0)) == 0.0, sign, 1.0)


def product(p: Quaternions, q: Quaternions) -> tuple[Array, Array, Array, Array]:
    """Product p q of quaternions."""
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def about_z(angle: Array) -> tuple[Array, Array, Array, Array]:
    """Turns about the z-axis."""
    zero = np.zeros_like(angle)
    return np.cos(0.5 * angle), zero, zero, np.sin(0.5 * angle)


def attitude(row: Any, prefix: str = "") -> Quaternions:
    """The attitude in a row, under names with a prefix."""
    return [getattr(row, prefix + name) for name in "wxyz"]


def attitudes(row: Any, left: Quaternions | None = None, right: Quaternions | None = None) -> Any:
    """A row with all its attitudes multiplied by a quaternion from the left or the right."""
    new: dict[str, Array] = {}
    for prefix in _PREFIXES:
        if f"{prefix}w" in getattr(row, "_fields", ()):
            q = attitude(row, prefix)
            q = q if left is None else product(left, q)
            q = q if right is None else product(q, right)
            new |= {prefix + name: part for name, part in zip("wxyz", q, strict=True)}
    return row._replace(**new) if new else row


# Symmetries that several systems have.


def everywhere(point: Point, change: Callable[[Any], Any]) -> Point:
    """A point with the same change of state, auxiliary state and action."""
    aux = change(point.aux) if point.aux else point.aux
    return point._replace(y=change(point.y), aux=aux, action=change(point.action))


def turn_of_space(pairs: Pairs) -> Callable[[Point, Array], Point]:
    """R -> S R with the turn S about the vertical, by which vectors in world axes are turned."""
    return lambda point, angle: everywhere(
        point, lambda row: attitudes(turned(row, pairs, angle), left=about_z(angle))
    )


def turn_of_body(pairs: Pairs) -> Callable[[Point, Array], Point]:
    """R -> R S^-1 with the turn S about e3, by which vectors are turned in axes turned back."""
    return lambda point, angle: everywhere(
        point, lambda row: attitudes(turned(row, pairs, angle), right=about_z(-angle))
    )


POSITIONS = (("X", "Y"), ("goal_X", "goal_Y"), ("reference_X", "reference_Y"))


def _move(point: Point, offset: Array) -> Point:
    def change(row: Any) -> Any:
        places = [(a, k) for pair in POSITIONS for k, a in enumerate(pair) if a in row._fields]
        return row._replace(**{name: getattr(row, name) + offset[:, k] for name, k in places})

    return everywhere(point, change)


TRANSLATION = Symmetry("translation in the plane", _move, offsets)
