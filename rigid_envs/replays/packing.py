"""Scenes, frames and curves as JSON and one block of binary numbers, for the replay page."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.render.scene import Frame, Mesh, Scene
from rigid_envs.replays.panels import Panel

__all__ = ["Packer"]

_KINDS = {"f4": np.float32, "f8": np.float64, "u1": np.uint8, "u4": np.uint32}
_ALIGNED = 8  # bytes
_SYMBOLS = {"omega": "\u03c9", "tau": "\u03c4"}


class Packer:
    """Collects arrays in one block; equal arrays and meshes are kept once.

    Attributes:
        meshes: References to the arrays of every mesh.
    """

    def __init__(self) -> None:
        """Begin with an empty block."""
        self.meshes: list[dict[str, Any]] = []
        self._block = bytearray()
        self._places: dict[tuple[str, bytes], list[Any]] = {}
        self._numbers: dict[int, tuple[int, Mesh]] = {}

    def array(self, values: npt.ArrayLike, kind: str = "f4") -> list[Any]:
        """Reference to an array, [kind, offset in bytes, number of entries]; rows follow rows."""
        data = np.ascontiguousarray(values, dtype=_KINDS[kind])
        raw = data.tobytes()
        if (kind, raw) not in self._places:
            self._places[kind, raw] = [kind, len(self._block), data.size]
            self._block += raw + bytes(-len(raw) % _ALIGNED)
        return self._places[kind, raw]

    def blob(self) -> str:
        """The block, deflated, in base64."""
        return base64.b64encode(zlib.compress(bytes(self._block), 9)).decode("ascii")

    def stage(self, panel: Panel) -> dict[str, Any]:
        """A panel: its scene, and its frames as arrays over time."""
        scene, frames = panel.scene, panel.frames
        camera, floor = scene.camera, scene.floor
        return {
            "times": self.array(panel.times, "f8"),
            "camera": {
                "target": [float(x) for x in camera.target],
                "distance": camera.distance,
                "azimuth": camera.azimuth,
                "elevation": camera.elevation,
                "fov": camera.field_of_view,
                "follow": camera.follow,
            },
            "floor": None
            if floor is None
            else {
                "height": floor.height,
                "size": floor.size,
                "cell": floor.cell,
                "colors": floor.colors,
            },
            "parts": [self._part(name, scene, frames) for name in scene.parts],
            "arrows": [self._arrow(name, scene, frames) for name in scene.arrows],
            "traces": [self._trace(name, panel) for name in scene.traces],
        }

    def _part(self, name: str, scene: Scene, frames: Sequence[Frame]) -> dict[str, Any]:
        part, poses = scene.parts[name], [frame.poses.get(name) for frame in frames]
        missing = (np.nan,) * 4
        rows: dict[str, list[npt.ArrayLike]] = {
            "position": [missing[:3] if pose is None else pose.position for pose in poses],
            "q": [missing if pose is None else pose.q for pose in poses],
            "scale": [missing[:3] if pose is None else pose.scale for pose in poses],
        }
        return {
            "name": name,
            "mesh": self._mesh(part.mesh),
            "opacity": part.opacity,
            "shadow": part.shadow,
            "shiny": part.shiny,
            **{key: self._rows(values) for key, values in rows.items()},
        }

    def _arrow(self, name: str, scene: Scene, frames: Sequence[Frame]) -> dict[str, Any]:
        arrow = scene.arrows[name]
        nothing = ((np.nan,) * 3,) * 2
        ends = [frame.arrows.get(name, nothing) for frame in frames]
        return {
            "color": arrow.color,
            "width": arrow.width,
            "label": _SYMBOLS.get(arrow.label, arrow.label),
            "start": self._rows([start for start, _ in ends]),
            "vector": self._rows([vector for _, vector in ends]),
        }

    def _trace(self, name: str, panel: Panel) -> dict[str, Any]:
        trace, whole = panel.scene.traces[name], panel.whole.get(name)
        points = [frame.points.get(name, (np.nan,) * 3) for frame in panel.frames]
        return {
            "color": trace.color,
            "width": trace.width,
            "part": trace.part,
            "length": trace.length,
            "whole": whole is not None,
            "points": self.array(np.asarray(points if whole is None else whole, dtype=np.float64)),
        }

    def _rows(self, values: Sequence[npt.ArrayLike]) -> list[Any]:
        """Rows over time; one row where they are all the same."""
        rows = np.array([np.asarray(value, dtype=np.float64) for value in values], dtype=np.float32)
        constant = np.array_equal(rows, np.broadcast_to(rows[0], rows.shape), equal_nan=True)
        return self.array(rows[:1] if constant else rows)

    def _mesh(self, mesh: Mesh) -> int:
        """Number of a mesh."""
        if id(mesh) not in self._numbers:  # kept, so that no other mesh gets its id
            self._numbers[id(mesh)] = (len(self.meshes), mesh)
            self.meshes.append(
                {
                    "vertices": self.array(mesh.vertices),
                    "normals": self.array(mesh.normals),
                    "colors": self.array(mesh.colors, "u1"),
                    "triangles": self.array(mesh.triangles, "u4"),
                }
            )
        return self._numbers[id(mesh)][0]
