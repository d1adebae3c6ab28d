"""Meshes that a backend adds to a scene: floor, shaft and head of an arrow."""

from __future__ import annotations

import functools

import numpy as np
import numpy.typing as npt

from rigid_envs.render.scene import Color, Floor, Mesh

__all__ = ["arrow_head", "arrow_shaft", "chequers"]

_SIDES = 16


@functools.cache
def arrow_shaft() -> Mesh:
    """Open cylinder of diameter 1 from z = 0 to z = 1, white."""
    return _mantle(0.5, 0.5, slope=0.0)


@functools.cache
def arrow_head() -> Mesh:
    """Cone of diameter 1 from its base at z = 0 to its tip at z = 1, white."""
    return _mantle(0.5, 0.0, slope=0.5)


@functools.lru_cache(maxsize=32)
def chequers(floor: Floor, horizon: Color) -> Mesh:
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
    normals = np.tile((0.0, 0.0, 1.0), (4 * n * n, 1))
    return Mesh(
        vertices.reshape(-1, 3).astype(np.float32),
        normals.astype(np.float32),
        np.round(255 * shades).astype(np.uint8).reshape(-1, 3),
        triangles.astype(np.int32),
    )


def _mantle(low: float, high: float, slope: float) -> Mesh:
    angle = np.linspace(0.0, 2 * np.pi, _SIDES, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    rings = [
        np.column_stack([radius * circle, np.full(_SIDES, z)])
        for radius, z in ((low, 0.0), (high, 1.0))
    ]
    outward = np.column_stack([circle, np.full(_SIDES, slope)])
    outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    k = np.arange(_SIDES)
    after = (k + 1) % _SIDES
    triangles = np.concatenate(
        [
            np.column_stack([k, after, k + _SIDES]),
            np.column_stack([after, after + _SIDES, k + _SIDES]),
        ]
    )
    vertices: npt.NDArray[np.float32] = np.concatenate(rings).astype(np.float32)
    return Mesh(
        vertices,
        np.concatenate([outward, outward]).astype(np.float32),
        np.full((2 * _SIDES, 3), 255, dtype=np.uint8),
        triangles.astype(np.int32),
    )
