"""Tasks that have one half of a reduction: its features beside the world's, or its frame alone.

*Features alone*: the world's observation, and beside it all features of the reduction; actions are
those of the world. *Frame alone*: actions of the reduced frame, and of its features only the plain
coordinates of the state. All else is that of the task.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

from rigid_envs.engine.algebra import Row
from rigid_envs.engine.compiler import scalar
from rigid_envs.systems.free_body.tasks import axis_flip
from rigid_envs.systems.free_body.tasks import axis_flip as flip
from rigid_envs.systems.free_body.tasks.axis_flip import AxisFlip
from rigid_envs.systems.heavy_top.tasks import top_precession
from rigid_envs.systems.heavy_top.tasks import top_precession as precession
from rigid_envs.systems.heavy_top.tasks.top_precession import TopPrecession
from rigid_envs.systems.rolling_ball.tasks import ball_park
from rigid_envs.systems.rolling_ball.tasks import ball_park as ball_pose
from rigid_envs.systems.rolling_ball.tasks.ball_park import BallPark
from rigid_envs.tasks.fields import Entry

__all__ = [
    "AxisFlipFeatures",
    "AxisFlipFrame",
    "BallParkFeatures",
    "BallParkFrame",
    "TopPrecessionFeatures",
    "TopPrecessionFrame",
]


@scalar
def ball_features(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """What the world shows of a ball, and the features of its reduction."""
    return (*ball_park.observe(y, aux, p, c), *ball_pose.observe_reduced(y, aux, p, c))


@scalar
def ball_coordinates(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Offset and rotation vector in the frame."""
    seen = ball_pose.observe_reduced(y, aux, p, c)
    return seen[0], seen[1], seen[2], seen[3]


@scalar
def flip_features(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """What the world shows of a flip, and the features of its reduction."""
    return (*axis_flip.observe(y, aux, p, c), *flip.observe_reduced(y, aux, p, c))


@scalar
def flip_coordinates(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Angular velocity in the frame, and time left."""
    seen = flip.observe_reduced(y, aux, p, c)
    return seen[0], seen[1], seen[2], seen[3]


@scalar
def top_features(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """What the world shows of a precessing top, and the features of its reduction."""
    return (*top_precession.observe(y, aux, p, c), *precession.observe_reduced(y, aux, p, c))


@scalar
def top_coordinates(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Tilt, goal and rates in the frame."""
    seen = precession.observe_reduced(y, aux, p, c)
    return seen[0], seen[1], seen[2], seen[4], seen[5]


class WithFeatures:
    """Mixed with a task: shows the features of its reduction beside those of the world.

    Not itself a `Task`, whose defaults would replace those of the task that it is mixed with.
    """

    reduction: ClassVar[Any]

    def features(self) -> tuple[Entry, ...]:
        """The world's and the reduction's."""
        features = super().features()  # type: ignore[misc]
        return (*features, *self.reduction.features)


@dataclass(frozen=True)
class BallParkFeatures(WithFeatures, BallPark):
    """`BallPark` with the features of its reduction beside the world's, and the world's actions."""

    episode: ClassVar = replace(BallPark.episode, observe=ball_features)


@dataclass(frozen=True)
class BallParkFrame(BallPark):
    """`BallPark` with the frame of its reduction and plain coordinates in it."""

    reduction: ClassVar = replace(
        ball_pose.BALL_POSE, observe=ball_coordinates, features=ball_pose.BALL_POSE.features[:4]
    )


@dataclass(frozen=True)
class AxisFlipFeatures(WithFeatures, AxisFlip):
    """`AxisFlip` with the features of its reduction beside the world's, and the world's actions."""

    episode: ClassVar = replace(AxisFlip.episode, observe=flip_features)


@dataclass(frozen=True)
class AxisFlipFrame(AxisFlip):
    """`AxisFlip` with the frame of its reduction and plain coordinates in it."""

    reduction: ClassVar = replace(
        flip.FLIP, observe=flip_coordinates, features=flip.FLIP.features[:4]
    )


@dataclass(frozen=True)
class TopPrecessionFeatures(WithFeatures, TopPrecession):
    """`TopPrecession` with the features of its reduction beside the world's, and its actions."""

    episode: ClassVar = replace(TopPrecession.episode, observe=top_features)


_TOP = precession.TOP_PRECESSION.features


@dataclass(frozen=True)
class TopPrecessionFrame(TopPrecession):
    """`TopPrecession` with the frame of its reduction and plain coordinates in it."""

    reduction: ClassVar = replace(
        precession.TOP_PRECESSION, observe=top_coordinates, features=(*_TOP[:3], *_TOP[4:6])
    )
