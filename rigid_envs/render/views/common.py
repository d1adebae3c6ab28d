"""What the views of all systems share: a scene in pieces, lines of text, lengths of arrows."""

from __future__ import annotations

import abc
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.moment import Moment
from rigid_envs.render.scene import Arrow, Camera, Floor, Frame, Mesh, Part, Pose, Scene, Trace
from rigid_envs.render.view import View
from rigid_envs.render.views.palette import GHOST

__all__ = ["Array", "Arrows", "SystemView", "above", "ghost", "scaled"]

Array = npt.NDArray[np.float64]
Arrows = dict[str, tuple[npt.ArrayLike, npt.ArrayLike]]


class SystemView(View):
    """A view in pieces, which subclasses override one by one.

    Attributes:
        system: the physical system, with the parameters of the episode: its accessors read states.
    """

    def __init__(self, task: Any, parameters: Mapping[str, float]) -> None:
        """Make the system and the scene."""
        self.system = task.system(parameters)
        super().__init__(task, dict(parameters))

    @abc.abstractmethod
    def parts(self) -> dict[str, Part]:
        """Rigid pieces by name."""

    @abc.abstractmethod
    def camera(self) -> Camera:
        """Point of view at first."""

    @abc.abstractmethod
    def poses(self, moment: Moment) -> dict[str, Pose]:
        """Where the pieces are."""

    def vectors(self) -> dict[str, Arrow]:
        """Look of the arrows; none."""
        return {}

    def traces(self) -> dict[str, Trace]:
        """Look of the paths; none."""
        return {}

    def floor(self) -> Floor | None:
        """The floor; none."""
        return None

    def arrows(self, moment: Moment) -> Arrows:
        """Start and vector of the arrows [m]; none."""
        return {}

    def points(self, moment: Moment) -> dict[str, npt.ArrayLike]:
        """Newest points of the paths; none."""
        return {}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """What else is to be read, beside time, reward and cost; nothing."""
        return ()

    def make_scene(self) -> Scene:
        """Put the pieces together."""
        return Scene(self.parts(), self.camera(), self.vectors(), self.traces(), self.floor())

    def frame(self, moment: Moment) -> Frame:
        """Where everything is at this moment."""
        return Frame(
            self.poses(moment), self.arrows(moment), self.points(moment), self.text(moment)
        )

    def text(self, moment: Moment) -> tuple[str, ...]:
        """Time and reward, cost with its unit, the readings, and success."""
        quantity, _, unit = self.task.cost_unit.rstrip("]").partition(" [")
        lines = (
            f"time {moment.time:.1f} s   reward {moment.reward:.3f}",
            f"cost {moment.cost:.3g} {unit} ({quantity})",
            *self.readings(moment),
        )
        return (*lines, "success") if moment.success else lines


def scaled(vector: npt.ArrayLike, scale: float, longest: float = math.inf) -> Array:
    """A vector as the length of an arrow, which is limited.

    Args:
        vector: shape (3,).
        scale: metres for a unit of the vector.
        longest: limit [m].
    """
    arrow = scale * np.asarray(vector, dtype=np.float64)
    length = float(np.linalg.norm(arrow))
    return arrow * (longest / length) if length > longest else arrow


def above(point: npt.ArrayLike, height: float) -> Array:
    """The point that is higher by this [m], shape (3,)."""
    return np.add(point, (0.0, 0.0, height), dtype=np.float64)


def ghost(mesh: Mesh, opacity: float = GHOST) -> Part:
    """A goal: translucent, without shadow."""
    return Part(mesh, opacity=opacity, shadow=False, shiny=False)
