"""What is to be seen: the scene as data, motion between two moments, and the views that make it."""

import abc
import importlib
import itertools
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from types import ModuleType
from typing import Any, ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.system import System
from rigid_envs.tasks.core import Moment
from rigid_envs.tasks.task import Task
from rigid_envs.watch.meshes import GHOST, Color, Mesh, brick, chequered_ball, circle

# Scene: what is to be seen, as data. A view makes it from a state; a backend draws it.
#
# World axes are right-handed with z up; lengths are in metres. A scene is constant in an episode; a
# `SceneFrame` says where its parts are at one moment. Neither knows how it is drawn.

IDENTITY = (1.0, 0.0, 0.0, 0.0)


class Part(NamedTuple):
    """A rigid piece of the scene.

    Attributes:
        mesh: its shape.
        opacity: 1 for a solid part, less for a ghost.
        shadow: whether it casts a shadow on the floor.
        shiny: whether it has a highlight.
    """

    mesh: Mesh
    opacity: float = 1.0
    shadow: bool = True
    shiny: bool = True


@dataclass(frozen=True)
class Arrow:
    """Look of a vector.

    Attributes:
        color: its colour.
        width: diameter of the shaft [m].
        label: symbol, as "L" or "omega".
    """

    color: Color
    width: float
    label: str


@dataclass(frozen=True)
class Trace:
    """Look of the path of a point.

    Attributes:
        color: its colour.
        width: width of the line [m]; in units of the part's scale where there is a part.
        part: part in whose axes, before its scale, the points are given; None for the world.
        length: number of points that are kept; None for all of the episode.
    """

    color: Color
    width: float
    part: str | None = None
    length: int | None = None


@dataclass(frozen=True)
class Floor:
    """Horizontal chequered square, on which shadows fall.

    Attributes:
        height: z of the floor [m].
        size: side of the square [m].
        cell: side of a cell [m].
        colors: colours of the two kinds of cell.
    """

    height: float
    size: float
    cell: float
    colors: tuple[Color, Color] = ((0.93, 0.94, 0.95), (0.84, 0.87, 0.90))


@dataclass(frozen=True)
class Camera:
    """Perspective camera that looks at a target.

    Attributes:
        target: point in the middle of the picture [m], relative to `follow`.
        distance: from target to camera [m].
        azimuth: direction from target to camera about the vertical, from +x to +y [deg].
        elevation: of the camera above the horizontal plane of the target [deg].
        field_of_view: vertical angle [deg].
        follow: part whose horizontal position is added to the target; None for a fixed camera.
    """

    target: tuple[float, float, float] = (0.0, 0.0, 0.0)
    distance: float = 5.0
    azimuth: float = -60.0
    elevation: float = 25.0
    field_of_view: float = 35.0
    follow: str | None = None


@dataclass(frozen=True, eq=False)
class Scene:
    """What an episode shows.

    Attributes:
        parts: rigid pieces by name.
        camera: initial point of view.
        arrows: vectors by name.
        traces: paths by name.
        floor: the floor; None for bodies in free space.
    """

    parts: Mapping[str, Part]
    camera: Camera
    arrows: Mapping[str, Arrow] = field(default_factory=dict)
    traces: Mapping[str, Trace] = field(default_factory=dict)
    floor: Floor | None = None


class Pose(NamedTuple):
    """Position, attitude and size of a part.

    Attributes:
        position: origin of the part in the world [m], shape (3,).
        q: attitude (w, x, y, z), unit, part to world.
        scale: factors along the axes of the part, before the rotation.
    """

    position: npt.ArrayLike = (0.0, 0.0, 0.0)
    q: npt.ArrayLike = IDENTITY
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


Arrows = dict[str, tuple[npt.ArrayLike, npt.ArrayLike]]
"""Start and vector of arrows [m], by name."""


