"""The unstable axis: coordinates along the separatrices, control along them."""

import math
from functools import partial
from typing import Any, NamedTuple

from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma, select
from rigid_envs.systems.free_body.symmetry import HALF_TURN_2, ROTATION_IN_SPACE
from rigid_envs.tasks.reduction import Reduction, Side

# The saddle of free rotation at the intermediate axis: numbers of a body.


class Shape(NamedTuple):
    """Shape of the saddle at e2 of a body with principal moments I1 < I2 < I3.

    With ``d, s = omega1 -+ ratio omega3`` over the rate Omega, Euler's equations read::

        d' = growth omega2 d,  s' = -growth omega2 s,  omega2' = share growth (s^2 - d^2)

    exactly, not only near e2. So d is the unstable and s the stable direction at e2, and the other
    way round at -e2. Free motion keeps ``s d = (2 T I2 - L^2) / (I1 (I2 - I1))`` and ``omega2^2 +
    share (d^2 + s^2)``, the square of the rate at which a motion with s d = 0 arrives at e2 or -e2.
    """

    ratio: float
    growth: float
    share: float


@scalar
def saddle_shape(I1: float, I2: float, I3: float) -> Shape:
    """Of a body with moments I1 < I2 < I3 [kg m^2]."""
    ratio = math.sqrt(I3 * (I3 - I2) / (I1 * (I2 - I1)))
    growth = (I3 - I2) / (I1 * ratio)
    return Shape(ratio, growth, share=I1 * (I3 - I1) / (4.0 * I2 * (I3 - I2)))


# Coordinates of a spin near the intermediate axis, and a scale on which small errors are seen.


class Place(NamedTuple):
    """Coordinates d and s of a spin, over the rate Omega, and the shape of the saddle.

    See `rigid_envs.systems.free_body.saddle.Shape`: d grows at e2, s at -e2.
    """

    d: float
    s: float
    ratio: float
    growth: float
    share: float


@scalar
def place_at(w1: float, w3: float, c: Any) -> Place:
    """Coordinates of a body with the middle moments."""
    shape = saddle_shape(c.middle1, c.middle2, c.middle3)
    ratio = shape.ratio
    return Place(fma(-ratio, w3, w1), fma(ratio, w3, w1), ratio, shape.growth, shape.share)


@scalar
def growing_side(at: Place, w2: float) -> float:
    """Sign of d at e2 and of s at -e2, the coordinate that grows; between them of the larger."""
    return select(fma(w2, at.d - at.s, at.d + at.s) < 0.0, -1.0, 1.0)


@scalar
def growing_frame(y: Any, aux: Any, p: Any, c: Any) -> Side:
    """Half turn about e2 to the growing side."""
    scale = 1.0 / c.spin_rate
    at = place_at(scale * y.omega1, scale * y.omega3, c)
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


half_turned = partial(
    Reduction,
    group="SO(3) x Z2",
    frame="half turn about $e2$ where the growing part of the motion would be negative.",
    symmetries=(ROTATION_IN_SPACE, HALF_TURN_2),
    Frame=Side,
)
"""Reduction by turns in space and by the half turn about e2."""
