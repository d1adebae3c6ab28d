"""Reduced coordinates of a ball on a table and the point where it is to be."""

import math
from typing import Any, NamedTuple

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma, log, select
from rigid_envs.symmetries.plates import ACROSS_X, ACROSS_Y, HALF_TURN
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.reduction import Reduction

__all__ = ["TABLE"]

_FAR, _FAST = 20.0, 20.0  # m, and m/s or rad/s; bounds of the observation
_WIDE = 2.0  # limits; bound of the observed tilt and tilt rate
_LOG = 17.0  # bound of the logarithm of offset over tolerance
_NEAR = 1.0  # m; an offset counts no further in the predicted one
_AHEAD = 3.5  # time of the prediction in that of the zero in the right half-plane


class _Signs(NamedTuple):
    """Signs by which X and Y are multiplied."""

    x: float
    y: float


@scalar
def predicted(y: Any, aux: Any, p: Any, c: Any) -> tuple[float, float]:
    """Offset [m] after the time T at constant tilt, of an offset that is limited in length.

    Near level, ``X'' = a alpha_y - radius alpha_y''`` with a = g / (1 + beta), and Y likewise with
    -alpha_x. The angles stop in the middle of the next period. With T = 3.5 sqrt(radius / a), 3.5
    times the time of the zero in the right half-plane, this is nearly parallel to the feedback of
    the linear-quadratic regulator: where it is 0, so is the best rate.
    """
    dx, dy = y.X - aux.point_X, y.Y - aux.point_Y
    near = 1.0 / max(math.sqrt(fma(dx, dx, dy * dy)) * (1.0 / _NEAR), 1.0)
    pull = p.g * p.share
    time = _AHEAD * math.sqrt(p.radius / pull)
    fall = 0.5 * time * time * pull
    return (
        near * dx
        + time * fma(p.radius, y.rate_y, y.VX)
        + fall * fma(0.5 * c.dt, y.rate_y, y.alpha_y),
        near * dy
        + time * fma(-p.radius, y.rate_x, y.VY)
        - fall * fma(0.5 * c.dt, y.rate_x, y.alpha_x),
    )


@scalar
def signs_of(x: float, y: float, p: Any) -> _Signs:
    """Both coordinates of (x, y) become positive; on a turntable, which has a sense, their sum."""
    together = select(x + y < 0.0, -1.0, 1.0)
    turning = p.turntable_rate != 0.0
    return _Signs(
        x=select(turning, together, select(x < 0.0, -1.0, 1.0)),
        y=select(turning, together, select(y < 0.0, -1.0, 1.0)),
    )


@scalar
def logarithmic(x: float, unit: float) -> float:
    """log(1 + abs(x) / unit) with the sign of x."""
    size = log(1.0 + min(abs(x), _FAR) / unit)
    return select(x < 0.0, -size, size)


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """The world's entries with signs such that the offset is positive, and what is predicted."""
    ahead_x, ahead_y = predicted(y, aux, p, c)
    dx, dy = y.X - aux.point_X, y.Y - aux.point_Y
    sign = signs_of(dx, dy, p)
    dx, dy = sign.x * dx, sign.y * dy
    tilt, rate = 1.0 / c.tilt_limit, 1.0 / c.tilt_rate
    return (
        min(max(dx, -_FAR), _FAR),
        min(max(dy, -_FAR), _FAR),
        logarithmic(dx, c.tolerance),
        logarithmic(dy, c.tolerance),
        min(max(sign.x * y.X, -_FAR), _FAR),
        min(max(sign.y * y.Y, -_FAR), _FAR),
        min(max(sign.x * y.VX, -_FAST), _FAST),
        min(max(sign.y * y.VY, -_FAST), _FAST),
        min(max(sign.x * sign.y * y.spin, -_FAST), _FAST),
        min(max(sign.y * tilt * y.alpha_x, -_WIDE), _WIDE),
        min(max(sign.x * tilt * y.alpha_y, -_WIDE), _WIDE),
        min(max(sign.y * rate * y.rate_x, -_WIDE), _WIDE),
        min(max(sign.x * rate * y.rate_y, -_WIDE), _WIDE),
        min(max(sign.x * ahead_x, -_FAR), _FAR),
        min(max(sign.y * ahead_y, -_FAR), _FAR),
        logarithmic(sign.x * ahead_x, c.tolerance),
        logarithmic(sign.y * ahead_y, c.tolerance),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> _Signs:
    """Signs of the offset."""
    return signs_of(y.X - aux.point_X, y.Y - aux.point_Y, p)


@scalar
def turn(a: Any, sign: Any) -> tuple[float, float]:
    """Rates of the angles of the table; that about x goes with Y."""
    return sign.y * a[0], sign.x * a[1]


_SIGNS, _LOGARITHM = "signs of the offset", "log(1 + abs / tolerance), signed"

TABLE = Reduction(
    group="Z2 x Z2",
    frame=(
        "signs such that the offset from the point is positive in both axes; on a turntable, such "
        "that its sum is."
    ),
    symmetries=(HALF_TURN, ACROSS_X, ACROSS_Y),
    features=(
        *(Entry(f"{k} - {k}*", "m", _SIGNS, -_FAR, _FAR) for k in "XY"),
        *(Entry(f"log of {k} - {k}*", "1", _LOGARITHM, -_LOG, _LOG) for k in "XY"),
        *(Entry(k, "m", _SIGNS, -_FAR, _FAR) for k in "XY"),
        *(Entry(f"V{k}", "m/s", _SIGNS, -_FAST, _FAST) for k in "XY"),
        Entry("spin", "rad/s", _SIGNS, -_FAST, _FAST),
        *(Entry(f"alpha_{k} / limit", "1", _SIGNS, -_WIDE, _WIDE) for k in "xy"),
        *(Entry(f"alpha_{k}' / limit", "1", _SIGNS, -_WIDE, _WIDE) for k in "xy"),
        *(Entry(f"predicted {k} - {k}*", "m", _SIGNS, -_FAR, _FAR) for k in "XY"),
        *(Entry(f"log of predicted {k} - {k}*", "1", _LOGARITHM, -_LOG, _LOG) for k in "XY"),
    ),
    observe=observe,
    Frame=_Signs,
    frame_of=frame_of,
    turn=turn,
    formulas="""
        The sign of X is -1 where ``X - X* < 0``, that of Y where ``Y - Y* < 0``, else 1; on a
        turntable both are that of the sum. X, VX, alpha_y and alpha_y' have the sign of X; Y, VY,
        alpha_x, alpha_x' that of Y; the spin their product. The action is multiplied by (sign of Y,
        sign of X).

        With the offset d, ``a = g / (1 + beta)`` and ``T = 3.5 sqrt(radius / a)``, predicted is ``d
        / max(|d|, 1) + T (VX + radius alpha_y', VY - radius alpha_x') + T^2 a / 2 (alpha_y + dt
        alpha_y' / 2, -alpha_x - dt alpha_x' / 2)``, with radius, beta and g of the episode. The
        logarithm is that of an offset limited to 20.
    """,
)
"""Reduction of `BallPlate`: reflections in both axes; half a turn where the table turns."""
