"""Park an upright coin: reach place, heading and roll phase by rolling and steering."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rigid_envs.kernels import episode, randoms, upright_coin
from rigid_envs.kernels.actions import clip_to_square
from rigid_envs.kernels.algebra import Row, compose
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.elementary import atan2, cbrt, select
from rigid_envs.kernels.layout import Memory, Shapes
from rigid_envs.systems import UprightCoin
from rigid_envs.tasks.base import Array, Entry, Task
from rigid_envs.tasks.fields import Number, Range, physical, setting, span

__all__ = ["CoinPark"]

_FAR = 50.0  # radii; offsets are observed and punished no further than this
_SMOOTH = 1e-3  # rounds the roots off at the origin
_UPRIGHT = math.sqrt(0.5)
_ROLL, _STEER, _POSITION, _HEADING, _PHASE, _SQUARE = range(5, 11)  # after the five weights


@scalar
def start(stream: randoms.Stream, p: Row, c: Row) -> tuple[Row, Row]:
    """Place uniform in a square, heading and phase uniform; q = Rz(phi) Rx(pi / 2) Rz(psi)."""
    x = c[_SQUARE] * (2.0 * randoms.uniform(stream, 0) - 1.0)
    y = c[_SQUARE] * (2.0 * randoms.uniform(stream, 1) - 1.0)
    heading, phase = randoms.direction(stream, 1 << 20), randoms.direction(stream, 1 << 21)
    turned = compose((heading[0], 0.0, 0.0, heading[1]), (_UPRIGHT, _UPRIGHT, 0.0, 0.0))
    return (*compose(turned, (phase[0], 0.0, 0.0, phase[1])), x, y, 0.0, 0.0), ()


@scalar
def actuate(a: Row, y: Row, memo: Row, p: Row, c: Row) -> tuple[Row, Row]:
    """Roll rate and steer rate, at once; no torque, so the way is an arc."""
    place = (y[0], y[1], y[2], y[3], y[4], y[5])
    return (*place, c[_STEER] * a[1], c[_ROLL] * a[0]), (0.0, 0.0)


@scalar
def wrapped(angle: float) -> float:
    """The same angle in [-pi, pi], for one in [-60 pi, 60 pi]."""
    turns: float = np.floor(angle * (0.5 / math.pi) + 0.5)
    return angle - 2.0 * math.pi * turns


@scalar
def judge(
    y: Row, u: Row, memo: Row, p: Row, c: Row, dt: float
) -> tuple[Row, Row, float, bool, bool]:
    """Cost by the order of the Lie bracket that generates each direction (see `CoinPark`)."""
    x, side = y[4] / p[1], y[5] / p[1]
    total, difference = atan2(y[3], y[0]), atan2(y[2], y[1])
    heading, phase = wrapped(total + difference), wrapped(total - difference)
    distance = math.sqrt(x * x + side * side)
    mismatch = wrapped(max(min(x, _FAR), -_FAR) + phase)
    near = distance * p[1] <= c[_POSITION]
    parked = near & (abs(heading) <= c[_HEADING]) & (abs(phase) <= c[_PHASE])
    off = min(abs(side), _FAR)
    terms = (
        -min(distance, _FAR),
        -abs(heading),
        -math.sqrt(math.sqrt(off * off + _SMOOTH * _SMOOTH)),
        -cbrt(math.sqrt(mismatch * mismatch + _SMOOTH * _SMOOTH)),
        select(parked, 1.0, 0.0),
    )
    return memo, terms, dt * p[1] * abs(y[7]), parked, parked


@scalar
def observe(y: Row, memo: Row, p: Row, c: Row) -> Row:
    """Position in radii."""
    x, y_ = y[4] / p[1], y[5] / p[1]
    return (min(max(x, -_FAR), _FAR), min(max(y_, -_FAR), _FAR))


SHAPES = Shapes(*upright_coin.SHAPES, (1.0,) * 6, (), (0.0,) * 2, (0.0,) * 11)


@kernel
def step(memory: Memory, first_block: int, last_block: int) -> int:
    """`episode.step` of this task."""
    return episode.step(
        upright_coin.step,
        upright_coin.restore,
        upright_coin.WEIGHTS,
        clip_to_square,
        actuate,
        judge,
        observe,
        SHAPES,
        memory,
        first_block,
        last_block,
    )


@kernel
def reset(memory: Memory, rows: Array, mode: int) -> None:
    """`episode.reset` of this task."""
    episode.reset(upright_coin.derive, start, observe, SHAPES, memory, rows, mode)


@dataclass(frozen=True)
class CoinPark(Task):
    """Park an upright coin: place at the origin, heading and roll phase 0.

    Four dimensions, two controls: the coin rolls and is steered, also where it stands, but it
    cannot slip sideways.

    Why it is hard: turning on the spot brings the heading right; the place can then be reached by
    rolling, but the phase arrives as it will. To change it a way must be gone whose length is not
    that of the straight one.

    Physics:
        ``(X', Y') = -radius psi' (cos phi, sin phi)`` with the heading phi and the roll phase psi.
        Both rates are set at once, so each step is an exact arc. Mass, moments and g have no effect
        on a coin whose rates are given.

        The two fields of controls and their Lie brackets span 2, 3 and 4 dimensions (growth vector
        (2, 3, 4)): at the goal steering and rolling are at hand, the side y takes a commutator of
        the two, and the mismatch ``x + psi`` between what was rolled and what is turned takes a
        commutator of that with steering. Nothing moves while the action is 0.

    Rewards:
        The cost weighs every direction by the order of the bracket that generates it. With p = (x,
        y) the offset in radii and m = x + psi within half a turn, ``position`` = ``-|p|``,
        ``heading`` = ``-|phi|``, ``side`` = ``-sqrt(|y|)`` and ``mismatch`` = ``-cbrt(|m|)``:
        orders 1, 1, 2 and 3, with roots that are rounded off within 0.001 of 0. |p|, |x| and |y|
        count up to 50. ``parked`` = 1 in the step that parks the coin.

    Starting State:
        Place uniform in the square ``|X|, |Y| <= start_half_width``, heading and phase uniform.

    Episode End:
        The episode terminates when the coin is parked: its offset is at most `position_tolerance`,
        its heading at most `heading_tolerance` and its phase, within half a turn, at most
        `phase_tolerance`. That step is the success (`info["is_success"]`).

    Reference:
        `two_rolls` takes two straight rolls by a and b with turns between them, ``a u_1 + b u_2 =
        D`` and ``a + b = 2 pi k - psi`` with D the offset in radii and u the headings.

        Bound: no path is shorter than ``max(distance, radius |psi|)``, less the tolerance. Turning
        while rolling would save steps.

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
    shapes: ClassVar = SHAPES
    step: ClassVar = staticmethod(step)
    reset: ClassVar = staticmethod(reset)
    terms: ClassVar = ("position", "heading", "side", "mismatch", "parked")
    cost_unit: ClassVar = "distance rolled [m]"

    def constants(self) -> tuple[float, ...]:
        """Weights, largest rates, tolerances, start square."""
        return (
            self.weight_position,
            self.weight_heading,
            self.weight_side,
            self.weight_mismatch,
            self.weight_parked,
            self.roll_per_step / self.dt,
            self.steer_per_step / self.dt,
            self.position_tolerance,
            self.heading_tolerance,
            self.phase_tolerance,
            self.start_half_width,
        )

    def actions(self) -> tuple[Entry, ...]:
        """Roll rate psi' and steer rate phi'."""
        roll, steer = self.roll_per_step / self.dt, self.steer_per_step / self.dt
        return (
            Entry("psi'", "rad/s", "axis", -roll, roll),
            Entry("phi'", "rad/s", "world", -steer, steer),
        )

    def features(self) -> tuple[Entry, ...]:
        """Offset in radii."""
        return (
            Entry("X / radius", "1", "world", -_FAR, _FAR),
            Entry("Y / radius", "1", "world", -_FAR, _FAR),
        )

    def largest_rate(self) -> float:
        """The larger of the two rates."""
        return max(self.roll_per_step, self.steer_per_step) / self.dt

    def lower_bound(self, y: Array) -> Array:
        """Path length [m] that no plan can beat: max(distance, radius * abs(psi)) to the origin."""
        roll = span(self.radius)[0] * np.abs(UprightCoin().phase(y))
        return np.maximum(np.hypot(y[..., 4], y[..., 5]), roll)
