"""The renderer: Panda3D without a display."""

import ctypes
import functools
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.error import DependencyNotInstalled

from rigid_envs.base.checks import Image
from rigid_envs.engine.compiler import kernel
from rigid_envs.envs.display import needed
from rigid_envs.watch.meshes import Color, Mesh
from rigid_envs.watch.pictures import pillow
from rigid_envs.watch.views import Pose

# Software display of Panda3D: needs no OpenGL, no display server and no system package.

_SETTINGS = """
load-display p3tinydisplay
audio-library-name null
notify-level error
default-directnotify-level error
"""
SOLID = "solid"
"""Name of the bin whose nodes are drawn in their order, and not in that of addresses in memory."""
_OPAQUE = 20  # place of Panda3D's own bin for what is not transparent
_X11 = "libX11.so.6"


@functools.cache
def library() -> Any:
    """The module `panda3d.core`.

    Raises:
        DependencyNotInstalled: it, or Pillow, is not installed.
    """
    pillow()  # first: otherwise Pillow would find the older FreeType inside Panda3D
    core = needed("panda3d.core", "pictures need panda3d")
    if sys.platform == "linux":
        load_without_x11(Path(core.__file__).with_name("libp3tinydisplay.so"))
    core.loadPrcFileData("rigid-envs", _SETTINGS)
    core.CullBinManager.getGlobalPtr().addBin(SOLID, core.CullBinManager.BTUnsorted, _OPAQUE)
    return core


def load_without_x11(display: Path) -> None:
    """Load the software display where libX11 is missing.

    It is linked against libX11, of which it calls nothing as long as it draws into memory. So a
    copy that asks for libm in its place, which is always there, does the same; its functions are
    linked when they are called: those that need libX11 never are.

    Args:
        display: the library.

    Raises:
        DependencyNotInstalled: libX11 is missing, and no copy can be loaded from memory.
    """
    try:
        ctypes.CDLL(_X11)
        return
    except OSError:
        copy = display.read_bytes().replace(f"\0{_X11}\0".encode(), b"\0libm.so.6\0\0\0")
    load = ctypes.CDLL(None).dlopen  # `ctypes.CDLL` would link all functions at once
    load.restype, load.argtypes = ctypes.c_void_p, [ctypes.c_char_p, ctypes.c_int]
    file = os.memfd_create(display.name)
    with open(file, "wb") as memory:
        memory.write(copy)
        memory.flush()
        handle = load(f"/proc/self/fd/{file}".encode(), os.RTLD_LAZY | os.RTLD_GLOBAL)
    if handle is None:
        raise DependencyNotInstalled(
            f"pictures need {_X11}, or /proc to do without it: apt-get install libx11-6"
        )
    ctypes.CDLL(display.name, handle=handle).get_pipe_type_p3tinydisplay()


# Pictures in memory, on which any scene graph can be drawn.


def picture_of(camera: Any, width: int, height: int, background: Color) -> Image:
    """Draw what a camera sees, with smooth edges: from four pixels each.

    Args:
        camera: camera node in a scene graph.
        width: of the picture.
        height: of the picture.
        background: colour where nothing is.

    Returns:
        RGB, shape (height, width, 3).
    """
    core = library()
    buffer, texture, region = _buffer(2 * width, 2 * height, os.getpid())
    buffer.setActive(True)
    buffer.setClearColor((*background, 1.0))
    region.setCamera(camera)
    core.GraphicsEngine.getGlobalPtr().renderFrame()
    region.setCamera(core.NodePath())
    buffer.setActive(False)
    drawing = np.frombuffer(texture.getRamImage(), dtype=np.uint8)
    picture = np.empty((height, width, 3), dtype=np.uint8)
    _loop()(drawing.reshape(2 * height, 2 * width, 4), picture)
    return picture


@functools.cache
def _loop() -> Callable[[Image, Image], None]:
    return kernel(_halve, "render.reduction", ())


def _halve(drawing: Image, picture: Image) -> None:
    """Mean of every square of four pixels, of blue, green and red, the lowest line first."""
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


@functools.cache
def _buffer(width: int, height: int, _process: int) -> tuple[Any, Any, Any]:
    """Buffer, texture and region of a size, one for each process."""
    core = library()
    pipe = core.GraphicsPipeSelection.getGlobalPtr().makePipe(
        "TinyOffscreenGraphicsPipe", "p3tinydisplay"
    )
    properties = core.FrameBufferProperties()
    properties.setRgbColor(True)
    properties.setDepthBits(24)
    buffer = core.GraphicsEngine.getGlobalPtr().makeOutput(
        pipe,
        f"rigid-envs {width} x {height}",
        0,
        properties,
        core.WindowProperties.size(width, height),
        core.GraphicsPipe.BFRefuseWindow,
    )
    texture = core.Texture()
    buffer.addRenderTexture(texture, core.GraphicsOutput.RTMCopyRam)
    return buffer, texture, buffer.makeDisplayRegion()


# Nodes of a scene graph.


def transform(pose: Pose) -> Any:
    """Panda3D's transform of a pose."""
    core = library()
    return core.TransformState.makePosQuatScale(
        core.Point3(*map(float, np.asarray(pose.position))),
        core.LQuaternion(*map(float, np.asarray(pose.q))),
        core.Vec3(*pose.scale),
    )


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
    data = core.GeomVertexData("ribbon", core.GeomVertexFormat.getV3(), core.Geom.UHDynamic)
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
