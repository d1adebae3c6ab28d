"""Precession: angle per nutation, mean rate, and the kind of path of the axis."""

import math
import sys
from dataclasses import dataclass
from typing import Literal

from numpy.typing import ArrayLike

from rigid_envs.analytic.heavy_top._cayley_klein import waves
from rigid_envs.analytic.heavy_top._nutation import Nutation
from rigid_envs.analytic.heavy_top._start import Start, start_of

__all__ = ["Path", "Precession", "precession"]

Path = Literal["smooth", "cusped", "looping", "steady", "sleeping", "through_pole"]

# cos theta that moves by less counts as steady.
_STEADY = 1e-12
# A path whose precession stops this close to its highest point, as a part of all the way that
# cos theta goes, counts as cusped: seen from where it turns, the loop or wave has no size.
_CUSP = 1e-9
_ROUNDING = 8.0 * sys.float_info.epsilon


@dataclass(frozen=True)
class Precession:
    """The path of the axis on the sphere.

    Attributes:
        per_nutation: angle phi gained from one smallest tilt to the next [rad]; infinite on the way
            to upright (unless in a plane), NaN where the axis stays on the vertical.
        mean_rate: per_nutation over the period of the nutation, or its limit [rad/s].
        path: kind of the path, the first of these that fits:
            "sleeping": the axis stays on the vertical, upright or hanging.
            "through_pole": it passes exactly through the vertical.
            "steady": cos theta moves by less than 1e-12.
            "cusped": the precession stops at the highest point, or within 1e-9 of the way of
            cos theta from it.
            "looping": the precession changes its direction on the way.
            "smooth": it never does, or the axis is on the way to upright.
    """

    per_nutation: float
    mean_rate: float
    path: Path


def precession(
    omega0: ArrayLike, q0: ArrayLike, *, i_perp: float, i3: float, mgl: float
) -> Precession:
    """Find the precession of a top from any initial state.

    A jump of phi at a pole, as in `euler_angles`, is counted.

    Args:
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.
        i_perp: transverse moment about the pivot [kg m^2].
        i3: axial moment [kg m^2].
        mgl: weight times distance of the centre of mass [N m].

    Raises:
        ValueError: as `nutation`.

    Source: Goldstein, sec. 5.7; Landau & Lifshitz, par. 35.
    """
    start = start_of(omega0, q0, i_perp=i_perp, i3=i3, mgl=mgl)
    first, second = waves(start)
    swing, drift = first.swing, first.drift + second.drift
    path = _path(start, swing)
    if path == "sleeping":
        return Precession(math.nan, math.nan, path)
    steady = drift * swing.period if drift != 0.0 else 0.0
    turns = math.pi * (first.half_turn + second.half_turn)
    angle = turns + (first.per_nutation() + second.per_nutation() + steady)
    return Precession(angle, angle / swing.period if swing.period < math.inf else drift, path)


def _path(start: Start, swing: Nutation) -> Path:
    """Kind of path, from b - a u at both turning points."""
    (d1, d2, d3), (e1, e2, _) = swing.depths, swing.heights
    if start.across == 0.0 and 0.0 in (start.upright.here, start.hanging.here):
        return "sleeping"
    if e1 == 0.0 or d2 == 0.0 < d3:
        return "through_pole"
    if d2 == 0.0:  # on the way to upright phi' tends to a / 2
        return "smooth"
    way = min(d1 - d2, e2 - e1)
    if way < _STEADY:
        return "steady"
    highest, lowest = start.upright.twist + start.a * d2, start.hanging.twist - start.a * e1
    if abs(highest) <= (_CUSP * way + _ROUNDING * d2) * abs(start.a):
        return "cusped"
    return "looping" if highest * lowest < 0.0 else "smooth"
