"""Reduced coordinates of an asymmetric top that is held by body torques: `TopRandom`."""

from typing import Any

from rigid_envs.kernels.actions import clip_to_disk, single
from rigid_envs.kernels.algebra import Row, Vector, attitude, vertical
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma
from rigid_envs.symmetries.tops import HALF_TURN, REFLECTION, TURN
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.reduced.planar import Frame, turned_back
from rigid_envs.tasks.reduced.tops import (
    FRAME_FORMULAS,
    LEAN_FORMULAS,
    UPRIGHT,
    UPRIGHT_FORMULAS,
    Lean,
    lean_frame,
    length,
    parts,
    share,
    upright_seen,
)
from rigid_envs.tasks.reduction import Reduction

__all__ = ["TOP_RANDOM"]


@scalar
def _lean(y: Any, c: Any) -> Lean:
    """Parts of the lean in body axes, of a symmetric top with the mean of the moments."""
    G = vertical(attitude(y))
    return parts(-G[0], -G[1], y.omega2, -y.omega1, y.omega3, c.fall_square, c.gyration)


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Lean, height, spin, and the azimuth of the frame, by which moments and products differ."""
    lean = _lean(y, c)
    frame = lean_frame(lean, y.omega3)
    return (
        *upright_seen(frame, lean, vertical(attitude(y))[2], y.omega3, c),
        share(length(y.omega1, y.omega2), 1.0),
        fma(2.0 * frame.cosine, frame.cosine, -1.0),
        2.0 * frame.side * frame.cosine * frame.sine,
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Frame:
    """Frame along the growing part of the lean."""
    return lean_frame(_lean(y, c), y.omega3)


@scalar
def turn(a: Any, frame: Any) -> Vector:
    """Torque that drives the axis e3 along an action in the frame, and the torque about e3."""
    (along, left), _ = clip_to_disk((a[0], a[1]))
    x, z = turned_back(frame, along, left)
    return single(-z), single(x), frame.side * a[2]


TOP_RANDOM = Reduction(
    group="O(2) x Z2",
    frame=(
        "x along the growing part of the lean in body axes, mirrored so that the spin is not "
        "negative. Torques across e3 are clipped to the disk in their square."
    ),
    symmetries=(TURN, HALF_TURN, REFLECTION),
    features=(
        *UPRIGHT,
        Entry("share omega", "1", "rate across e3, of itself + 1 rad/s", 0.0, 1.0),
        Entry("cos 2 alpha", "1", "alpha of the frame in the body", -1.0, 1.0),
        Entry("sin 2 alpha", "1", "alpha of the frame in the body", -1.0, 1.0),
    ),
    observe=observe,
    Frame=Frame,
    frame_of=frame_of,
    turn=turn,
    formulas=f"""{LEAN_FORMULAS} u, along s where u is 0, and along e1 where both are 0;
    {FRAME_FORMULAS} Here `e = -(R31 + i R32)`, in body axes, and e' stands for `omega2 - i omega1`.

    {UPRIGHT_FORMULAS} Then `w / (w + 1)` with `w = |(omega1, omega2)|`, `cos(2 alpha)` and `S
    sin(2 alpha)` with the angle alpha from e1 to the x-axis; S is -1 where omega3 < 0, else 1. The
    first two entries of the action, clipped to the disk and then as p along e1 and e2, act as
    (-p_2, p_1), rounded to float32, and the third as S a3.
    """,
)
"""Reduction of `TopRandom`: turns about the vertical, half turn and reflections of the body.

The frame turns in the body, so the first two entries of the action are limited to a disk.
"""
