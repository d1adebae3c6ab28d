"""Meshes of balls, wheels and tops, of radius 1 where they roll, and of what they stand on.

Each is made once in a process.
"""

from __future__ import annotations

import functools
import math
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from rigid_envs.render.meshes import (
    ball,
    box,
    cylinder,
    frustum,
    grid,
    join,
    lathe,
    loop,
    moved,
    octants,
    ring,
    sectors,
    tube,
)
from rigid_envs.render.scene import Color, Mesh
from rigid_envs.render.views import palette as look

__all__ = [
    "coin",
    "disk",
    "dome",
    "edge_ring",
    "goal_ball",
    "goal_cell",
    "goal_cone",
    "goal_disk",
    "goal_hoop",
    "goal_ring",
    "goal_wheel",
    "mass",
    "octant_ball",
    "puck",
    "rod",
    "slab",
    "spoked_wheel",
    "stand",
    "table",
    "top",
    "valley",
]

Array = npt.NDArray[np.float64]


@functools.cache
def octant_ball() -> Mesh:
    """Ball of radius 1 with octants in eight colours."""
    return octants(1.0, look.OCTANTS)


@functools.cache
def goal_ball() -> Mesh:
    """Ball of radius 1 in one colour: a place, whatever the attitude."""
    return ball(1.0, look.GREEN, n=14)


@functools.cache
def goal_disk() -> Mesh:
    """Thin disk of radius 1 across z, with a bright middle: a place on a plane."""
    outer, inner = cylinder(1.0, 0.004, look.GREEN, 48), cylinder(0.5, 0.008, look.CREAM, 32)
    return join(outer, inner)


@functools.cache
def goal_ring() -> Mesh:
    """Flat ring of radius 1 across z, open, seen from above."""
    return lathe([(1.015, 0.0), (0.985, 0.0)], look.GREEN, 96)


@functools.cache
def edge_ring() -> Mesh:
    """Flat ring of radius 1 across z, open, seen from above: a border."""
    return lathe([(1.01, 0.0), (0.99, 0.0)], look.RED, 96)


@functools.cache
def dome() -> Mesh:
    """Equator and two meridians of the upper half of the unit sphere, thin."""
    angle = np.linspace(0.0, math.pi, 31)
    arc = np.stack([np.cos(angle), 0.0 * angle, np.sin(angle)], axis=-1)
    circle = np.stack([np.cos(2.0 * angle), np.sin(2.0 * angle), 0.0 * angle], axis=-1)[:-1]
    other = arc[:, [1, 0, 2]]
    bars = [tube(half, 0.004, look.LIGHT, 3) for half in (arc, other)]
    return join(loop(circle, 0.004, look.LIGHT, 3), *bars)


@functools.cache
def goal_hoop() -> Mesh:
    """Thin hoop of radius 1 about z."""
    angle = np.linspace(0.0, 2.0 * math.pi, 64, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
    return loop(circle, 0.022, look.GREEN, 6)


@functools.cache
def goal_cone() -> Mesh:
    """Open cone from the origin to the unit circle at z = 1, seen from both sides."""
    angle = np.linspace(0.0, 2.0 * math.pi, 49)
    rim = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle + 1.0], axis=-1)
    outward = rim * (1.0, 1.0, -1.0)
    return _two_sided(grid([0.0 * rim, rim], [outward, outward], look.GREEN))


@functools.cache
def rod() -> Mesh:
    """Thin round bar from the origin to z = 1."""
    return frustum(0.02, 0.02, 1.0, look.GREEN, 12)


@functools.cache
def coin() -> Mesh:
    """Coin of radius 1 about z: gold with a square, silver with a cross, a red mark at +y."""
    front = moved(box((0.7, 0.7, 0.02), [look.CREAM]), (0.0, 0.0, 0.07))
    bar = box((1.1, 0.22, 0.02), [look.CREAM])
    cross = join(bar, moved(bar, rotation=[[0, -1, 0], [1, 0, 0], [0, 0, 1]]))
    back = [(0.0, -0.06), (0.9, -0.06), (0.9, -0.08), (1.0, -0.08), (1.0, 0.0)]
    face = [(r, -z) for r, z in back[::-1]]
    halves = [lathe(back, look.BLUE, 64), lathe(face, look.ORANGE, 64)]
    return join(*halves, front, moved(cross, (0.0, 0.0, -0.07)), _mark(0.17))


@functools.cache
def disk() -> Mesh:
    """Disk of radius 1 about z with sectors, orange on +z, blue on -z, a red mark at +y."""
    below = [(0.0, -0.05), (0.93, -0.05), (1.0, -0.02), (1.0, 0.0)]
    above = [(1.0, 0.0), (1.0, 0.02), (0.93, 0.05), (0.0, 0.05)]
    return join(
        sectors(below, [look.BLUE, look.CREAM] * 4, 64),
        sectors(above, [look.ORANGE, look.CREAM] * 4, 64),
        cylinder(0.12, 0.2, look.STEEL, 20),
        _mark(0.12),
    )


@functools.cache
def spoked_wheel() -> Mesh:
    """Wheel of radius 1 about z with six spokes and a red mark at +y."""
    spokes = []
    for k in range(6):
        x, y = math.cos(k * math.pi / 3.0), math.sin(k * math.pi / 3.0)
        spokes.append(tube([(0.1 * x, 0.1 * y, 0.0), (0.9 * x, 0.9 * y, 0.0)], 0.03, look.GREY, 8))
    rim = ring(0.86, 1.0, 0.3, look.STEEL, 72)
    return join(rim, cylinder(0.14, 0.4, look.DARK, 24), *spokes, _mark(0.34))


