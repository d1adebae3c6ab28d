"""View: makes the scene of a task, and the frame of a moment."""

from __future__ import annotations

import abc
from typing import Any

from rigid_envs.moment import Moment
from rigid_envs.render.scene import Frame, Scene

__all__ = ["View"]


class View(abc.ABC):
    """What an episode of a task looks like.

    Args:
        task: the task.
        parameters: parameters of the system by name, of the episode.

    Attributes:
        scene: its parts, camera, arrows and traces.
    """

    scene: Scene

    def __init__(self, task: Any, parameters: dict[str, float]) -> None:
        """Make the scene."""
        self.task = task
        self.parameters = parameters
        self.scene = self.make_scene()

    @abc.abstractmethod
    def make_scene(self) -> Scene:
        """Make the parts, with the parameters of the episode."""

    @abc.abstractmethod
    def frame(self, moment: Moment) -> Frame:
        """Where everything is at this moment."""
