"""The reduced frame of a task, and the frames of planar and spinning motion."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, NamedTuple

from rigid_envs.engine.algebra import Vector
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma, select
from rigid_envs.engine.episode import Episode, NoFrame, as_given, no_frame, single
from rigid_envs.tasks.fields import Entry
from rigid_envs.tasks.symmetry import Symmetry

# Reduction of a task by its symmetry: invariant observations, actions in a frame of the state.
#
# A *symmetry* of a task is a change of state, parameters and action that commutes with a step and
# changes neither reward, success nor end. States that symmetries lead to one another need the same
# action up to the symmetry. In the reduced frame they look the same: the observation consists of
# invariants, and the action is given in a frame that turns with the state (a moving frame, Olver,
# *Classical Invariant Theory*, chapter 8). So a policy learns the task once, not once for each
# direction.


class Side(NamedTuple):
    """Frame of a group of two elements: -1 where the state is mirrored, else 1."""

    sign: float


@scalar
def turn_one(a: Any, frame: Side) -> tuple[float]:
    """The only entry of an action, from the frame of a side."""
    return (frame.sign * a[0],)


@dataclass(frozen=True, eq=False, kw_only=True)
class Reduction:
    """Group of symmetries of a task, and its reduced coordinates.

    Attributes:
        group: name of the group of symmetries.
        symmetries: symmetries that generate it.
        frame: how the frame of the action turns with the state, as a sentence without subject.
        features: entries of the observation in the reduced frame; those of a goal task come after
            the two goals, which stay as they are.
        observe: ``observe(y, aux, p, c) -> features``, compiled; in a goal task, after both goals.
        Frame: `NamedTuple` of the numbers that give the frame.
        frame_of: ``frame_of(y, aux, p, c) -> frame``, compiled.
        turn: ``turn(action, frame) -> action``, compiled: from the reduced frame to that of the
            task, after the action was clipped; what is not a float32 is rounded, by `single`.
        formulas: of the frame, the entries and the action, for the page; paragraphs are separated
            by empty lines.
    """

    group: str
    symmetries: tuple[Symmetry, ...]
    frame: str
    features: tuple[Entry, ...]
    observe: Callable[..., Any]
    Frame: type[Any] = NoFrame
    frame_of: Callable[..., Any] = no_frame
    turn: Callable[..., Any] = as_given
    formulas: str = ""


@cache
def in_reduced_frame(episode: Episode, reduction: Reduction) -> Episode:
    """The same episodes, observed and acted on in the reduced frame; made and compiled once."""
    return replace(
        episode,
        observe=reduction.observe,
        Frame=reduction.Frame,
        frame_of=reduction.frame_of,
        turn=reduction.turn,
    )


# Frames in the plane that turn with the state, and their mirror images.

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
