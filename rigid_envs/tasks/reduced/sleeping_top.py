"""Reduced coordinates of a symmetric top that is held by a horizontal torque: `SleepingTop`."""

from typing import Any

from rigid_envs.kernels.actions import single
from rigid_envs.kernels.algebra import Row, attitude, vertical
from rigid_envs.kernels.compiler import scalar
from rigid_envs.symmetries.tops import PHASE, REFLECTION, TURN
from rigid_envs.tasks.reduced.planar import Frame, turned_back
from rigid_envs.tasks.reduced.tops import (
    FRAME_FORMULAS,
    LEAN_FORMULAS,
    UPRIGHT,
    UPRIGHT_FORMULAS,
    Lean,
    lean_frame,
    upright_seen,
    world_lean,
)
from rigid_envs.tasks.reduction import Reduction

__all__ = ["SLEEPING_TOP"]


@scalar
def _lean(y: Any, c: Any) -> Lean:
    omega = (y.omega1, y.omega2, y.omega3)
    return world_lean(attitude(y), omega, c.fall_square, c.gyration)


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Lean, height and spin; the parameters may be hidden, so those of the middle top are used."""
    lean = _lean(y, c)
    frame = lean_frame(lean, y.omega3)
    return upright_seen(frame, lean, vertical(attitude(y))[2], y.omega3, c)


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Frame:
    """Frame along the growing part of the lean."""
    return lean_frame(_lean(y, c), y.omega3)


@scalar
def turn(a: Any, frame: Any) -> tuple[float, float]:
    """Torque about the horizontal axis that drives the axis e3 along an action in the frame."""
    x, z = turned_back(frame, a[0], a[1])
    return single(-z), single(x)


SLEEPING_TOP = Reduction(
    group="O(2) x SO(2)",
    frame=(
        "x along the growing part of the lean, mirrored so that the spin is not negative. The "
        "action is the push of the axis: the torque is at right angles to it."
    ),
    symmetries=(TURN, PHASE, REFLECTION),
    features=UPRIGHT,
    observe=observe,
    Frame=Frame,
    frame_of=frame_of,
    turn=turn,
    formulas=f"""{LEAN_FORMULAS} u, along s where u is 0, and that of the world where both are 0;
    {FRAME_FORMULAS} Here `e = R13 + i R23`.

    {UPRIGHT_FORMULAS} The action, as p in world axes, acts as (-p_y, p_x), rounded to float32.
    """,
)
"""Reduction of `SleepingTop`: O(2), turns about the vertical and reflections, and the phase."""
