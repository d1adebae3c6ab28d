"""Pictures of moments of one episode."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.moment import Moment
from rigid_envs.render.pixels import Pixels
from rigid_envs.render.scene import Camera
from rigid_envs.render.views import view_of
from rigid_envs.tasks import Task

__all__ = ["Drawing", "Look"]

Image = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Look:
    """Size and point of view of pictures.

    Attributes:
        width: in pixels.
        height: in pixels.
        camera: fields of `Camera` that differ from those of the scene.
        shadows: whether parts cast shadows on the floor.
    """

    width: int = 480
    height: int = 480
    camera: Mapping[str, Any] = field(default_factory=dict)
    shadows: bool = True


class Drawing:
    """Pictures of an episode; traces grow with every picture.

    Args:
        task: the task.
        parameters: parameters of the system by name, of the episode.
        look: size and point of view.

    Attributes:
        parameters: of the system.
        camera: point of view.

    Raises:
        DependencyNotInstalled: a package that draws is not installed.
    """

    def __init__(self, task: Task, parameters: Mapping[str, float], look: Look) -> None:
        """Make the scene."""
        self.parameters = dict(parameters)
        self._view = view_of(task, self.parameters)
        scene = self._view.scene
        self.camera: Camera = replace(scene.camera, **look.camera)
        self._pixels = Pixels(scene, look.width, look.height, self.camera, look.shadows)

    def picture(self, moment: Moment, extend: bool = True) -> Image:
        """RGB picture of a moment, shape (height, width, 3).

        Args:
            moment: what is drawn.
            extend: whether traces grow by it.
        """
        return self._pixels.draw(self._view.frame(moment), extend)

    def clear(self) -> None:
        """Forget the traces: another episode with the same parameters begins."""
        self._pixels.clear()

    def close(self) -> None:
        """Free the memory."""
        self._pixels.close()
