"""Pictures of what a view shows, drawn in software."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, Image
from rigid_envs.mechanics import rotations
from rigid_envs.tasks.core import Moment
from rigid_envs.tasks.task import Task
from rigid_envs.watch.meshes import Color, Mesh, arrow_head, arrow_shaft
from rigid_envs.watch.panda import SOLID, geometry, library, picture_of, strip, transform
from rigid_envs.watch.pictures import write
from rigid_envs.watch.views import Arrow, Arrows, Floor, Part, Pose, Trace, View, from_z, view_of

# Pictures of one episode.


@dataclass(frozen=True)
class Look:
    """Size and point of view of pictures.

    Attributes:
        width: in pixels.
        height: in pixels.
        camera: fields of `Camera` that differ from those of the scene.
        shadows: whether parts cast shadows on the floor.
        text: whether the lines of the scene are written.
    """

    width: int = 480
    height: int = 480
    camera: Mapping[str, Any] = field(default_factory=dict)
    shadows: bool = True
    text: bool = True


_SKY = (0.97, 0.975, 0.985)
# together at most 1, also on white: the sum of a highlight and more would run over and look dark
_AMBIENT = (0.50, 0.505, 0.52)
_SUN = (0.44, 0.435, 0.42)
_HIGHLIGHT = 0.10
_TO_SUN = (0.35, -0.45, 1.0)
_SHADE = (0.13, 0.16, 0.22, 0.30)
_HEAD = 3.0  # length and width of the head of an arrow, in widths of its shaft


def drawing_of(task: Task, parameters: Mapping[str, float], look: Look) -> Drawing:
    """Drawing of an episode of a task, with the parameters of its system by name."""
    return Drawing(view_of(task, parameters), look)


class Drawing:
    """Pictures of an episode; traces grow with every picture.

    Args:
        view: what is seen of the episode.
        look: size and point of view.

    Raises:
        DependencyNotInstalled: a package that draws is not installed.
    """

    def __init__(self, view: View, look: Look) -> None:
        """Build the scene graph."""
        core, scene = library(), view.scene
        self.view, self._look = view, look
        self._camera = replace(scene.camera, **look.camera)
        self._root = core.NodePath("scene")
        self._root.setBin(SOLID, 0)
        for light in _lights():
            self._root.setLight(light)
        self._parts = {name: self._add_part(name, part) for name, part in scene.parts.items()}
        self._arrows = {name: self._add_arrow(name, each) for name, each in scene.arrows.items()}
        self._lines = {name: self._add_line(name, each) for name, each in scene.traces.items()}
        self._points: dict[str, list[Array]] = {name: [] for name in scene.traces}
        self._eye = self._add_camera()
        self._shadows: dict[str, Any] = {}
        self._ground = self._root.attachNewNode("ground")
        if scene.floor is not None:
            self._add_floor(scene.floor)
            if look.shadows:
                self._shadows = self._add_shadows(scene.floor)

    def picture(self, moment: Moment, extend: bool = True) -> Image:
        """RGB picture of a moment, shape (height, width, 3).

        Args:
            moment: what is drawn.
            extend: whether traces grow by it.
        """
        frame = self.view.frame(moment)
        self._place_parts(frame.poses)
        self._place_arrows(frame.arrows)
        eye = self._place_camera(frame.poses)
        if extend:
            self._extend(frame.points)
        self._trace(frame.poses, eye)
        picture = picture_of(self._eye, self._look.width, self._look.height, _SKY)
        if self._look.text:
            write(picture, frame.text)
        return picture

    def place_of(self, point: npt.ArrayLike) -> Array:
        """Where a point of the world is in the last picture.

        Args:
            point: shape (3,) [m].

        Returns:
            Right and up of the middle, in halves of the picture: beyond 1 it is outside, where the
            direction alone counts.
        """
        place = library().Point3(*np.asarray(point, dtype=np.float64))
        x, depth, y = self._eye.getRelativePoint(self._root, place)
        half = np.tan(np.radians(self._eye.node().getLens().getFov()) / 2)
        return np.asarray((x, y) / half / max(depth, 1e-6))

    def clear(self) -> None:
        """Remove the lines of the traces: a new episode begins."""
        for points in self._points.values():
            points.clear()

    def close(self) -> None:
        """Free the scene graph."""
        core = library()
        self._root.removeNode()
        self._parts, self._arrows, self._lines, self._shadows = {}, {}, {}, {}
        for states in (core.RenderState, core.TransformState):
            states.clearCache()  # it keeps what scenes that are gone were made of
            states.garbageCollect()

    def _add_part(self, name: str, part: Part) -> Any:
        core = library()
        node = self._root.attachNewNode(name)
        node.attachNewNode(geometry(part.mesh))
        node.setMaterial(_material(part.shiny))
        if part.opacity < 1.0:
            node.setTransparency(core.TransparencyAttrib.MAlpha)
            node.setAlphaScale(part.opacity)
            node.setBin("transparent", 0)
        return node

    def _add_arrow(self, name: str, arrow: Arrow) -> Any:
        """A node with the shaft and the head."""
        node = self._root.attachNewNode(name)
        node.setColor(*arrow.color, 1.0)
        node.setMaterial(_material(False))
        for mesh in (arrow_shaft(), arrow_head()):
            # a place of its own: the mesh is shared
            node.attachNewNode("piece").attachNewNode(geometry(mesh))
        return node

    def _add_line(self, name: str, trace: Trace) -> Any:
        core = library()
        node = self._root.attachNewNode(name)
        node.setLightOff()
        node.setAttrib(core.ShadeModelAttrib.make(core.ShadeModelAttrib.MFlat))
        node.setTwoSided(True)
        node.setColor(*trace.color, 1.0)
        return node

    def _add_camera(self) -> Any:
        core, camera = library(), self._camera
        lens = core.PerspectiveLens()
        aspect = self._look.width / self._look.height
        across = aspect * math.tan(math.radians(camera.field_of_view / 2))
        lens.setFov(2 * math.degrees(math.atan(across)))
        lens.setAspectRatio(aspect)
        lens.setNearFar(0.05 * camera.distance, 20.0 * camera.distance)
        node = core.Camera("camera")
        node.setLens(lens)
        return self._root.attachNewNode(node)

    def _add_floor(self, floor: Floor) -> None:
        core = library()
        node = self._ground.attachNewNode(geometry(_chequers(floor, _SKY)))
        node.setLightOff()
        node.setBin("background", 0)
        node.setAttrib(core.ShadeModelAttrib.make(core.ShadeModelAttrib.MFlat))
        node.setDepthWrite(False)  # it is below all parts
        node.setDepthTest(False)

    def _add_shadows(self, floor: Floor) -> dict[str, Any]:
        """A flattened copy of every part that casts a shadow, on the floor."""
        core = library()
        x, y, z = _TO_SUN
        height = floor.height + 1e-3 * self._camera.distance
        # (X, Y, Z) -> (X - x / z (Z - h), Y - y / z (Z - h), h), with a trace of thickness: the
        # nearest one of all layers is drawn first, and hides the others
        thin = 1e-5
        flat = core.LMatrix4(
            1, 0, 0, 0,
            0, 1, 0, 0,
            -x / z, -y / z, thin, 0,
            height * x / z, height * y / z, height * (1 - thin), 1,
        )  # fmt: skip
        shade = self._root.attachNewNode("shadows")
        shade.setTransform(core.TransformState.makeMat(flat))
        shade.setLightOff(1)
        shade.setAttrib(core.ShadeModelAttrib.make(core.ShadeModelAttrib.MFlat), 1)
        shade.setColor(*_SHADE, 2)
        shade.setTransparency(core.TransparencyAttrib.MAlpha, 1)
        shade.setBin("background", 1, 1)
        shadows = {}
        for name, part in self.view.scene.parts.items():
            if part.shadow and part.opacity == 1.0:
                shadows[name] = shade.attachNewNode(name)
                shadows[name].attachNewNode(geometry(part.mesh))
        return shadows

    def _place_parts(self, poses: Mapping[str, Pose]) -> None:
        """Show the parts that have a pose, each with its shadow."""
        for nodes in (self._parts, self._shadows):
            for name, node in nodes.items():
                if name in poses:
                    node.show()
                    node.setTransform(transform(poses[name]))
                else:
                    node.hide()

    def _place_arrows(self, arrows: Arrows) -> None:
        """Show the arrows that have a length."""
        core = library()
        for name, node in self._arrows.items():
            start, vector = np.array(arrows.get(name, np.zeros((2, 3))), dtype=np.float64)
            length = float(np.linalg.norm(vector))
            if length < 1e-9:
                node.hide()
                continue
            node.show()
            width = self.view.scene.arrows[name].width
            tip = min(_HEAD * width, length)
            size = width * min(1.0, length / (_HEAD * width))
            q = core.LQuaternion(*from_z(vector / length))
            shaft, head = node.getChildren()
            scale = core.Vec3(size, size, max(length - tip, 1e-6))
            shaft.setPosQuatScale(core.Point3(*start), q, scale)
            end = core.Point3(*(start + vector * (1 - tip / length)))
            head.setPosQuatScale(end, q, core.Vec3(size * _HEAD, size * _HEAD, tip))

    def _place_camera(self, poses: Mapping[str, Pose]) -> Array:
        """Place the camera, and the floor below it by pairs of cells; returns its position."""
        camera, floor = self._camera, self.view.scene.floor
        target = np.array(camera.target, dtype=np.float64)
        if camera.follow is not None and camera.follow in poses:
            ahead = np.asarray(poses[camera.follow].position, dtype=np.float64)[:2]
            target[:2] += ahead
            pair = 2.0 if floor is None else 2.0 * floor.cell
            self._ground.setPos(*(pair * np.round(ahead / pair)), 0.0)
        azimuth, elevation = math.radians(camera.azimuth), math.radians(camera.elevation)
        level = math.cos(elevation)
        direction = (level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation))
        eye = target + camera.distance * np.array(direction)
        self._eye.setPos(*eye)
        self._eye.lookAt(library().Point3(*target))
        return eye

    def _extend(self, points: Mapping[str, npt.ArrayLike]) -> None:
        for name, point in points.items():
            line, length = self._points[name], self.view.scene.traces[name].length
            line.append(np.asarray(point, dtype=np.float64))
            if length is not None:
                del line[:-length]

    def _trace(self, poses: Mapping[str, Pose], eye: Array) -> None:
        """Show the lines of the traces."""
        for name, trace in self.view.scene.traces.items():
            line, seen_from = self._lines[name], eye
            if trace.part is not None:
                pose = poses[trace.part]
                line.setTransform(transform(pose))
                offset = eye - np.asarray(pose.position, dtype=np.float64)
                seen_from = rotations.rotate_inverse(pose.q, offset) / np.array(pose.scale)
            line.node().removeAllChildren()
            for part in _runs(np.array(self._points[name]).reshape(-1, 3)):
                line.attachNewNode(strip(_ribbon(part, seen_from, trace.width)))


@functools.cache
def _material(shiny: bool) -> Any:
    """Surface that reflects light in the colours of its vertices."""
    core = library()
    material = core.Material()
    material.setAmbient((1.0, 1.0, 1.0, 1.0))
    material.setDiffuse((1.0, 1.0, 1.0, 1.0))
    if shiny:
        material.setSpecular((_HIGHLIGHT, _HIGHLIGHT, _HIGHLIGHT, 1.0))
        material.setShininess(25.0)
    return material


@functools.cache
def _lights() -> tuple[Any, ...]:
    """Lights of all scenes."""
    core = library()
    ambient = core.AmbientLight("ambient")
    ambient.setColor((*_AMBIENT, 1.0))
    sun = core.DirectionalLight("sun")
    sun.setColor((*_SUN, 1.0))
    sun.setDirection(core.Vec3(*(-x for x in _TO_SUN)))
    return core.NodePath(ambient), core.NodePath(sun)


# Lines with a width: ribbons that face the camera.


def _runs(points: Array) -> list[Array]:
    """Parts of a line between points that are not finite, each of two points or more."""
    breaks = np.flatnonzero(~np.isfinite(points).all(axis=-1))
    parts = np.split(points, breaks)
    parts = [parts[0], *(part[1:] for part in parts[1:])]
    return [part for part in parts if len(part) > 1]


def _ribbon(points: Array, eye: Array, width: float) -> npt.NDArray[np.float32]:
    """Left and right edge of a line that is seen from a point with its full width.

    The edges are moved towards the eye along the lines of sight, by the width: nothing changes in
    the picture, and a line on a surface is not hidden by it.

    Args:
        points: shape (n, 3), n > 1.
        eye: where it is seen from, shape (3,).
        width: of the line.

    Returns:
        Shape (n, 2, 3).
    """
    sight = eye - points
    distance = np.linalg.norm(sight, axis=-1, keepdims=True)
    across = _cross(np.diff(points, axis=0), sight[:-1])
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    across /= np.where(length > 0.0, length, 1.0)
    both = np.concatenate([across[:1], across]) + np.concatenate([across, across[-1:]])
    square = (both * both).sum(axis=-1, keepdims=True)
    half = width * both / np.maximum(square, 1.0)  # mitred corners, cut off where they are sharp
    centre = points + np.minimum(width / np.maximum(distance, 1e-12), 0.5) * sight
    return np.stack([centre - half, centre + half], axis=1).astype(np.float32)


def _cross(a: Array, b: Array) -> Array:
    """Products a x b of rows, shape (n, 3); faster than NumPy's."""
    one, two = (1, 2, 0), (2, 0, 1)
    return np.asarray(a[:, one] * b[:, two] - a[:, two] * b[:, one])


