"""Software display of Panda3D: needs no OpenGL, no display server and no system package."""

from __future__ import annotations

import functools
import os
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.render.lettering import pillow
from rigid_envs.render.needed import needed
from rigid_envs.render.scene import Mesh
from rigid_envs.render.without_x11 import provide_x11

__all__ = ["Surface", "geometry", "library", "strip", "surface"]

Image = npt.NDArray[np.uint8]

_SETTINGS = """
load-display p3tinydisplay
audio-library-name null
notify-level error
default-directnotify-level error
"""


@functools.cache
def library() -> Any:
    """The module `panda3d.core`.

    Raises:
        DependencyNotInstalled: it, or Pillow, is not installed.
    """
    pillow()  # first: otherwise Pillow would find the older FreeType inside Panda3D
    core = needed("panda3d.core", "pictures need panda3d")
    provide_x11(Path(core.__file__).with_name("libp3tinydisplay.so"))
    core.loadPrcFileData("rigid-envs", _SETTINGS)
    return core


class Surface:
    """Picture in memory, on which any scene graph can be drawn; one for each size and process."""

    def __init__(self, width: int, height: int) -> None:
        """Open the surface."""
        core = library()
        pipe = core.GraphicsPipeSelection.getGlobalPtr().makePipe(
            "TinyOffscreenGraphicsPipe", "p3tinydisplay"
        )
        self.width, self.height = width, height
        self._engine = core.GraphicsEngine.getGlobalPtr()
        properties = core.FrameBufferProperties()
        properties.setRgbColor(True)
        properties.setDepthBits(24)
        self._buffer = self._engine.makeOutput(
            pipe,
            f"rigid-envs {width} x {height}",
            0,
            properties,
            core.WindowProperties.size(width, height),
            core.GraphicsPipe.BFRefuseWindow,
        )
        self._texture = core.Texture()
        self._buffer.addRenderTexture(self._texture, core.GraphicsOutput.RTMCopyRam)
        self._region = self._buffer.makeDisplayRegion()

    def draw(self, camera: Any, background: tuple[float, float, float]) -> Image:
        """Draw what a camera sees.

        Args:
            camera: camera node in a scene graph.
            background: colour where nothing is.

        Returns:
            Blue, green, red and a fourth number, the lowest line first, shape (height, width, 4).
        """
        self._buffer.setActive(True)
        self._buffer.setClearColor((*background, 1.0))
        self._region.setCamera(camera)
        self._engine.renderFrame()
        self._region.setCamera(library().NodePath())
        self._buffer.setActive(False)
        image = np.frombuffer(self._texture.getRamImage(), dtype=np.uint8)
        return image.reshape(self.height, self.width, 4)


def surface(width: int, height: int) -> Surface:
    """The surface of this size in this process."""
    return _surface(width, height, os.getpid())


@functools.cache
def _surface(width: int, height: int, _process: int) -> Surface:
    return Surface(width, height)


@functools.lru_cache(maxsize=256)
def geometry(mesh: Mesh) -> Any:
    """Panda3D node of a mesh; scenes share it."""
    core = library()
    data = core.GeomVertexData("mesh", _format(), core.Geom.UHStatic)
    n = len(mesh.vertices)
    row = np.zeros(n, dtype=[("v", "<f4", 3), ("n", "<f4", 3), ("c", "u1", 4)])
    row["v"], row["n"], row["c"][:, 3] = mesh.vertices, mesh.normals, 255
    row["c"][:, :3] = mesh.colors
    _fill(data.modifyArray(0), row, n)
    return _node(data, mesh.triangles, core.Geom.UHStatic)


def strip(corners: npt.NDArray[np.float32]) -> Any:
    """Panda3D node of a ribbon, without normals.

    Args:
        corners: left and right edge, shape (n, 2, 3).
    """
    core = library()
    vertices = core.GeomVertexFormat.getV3()
    data = core.GeomVertexData("ribbon", vertices, core.Geom.UHDynamic)
    n = len(corners)
    _fill(data.modifyArray(0), np.ascontiguousarray(corners, dtype="<f4"), 2 * n)
    k = 2 * np.arange(n - 1, dtype=np.int32)[:, None]
    triangles = np.concatenate([k + np.array((0, 1, 2)), k + np.array((2, 1, 3))])
    return _node(data, triangles.astype(np.int32), core.Geom.UHDynamic)


@functools.cache
def _format() -> Any:
    """Format of a vertex: position, normal, colour."""
    core = library()
    array = core.GeomVertexArrayFormat()
    array.addColumn("vertex", 3, core.Geom.NTFloat32, core.Geom.CPoint)
    array.addColumn("normal", 3, core.Geom.NTFloat32, core.Geom.CNormal)
    array.addColumn("color", 4, core.Geom.NTUint8, core.Geom.CColor)
    return core.GeomVertexFormat.registerFormat(core.GeomVertexFormat(array))


def _fill(array: Any, rows: npt.NDArray[Any], n: int) -> None:
    array.uncleanSetNumRows(n)
    memoryview(array).cast("B")[:] = rows.reshape(-1).view(np.uint8).data


def _node(data: Any, triangles: npt.NDArray[np.int32], usage: Any) -> Any:
    core = library()
    primitive = core.GeomTriangles(usage)
    primitive.setIndexType(core.Geom.NTUint32)
    indices = np.ascontiguousarray(triangles, dtype="<u4")
    _fill(primitive.modifyVertices(), indices, indices.size)
    geom = core.Geom(data)
    geom.addPrimitive(primitive)
    node = core.GeomNode("mesh")
    node.addGeom(geom)
    return node
