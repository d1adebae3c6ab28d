"""Frames in the plane that turn with the state, and their mirror images."""

import math
from typing import Any, NamedTuple

from rigid_envs.kernels.actions import single
from rigid_envs.kernels.algebra import Vector
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma, select

__all__ = ["Frame", "axial_seen", "frame_along", "polar_seen", "turn", "turned_back"]

_ZERO = 1e-18  # a vector whose square is less has no direction


class Frame(NamedTuple):
    """x-axis (cosine, sine) in world axes, and -1 where y points to the right of it, else 1."""

    cosine: float
    sine: float
    side: float


@scalar
def frame_along(x: float, y: float, spare_x: float, spare_y: float, flipped: bool) -> Frame:
    """Frame whose x-axis is along (x, y); along (spare_x, spare_y) where that is zero.

    Where both are zero it is the frame of the world.
    """
    zero = fma(x, x, y * y) < _ZERO
    x, y = select(zero, spare_x, x), select(zero, spare_y, y)
    square = fma(x, x, y * y)
    lost = square < _ZERO
    inverse = 1.0 / math.sqrt(select(lost, 1.0, square))
    return Frame(
        cosine=select(lost, 1.0, x * inverse),
        sine=select(lost, 0.0, y * inverse),
        side=select(flipped, -1.0, 1.0),
    )


@scalar
def polar_seen(frame: Frame, x: float, y: float) -> tuple[float, float]:
    """Components in the frame of a horizontal vector: an offset, a velocity, a force."""
    along = fma(frame.cosine, x, frame.sine * y)
    return along, frame.side * fma(frame.cosine, y, -frame.sine * x)


@scalar
def axial_seen(frame: Frame, v: Vector) -> Vector:
    """Components in the frame of an axial vector, which a reflection reverses in its plane."""
    along, left = polar_seen(frame, v[0], v[1])
    return frame.side * along, frame.side * left, frame.side * v[2]


@scalar
def turned_back(frame: Frame, along: float, left: float) -> tuple[float, float]:
    """World components of a horizontal vector from those in the frame."""
    left = frame.side * left
    return (
        fma(frame.cosine, along, -frame.sine * left),
        fma(frame.sine, along, frame.cosine * left),
    )


@scalar
def turn(a: Any, frame: Any) -> tuple[float, float]:
    """World components of an action in the frame, rounded to float32."""
    along, left = turned_back(frame, a[0], a[1])
    return single(along), single(left)