@dataclass(frozen=True, eq=False)
class SceneFrame:
    """The scene at one moment.

    Attributes:
        poses: pose of every part; a part that is left out is not shown.
        arrows: start and vector [m] of the arrows shown, by name.
        points: newest point of the traces, by name; a point that is not finite interrupts the line.
        text: lines of text.
    """

    poses: Mapping[str, Pose]
    arrows: Arrows = field(default_factory=dict)
    points: Mapping[str, npt.ArrayLike] = field(default_factory=dict)
    text: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Panel:
    """A scene over time.

    Attributes:
        title: what it shows.
        scene: what there is.
        frames: where it is, at each time.
        times: of the frames [s].
        whole: points of traces of the scene that are shown from the start, by name, each (n, 3).
    """

    title: str
    scene: Scene
    frames: Sequence[SceneFrame]
    times: Array
    whole: Mapping[str, npt.ArrayLike] = field(default_factory=dict)


def from_z(direction: npt.ArrayLike) -> Array:
    """Quaternion of the shortest turn from the z-axis to a unit vector."""
    x, y, z = np.asarray(direction, dtype=np.float64)
    if z < -1.0 + 1e-12:
        return np.array([0.0, 1.0, 0.0, 0.0])
    turn = np.array([1.0 + z, -y, x, 0.0])
    return np.asarray(turn / np.linalg.norm(turn))


# Motion between two successive moments, so that pictures move smoothly and paths are curves.


class Interpolation:
    """Motion of a step, for the eye: it is interpolated, not simulated.

    The attitude turns about one axis at a constant rate, all other numbers change linearly; input,
    action and results are those of the step. Rolling along a straight line, and a quarter roll on
    the grid, are met exactly.

    Args:
        system: the physical system, with its parameters.
        one: earlier moment.
        other: the next moment of the same episode.

    Attributes:
        turn: rotation vector of the step in world axes [rad], shape (3,). Of those that lead from
            one attitude to the other, the nearest to the angular velocity times the duration.
    """

    def __init__(self, system: System, one: Moment, other: Moment) -> None:
        """Find the turn."""
        self._one, self._other = one, other
        self._part = system.components.get("q")
        self.turn = np.zeros(3)
        if self._part is not None:
            self._q = rotations.normalize(one.y[self._part])
            end = rotations.normalize(other.y[self._part])
            short = rotations.log(rotations.multiply(end, rotations.conjugate(self._q)))
            self.turn = _nearest(short, _omega(system, other) * (other.time - one.time))

    def at(self, share: float) -> Moment:
        """The moment at a share of the time, from 0 to 1."""
        one, other = self._one, self._other
        if share <= 0.0 or share >= 1.0:
            return one if share <= 0.0 else other
        y = one.y + share * (other.y - one.y)
        if self._part is not None:
            y[self._part] = rotations.multiply(rotations.exp(share * self.turn), self._q)
        return replace(
            other,
            y=y,
            aux=_auxiliary(one.aux, other.aux, share),
            time=one.time + share * (other.time - one.time),
            success=one.success,
        )


def _nearest(short: Array, expected: Array) -> Array:
    """Of the rotation vectors of one rotation, the nearest to another vector."""
    angle, size = float(np.linalg.norm(short)), float(np.linalg.norm(expected))
    if angle <= 1e-9 and size == 0.0:
        return short
    along = short / angle if angle > 1e-9 else expected / size
    turns = np.round((expected @ along - angle) / (2.0 * np.pi))
    return np.asarray(short + 2.0 * np.pi * turns * along)


def _omega(system: System, moment: Moment) -> Array:
    """Angular velocity at the end of a step in world axes [rad/s]; zero where none is known."""
    accessor = system.accessors.get("omega_world")
    if accessor is not None:
        return accessor(moment.y)
    of_input = getattr(system, "omega_world", None)  # of kinematic rolling
    return np.zeros(3) if of_input is None else np.asarray(of_input(moment.u))


