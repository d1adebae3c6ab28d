"""The renderer: Panda3D without a display."""

from __future__ import annotations

import ctypes
import functools
import os
import platform
import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.error import DependencyNotInstalled

from rigid_envs.base.checks import Image
from rigid_envs.envs.display import needed
from rigid_envs.watch.lettering import pillow
from rigid_envs.watch.scene import Mesh

# Stand-in for libX11 where it is not installed.
#
# Panda3D's software display is linked against libX11, of which it calls nothing as long as it draws
# into memory. The linker only asks whether a library of this name is there.

_X11 = "libX11.so.6"
_MACHINES = {"x86_64": 62, "aarch64": 183}  # e_machine of ELF
_LOAD, _DYNAMIC, _STACK = 1, 2, 0x6474E551  # segments
_NULL, _HASH, _STRINGS, _SYMBOLS, _STRINGS_SIZE, _SYMBOL_SIZE, _NAME = 0, 4, 5, 6, 10, 11, 14
_READ_WRITE = 6


def provide_x11(user: Path) -> None:
    """Load a library that is linked against libX11, on Linux, also where libX11 is missing.

    Then an empty library takes its name, and the functions of the library are linked when they are
    called: those that need libX11 never are.

    Args:
        user: the library.

    Raises:
        DependencyNotInstalled: libX11 is missing, and nothing can take its name: memory is loaded
            as a file of /proc.
    """
    machine = platform.machine()
    if sys.platform != "linux" or machine not in _MACHINES:
        return
    try:
        ctypes.CDLL(_X11)
    except OSError:
        file = os.memfd_create(_X11)
        try:
            os.write(file, empty_library(_X11, machine))
            _KEPT.append(ctypes.CDLL(f"/proc/self/fd/{file}", mode=ctypes.RTLD_GLOBAL))
        except OSError as error:
            raise DependencyNotInstalled(
                f"pictures need {_X11}, or /proc to do without it: install libx11-6 ({error})"
            ) from error
        finally:
            os.close(file)
        open_library = ctypes.CDLL(None).dlopen  # `ctypes.CDLL` would link all functions at once
        open_library.restype, open_library.argtypes = (
            ctypes.c_void_p,
            [ctypes.c_char_p, ctypes.c_int],
        )
        open_library(os.fsencode(user), os.RTLD_LAZY | os.RTLD_GLOBAL)


_KEPT: list[ctypes.CDLL] = []


def empty_library(name: str, machine: str) -> bytes:
    """A shared library without a symbol, in the format ELF (64 bits, little-endian).

    Args:
        name: under which the linker knows it.
        machine: "x86_64" or "aarch64".

    Source: System V Application Binary Interface, chapters 4 and 5.
    """
    header, segment, symbol = 64, 56, 24
    strings = b"\0" + name.encode() + b"\0"
    at_symbols = header + 3 * segment
    at_hash = at_symbols + symbol  # one symbol: the undefined one
    at_dynamic = at_hash + 16
    at_strings = at_dynamic + 7 * 16
    end = at_strings + len(strings)
    dynamic = [
        (_NAME, 1),
        (_HASH, at_hash),
        (_STRINGS, at_strings),
        (_SYMBOLS, at_symbols),
        (_STRINGS_SIZE, len(strings)),
        (_SYMBOL_SIZE, symbol),
        (_NULL, 0),
    ]
    segments = [
        (_LOAD, _READ_WRITE, 0, 0, 0, end, end, 0x10000),
        (_DYNAMIC, _READ_WRITE, *(at_dynamic,) * 3, *(16 * len(dynamic),) * 2, 8),
        (_STACK, _READ_WRITE, 0, 0, 0, 0, 0, 16),
    ]
    kind = b"\x7fELF\x02\x01\x01" + bytes(9)  # 64 bits, little-endian, version 1
    return b"".join(
        [
            struct.pack(
                "<16sHHIQQQIHHHHHH",
                *(kind, 3, _MACHINES[machine], 1, 0, header, 0, 0, header, segment, 3, 0, 0, 0),
            ),
            *(struct.pack("<IIQQQQQQ", *entry) for entry in segments),
            bytes(symbol),
            struct.pack("<IIII", 1, 1, 0, 0),
            *(struct.pack("<QQ", *entry) for entry in dynamic),
            strings,
        ]
    )


# Software display of Panda3D: needs no OpenGL, no display server and no system package.

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
