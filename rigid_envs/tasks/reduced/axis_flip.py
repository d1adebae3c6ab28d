"""Reduced coordinates of a spin that is to flip from e2 to -e2 in a given time: `AxisFlip`.

A half turn about e2 makes the growing coordinate of the saddle positive. The motion on the
separatrix that arrives at the commanded time is known; the spin is seen relative to it. The moments
are the middles of their ranges.
"""

import math
from typing import Any

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma, log, select
from rigid_envs.symmetries.bodies import HALF_TURN_2, ROTATION
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.free_bodies import FASTEST, observed_rates
from rigid_envs.tasks.reduced.saddle import (
    Saddle,
    growing_frame,
    growing_side,
    near,
    saddle,
    turn,
    within,
)
from rigid_envs.tasks.reduction import Reduction, Side

__all__ = ["FLIP"]

_ARRIVED = 0.6  # of the tolerance: distance from -e2 on arrival
_DECADE = 0.4342944819032518  # 1 / log(10)
_DECADES = 20.0  # bound of phases
_SMALLEST = 1e-9  # of Omega; a smaller d is taken for this


@scalar
def decay(x: float) -> float:
    """exp(-x) for 0 <= x <= 16, to 1e-6: the 128th power of the fifth-order series."""
    z = -min(x, 16.0) * (1.0 / 128.0)
    e = 1.0 + z * fma(z, fma(z, fma(z, fma(z, 1.0 / 120.0, 1.0 / 24.0), 1.0 / 6.0), 0.5), 1.0)
    for _ in range(7):
        e = e * e
    return e


@scalar
def phase_left(at: Saddle, left: float, c: Any) -> float:
    """Time to the middle of the flip that arrives at the commanded time, over that of growth.

    From ``1 / sqrt(share)``, which d has in the middle, it decays as ``2 exp(-time)`` of that.
    """
    # omega1 = d / 2 and omega3 = -d / (2 ratio) are the components of the distance from -e2
    last = 2.0 * _ARRIVED * c.tolerance / math.sqrt(1.0 + 1.0 / (at.ratio * at.ratio))
    return fma(at.growth * c.spin_rate, left, -log(max(2.0 / (last * math.sqrt(at.share)), 1.0)))


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """The spin, its time to the middle of the flip, and its difference from the timed motion."""
    w1, w2, w3 = observed_rates(y, 1.0 / c.spin_rate)
    at = saddle(w1, w3, c)
    sign = growing_side(at, w2)
    d, s, w1, w3 = sign * at.d, sign * at.s, sign * w1, sign * w3
    left, most = max(aux.time_left, 0.0), 1.0 / math.sqrt(at.share)
    # on the separatrix omega2 = tanh(phase) and d = most / cosh(phase), over the rate of arrival
    wanted = phase_left(at, left, c)
    e = decay(abs(wanted))
    cosh_inverse = 2.0 * e / fma(e, e, 1.0)
    timed2 = fma(-e, e, 1.0) / fma(e, e, 1.0)
    before = left > 0.0
    late2 = -math.sqrt(max(fma(-at.share * d, d, 1.0), 0.0))
    timed2 = select(before, select(wanted < 0.0, -timed2, timed2), late2)
    timed_d = select(before, select(d < 0.0, -most, most) * cosh_inverse, d)
    error1, error2 = fma(-0.5, timed_d, w1), w2 - timed2
    error3 = fma(0.5 / at.ratio, timed_d, w3)
    rate = math.sqrt(fma(w2, w2, at.share * fma(d, d, s * s)))
    coming = log(max((rate + abs(w2)) * most, _SMALLEST) / max(abs(d), _SMALLEST))
    coming = select(w2 < 0.0, -coming, coming)
    return (
        w1,
        w2,
        w3,
        min(left / c.largest_flip_time, 1.0),
        within(_DECADE * wanted, _DECADES),
        select(before, within(_DECADE * (coming - wanted), _DECADES), 0.0),
        near(error1, c.tolerance),
        near(error2, c.tolerance),
        near(error3, c.tolerance),
    )


FLIP = Reduction(
    group="SO(3) x Z2",
    frame="half turn about e2 where the growing part of the motion would be negative.",
    symmetries=(ROTATION, HALF_TURN_2),
    features=(
        *(Entry(f"omega{k} / Omega", "1", "reduced", -FASTEST, FASTEST) for k in (1, 2, 3)),
        Entry("time left / longest", "1", "none", 0.0, 1.0),
        Entry("wanted time to flip", "1", "decades of growth", -_DECADES, _DECADES),
        Entry("late by", "1", "decades of growth", -_DECADES, _DECADES),
        *(Entry(f"near error{k}", "1", "reduced", -1.0, 1.0) for k in (1, 2, 3)),
    ),
    observe=observe,
    Frame=Side,
    frame_of=growing_frame,
    turn=turn,
    formulas="""
    With w = omega / Omega, in the entries limited to +-20, `r = sqrt(I3 (I3 - I2) / (I1 (I2 -
    I1)))`, `growth = sqrt((I2 - I1)(I3 - I2) / (I1 I3))`, `k = I1 (I3 - I1) / (4 I2 (I3 - I2))`: `d
    = w1 - r w3`, `s = w1 + r w3`, and the sign S is -1 where `w2 (d - s) + d + s` < 0, else 1. From
    here on w1, w3, d and s are those times S.

    The motion that arrives at T, within 0.6 of `tolerance`, is `w2 = tanh(W)`, `d = D = +-1 /
    (sqrt(k) cosh(W))` with the sign of d, and s = 0, where the wanted time is `W = Omega growth
    left - log(max(2 / (l sqrt(k)), 1))`, `l = 1.2 tolerance / sqrt(1 + 1 / r^2)` and left is the
    time left, at least 0. With `n = sqrt(w2^2 + k (d^2 + s^2))` the flip is to come at `C =
    +-log((n + |w2|) / (sqrt(k) |d|))` with the sign of w2; numerator over sqrt(k) and |d| are at
    least 1e-9.

    Entries: w1, w2, w3, left / longest, `W / log(10)`, `(C - W) / log(10)`, and `x / (|x| +
    tolerance)` of `w1 - D / 2`, `w2 - tanh(W)`, `w3 + D / (2 r)`. When no time is left, the sixth
    is 0, D is d, and tanh(W) is replaced by `-sqrt(max(1 - k d^2, 0))`. |W| counts as at most 16 in
    tanh and cosh, whose error is below 1e-5. The action a acts as (S a1, a2, S a3).
    """,
)
"""Reduction of `AxisFlip`: SO(3), turns in space, times the half turn about e2."""
