"""Scene: what is to be seen, as data. A view makes it from a state; a backend draws it.

World axes are right-handed with z up; lengths are in metres. A scene is constant in an episode; a
`Frame` says where its parts are at one moment. Neither knows how it is drawn.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

__all__ = ["Arrow", "Camera", "Color", "Floor", "Frame", "Mesh", "Part", "Pose", "Scene", "Trace"]

Array = npt.NDArray[np.float64]
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


@dataclass(frozen=True, eq=False)
class Frame:
    """The scene at one moment.

    Attributes:
        poses: pose of every part; a part that is left out is not shown.
        arrows: start and vector [m] of the arrows shown, by name.
        points: newest point of the traces, by name; a point that is not finite interrupts the line.
        text: lines of text.
    """

    poses: Mapping[str, Pose]
    arrows: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]] = field(default_factory=dict)
    points: Mapping[str, npt.ArrayLike] = field(default_factory=dict)
    text: tuple[str, ...] = ()
