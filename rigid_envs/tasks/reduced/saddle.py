"""Coordinates of a spin near the intermediate axis, and a scale on which small errors are seen."""

from typing import Any, NamedTuple

from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma, select
from rigid_envs.kernels.saddle import saddle_shape
from rigid_envs.tasks.reduction import Side

__all__ = ["Saddle", "growing_frame", "growing_side", "near", "saddle", "turn", "within"]


class Saddle(NamedTuple):
    """Coordinates d and s of a spin, over the rate Omega, and the shape of the saddle.

    See `rigid_envs.kernels.saddle.Shape`: d grows at e2, s at -e2.
    """

    d: float
    s: float
    ratio: float
    growth: float
    share: float


@scalar
def saddle(w1: float, w3: float, c: Any) -> Saddle:
    """Coordinates of a body with the middle moments."""
    shape = saddle_shape(c.middle1, c.middle2, c.middle3)
    ratio = shape.ratio
    return Saddle(fma(-ratio, w3, w1), fma(ratio, w3, w1), ratio, shape.growth, shape.share)


@scalar
def growing_side(at: Saddle, w2: float) -> float:
    """Sign of d at e2 and of s at -e2, the coordinate that grows; between them of the larger."""
    return select(fma(w2, at.d - at.s, at.d + at.s) < 0.0, -1.0, 1.0)


@scalar
def growing_frame(y: Any, aux: Any, p: Any, c: Any) -> Side:
    """Half turn about e2 to the growing side."""
    scale = 1.0 / c.spin_rate
    at = saddle(scale * y.omega1, scale * y.omega3, c)
    return Side(growing_side(at, scale * y.omega2))


@scalar
def turn(a: Any, frame: Any) -> tuple[float, float, float]:
    """Torque about the axes of the body, from those after a half turn about e2."""
    return frame.sign * a[0], a[1], frame.sign * a[2]


@scalar
def within(x: float, bound: float) -> float:
    """x, clipped to [-bound, bound]."""
    return min(max(x, -bound), bound)


@scalar
def near(x: float, tolerance: float) -> float:
    """X / (abs(x) + tolerance): x in tolerances where it is small, its sign where it is large."""
    return x / (abs(x) + tolerance)
