"""Pictures of one row of an environment."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rigid_envs.core import Core
from rigid_envs.render.drawing import Drawing, Look

__all__ = ["Viewer"]

Image = npt.NDArray[np.uint8]


class Viewer:
    """Pictures of a row: a line of a trace has a point for each moment of which one was made."""

    def __init__(self, core: Core, row: int, look: Look) -> None:
        """Nothing is drawn yet."""
        self._core, self._row, self._look = core, row, look
        self._episode = (-1, -1.0)  # number of the episode, time of the last picture
        self._drawing: Drawing | None = None

    def picture(self) -> Image:
        """RGB picture of the present state, shape (height, width, 3)."""
        moment, number = self._core.moment(self._row), self._core.episode(self._row)
        if self._drawing is None or self._drawing.parameters != moment.parameters:
            self.close()
            self._drawing = Drawing(self._core.task, moment.parameters, self._look)
        last, time = self._episode
        if number != last or moment.time < time:
            self._drawing.clear()
        extend = (number, moment.time) != self._episode
        self._episode = (number, moment.time)
        return self._drawing.picture(moment, extend)

    def close(self) -> None:
        """Free the memory."""
        if self._drawing is not None:
            self._drawing.close()
            self._drawing = None