@functools.cache
def goal_wheel() -> Mesh:
    """Ring of radius 1 about z: where a wheel is to be."""
    return ring(0.84, 1.0, 0.3, look.GREEN, 48)


@functools.cache
def mass() -> Mesh:
    """Small ball that slides on a spoke, of radius 0.12."""
    return ball(0.12, look.RED, n=10)


@functools.cache
def top() -> Mesh:
    """Top of height 1.5 about z, its point at the origin; a rotor of radius 1 with sectors."""
    shaft = [(0.0, 0.0), (0.06, 0.16), (0.06, 1.4), (0.04, 1.46), (0.0, 1.5)]
    below = [(0.0, 0.5), (0.95, 0.66), (1.0, 0.7), (1.0, 0.75)]
    above = [(1.0, 0.75), (1.0, 0.8), (0.95, 0.84), (0.0, 0.95)]
    return join(
        lathe(shaft, look.DARK, 20),
        sectors(below, [look.BLUE, look.SKY] * 3, 48),
        sectors(above, [look.ORANGE, look.CREAM, *[look.BLUE, look.CREAM] * 2], 48),
    )


@functools.cache
def stand() -> Mesh:
    """Stand of height 1 whose point is at the origin."""
    profile = [(0.0, -1.0), (0.4, -1.0), (0.4, -0.95), (0.1, -0.9), (0.07, -0.08), (0.0, 0.0)]
    return lathe(profile, look.STEEL, 24)


@functools.cache
def puck() -> Mesh:
    """Sliding carriage of height 0.2 whose upper face is at z = 0."""
    profile = [(0.0, -0.2), (0.42, -0.2), (0.45, -0.16), (0.45, -0.1), (0.14, -0.04), (0.0, 0.0)]
    return lathe(profile, look.STEEL, 32)


@functools.cache
def table(radius: float = 1.0, thickness: float = 0.1) -> Mesh:
    """Disk below z = 0, its upper face with rings and sectors.

    Args:
        radius: of the disk [m].
        thickness: of the disk [m].
    """
    rings = []
    for k in range(4):
        profile = [(0.25 * radius * (k + 1), 0.0), (0.25 * radius * k, 0.0)]
        pair = [(0.68, 0.75, 0.83), (0.80, 0.84, 0.88)]
        rings.append(sectors(profile, (pair if k % 2 else pair[::-1]) * 6, 48))
    low = -thickness
    return join(*rings, lathe([(0.0, low), (radius, low), (radius, 0.0)], look.STEEL, 48))


@functools.cache
def goal_cell() -> Mesh:
    """Square of side 1 across z, with a border."""
    border = moved(box((1.0, 1.0, 1.0), [look.GREEN]), (0.0, 0.0, -0.5))
    inner = moved(box((0.8, 0.8, 1.0), [look.CREAM]), (0.0, 0.0, -0.4))
    return join(border, inner)


@functools.cache
def slab() -> Mesh:
    """Board of side 1 below z = 0."""
    return moved(box((1.0, 1.0, 1.0), [look.LIGHT]), (0.0, 0.0, -0.5))


@functools.cache
def valley(rim: float = 1.2) -> Mesh:
    """Trough whose bottom is a circle of radius 1 about y, of width 1.

    Args:
        rim: angle from the bottom [rad], on both sides, from which on it is green.
    """
    n = 2 * max(2, round(6.0 * rim))
    ends = np.linspace(-rim, rim, n + 1)
    tones = [(0.66, 0.73, 0.81), (0.80, 0.84, 0.88)]
    bands = [_arc(a, b, tones[k % 2]) for k, (a, b) in enumerate(pairwise(ends))]
    edges = [_arc(-rim - 0.08, -rim, look.GREEN), _arc(rim, rim + 0.08, look.GREEN)]
    return join(*bands, *edges)


def _arc(first: float, last: float, color: Color) -> Mesh:
    """Part of the trough between two angles."""
    angle = np.linspace(first, last, 3)
    out = np.stack([np.sin(angle), 0.0 * angle, -np.cos(angle)], axis=-1)
    side = np.array([0.0, 0.5, 0.0])
    inner, outer = out, 1.03 * out
    sheets = [
        grid([inner - side, inner + side], [-out, -out], color),
        grid([outer + side, outer - side], [out, out], color),
    ]
    for s, rows in ((-1.0, (outer, inner)), (1.0, (inner, outer))):
        normal = np.broadcast_to([0.0, s, 0.0], (2, 3, 3))
        sheets.append(grid([rows[0] + s * side, rows[1] + s * side], normal, color))
    for k, s in ((0, -1.0), (-1, 1.0)):
        along = s * np.array([math.cos(angle[k]), 0.0, math.sin(angle[k])])
        near, far = (inner[k], outer[k]) if s < 0 else (outer[k], inner[k])
        corners = [[near - side, near + side], [far - side, far + side]]
        sheets.append(grid(corners, np.broadcast_to(along, (2, 2, 3)), color))
    return join(*sheets)


def _mark(width: float) -> Mesh:
    """Red mark at the rim of a wheel, at +y."""
    return moved(box((0.16, 0.12, width), [look.RED]), (0.0, 0.945, 0.0))


def _two_sided(mesh: Mesh) -> Mesh:
    """The mesh and its reverse: an open surface that is seen from both sides."""
    back = Mesh(mesh.vertices, -mesh.normals, mesh.colors, mesh.triangles[:, ::-1])
    return join(mesh, back)
