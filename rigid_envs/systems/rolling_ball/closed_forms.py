"""Rolling of a ball along curves in closed form, and its controllability."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import fresnel

from rigid_envs.base.checks import (
    Array,
    all_finite,
    all_positive,
    array,
    exact_array,
    integer,
    number,
    positive,
    positive_array,
    require,
)
from rigid_envs.mechanics import special

# Drives of a rolling ball: its centre, a plate on top of it, or the plane under it.


class Arrangement(NamedTuple):
    """Velocities per unit of the commanded velocity.

    Attributes:
        centre: of the centre in the world.
        roll: of the centre relative to the plane it rolls on: this is what turns the ball.
    """

    centre: float
    roll: float


ARRANGEMENTS = MappingProxyType(
    {
        "fixed_plane": Arrangement(centre=1.0, roll=1.0),
        "top_plate": Arrangement(centre=0.5, roll=0.5),
        "plane_under_fixed_centre": Arrangement(centre=0.0, roll=-1.0),
    }
)
"""The commanded velocity is that of the centre over a plane at rest (`fixed_plane`), of a plate
that lies on the ball while the plane under it is at rest (`top_plate`: the centre lags by half), or
of the plane while the centre is held (`plane_under_fixed_centre`). Source: Jurdjevic (1993)."""


# Straight rolls, each a rotation about a horizontal axis, and sequences of them.


def roll_straight(displacement: ArrayLike, radius: float, *, twist: ArrayLike = 0.0) -> Array:
    """Turn of a straight roll: the rotation vector (-d_y / radius, d_x / radius, twist).

    Args:
        displacement: of the centre, shape (..., 2) [m], world.
        radius: of the ball [m].
        twist: angle spun about the vertical meanwhile, uniformly, broadcast with (...) [rad].

    Returns:
        Turn, shape (..., 4).

    Raises:
        ValueError: the displacement has not two components, or the radius is not positive.
    """
    positive(radius, "radius")
    moved = array(displacement, "displacement", 2)
    parts = np.broadcast_arrays(
        -moved[..., 1] / radius, moved[..., 0] / radius, array(twist, "twist")
    )
    return special.from_rotation_vector(np.stack(parts, axis=-1))


def roll_polygon(displacements: ArrayLike, radius: float) -> Array:
    """Turn of straight rolls one after the other: their product, the last on the left.

    Args:
        displacements: of the centre in each roll, shape (n, 2) [m], world.
        radius: of the ball [m].

    Returns:
        Turn, shape (4,).

    Raises:
        ValueError: a wrong shape, or the radius is not positive.
    """
    rolls = array(displacements, "displacements", 2)
    if rolls.ndim != 2:
        raise ValueError(f"displacements has shape {rolls.shape}; expected (n, 2)")
    total = np.array([1.0, 0.0, 0.0, 0.0])
    for turn in roll_straight(rolls, radius):
        total = special.product(turn, total)
    return total


def roll_segments(t: ArrayLike, segments: ArrayLike, radius: float) -> tuple[Array, Array]:
    """Displacement and turn of a ball under piecewise constant velocity.

    Args:
        t: times, any shape [s], 0 up to the sum of the durations.
        segments: shape (n, 4): v_x, v_y [m/s], spin omega_z [rad/s], duration [s], world.
        radius: of the ball [m].

    Returns:
        Displacement of the centre since t = 0, shape t.shape + (2,) [m], and turn since t = 0,
        shape t.shape + (4,).

    Raises:
        ValueError: a wrong shape, a negative duration, a time outside the segments, or the radius
            is not positive.
    """
    times, rows = array(t, "t"), exact_array(segments, "segments", "n", 4)
    require(rows[:, 3] >= 0.0, rows, "segments", "v_x, v_y, spin and a duration of at least 0")
    span = float(np.sum(rows[:, 3]))
    inside = (times >= 0.0) & (times <= span)
    require(inside, times, "t", f"a time within the segments, 0 to {span} [s]")
    moved = np.zeros((*times.shape, 2))
    turn = np.broadcast_to(np.array([1.0, 0.0, 0.0, 0.0]), (*times.shape, 4))
    begin = np.cumsum(rows[:, 3]) - rows[:, 3]
    for (v_x, v_y, spin, duration), start in zip(rows, begin, strict=True):
        spent = np.clip(times - start, 0.0, duration)
        step = spent[..., np.newaxis] * np.array([v_x, v_y])
        moved = moved + step
        turn = special.product(roll_straight(step, radius, twist=spin * spent), turn)
    return moved, turn


# Rolling round a circle: omega is constant in a frame that turns with the centre.


def roll_circle(
    t: ArrayLike,
    *,
    radius: float,
    circle_radius: float,
    rate: float,
    phase: float = 0.0,
    spin: float = 0.0,
) -> tuple[Array, Array]:
    """Place and turn of a ball whose centre runs uniformly round a circle about the origin.

    With rho = circle_radius / radius and angle = phase + rate t, omega is Rz(angle) w for the
    constant w = (-rho rate, 0, spin), hence

        turn = Rz(angle) exp(t (w - rate e_z)) Rz(-phase).

    Args:
        t: times, any shape [s].
        radius: of the ball [m].
        circle_radius: of the circle that the centre runs on [m].
        rate: angular velocity of the centre, positive counter-clockwise [rad/s].
        phase: angle of the centre at t = 0, from world x [rad].
        spin: constant omega_z of the ball [rad/s].

    Returns:
        Position of the centre from the circle's own centre, shape t.shape + (2,) [m], and turn
        since t = 0, shape t.shape + (4,).

    Raises:
        ValueError: a radius that is not positive.
    """
    all_positive(radius=radius, circle_radius=circle_radius)
    all_finite(rate=rate, phase=phase, spin=spin)
    times = array(t, "t")
    angle = phase + rate * times
    place = circle_radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    steady = np.array([-circle_radius / radius * rate, 0.0, spin - rate])
    inner = special.from_rotation_vector(times[..., np.newaxis] * steady)
    turn = special.product(inner, special.about_vertical(np.full_like(times, -phase)))
    return place, special.product(special.about_vertical(angle), turn)


def circle_holonomy(circle_radius: ArrayLike, radius: float, *, phase: float = 0.0) -> Array:
    """Turn of one round of a circle, counter-clockwise, without spin about the vertical.

    exp(2 pi (-rho, 0, -1)) for rho = circle_radius / radius, turned about z by the phase. Less one
    whole turn, its angle is 2 pi (sqrt(1 + rho^2) - 1): for small circles pi rho^2 = A / radius^2
    about -z, for rho = sqrt(3) nothing at all. Clockwise it is the inverse.

    Args:
        circle_radius: of the circle that the centre runs on, any shape [m].
        radius: of the ball [m].
        phase: angle of the centre at the start, from world x [rad].

    Returns:
        Turn, shape circle_radius.shape + (4,).

    Raises:
        ValueError: a radius that is not positive.
    """
    all_finite(phase=phase)
    rho = positive_array(circle_radius, "circle_radius", "m") / positive(radius, "radius", "m")
    root = np.sqrt(1.0 + rho * rho)
    angle = 2.0 * np.pi * rho * rho / (1.0 + root)  # 2 pi (root - 1), without the cancellation
    axis = np.stack([-rho * np.cos(phase), -rho * np.sin(phase), -np.ones_like(rho)], axis=-1)
    return special.from_rotation_vector((angle / root)[..., np.newaxis] * axis)


def circle_rotation_vector(
    circle_radius: ArrayLike, radius: float, *, phase: float = 0.0, spin_per_rate: float = 0.0
) -> Array:
    """Rotation vector of one counter-clockwise round, whole turns included.

    2 pi (-rho, 0, spin / rate - 1) for rho = circle_radius / radius, turned about z by the phase.
    Its length without spin is 2 pi sqrt(1 + rho^2); `circle_holonomy` is its rotation.

    Args:
        circle_radius: of the circle that the centre runs on, any shape [m].
        radius: of the ball [m].
        phase: angle of the centre at the start, from world x [rad].
        spin_per_rate: constant omega_z of the ball over the angular velocity of the centre.

    Returns:
        Rotation vector, shape circle_radius.shape + (3,) [rad], world.

    Raises:
        ValueError: a radius that is not positive.

    Source: Hammersley (1983).
    """
    all_finite(phase=phase, spin_per_rate=spin_per_rate)
    rho = positive_array(circle_radius, "circle_radius", "m") / positive(radius, "radius", "m")
    vertical = np.full_like(rho, spin_per_rate - 1.0)
    return 2.0 * np.pi * np.stack([-rho * np.cos(phase), -rho * np.sin(phase), vertical], axis=-1)


# Rolling along a clothoid, whose curvature grows with the arc length: Landau and Zener's ball.
#
# At finite times the attitude is a Kummer function of complex order; what is elementary is the
# path, and how far the complete clothoid, from one eye to the other, tips the ball.


def clothoid_path(t: ArrayLike, *, speed: float, heading_acceleration: float) -> Array:
    """Path of a centre with constant speed and the heading k t^2 / 2 from world x.

    x + i y = speed sqrt(pi / k) (C(z) + i S(z)),  z = t sqrt(k / pi), mirrored for k < 0.

    Args:
        t: times, negative ones included, any shape [s].
        speed: of the centre [m/s].
        heading_acceleration: k, not 0 [rad/s^2].

    Returns:
        Displacement of the centre since t = 0, shape t.shape + (2,) [m], world.

    Raises:
        ValueError: heading_acceleration is 0, or a number is not finite.

    Source: DLMF 7.2(iii), 7.20(ii).
    """
    k, v = number(heading_acceleration, "heading_acceleration"), number(speed, "speed")
    expected = "a number other than 0 [rad/s^2]: use roll_straight instead"
    require(k != 0.0, heading_acceleration, "heading_acceleration", expected)
    scale = math.sqrt(math.pi / abs(k))
    sine, cosine = fresnel(array(t, "t") / scale)
    return np.asarray(v * scale * np.stack([cosine, math.copysign(1.0, k) * sine], axis=-1))


def complete_clothoid_angle(*, speed: float, heading_acceleration: float, radius: float) -> float:
    """Angle by which a ball is tipped that rolls a whole clothoid, t from -inf to inf [rad].

    cos(angle / 2) = exp(-pi (speed / radius)^2 / (4 k)), so that the 33 element of the turn is
    2 exp(-pi (speed / radius)^2 / (2 k)) - 1. The axis of the turn tends to the horizontal, but in
    no direction: that drifts with the logarithm of the time.

    Args:
        speed: of the centre, without spin about the vertical [m/s].
        heading_acceleration: k of the heading k t^2 / 2, positive [rad/s^2].
        radius: of the ball [m].

    Raises:
        ValueError: a number that is not positive.

    Source: Zener (1932), Proc. R. Soc. A 137:696, doi:10.1098/rspa.1932.0165; Rojo & Bloch (2010),
        The rolling sphere, the quantum spin and a simple view of the Landau-Zener problem,
        arXiv:0906.2934.
    """
    all_positive(speed=speed, heading_acceleration=heading_acceleration, radius=radius)
    exponent = -0.5 * math.pi * (speed / radius) ** 2 / heading_acceleration
    return 2.0 * math.atan2(math.sqrt(-math.expm1(exponent)), math.exp(0.5 * exponent))


# Dual numbers: exact first derivatives, and exact higher ones where they are nested.


@dataclass(frozen=True)
class _Dual:
    """The number value + slope e with e^2 = 0; both may be dual themselves.

    NumPy calls `sin` and `cos` of an object array on its elements.

    Source: Clifford (1873), Proc. London Math. Soc. 4:381, doi:10.1112/plms/s1-4.1.381.
    """

    value: Any
    slope: Any

    def __add__(self, other: Any) -> _Dual:
        """Sum."""
        other = _dual(other)
        return _Dual(self.value + other.value, self.slope + other.slope)

    __radd__ = __add__

    def __neg__(self) -> _Dual:
        """Negative."""
        return _Dual(-self.value, -self.slope)

    def __sub__(self, other: Any) -> _Dual:
        """Difference."""
        other = _dual(other)
        return _Dual(self.value - other.value, self.slope - other.slope)

    def __rsub__(self, other: Any) -> _Dual:
        """Difference, the dual number second."""
        return _dual(other) - self

    def __mul__(self, other: Any) -> _Dual:
        """Product."""
        other = _dual(other)
        slope = self.value * other.slope + self.slope * other.value
        return _Dual(self.value * other.value, slope)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> _Dual:
        """Quotient."""
        other = _dual(other)
        ratio = self.value / other.value
        return _Dual(ratio, (self.slope - ratio * other.slope) / other.value)

    def __rtruediv__(self, other: Any) -> _Dual:
        """Quotient, the dual number below."""
        return _dual(other) / self

    def sin(self) -> _Dual:
        """Sine."""
        return _Dual(np.sin(self.value), self.slope * np.cos(self.value))

    def cos(self) -> _Dual:
        """Cosine."""
        return _Dual(np.cos(self.value), -(self.slope * np.sin(self.value)))


def _dual(number: Any) -> _Dual:
    """The number itself, or a constant without slope."""
    return number if isinstance(number, _Dual) else _Dual(number, 0.0)


# Lie brackets of the control vector fields of rolling bodies, and their growth vectors.
#
# A control system x' = u1 f1(x) + u2 f2(x) + ... moves along f1, f2, ... by its controls, and along
# their brackets [f, g] = Dg f - Df g by small loops: f and g on for a time e each, then both back,
# shift x by e^2 [f, g]. How many directions the brackets of each depth add is the growth vector;
# for the rolling ball (2, 3, 5), for the upright coin (2, 3, 4). Derivatives are exact, by dual
# numbers.
#
# A field is a function of the state that returns its rate, an array, and is written with
# + - * /, np.sin and np.cos, so that it takes dual numbers, too.
#
# Sources: Murray, Li & Sastry, A Mathematical Introduction to Robotic Manipulation, ch. 7; Agrachev
# & Sachkov, Control Theory from the Geometric Viewpoint, ch. 5 and 24 (rolling bodies).

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
    moved = np.array([_Dual(x, d) for x, d in zip(state, direction, strict=True)], dtype=object)
    rates = [rate.slope if isinstance(rate, _Dual) else 0.0 for rate in field(moved)]
    return np.array(rates)
