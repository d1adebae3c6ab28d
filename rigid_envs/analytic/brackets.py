"""Lie brackets of the control vector fields of rolling bodies, and their growth vectors.

A control system x' = u1 f1(x) + u2 f2(x) + ... moves along f1, f2, ... by its controls, and along
their brackets [f, g] = Dg f - Df g by small loops: f and g on for a time e each, then both back,
shift x by e^2 [f, g]. How many directions the brackets of each depth add is the growth vector; for
the rolling ball (2, 3, 5), for the upright coin (2, 3, 4). Derivatives are exact, by dual numbers.

A field is a function of the state that returns its rate, an array, and is written with
+ - * /, np.sin and np.cos, so that it takes dual numbers, too.

Sources: Murray, Li & Sastry, A Mathematical Introduction to Robotic Manipulation, ch. 7; Agrachev &
Sachkov, Control Theory from the Geometric Viewpoint, ch. 5 and 24 (rolling bodies).
"""

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigid_envs.analytic._dual import Dual
from rigid_envs.checks import Array, exact_array, integer, positive, require

__all__ = [
    "Field",
    "ball_fields",
    "bracket",
    "bracket_norms",
    "coin_fields",
    "degree_of_nonholonomy",
    "growth_vector",
    "iterated_brackets",
]

Field = Callable[[NDArray[Any]], NDArray[Any]]


def ball_fields(radius: float) -> tuple[Field, Field]:
    """Control fields of a rolling ball: unit velocity of the centre along x and along y.

    State (X, Y, w, x, y, z): place of the centre [m] and attitude, a unit quaternion, body to
    world, with q' = (0, omega) q / 2 and omega = (-v_y, v_x, 0) / radius. Its first bracket is a
    spin of -1 / radius^2 about the vertical.

    Args:
        radius: of the ball [m].

    Raises:
        ValueError: a radius that is not positive.

    Source: Jurdjevic (1993), Arch. Rational Mech. Anal. 124:305, doi:10.1007/BF00375605.
    """
    positive(radius, "radius")
    rate = 0.5 / radius

    def along_x(state: NDArray[Any]) -> NDArray[Any]:
        _, _, w, x, y, z = state
        return np.array([1.0, 0.0, -rate * y, rate * z, rate * w, -rate * x])

    def along_y(state: NDArray[Any]) -> NDArray[Any]:
        _, _, w, x, y, z = state
        return np.array([0.0, 1.0, rate * x, -rate * w, rate * z, -rate * y])

    return along_x, along_y


def coin_fields(radius: float) -> tuple[Field, Field]:
    """Control fields of an upright coin: rolling at unit psi' and steering at unit phi'.

    State (x, y, phi, psi): place [m], heading and phase [rad], with x' = -radius psi' cos(phi) and
    y' = -radius psi' sin(phi). Their bracket is a motion of the speed radius sideways.

    Args:
        radius: of the coin [m].

    Raises:
        ValueError: a radius that is not positive.

    Source: Bloch, Nonholonomic Mechanics and Control, sec. 1.4 and 4.2.
    """
    positive(radius, "radius")

    def roll(state: NDArray[Any]) -> NDArray[Any]:
        return np.array([-radius * np.cos(state[2]), -radius * np.sin(state[2]), 0.0, 1.0])

    def steer(state: NDArray[Any]) -> NDArray[Any]:
        return np.array([0.0, 0.0, 1.0, 0.0])

    return roll, steer


def bracket(first: Field, second: Field) -> Field:
    """Lie bracket [f, g] = Dg f - Df g of two fields, a field again.

    Args:
        first: f.
        second: g.

    Source: Murray, Li & Sastry, sec. 7.2.
    """

    def field(state: NDArray[Any]) -> NDArray[Any]:
        forth, back = _along(second, state, first(state)), _along(first, state, second(state))
        return np.asarray(forth - back)

    return field


def iterated_brackets(fields: Sequence[Field], state: ArrayLike, depth: int) -> tuple[Array, ...]:
    """Values of the fields and of their brackets [f_i, [f_j, ... [f_k, f_l]]] up to a depth.

    These nested brackets span all brackets of their depth.

    Args:
        fields: control fields.
        state: where, shape (dim,).
        depth: 1 for the fields alone, 2 with their brackets, and so on.

    Returns:
        For each depth the values, shape (number of brackets, dim).

    Raises:
        ValueError: a state that is not a finite vector, or a depth below 1.

    Source: Murray, Li & Sastry, sec. 7.2.
    """
    at, depth = exact_array(state, "state", "dim"), integer(depth, "depth", 1)
    levels = [list(fields)]
    if depth > 1:
        levels.append([bracket(f, g) for f, g in combinations(fields, 2)])
    while len(levels) < depth:
        levels.append([bracket(f, inner) for f in fields for inner in levels[-1]])
    shape = (-1, at.size)
    return tuple(
        np.array([field(at) for field in level], dtype=np.float64).reshape(shape)
        for level in levels
    )


def bracket_norms(fields: Sequence[Field], state: ArrayLike, depth: int) -> tuple[Array, ...]:
    """Norms of the brackets of `iterated_brackets`.

    Args:
        fields: control fields.
        state: where, shape (dim,).
        depth: as in `iterated_brackets`.

    Returns:
        For each depth the Euclidean lengths, shape (number of brackets,), in units of the state.

    Raises:
        ValueError: as `iterated_brackets`.
    """
    levels = iterated_brackets(fields, state, depth)
    return tuple(np.linalg.norm(level, axis=-1) for level in levels)


def growth_vector(fields: Sequence[Field], state: ArrayLike, depth: int) -> tuple[int, ...]:
    """Dimensions spanned by the brackets up to each depth.

    Args:
        fields: control fields.
        state: where, shape (dim,).
        depth: of the last entry.

    Returns:
        Numerical ranks, one for each depth from 1 on: each bracket is scaled to unit length, and
        what is below the rounding of their singular values does not count.

    Raises:
        ValueError: as `iterated_brackets`.

    Source: Montgomery, A Tour of Subriemannian Geometries, sec. 2.3.
    """
    rows = np.empty((0, np.size(state)))
    ranks = []
    for level in iterated_brackets(fields, state, depth):
        length = np.linalg.norm(level, axis=-1, keepdims=True)
        rows = np.concatenate([rows, level / np.where(length > 0.0, length, 1.0)])
        ranks.append(int(np.linalg.matrix_rank(rows)))
    return tuple(ranks)


def degree_of_nonholonomy(growth: Sequence[int], dimension: int) -> int:
    """Degree of nonholonomy: depth of brackets that span every direction.

    A motion of size e in the last directions takes controls of the size of its root of this degree.

    Args:
        growth: growth vector.
        dimension: of the space of states; a unit quaternion counts 3.

    Raises:
        ValueError: the growth vector does not reach the dimension.

    Source: Montgomery, A Tour of Subriemannian Geometries, sec. 2.4.
    """
    expected = (
        f"to reach {dimension}: go to a larger depth, or the system cannot be steered everywhere"
    )
    require(dimension in growth, tuple(growth), "growth", expected)
    return list(growth).index(dimension) + 1


def _along(field: Field, state: NDArray[Any], direction: NDArray[Any]) -> NDArray[Any]:
    """Derivative of a field along a direction, exact, shape (dim,)."""
    moved = np.array([Dual(x, d) for x, d in zip(state, direction, strict=True)], dtype=object)
    rates = [rate.slope if isinstance(rate, Dual) else 0.0 for rate in field(moved)]
    return np.array(rates)
