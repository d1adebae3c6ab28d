"""Reduced coordinates of a spin held at e2: `IntermediateAxis` and `IntermediateAxisSingle`.

A half turn about e2 makes the growing coordinate of the saddle positive. Its size is seen in units
of what the torque can hold. The coordinates are those of the middle of the ranges of the moments:
no drawn moment enters that is not observed.
"""

from typing import Any

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import select
from rigid_envs.symmetries.bodies import HALF_TURN_2, ROTATION
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.free_bodies import FASTEST, observed_rates
from rigid_envs.tasks.reduced.saddle import Saddle, near, saddle, turn, within
from rigid_envs.tasks.reduction import Reduction, Side

__all__ = ["HOLDING", "POINTING"]


@scalar
def side(at: Saddle) -> float:
    """-1 where a half turn about e2 makes d positive, else 1."""
    return select(at.d < 0.0, -1.0, 1.0)


@scalar
def held(at: Saddle, pull: float, c: Any) -> tuple[float, float]:
    """Growing and decaying coordinate over the largest d that torque can hold by d' = -pull."""
    inverse = c.spin_rate * c.spin_rate * at.growth / pull
    return within(abs(at.d) * inverse, FASTEST), within(side(at) * at.s * inverse, FASTEST)


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """The spin relative to Omega e2, with d >= 0."""
    w1, w2, w3 = observed_rates(y, 1.0 / c.spin_rate)
    at = saddle(w1, w3, c)
    sign = side(at)
    d, s = held(at, c.torque * (1.0 / c.middle1 + at.ratio / c.middle3), c)
    return (
        sign * w1,
        w2,
        sign * w3,
        d,
        s,
        near(abs(at.d), c.tolerance),
        near(sign * at.s, c.tolerance),
        near(w2 - 1.0, c.tolerance),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Side:
    """Half turn about e2 that makes d positive."""
    return Side(side(saddle(y.omega1, y.omega3, c)))


@scalar
def observe_direction(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """The spin relative to the direction e2, with d >= 0."""
    w1, w2, w3 = observed_rates(y, 1.0 / c.spin_rate)
    at = saddle(w1, w3, c)
    sign = side(at)
    d, s = held(at, c.torque * at.ratio / c.middle3, c)
    return (
        sign * w1,
        w2,
        sign * w3,
        d,
        s,
        near(abs(at.d), c.tolerance),
        near(sign * at.s, c.tolerance),
    )


@scalar
def turn_single(a: Any, frame: Any) -> tuple[float]:
    """Torque about e3."""
    return (frame.sign * a[0],)


_SHAPE = """\
    With w = omega / Omega, in the entries limited to +-20, `r = sqrt(I3 (I3 - I2) / (I1 (I2 -
    I1)))` and `growth = sqrt((I2 - I1)(I3 - I2) / (I1 I3))`: `d = w1 - r w3`, `s = w1 + r w3`, and
    the sign S is -1 where d < 0, else 1. Entries: S w1, w2, S w3, k |d|, S k s"""
_RATES = tuple(Entry(f"omega{k} / Omega", "1", "reduced", -FASTEST, FASTEST) for k in (1, 2, 3))
_SADDLE = (
    Entry("d / held", "1", "reduced", 0.0, FASTEST),
    Entry("s / held", "1", "reduced", -FASTEST, FASTEST),
    Entry("near d", "1", "reduced, d / (abs d + tolerance)", 0.0, 1.0),
    Entry("near s", "1", "reduced, likewise", -1.0, 1.0),
)
HOLDING = Reduction(
    group="SO(3) x Z2",
    frame="half turn about e2 where the growing part of the motion would be negative.",
    symmetries=(ROTATION, HALF_TURN_2),
    features=(
        *_RATES,
        *_SADDLE,
        Entry("near omega2 - Omega", "1", "likewise", -1.0, 1.0),
    ),
    observe=observe,
    Frame=Side,
    frame_of=frame_of,
    turn=turn,
    formulas=f"""{_SHAPE} with `k = Omega^2 growth / (torque (1 / I1 + r / I3))`, and `x / (|x| +
    tolerance)` of |d|, S s and w2 - 1. The action a acts as (S a1, a2, S a3).""",
)
"""Reduction of `IntermediateAxis`: SO(3), turns in space, times the half turn about e2."""
POINTING = Reduction(
    group="SO(3) x Z2",
    frame="half turn about e2 where the growing part of the motion would be negative.",
    symmetries=(ROTATION, HALF_TURN_2),
    features=(*_RATES, *_SADDLE),
    observe=observe_direction,
    Frame=Side,
    frame_of=frame_of,
    turn=turn_single,
    formulas=f"""{_SHAPE} with `k = Omega^2 growth I3 / (torque r)`, and `x / (|x| + tolerance)` of
    |d| and S s. The action a acts as S a.""",
)
"""Reduction of `IntermediateAxisSingle`, whose goal is the direction e2: the same group."""