# The floor.


@functools.lru_cache(maxsize=32)
def _chequers(floor: Floor, horizon: Color) -> Mesh:
    """Cells of a floor; towards the edge their colours turn into that of the horizon."""
    n = max(2, round(floor.size / floor.cell))
    edges = floor.cell * (np.arange(n + 1) - n / 2)
    x, y = (grid.ravel() for grid in np.meshgrid(edges[:-1], edges[:-1], indexing="ij"))
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * floor.cell
    level = np.stack([x, y], axis=-1)[:, None] + corners
    i, j = np.divmod(np.arange(n * n), n)
    colors = np.array(floor.colors)[(i + j) % 2][:, None]
    far = np.clip(np.linalg.norm(level, axis=-1, keepdims=True) / (0.5 * floor.size), 0.0, 1.0)
    shades = colors + far**2 * (np.array(horizon) - colors)
    vertices = np.concatenate([level, np.full((n * n, 4, 1), floor.height)], axis=-1)
    first = 4 * np.arange(n * n)[:, None]
    triangles = np.concatenate([first + np.array((0, 1, 2)), first + np.array((0, 2, 3))])
    return Mesh(
        vertices.reshape(-1, 3).astype(np.float32),
        np.tile(np.array((0.0, 0.0, 1.0), dtype=np.float32), (4 * n * n, 1)),
        np.round(255 * shades).astype(np.uint8).reshape(-1, 3),
        triangles.astype(np.int32),
    )
