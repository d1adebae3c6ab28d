"""Scene to pixels."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, Image
from rigid_envs.engine.compiler import kernel
from rigid_envs.mechanics import rotations
from rigid_envs.watch.lettering import write
from rigid_envs.watch.panda import geometry, library, strip, surface
from rigid_envs.watch.scene import (
    Arrow,
    Camera,
    Frame,
    Part,
    Pose,
    Scene,
    arrow_head,
    arrow_shaft,
    chequers,
)

# Places of parts in the world, for Panda3D and in numbers.


def transform(pose: Pose) -> Any:
    """Panda3D's transform of a pose."""
    core = library()
    return core.TransformState.makePosQuatScale(
        core.Point3(*map(float, np.asarray(pose.position))),
        core.LQuaternion(*map(float, np.asarray(pose.q))),
        core.Vec3(*pose.scale),
    )


def into(pose: Pose, point: Array) -> Array:
    """A point of the world in the axes of a part."""
    offset = point - np.asarray(pose.position, dtype=np.float64)
    return np.asarray(rotations.rotate_inverse(pose.q, offset) / np.array(pose.scale))


def from_z(direction: npt.ArrayLike) -> Array:
    """Quaternion of the shortest turn from the z-axis to a unit vector."""
    x, y, z = np.asarray(direction, dtype=np.float64)
    if z < -1.0 + 1e-12:
        return np.array([0.0, 1.0, 0.0, 0.0])
    turn = np.array([1.0 + z, -y, x, 0.0])
    return np.asarray(turn / np.linalg.norm(turn))


# Lines with a width: ribbons that face the camera.


def runs(points: Array) -> list[Array]:
    """Parts of a line between points that are not finite, each of two points or more."""
    breaks = np.flatnonzero(~np.isfinite(points).all(axis=-1))
    parts = np.split(points, breaks)
    parts = [parts[0], *(part[1:] for part in parts[1:])]
    return [part for part in parts if len(part) > 1]


def ribbon(points: Array, eye: Array, width: float) -> npt.NDArray[np.float32]:
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


# Reduction of a drawing to a picture: the mean of every square of four pixels.


