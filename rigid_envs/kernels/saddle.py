"""The saddle of free rotation at the intermediate axis: numbers of a body."""

import math
from typing import NamedTuple

from rigid_envs.kernels.compiler import scalar

__all__ = ["Shape", "saddle_shape"]


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
