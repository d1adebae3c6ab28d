"""The scene: what is to be seen, as data; and motion between two moments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.system import System
from rigid_envs.tasks.core import Moment

# Scene: what is to be seen, as data. A view makes it from a state; a backend draws it.
#
# World axes are right-handed with z up; lengths are in metres. A scene is constant in an episode; a
# `SceneFrame` says where its parts are at one moment. Neither knows how it is drawn.

Color = tuple[float, float, float]
"""Red, green and blue in [0, 1], sRGB."""

IDENTITY = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with a normal and a colour at every vertex.

    Attributes:
        vertices: positions in the axes of the part [m], float32 (V, 3).
        normals: outward unit normals, float32 (V, 3).
        colors: sRGB, uint8 (V, 3).
        triangles: vertex indices, counter-clockwise seen from outside, int32 (T, 3).
    """

    vertices: npt.NDArray[np.float32]
    normals: npt.NDArray[np.float32]
    colors: npt.NDArray[np.uint8]
    triangles: npt.NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Part:
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


@dataclass(frozen=True, eq=False)
class Pose:
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