def halved(drawing: Image) -> Image:
    """Picture of half the width and height.

    Args:
        drawing: blue, green, red and a fourth number, lowest line first, (height, width, 4), with
            even height and width.

    Returns:
        RGB, first line on top, shape (height / 2, width / 2, 3).
    """
    height, width, _ = drawing.shape
    picture = np.empty((height // 2, width // 2, 3), dtype=np.uint8)
    _loop()(drawing, picture)
    return picture


@functools.cache
def _loop() -> Callable[[Image, Image], None]:
    return kernel(_halve, "render.reduction", ())


def _halve(drawing: Image, picture: Image) -> None:
    height, width, _ = picture.shape
    for i in range(height):
        low, high = 2 * (height - 1 - i), 2 * (height - 1 - i) + 1
        for j in range(width):
            for k in range(3):
                total = np.uint16(2)  # so that the mean is rounded to the nearest
                for line in (low, high):
                    total += np.uint16(drawing[line, 2 * j, 2 - k])
                    total += np.uint16(drawing[line, 2 * j + 1, 2 - k])
                picture[i, j, k] = total >> 2


# Backend that draws a scene into an array of pixels, in software.

_SKY = (0.97, 0.975, 0.985)
# together at most 1, also on white: the sum of a highlight and more would run over and look dark
_AMBIENT = (0.50, 0.505, 0.52)
_SUN = (0.44, 0.435, 0.42)
_HIGHLIGHT = 0.10
_TO_SUN = (0.35, -0.45, 1.0)
_SHADE = (0.13, 0.16, 0.22, 0.30)
_HEAD = 3.0  # length and width of the head of an arrow, in widths of its shaft


class Pixels:
    """Pictures of one scene.

    Args:
        scene: what is drawn.
        width: of a picture, in pixels.
        height: of a picture, in pixels.
        camera: point of view; None for that of the scene.
        shadows: whether parts cast shadows on the floor.

    Raises:
        DependencyNotInstalled: panda3d or Pillow is not installed.
    """

    def __init__(
        self,
        scene: Scene,
        width: int = 480,
        height: int = 480,
        camera: Camera | None = None,
        shadows: bool = True,
    ) -> None:
        """Build the scene graph."""
        core = library()
        self.scene = scene
        self.camera = camera or scene.camera
        self.width, self.height = width, height
        self._root = core.NodePath("scene")
        for light in _lights():
            self._root.setLight(light)
        self._parts = {name: self._add_part(name, part) for name, part in scene.parts.items()}
        self._arrows = {name: self._add_arrow(arrow) for name, arrow in scene.arrows.items()}
        self._lines = {name: self._root.attachNewNode(name) for name in scene.traces}
        for name, line in self._lines.items():
            line.setLightOff()
            line.setAttrib(core.ShadeModelAttrib.make(core.ShadeModelAttrib.MFlat))
            line.setTwoSided(True)
            line.setColor(*scene.traces[name].color, 1.0)
        self._points: dict[str, list[Array]] = {name: [] for name in scene.traces}
        self._eye = self._add_camera()
        if scene.floor is not None:
            self._add_floor()
        self._shadows = self._add_shadows() if shadows and scene.floor is not None else {}

    def draw(self, frame: Frame, extend: bool = True) -> Image:
        """Draw the scene at one moment.

        Args:
            frame: the moment.
            extend: add the points of its traces to their lines.

        Returns:
            RGB, shape (height, width, 3).
        """
        self._pose(frame.poses)
        self._point(frame)
        eye = self._look(frame.poses)
        if extend:
            self._extend(frame.points)
        self._trace(frame.poses, eye)
        drawing = surface(2 * self.width, 2 * self.height).draw(self._eye, _SKY)
        picture = halved(drawing)  # smooth edges: four pixels of the drawing for each
        write(picture, frame.text)
        return picture

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

    def _add_arrow(self, arrow: Arrow) -> tuple[Any, Any]:
        nodes = []
        for mesh in (arrow_shaft(), arrow_head()):
            node = self._root.attachNewNode("arrow")  # its own place: the mesh is shared
            node.attachNewNode(geometry(mesh))
            node.setColor(*arrow.color, 1.0)
            node.setMaterial(_material(False))
            nodes.append(node)
        return nodes[0], nodes[1]

    def _add_camera(self) -> Any:
        core = library()
        lens = core.PerspectiveLens()
        vertical = self.camera.field_of_view
        aspect = self.width / self.height
        lens.setFov(2 * math.degrees(math.atan(aspect * math.tan(math.radians(vertical / 2)))))
        lens.setAspectRatio(aspect)
        lens.setNearFar(0.05 * self.camera.distance, 20.0 * self.camera.distance)
        node = core.Camera("camera")
        node.setLens(lens)
        return self._root.attachNewNode(node)

    def _add_floor(self) -> None:
        floor = self.scene.floor
        assert floor is not None
        core = library()
        node = self._root.attachNewNode(geometry(chequers(floor, _SKY)))
        node.setLightOff()
        node.setBin("background", 0)
        node.setAttrib(core.ShadeModelAttrib.make(core.ShadeModelAttrib.MFlat))
        node.setDepthWrite(False)  # it is below all parts
        node.setDepthTest(False)

    def _add_shadows(self) -> dict[str, Any]:
        """A flattened copy of every part that casts a shadow, on the floor."""
        core = library()
        floor = self.scene.floor
        assert floor is not None
        x, y, z = _TO_SUN
        height = floor.height + 1e-3 * self.camera.distance
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
        for name, part in self.scene.parts.items():
            if part.shadow and part.opacity == 1.0:
                shadows[name] = shade.attachNewNode(name)
                shadows[name].attachNewNode(geometry(part.mesh))
        return shadows

    def _pose(self, poses: Mapping[str, Pose]) -> None:
        for name, node in self._parts.items():
            pose, shadow = poses.get(name), self._shadows.get(name)
            for item in (node, shadow):
                if item is None:
                    continue
                if pose is None:
                    item.hide()
                    continue
                item.show()
                item.setTransform(transform(pose))

    def _point(self, frame: Frame) -> None:
        """Show the arrows."""
        core = library()
        for name, (shaft, head) in self._arrows.items():
            if name not in frame.arrows:
                shaft.hide()
                head.hide()
                continue
            start, vector = (np.asarray(part, dtype=np.float64) for part in frame.arrows[name])
            width = self.scene.arrows[name].width
            length = float(np.linalg.norm(vector))
            tip = min(_HEAD * width, length)
            if length < 1e-9:
                shaft.hide()
                head.hide()
                continue
            q = core.LQuaternion(*from_z(vector / length))
            size = width * min(1.0, length / (_HEAD * width))
            shaft.show()
            head.show()
            shaft.setPosQuatScale(
                core.Point3(*start), q, core.Vec3(size, size, max(length - tip, 1e-6))
            )
            head.setPosQuatScale(
                core.Point3(*(start + vector * (1 - tip / length))),
                q,
                core.Vec3(size * _HEAD, size * _HEAD, tip),
            )

    def _look(self, poses: Mapping[str, Pose]) -> Array:
        """Place the camera; returns its position."""
        core, camera = library(), self.camera
        target = np.array(camera.target, dtype=np.float64)
        if camera.follow is not None and camera.follow in poses:
            target[:2] += np.asarray(poses[camera.follow].position)[:2]
        azimuth, elevation = math.radians(camera.azimuth), math.radians(camera.elevation)
        level = math.cos(elevation)
        direction = (
            level * math.cos(azimuth),
            level * math.sin(azimuth),
            math.sin(elevation),
        )
        eye = target + camera.distance * np.array(direction)
        self._eye.setPos(*eye)
        self._eye.lookAt(core.Point3(*target))
        return eye

    def _extend(self, points: Mapping[str, npt.ArrayLike]) -> None:
        for name, point in points.items():
            line = self._points[name]
            line.append(np.asarray(point, dtype=np.float64))
            length = self.scene.traces[name].length
            if length is not None:
                del line[:-length]

    def _trace(self, poses: Mapping[str, Pose], eye: Array) -> None:
        """Show the lines of the traces."""
        for name, trace in self.scene.traces.items():
            line, seen_from = self._lines[name], eye
            if trace.part is not None:
                pose = poses[trace.part]
                line.setTransform(transform(pose))
                seen_from = into(pose, eye)
            line.node().removeAllChildren()
            for part in runs(np.array(self._points[name]).reshape(-1, 3)):
                line.attachNewNode(strip(ribbon(part, seen_from, trace.width)))


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
