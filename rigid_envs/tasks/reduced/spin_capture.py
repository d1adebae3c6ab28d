"""Reduced coordinates of a tumbling body that is steered to the separatrix: `SpinCapture`.

A half turn about e2 makes the growing coordinate of the saddle positive. The distances of energy
and momentum from those of the goal, and how torque changes them, are among the features. The
moments are the middles of their ranges.
"""

from typing import Any

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma
from rigid_envs.symmetries.bodies import HALF_TURN_2, ROTATION
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.free_bodies import FASTEST, observed_rates
from rigid_envs.tasks.reduced.saddle import (
    growing_frame,
    growing_side,
    near,
    saddle,
    turn,
    within,
)
from rigid_envs.tasks.reduction import Reduction, Side

__all__ = ["CAPTURE"]

_FULL = 0.1  # slope against which torque is worth half of its largest value


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """The spin relative to Omega e2, its distance from the separatrix, and how torque changes it.

    ``p = s d`` is 0 on the motions that approach e2 or -e2, ``E = omega2^2 + share (d^2 + s^2) -
    1`` on those with the rate Omega there. The slopes are the derivatives of ``(p^2 + E^2) / 2``
    along omega.
    """
    w1, w2, w3 = observed_rates(y, 1.0 / c.spin_rate)
    at = saddle(w1, w3, c)
    sign = growing_side(at, w2)
    off = at.s * at.d
    energy = fma(at.share, fma(at.d, at.d, at.s * at.s), fma(w2, w2, -1.0))
    square = at.ratio * at.ratio
    slope1 = 2.0 * sign * w1 * fma(2.0 * at.share, energy, off)
    slope3 = 2.0 * sign * w3 * square * fma(2.0 * at.share, energy, -off)
    slope2 = 2.0 * w2 * energy
    return (
        sign * w1,
        w2,
        sign * w3,
        within(off, FASTEST),
        within(energy, FASTEST),
        near(slope1, _FULL),
        near(slope2, _FULL),
        near(slope3, _FULL),
        near(sign * at.d, c.tolerance),
        near(sign * at.s, c.tolerance),
        near(w2 - 1.0, c.tolerance),
    )


CAPTURE = Reduction(
    group="SO(3) x Z2",
    frame="half turn about e2 where the growing part of the motion would be negative.",
    symmetries=(ROTATION, HALF_TURN_2),
    features=(
        *(Entry(f"omega{k} / Omega", "1", "reduced", -FASTEST, FASTEST) for k in (1, 2, 3)),
        *(Entry(k, "1", "", -FASTEST, FASTEST) for k in "pE"),
        *(Entry(f"near slope{k}", "1", "reduced", -1.0, 1.0) for k in (1, 2, 3)),
        *(Entry(f"near {k}", "1", "reduced", -1.0, 1.0) for k in ("d", "s", "omega2 - Omega")),
    ),
    observe=observe,
    Frame=Side,
    frame_of=growing_frame,
    turn=turn,
    formulas="""
    With w = omega / Omega, in the entries limited to +-20, `r = sqrt(I3 (I3 - I2) / (I1 (I2 -
    I1)))` and `k = I1 (I3 - I1) / (4 I2 (I3 - I2))`: `d = w1 - r w3`, `s = w1 + r w3`, and the sign
    S is -1 where `w2 (d - s) + d + s` < 0, else 1. Entries: S w1, w2, S w3, `p = s d`, `E = w2^2 +
    k (d^2 + s^2) - 1`, then `x / (|x| + 0.1)` of the slopes `2 S w1 (2 k E + p)`, `2 w2 E` and `2 S
    r^2 w3 (2 k E - p)`, and `x / (|x| + tolerance)` of S d, S s and w2 - 1. The action a acts as (S
    a1, a2, S a3).
    """,
)
"""Reduction of `SpinCapture`: SO(3), turns in space, times the half turn about e2."""
