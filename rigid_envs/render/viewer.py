"""Pictures of one row of an environment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.core import Core
from rigid_envs.moment import Moment
from rigid_envs.render.pixels import Pixels
from rigid_envs.render.view import View
from rigid_envs.render.views import view_of

__all__ = ["Look", "Viewer"]

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


class Viewer:
    """Pictures of a row: a line of a trace has a point for each moment of which one was made."""

    def __init__(self, core: Core, row: int, look: Look) -> None:
        """Nothing is drawn yet."""
        self._core, self._row, self._look = core, row, look
        self._episode = (-1, -1.0)  # number of the episode, time of the last picture
        self._view: View | None = None
        self._pixels: Pixels | None = None

    def picture(self) -> Image:
        """RGB picture of the present state, shape (height, width, 3)."""
        moment, number = self._core.moment(self._row), self._core.episode(self._row)
        view, pixels = self._drawing(moment)
        last, time = self._episode
        if number != last or moment.time < time:
            pixels.clear()
        extend = (number, moment.time) != self._episode
        self._episode = (number, moment.time)
        return pixels.draw(view.frame(moment), extend)

    def close(self) -> None:
        """Free the memory."""
        if self._pixels is not None:
            self._pixels.close()
        self._view = self._pixels = None

    def _drawing(self, moment: Moment) -> tuple[View, Pixels]:
        """View and backend, made anew where the parameters of the system are others."""
        if self._view is None or self._pixels is None or self._view.parameters != moment.parameters:
            self.close()
            look = self._look
            self._view = view_of(self._core.task, dict(moment.parameters))
            scene = self._view.scene
            camera = replace(scene.camera, **look.camera)
            self._pixels = Pixels(scene, look.width, look.height, camera, look.shadows)
        return self._view, self._pixels
