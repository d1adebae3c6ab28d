"""Reduced coordinates of a symmetric top whose pivot is accelerated: `PivotTop`."""

import math
from typing import Any, NamedTuple

from rigid_envs.kernels.algebra import Row, attitude, vertical
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma
from rigid_envs.symmetries.tops import PHASE, REFLECTION, TURN
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.reduced.planar import Frame, frame_along, polar_seen, turn
from rigid_envs.tasks.reduced.tops import (
    FRAME_FORMULAS,
    LEAN_FORMULAS,
    Lean,
    length,
    share,
    shares,
    world_lean,
)
from rigid_envs.tasks.reduction import Reduction

__all__ = ["PIVOT_TOP"]

_FAST, _FAR = 4.0, 5.0
_RETURN = 0.35  # rate at which the pivot is to return, over that at which the top falls
_NEAR, _CLOSE = 0.2, 0.02  # rad/s, m, m/s
_LEAN = 0.1  # rad


class _Returning(NamedTuple):
    """Lean; what grows of it beyond what brings the pivot back; frame along that."""

    lean: Lean
    grown: float
    frame: Frame


@scalar
def _returning(y: Any, c: Any) -> _Returning:
    """Frame along the growing part of the lean less that of a lean which brings the pivot back.

    The pivot X at the velocity V returns under the acceleration a = -(r^2 X + 2 r V), under which
    the top leans by a / g at rest. Of a lean e with e' = 0 the growing part is
    ``(growth - i kappa / 2) e``.
    """
    lean = world_lean(attitude(y), (y.omega1, y.omega2, y.omega3), c.fall_square, c.gyration)
    back = _RETURN * math.sqrt(c.fall_square)
    lean_x = back * fma(back, y.X, 2.0 * y.VX) / c.gravity
    lean_y = back * fma(back, y.Y, 2.0 * y.VY) / c.gravity
    half = 0.5 * c.gyration * y.omega3
    x = fma(lean.growth, lean_x, fma(half, lean_y, lean.growing_x))
    z = fma(lean.growth, lean_y, fma(-half, lean_x, lean.growing_y))
    frame = frame_along(x, z, lean.growing_x, lean.growing_y, y.omega3 < 0.0)
    return _Returning(lean, length(x, z), frame)


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Lean, pivot, height and spin; the parameters may be hidden: those of the middle top."""
    lean, grown, frame = _returning(y, c)
    decaying = polar_seen(frame, lean.decaying_x, lean.decaying_y)
    tilt = polar_seen(frame, lean.x, lean.y)
    pivot = polar_seen(frame, y.X, y.Y)
    velocity = polar_seen(frame, y.VX, y.VY)
    close = 1.0 / (length(pivot[0], pivot[1]) + _NEAR)
    free = 1.0 / math.sqrt(c.fall_square)
    spin = 0.5 * c.gyration * abs(y.omega3) * free
    return (
        min(3.0 * grown, 3.0),
        share(grown, _NEAR),
        share(grown, _CLOSE),
        *shares(decaying[0], decaying[1], _NEAR),
        *shares(tilt[0], tilt[1], _LEAN),
        min(max(pivot[0], -_FAR), _FAR),
        min(max(pivot[1], -_FAR), _FAR),
        close * pivot[0],
        close * pivot[1],
        min(max(velocity[0], -_FAR), _FAR),
        min(max(velocity[1], -_FAR), _FAR),
        *shares(velocity[0], velocity[1], _NEAR),
        vertical(attitude(y))[2],
        min(spin, _FAST),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Frame:
    """Frame along what grows beyond what brings the pivot back."""
    return _returning(y, c).frame


PIVOT_TOP = Reduction(
    group="O(2) x SO(2)",
    frame=(
        "x along the growing part of the lean less that of a lean which brings the pivot back, "
        "mirrored so that the spin is not negative."
    ),
    symmetries=(TURN, PHASE, REFLECTION),
    features=(
        Entry("3 |w|", "rad/s", "growing part w less that of the return, limited", 0.0, 3.0),
        Entry("share w", "1", f"of |w| + {_NEAR}", 0.0, 1.0),
        Entry("share w", "1", f"of |w| + {_CLOSE}", 0.0, 1.0),
        *(Entry(f"share s_{k}", "1", f"reduced, of |s| + {_NEAR}", -1.0, 1.0) for k in "xy"),
        *(Entry(f"share e_{k}", "1", f"reduced, of |e| + {_LEAN}", -1.0, 1.0) for k in "xy"),
        *(Entry(k, "m", "reduced, limited", -_FAR, _FAR) for k in "XY"),
        *(Entry(f"share {k}", "1", f"reduced, of distance + {_NEAR}", -1.0, 1.0) for k in "XY"),
        *(Entry(f"V{k}", "m/s", "reduced, limited", -_FAR, _FAR) for k in "XY"),
        *(Entry(f"share V{k}", "1", f"reduced, of speed + {_NEAR}", -1.0, 1.0) for k in "XY"),
        Entry("R33", "1", "body to world", -1.0, 1.0),
        Entry("|omega3|", "1", "critical spins, limited", 0.0, _FAST),
    ),
    observe=observe,
    Frame=Frame,
    frame_of=frame_of,
    turn=turn,
    formulas=f"""{LEAN_FORMULAS} w, along u where w is 0, and that of the world where both are 0;
    {FRAME_FORMULAS} Here `e = R13 + i R23`. With `k = 0.35 sqrt(fall)` the pivot X + i Y returns
    at the lean `l = k (k (X + i Y) + 2 (VX + i VY)) / g`; `w = u + (growth - i kappa / 2) l`.

    Entries: `min(3 |w|, 3)`, the shares of |w|, s and e with their halves, the pivot, entry by
    entry up to 5, its share, its velocity likewise, R33 and `min(|kappa| / (2 sqrt(fall)), 4)`. The
    action, in world axes, is rounded to float32.
    """,
)
"""Reduction of `PivotTop`: O(2), turns about the vertical and reflections, and the phase."""
