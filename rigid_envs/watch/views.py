"""What views share, and the view of every task."""

from __future__ import annotations

import abc
import importlib
import itertools
import math
import sys
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.tasks.core import Moment
from rigid_envs.tasks.task import Task
from rigid_envs.watch.meshes import GHOST, brick
from rigid_envs.watch.scene import (
    Arrow,
    Arrows,
    Camera,
    Floor,
    Mesh,
    Panel,
    Part,
    Pose,
    Scene,
    SceneFrame,
    Trace,
)


class View(abc.ABC):
    """What an episode of a task looks like, in pieces, which subclasses give one by one.

    Args:
        task: the task.
        parameters: parameters of the system by name, of the episode.

    Attributes:
        system: the physical system, with the parameters of the episode: its accessors read states.
        scene: its parts, camera, arrows and traces.
    """

    def __init__(self, task: Any, parameters: Mapping[str, float]) -> None:
        """Make the system and the scene."""
        self.task, self.parameters = task, dict(parameters)
        self.system = task.system(parameters)
        self.scene = Scene(self.parts(), self.camera(), self.vectors(), self.traces(), self.floor())

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

    def frame(self, moment: Moment) -> SceneFrame:
        """Where everything is at this moment."""
        return SceneFrame(
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

    @staticmethod
    def insets(system: Any, y: Array, times: Array, driven: bool) -> list[Panel]:
        """What a page of replays shows beside the scene: nothing.

        Args:
            system: the system.
            y: its states, shape (n, n_state).
            times: of the states [s], shape (n,).
            driven: whether anything acts on it.
        """
        return []


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


# View of a system that has none of its own.

_MOST = 8  # lines of state


class GenericView(View):
    """A box with the attitude of a state that has one, and the state in words."""

    def parts(self) -> dict[str, Part]:
        """A box, where there is an attitude."""
        return {"body": Part(brick())} if "q" in self.system.components else {}

    def camera(self) -> Camera:
        """The box."""
        return Camera(distance=5.0)

    def poses(self, moment: Moment) -> dict[str, Pose]:
        """The box, with three different sides."""
        part = self.system.components.get("q")
        return {} if part is None else {"body": Pose(q=moment.y[part], scale=(1.6, 1.1, 0.6))}

    def readings(self, moment: Moment) -> tuple[str, ...]:
        """The entries of the state."""
        part = self.system.components.get("q", slice(0, 0))
        entries = list(zip(self.system.state_entries, moment.y, strict=True))
        del entries[part]
        return tuple(f"{name} {value:.3f}" for name, value in entries[:_MOST])


# Which view shows which task or system: it has the name of their class.


def view_class(owner: type) -> type[View]:
    """The class of the view of a task or a system: its own, else of its system, else a generic one.

    The view of a class ``Wheel`` is ``WheelView``, in the module of the class or in a module
    ``view`` of a package that holds it. Subclasses are shown likewise.
    """
    for kind in (*owner.__mro__, *getattr(owner, "system_type", object).__mro__):
        for module in _modules(kind.__module__):
            found = getattr(module, f"{kind.__name__}View", None)
            if isinstance(found, type) and issubclass(found, View):
                return found
    return GenericView


def view_of(task: Task, parameters: Mapping[str, float]) -> View:
    """The view of an episode.

    Args:
        task: the task.
        parameters: parameters of the system by name, of the episode.
    """
    return view_class(type(task))(task, parameters)


def _modules(name: str) -> Iterator[ModuleType]:
    """A module, and the modules ``view`` of the packages that hold it, the innermost first."""
    places = [*itertools.accumulate(name.split("."), "{}.{}".format)]
    known = [sys.modules[place] for place in reversed(places) if place in sys.modules]
    yield from known[:1]
    for module in known:
        if hasattr(module, "__path__") and find_spec(view := f"{module.__name__}.view"):
            yield importlib.import_module(view)
