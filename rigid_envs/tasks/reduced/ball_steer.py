"""Reduced coordinates of `BallSteer`: the error in the frame of the reference's path."""

import math
from typing import Any

from rigid_envs.kernels.algebra import Row, attitude, compose, log_rotation
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import select
from rigid_envs.symmetries.balls import BODY_AXES, REFLECTION, TRANSLATION, TURN
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.reduced.planar import Frame, axial_seen, polar_seen, turn
from rigid_envs.tasks.reduction import Reduction

__all__ = ["ALONG_PATH"]

_FAR, _BENT = 50.0, 5.0  # radii, and curvature times radius; bounds of the observation


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Frame:
    """x-axis along the heading of the reference, mirrored so that its path bends to the left."""
    side = select(aux.curvature < 0.0, -1.0, 1.0)
    return Frame(aux.heading_X, aux.heading_Y, side)


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Offset and rotation from the reference; curvature and force of its path."""
    frame, square = frame_of(y, aux, p, c), p.radius * p.radius
    inverse = (aux.reference_w, -aux.reference_x, -aux.reference_y, -aux.reference_z)
    theta = axial_seen(frame, log_rotation(compose(attitude(y), inverse)))
    X, Y = y.X - aux.reference_X, y.Y - aux.reference_Y
    ahead, left = polar_seen(frame, X * p.inverse_radius, Y * p.inverse_radius)
    pull, push = polar_seen(frame, square * aux.force_X, square * aux.force_Y)
    return (
        min(max(ahead, -_FAR), _FAR),
        min(max(left, -_FAR), _FAR),
        min(max(theta[0], -math.pi), math.pi),
        min(max(theta[1], -math.pi), math.pi),
        min(max(theta[2], -math.pi), math.pi),
        min(abs(aux.curvature) * p.radius, _BENT),
        min(max(pull, -_BENT), _BENT),
        min(max(push, -_BENT), _BENT),
    )


ALONG_PATH = Reduction(
    group="E(2) x SO(3)",
    frame="x along the heading of the reference, mirrored so that its path bends to the left.",
    symmetries=(TRANSLATION, TURN, REFLECTION, BODY_AXES),
    features=(
        Entry("ahead / radius", "1", "path", -_FAR, _FAR),
        Entry("left / radius", "1", "path", -_FAR, _FAR),
        *(Entry(f"theta_{k}", "rad", "path", -math.pi, math.pi) for k in "xyz"),
        Entry("curvature * radius", "1", "path", 0.0, _BENT),
        *(Entry(f"force_{k} * radius^2", "1", "path", -_BENT, _BENT) for k in "xy"),
    ),
    observe=observe,
    Frame=Frame,
    frame_of=frame_of,
    turn=turn,
    formulas="""
        The frame is as in `BallPark`, with ``(c, s)`` the heading of the reference and the side k
        -1 where the curvature is negative, else 1: offset and force are seen as horizontal vectors,
        theta as there, and the curvature as its magnitude.
    """,
)
"""Reduction of `BallSteer`: only the error and the shape of the path ahead matter."""
