"""Park an upright coin: reach position, heading and roll phase by rolling and steering."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from rigid_envs.kernels import randoms
from rigid_envs.kernels.actions import clip_to_square
from rigid_envs.kernels.algebra import attitude, compose
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import atan2, cbrt, select
from rigid_envs.kernels.episode import Episode, NoAuxiliary
from rigid_envs.kernels.upright_coin import UPRIGHT_COIN, Input, Parameters, State
from rigid_envs.systems import UprightCoin
from rigid_envs.tasks.base import Array, Entry
from rigid_envs.tasks.coins import FAR, wrapped
from rigid_envs.tasks.fields import Number, Range, physical, setting, span
from rigid_envs.tasks.ground import Rolling
from rigid_envs.tasks.reduced.coin_park import COIN_POSE

__all__ = ["CoinPark"]

_SMOOTH = 1e-3  # smooths the roots at the origin
_UPRIGHT = math.sqrt(0.5)


class Action(NamedTuple):
    """Roll rate and steer rate, each as a fraction of its maximum."""

    roll_rate: float
    steer_rate: float


class Terms(NamedTuple):
    """Reward terms of `CoinPark`."""

    position: float
    heading: float
    side: float
    mismatch: float
    parked: float


class Constants(NamedTuple):
    """Largest rates [rad/s], tolerances [m, rad, rad], half side of the start square [m]."""

    largest_roll_rate: float
    largest_steer_rate: float
    position_tolerance: float
    heading_tolerance: float
    phase_tolerance: float
    start_half_width: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, tuple[()]]:
    """Position uniform in a square, heading and phase uniform; q = Rz(phi) Rx(pi / 2) Rz(psi)."""
    X = c.start_half_width * (2.0 * randoms.uniform(stream, 0) - 1.0)
    Y = c.start_half_width * (2.0 * randoms.uniform(stream, 1) - 1.0)
    heading, phase = randoms.direction(stream, 1 << 20), randoms.direction(stream, 1 << 21)
    turned = compose((heading[0], 0.0, 0.0, heading[1]), (_UPRIGHT, _UPRIGHT, 0.0, 0.0))
    q = compose(turned, (phase[0], 0.0, 0.0, phase[1]))
    return State(*q, X, Y, 0.0, 0.0), ()


@scalar
def actuate(
    a: Action, y: State, aux: NoAuxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """Roll rate and steer rate, set at once; without torque the path is an arc."""
    steer_rate, roll_rate = c.largest_steer_rate * a.steer_rate, c.largest_roll_rate * a.roll_rate
    return State(*attitude(y), y.X, y.Y, steer_rate, roll_rate), Input(0.0, 0.0)


@scalar
def outcome(
    y: State, u: Input, aux: NoAuxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[NoAuxiliary, Terms, float, bool, bool]:
    """Cost by the order of the Lie bracket that generates each direction (see `CoinPark`)."""
    X, Y = y.X / p.radius, y.Y / p.radius
    total, difference = atan2(y.z, y.w), atan2(y.y, y.x)
    heading, phase = wrapped(total + difference), wrapped(total - difference)
    distance = math.sqrt(X * X + Y * Y)
    mismatch = wrapped(max(min(X, FAR), -FAR) + phase)
    near = distance * p.radius <= c.position_tolerance
    parked = near & (abs(heading) <= c.heading_tolerance) & (abs(phase) <= c.phase_tolerance)
    side = min(abs(Y), FAR)
    terms = Terms(
        position=-min(distance, FAR),
        heading=-abs(heading),
        side=-math.sqrt(math.sqrt(side * side + _SMOOTH * _SMOOTH)),
        mismatch=-cbrt(math.sqrt(mismatch * mismatch + _SMOOTH * _SMOOTH)),
        parked=select(parked, 1.0, 0.0),
    )
    return aux, terms, dt * p.radius * abs(y.roll_rate), parked, parked


@scalar
def observe(y: State, aux: NoAuxiliary, p: Parameters, c: Constants) -> tuple[float, float]:
    """Position in radii."""
    X, Y = y.X / p.radius, y.Y / p.radius
    return min(max(X, -FAR), FAR), min(max(Y, -FAR), FAR)


@dataclass(frozen=True)
class CoinPark(Rolling):
    """Park an upright coin: position at the origin, heading and roll phase 0.

    Four dimensions, two controls: the coin rolls and is steered, also on the spot, but it cannot
    slip sideways.

    Why it is hard: turning on the spot corrects the heading, and rolling then reaches the position,
    but the final phase follows from the length of the path. To change the phase, the path must have
    another length than the straight one.

    Physics:
        ``(X', Y') = -radius psi' (cos phi, sin phi)`` with the heading phi and the roll phase psi.
        Both rates are set at once, so each step is an arc, exact to 4e-11 rad, and those of the
        start do not matter. Mass, moments and g have no effect on the motion, as the rates are
        given. phi and psi are within half a turn. Actions of 1 roll by `roll_per_step` and turn by
        `steer_per_step`. On the arc the coin needs the coefficient of friction ``radius |phi' psi'|
        / g``; what the jumps of the rates would need is not counted.

        The two control vector fields and their Lie brackets span 2, 3 and 4 dimensions (growth
        vector (2, 3, 4)). At the goal steering and rolling are directly controlled, the lateral
        offset y needs the bracket of the two, and the mismatch ``x + psi`` between rolled offset
        and phase needs the bracket of that with steering. There is no drift: nothing moves while
        the action is 0.

    Rewards:
        Each direction has the root of the order of the bracket that generates it. With p = (x, y)
        the offset in radii and m = x + psi within half a turn, ``position`` = ``-|p|``, ``heading``
        = ``-|phi|``, ``side`` = ``-sqrt(s)`` and ``mismatch`` = ``-cbrt(t)``: orders 1, 1, 2 and 3,
        where ``s = sqrt(y^2 + 0.001^2)`` and ``t = sqrt(m^2 + 0.001^2)`` round the roots off at 0.
        |p|, |x| and |y| are limited to 50 in all of them.
        ``parked`` = 1 in the step that parks the coin.

    Starting State:
        Position uniform in the square ``|X|, |Y| <= start_half_width``, heading and phase uniform.

    Episode End:
        The episode terminates when the coin is parked: its offset is at most `position_tolerance`,
        its heading at most `heading_tolerance` and its phase, within half a turn, at most
        `phase_tolerance`. That step is the success (`info["is_success"]`).

    Reference:
        `two_rolls` takes two straight rolls by a and b with turns between them, ``a u_1 + b u_2 =
        D`` and ``a + b = 2 pi k - psi`` with D the offset in radii and u the headings.

        Bound: no path is shorter than ``max(distance, radius |psi|)``, less the tolerance. Turning
        while rolling takes fewer steps.

    Version History:
        v0: first version.

    Source:
        Bloch, *Nonholonomic Mechanics and Control*, section 1.4; Murray & Sastry 1993,
        "Nonholonomic motion planning: steering using sinusoids", IEEE Transactions on Automatic
        Control 38.
    """

    m: Range = physical(1.0, "mass", "kg")
    radius: Range = physical(1.0, "radius of the rim", "m")
    I1: Range = physical(0.25, "moment about a diameter", "kg m^2")
    I3: Range = physical(0.5, "moment about the axis", "kg m^2")
    g: Range = physical(9.81, "gravitational acceleration", "m/s^2")
    slope: float = setting(0.0, Number("slope of the plane: level", "rad", 0.0, 0.0))
    roll_per_step: float = setting(
        math.pi / 8, Number("largest roll per control period", "rad", 1e-3, math.pi / 2)
    )
    steer_per_step: float = setting(
        math.pi / 8, Number("largest turn per control period", "rad", 1e-3, math.pi / 2)
    )
    start_half_width: float = setting(2.0, Number("half side of the start square", "m", 0.0, 20.0))
    position_tolerance: float = setting(0.1, Number("largest offset when parked", "m", 1e-6, 10.0))
    heading_tolerance: float = setting(0.1, Number("largest heading when parked", "rad", 1e-6, 3.2))
    phase_tolerance: float = setting(0.15, Number("largest phase when parked", "rad", 1e-6, 3.2))
    weight_position: float = setting(0.01, Number("weight of -|p|", "1", -1e3, 1e3))
    weight_heading: float = setting(0.01, Number("weight of -|phi|", "1", -1e3, 1e3))
    weight_side: float = setting(0.02, Number("weight of -sqrt|y|", "1", -1e3, 1e3))
    weight_mismatch: float = setting(0.02, Number("weight of -cbrt|x + psi|", "1", -1e3, 1e3))
    weight_parked: float = setting(10.0, Number("weight of the step that parks", "1", -1e3, 1e3))

    system_type: ClassVar = UprightCoin
    episode: ClassVar = Episode(
        dynamics=UPRIGHT_COIN,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        start=start,
        clip=clip_to_square,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = COIN_POSE
    cost_unit: ClassVar = "distance rolled [m]"

    @property
    def largest_roll_rate(self) -> float:
        """Roll rate at full action [rad/s]."""
        return self.roll_per_step / self.dt

    @property
    def largest_steer_rate(self) -> float:
        """Steer rate at full action [rad/s]."""
        return self.steer_per_step / self.dt

    def actions(self) -> tuple[Entry, ...]:
        """Roll rate psi' and steer rate phi'."""
        roll, steer = self.largest_roll_rate, self.largest_steer_rate
        return (
            Entry("psi'", "rad/s", "axis", -roll, roll),
            Entry("phi'", "rad/s", "world", -steer, steer),
        )

    def features(self) -> tuple[Entry, ...]:
        """Offset in radii."""
        return (
            Entry("X / radius", "1", "world", -FAR, FAR),
            Entry("Y / radius", "1", "world", -FAR, FAR),
        )

    def largest_rate(self, duration: float) -> float:
        """The larger of the two rates."""
        return max(self.roll_per_step, self.steer_per_step) / self.dt

    def lower_bound(self, y: Array) -> Array:
        """Lower bound on the path length [m]: max(distance, radius * abs(psi)) to the origin."""
        coin = UprightCoin()
        distance = np.hypot(*np.moveaxis(coin.contact(y), -1, 0))
        return np.asarray(np.maximum(distance, span(self.radius)[0] * np.abs(coin.phase(y))))
