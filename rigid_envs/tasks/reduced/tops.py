"""Lean of a top in its growing and its decaying part, and the frame along the growing one."""

import math
from typing import Any, NamedTuple

from rigid_envs.kernels.algebra import Quaternion, Row, Vector, rotate
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.reduced.planar import Frame, frame_along, polar_seen

__all__ = [
    "FRAME_FORMULAS",
    "LEAN_FORMULAS",
    "UPRIGHT",
    "UPRIGHT_FORMULAS",
    "Lean",
    "lean_frame",
    "length",
    "parts",
    "share",
    "shares",
    "upright_seen",
    "world_lean",
]

_NEAR, _CLOSE = 0.2, 0.01  # rad/s; parts of the lean that are shown as a half
_LEAN = 0.1  # rad; lean that is shown as a half
_FAST = 4.0  # critical spins; bound of the spin


class Lean(NamedTuple):
    """Growing and decaying part of a lean [rad/s], the lean itself [rad], growth rate [1/s]."""

    growing_x: float
    growing_y: float
    decaying_x: float
    decaying_y: float
    x: float
    y: float
    growth: float


@scalar
def parts(
    x: float, y: float, rate_x: float, rate_y: float, spin: float, fall: float, gyration: float
) -> Lean:
    """Parts of the lean e = x + i y of a symmetric top that grow and decay without control.

    ``e'' - i kappa e' - fall e = 0`` with kappa = gyration spin, fall = m g ell / I1 and gyration
    = I3 / I1 has the solutions exp(lambda t) of lambda = i kappa / 2 +- growth. With the rate
    b = e' - i kappa e / 2 the parts are ``b + growth e``, which grows, and ``b - growth e``.
    Above the sleeping threshold growth is 0 and both are b.
    """
    half = 0.5 * gyration * spin
    growth = math.sqrt(max(fma(-half, half, fall), 0.0))
    bx, by = fma(half, y, rate_x), fma(-half, x, rate_y)
    return Lean(
        growing_x=fma(growth, x, bx),
        growing_y=fma(growth, y, by),
        decaying_x=fma(-growth, x, bx),
        decaying_y=fma(-growth, y, by),
        x=x,
        y=y,
        growth=growth,
    )


@scalar
def world_lean(q: Quaternion, omega: Vector, fall: float, gyration: float) -> Lean:
    """Parts of the lean e, the horizontal part of the axis e3, in world axes."""
    w, x, y, z = q
    rate = rotate(q, (omega[1], -omega[0], 0.0))
    lean_x, lean_y = 2.0 * fma(x, z, w * y), 2.0 * fma(y, z, -w * x)
    return parts(lean_x, lean_y, rate[0], rate[1], omega[2], fall, gyration)


@scalar
def lean_frame(lean: Lean, spin: float) -> Frame:
    """x-axis along the growing part, mirrored so that the spin is not negative."""
    return frame_along(lean.growing_x, lean.growing_y, lean.decaying_x, lean.decaying_y, spin < 0.0)


@scalar
def lean_seen(frame: Frame, lean: Lean) -> Row:
    """The lean and its parts in a frame along the growing one; see `LEAN`."""
    growing = length(lean.growing_x, lean.growing_y)
    decaying = polar_seen(frame, lean.decaying_x, lean.decaying_y)
    near = shares(decaying[0], decaying[1], _NEAR)
    close = shares(decaying[0], decaying[1], _CLOSE)
    x, y = polar_seen(frame, lean.x, lean.y)
    tilt = shares(x, y, _LEAN)
    return (
        min(3.0 * growing, 3.0),
        share(growing, _NEAR),
        share(growing, _CLOSE),
        near[0],
        near[1],
        close[0],
        close[1],
        tilt[0],
        tilt[1],
    )


LEAN = (
    Entry("3 |u|", "rad/s", "growing part u, limited", 0.0, 3.0),
    Entry("share u", "1", f"of |u| + {_NEAR}", 0.0, 1.0),
    Entry("share u", "1", f"of |u| + {_CLOSE}", 0.0, 1.0),
    *(Entry(f"share s_{k}", "1", f"reduced, of |s| + {_NEAR}", -1.0, 1.0) for k in "xy"),
    *(Entry(f"share s_{k}", "1", f"reduced, of |s| + {_CLOSE}", -1.0, 1.0) for k in "xy"),
    *(Entry(f"share e_{k}", "1", f"reduced, of |e| + {_LEAN}", -1.0, 1.0) for k in "xy"),
)
"""Entries of `lean_seen`: growing part u, decaying part s, lean e."""


@scalar
def upright_seen(frame: Frame, lean: Lean, height: float, spin: float, c: Any) -> Row:
    """The lean, the height of the axis e3 and the spin [rad/s]; see `UPRIGHT`."""
    free = 1.0 / math.sqrt(c.fall_square)
    spins = 0.5 * c.gyration * abs(spin) * free
    return (*lean_seen(frame, lean), height, min(spins, _FAST), lean.growth * free)


UPRIGHT = (
    *LEAN,
    Entry("R33", "1", "body to world", -1.0, 1.0),
    Entry("|omega3|", "1", "critical spins, limited", 0.0, _FAST),
    Entry("growth", "1", "of u, over that without spin", 0.0, 1.0),
)
"""Entries of `upright_seen`."""


LEAN_FORMULAS = """\
    The lean is e = e_x + i e_y with the rate e'. With `fall = m g ell / I`, I the mean of I1 and
    I2, and `kappa = I3 omega3 / I`: `b = e' - i kappa e / 2`, `growth = sqrt(max(fall - kappa^2 /
    4, 0))`, `u = b + growth e`, `s = b - growth e`. The x-axis of the frame is along"""
FRAME_FORMULAS = """\
    y is to the left of it, or to the right where omega3 < 0. A vector whose square is below 1e-18
    has no direction. The share of a vector v with the half h is `v / (|v| + h)`."""
UPRIGHT_FORMULAS = """\
    Entries: `min(3 |u|, 3)`, the shares of |u|, s, s and e with their halves, R33,
    `min(|kappa| / (2 sqrt(fall)), 4)` and `growth / sqrt(fall)`."""
"""Formulas of `parts`, `lean_frame` and `upright_seen`."""


@scalar
def length(x: float, y: float) -> float:
    """Length of a vector in the plane."""
    return math.sqrt(fma(x, x, y * y))


@scalar
def share(size: float, half: float) -> float:
    """``size / (size + half)``: from 0 to 1, steepest at 0."""
    return size / (size + half)


@scalar
def shares(x: float, y: float, half: float) -> tuple[float, float]:
    """A vector whose length is replaced by its `share`."""
    factor = 1.0 / (length(x, y) + half)
    return factor * x, factor * y