def _auxiliary(
    one: Mapping[str, float], other: Mapping[str, float], share: float
) -> dict[str, float]:
    """Auxiliary state between two; four entries ``name_w`` to ``name_z`` are an attitude."""
    mixed = {name: value + share * (other[name] - value) for name, value in one.items()}
    for name in one:
        names = [f"{name[:-1]}{letter}" for letter in "wxyz"]
        if name.endswith("_w") and all(entry in one for entry in names):
            p, q = ([each[entry] for entry in names] for each in (one, other))
            mixed.update(zip(names, rotations.slerp(p, q, share).tolist(), strict=True))
    return mixed


# What views share, and the view of every task.


class View(abc.ABC):
    """What an episode of a task looks like, in pieces, which subclasses give one by one.

    Args:
        task: the task.
        parameters: parameters of the system by name, of the episode.

    Attributes:
        system: the physical system, with the parameters of the episode: its accessors read states.
        scene: its parts, camera, arrows and traces.
        steered: part that a player's camera follows on its way to the part "goal"; None for none.
    """

    steered: ClassVar[str | None] = None

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
        """Time, reward and cost, the readings, and success: sums of the episode where known."""
        quantity, _, unit = self.task.cost_unit.rstrip("]").partition(" [")
        name, which = ("reward", " of this step") if moment.totals is None else ("return", "")
        reward, cost = moment.totals or (moment.reward, moment.cost)
        lines = (
            f"time {moment.time:.1f} s   {name} {round(reward, 3) + 0.0:.3f}",
            f"cost {cost_figure(self.task, cost)} {unit} ({quantity}{which})",
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


_LEAST = 1e-3  # cost that is shown, in parts of what the largest action costs in a step


def cost_figure(task: Task, cost: float) -> str:
    """A cost, by `three_digits`; 0 where it is nothing beside what actions cost.

    Args:
        task: the task, whose largest input times its control period tells what a step may cost.
        cost: in ``task.cost_unit``.
    """
    largest = task.dt * max(max(abs(entry.low), abs(entry.high)) for entry in task.actions())
    return three_digits(cost if abs(cost) >= _LEAST * largest else 0.0)


def three_digits(value: float) -> str:
    """A number in three digits; from 1000 on to the unit, without an exponent."""
    return f"{value:.3g}" if abs(value) < 999.5 else f"{value:.0f}"


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


# What insets share.

INSET_BLUE, INSET_RED, INSET_GREEN = (0.0, 0.447, 0.698), (0.835, 0.369, 0.0), (0.0, 0.62, 0.451)
INSET_INK = (0.42, 0.46, 0.52)
LIFT = 1.01  # of lines above the surface that they are drawn on


def body_axes() -> dict[str, Arrow]:
    """Principal axes of a body, with their names."""
    names = ("e\u2081", "e\u2082", "e\u2083")
    return {f"e{k + 1}": Arrow(INSET_INK, 0.02, name) for k, name in enumerate(names)}


def axis_sphere(y: Array, times: Array, elevation: float = 38.0) -> Panel:
    """Path of the axis e3 of a top on the unit sphere, in world axes.

    Args:
        y: states, which begin with the attitude, shape (n, n_state).
        times: of the states [s], shape (n,).
        elevation: of the camera [deg].
    """
    axis = rotations.rotate(rotations.normalize(y[:, :4]), np.array([0.0, 0.0, 1.0]))
    scene = Scene(
        parts={"sphere": Part(chequered_ball(), opacity=0.55)},
        camera=Camera((0.0, 0.0, 0.18), 4.8, -60.0, elevation, 32.0),
        arrows={"e3": Arrow(INSET_BLUE, 0.04, "e\u2083")},
        traces={"axis": Trace(INSET_RED, 0.045), "equator": Trace(INSET_INK, 0.012)},
    )
    pose = {"sphere": Pose()}
    frames = [
        SceneFrame(pose, {"e3": ((0.0, 0.0, 0.0), 1.15 * point)}, {"axis": LIFT * point})
        for point in axis
    ]
    title = "Axis e\u2083 on the sphere"
    return Panel(title, scene, frames, times, {"equator": LIFT * circle(97)})


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
