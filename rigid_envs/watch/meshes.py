"""Meshes of the scene."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.watch.scene import Color, Floor, Mesh

# Meshes of simple solids, and how to join, move and colour them.
#
# Each is closed unless its docstring says otherwise, its triangles counter-clockwise from outside.
# Lengths are in metres, colours sRGB. Vertices are repeated where faces meet at an edge.

_CREASE = math.cos(math.radians(35.0))  # two faces at a larger angle meet at a visible edge
_FACES = (  # of a box: the two axes of each face, whose vector product is the outward normal
    ((0, 1, 0), (0, 0, 1)),
    ((0, 0, 1), (0, 1, 0)),
    ((0, 0, 1), (1, 0, 0)),
    ((1, 0, 0), (0, 0, 1)),
    ((1, 0, 0), (0, 1, 0)),
    ((0, 1, 0), (1, 0, 0)),
)


def grid(points: npt.ArrayLike, normals: npt.ArrayLike, color: Color) -> Mesh:
    """Curved sheet through a grid of points; open, seen from one side.

    Triangles without area, at the pole of a sphere, are left out.

    Args:
        points: shape (m, n, 3).
        normals: outward normals, shape (m, n, 3). Outward is the second direction of the grid
            times the first.
        color: of the sheet.
    """
    p, n = np.asarray(points, dtype=np.float64), np.asarray(normals, dtype=np.float64)
    rows, columns = p.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    triangles = np.concatenate([np.stack([a, b, c], -1), np.stack([b, d, c], -1)]).reshape(-1, 3)
    corners = p.reshape(-1, 3)[triangles]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1
    )
    n = n / np.linalg.norm(n, axis=-1, keepdims=True)
    return Mesh(
        p.reshape(-1, 3).astype(np.float32),
        n.reshape(-1, 3).astype(np.float32),
        np.tile(np.round(255.0 * np.asarray(color)).astype(np.uint8), (rows * columns, 1)),
        triangles[area > 1e-9 * area.max()].astype(np.int32),
    )


def join(*meshes: Mesh) -> Mesh:
    """All of these as one mesh."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    shifted = [mesh.triangles + k for mesh, k in zip(meshes, first, strict=False)]
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.colors for mesh in meshes]),
        np.concatenate(shifted).astype(np.int32),
    )


def moved(
    mesh: Mesh,
    offset: npt.ArrayLike = (0.0, 0.0, 0.0),
    rotation: npt.ArrayLike | None = None,
    scale: npt.ArrayLike = (1.0, 1.0, 1.0),
) -> Mesh:
    """The mesh stretched along its axes, then rotated, then shifted.

    Args:
        mesh: what is moved.
        offset: shift [m], shape (3,).
        rotation: matrix, shape (3, 3); None for none.
        scale: positive factors, shape (3,).
    """
    turn = np.eye(3) if rotation is None else np.asarray(rotation, dtype=np.float64)
    stretch = np.asarray(scale, dtype=np.float64)
    normals = mesh.normals / stretch
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    vertices = (mesh.vertices * stretch) @ turn.T + np.asarray(offset)
    return Mesh(
        vertices.astype(np.float32),
        (normals @ turn.T).astype(np.float32),
        mesh.colors,
        mesh.triangles,
    )


def lathe(profile: npt.ArrayLike, color: Color, sides: int = 40) -> Mesh:
    """Solid of revolution about z.

    It is smooth where its profile bends by less than 35 degrees, else it has an edge.

    Args:
        profile: points (distance from the axis, z), shape (k, 2), that run so that outside is on
            their right: upwards along the side. Closed, if it begins and ends on the axis or ends
            where it begins.
        color: of the solid.
        sides: number of flat sides.
    """
    return sectors(profile, [color], sides)


def sectors(profile: npt.ArrayLike, colors: Sequence[Color], sides: int = 40) -> Mesh:
    """Solid of revolution as of `lathe`, in equal sectors of these colours, the first from x on.

    Args:
        profile: as for `lathe`, shape (k, 2).
        colors: of the sectors.
        sides: number of flat sides, a multiple of the number of sectors.
    """
    points = np.asarray(profile, dtype=np.float64)
    along = np.diff(points, axis=0)
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    normals = np.stack([along[:, 1], -along[:, 0]], axis=-1)
    smooth = np.sum(normals[1:] * normals[:-1], axis=-1) > _CREASE
    ends = [0, *(np.flatnonzero(~smooth) + 1).tolist(), len(points) - 1]
    pieces: list[Mesh] = []
    for first, last in pairwise(ends):
        inner = normals[first:last]
        mean = np.concatenate([inner[:1], inner[1:] + inner[:-1], inner[-1:]])
        pieces += _turned(points[first : last + 1], mean, colors, sides)
    return join(*pieces)


def frustum(low: float, high: float, height: float, color: Color, sides: int = 40) -> Mesh:
    """Cone about z of which the tip is cut off, from z = 0 on; a whole cone where a radius is 0.

    Args:
        low: radius at z = 0.
        high: radius at the height.
        height: from end to end.
        color: of the solid.
        sides: number of flat sides.
    """
    profile = [(0.0, 0.0), (low, 0.0), (high, height), (0.0, height)]
    kept = [profile[0]] + [q for p, q in pairwise(profile) if p != q]
    return lathe(kept, color, sides)


def cylinder(radius: float, height: float, color: Color, sides: int = 40) -> Mesh:
    """Cylinder about z from -height / 2 to height / 2."""
    mesh = frustum(radius, radius, height, color, sides)
    return moved(mesh, (0.0, 0.0, -0.5 * height))


def ring(inner: float, outer: float, height: float, color: Color, sides: int = 64) -> Mesh:
    """Flat ring about z from -height / 2 to height / 2."""
    z = 0.5 * height
    profile = [(inner, -z), (outer, -z), (outer, z), (inner, z), (inner, -z)]
    return lathe(profile, color, sides)


def ball(radius: float, color: Color, n: int = 20) -> Mesh:
    """Sphere of one colour, n bands from pole to pole."""
    points = _cap((0.0, math.pi), (0.0, 2.0 * math.pi), n, 2 * n)
    return grid(radius * points, points, color)


def octants(radius: float, colors: Sequence[Color], n: int = 11) -> Mesh:
    """Sphere whose octants have a colour each.

    Args:
        radius: of the sphere.
        colors: eight colours, at k = (x < 0) + 2 (y < 0) + 4 (z < 0).
        n: number of bands in an octant.
    """
    quarter, pieces = 0.5 * math.pi, []
    for below in (0, 1):
        for turn in range(4):
            polar, azimuth = (below * quarter, turn * quarter), (turn * quarter, turn * quarter)
            points = _cap((polar[0], polar[0] + quarter), (azimuth[0], azimuth[1] + quarter), n, n)
            x, y, _ = points[n // 2, n // 2]
            k = int(x < 0) + 2 * int(y < 0) + 4 * below
            pieces.append(grid(radius * points, points, colors[k]))
    return join(*pieces)


def box(size: npt.ArrayLike, colors: Sequence[Color]) -> Mesh:
    """Box about the origin.

    Args:
        size: lengths along x, y and z, shape (3,).
        colors: of the faces +x, -x, +y, -y, +z, -z, or one for all.
    """
    half = 0.5 * np.asarray(size, dtype=np.float64)
    six = colors if len(colors) == 6 else list(colors) * 6
    faces = []
    for (a, b), color in zip(_FACES, six, strict=True):
        u, v = np.array(a, dtype=np.float64), np.array(b, dtype=np.float64)
        n = np.cross(u, v)
        corners = [[half * (n + i * v + j * u) for j in (-1, 1)] for i in (-1, 1)]
        faces.append(grid(corners, np.broadcast_to(n, (2, 2, 3)), color))
    return join(*faces)


def tube(curve: npt.ArrayLike, radius: float, color: Color, sides: int = 12) -> Mesh:
    """Round bar along a curve, with flat ends.

    Args:
        curve: points [m], shape (k, 3), k > 1.
        radius: of the bar.
        color: of the bar.
        sides: number of flat sides.
    """
    points = np.asarray(curve, dtype=np.float64)
    along = np.gradient(points, axis=0)
    around = _round(along, sides)
    mantle = grid(points[:, None] + radius * around, around, color)
    ends = []
    for k, sign in ((0, -1.0), (-1, 1.0)):
        rim = points[k] + radius * around[k]
        middle = np.broadcast_to(points[k], rim.shape)
        rows = [middle, rim] if sign < 0 else [rim, middle]
        ends.append(grid(rows, np.broadcast_to(sign * along[k], (2, *rim.shape)), color))
    return join(mantle, *ends)


def loop(curve: npt.ArrayLike, radius: float, color: Color, sides: int = 12) -> Mesh:
    """Round bar along a closed curve in a plane: a torus, a racket's head.

    Args:
        curve: points [m], the last not the first again, shape (k, 3).
        radius: of the bar.
        color: of the bar.
        sides: number of flat sides.
    """
    points = np.asarray(curve, dtype=np.float64)
    around = _round(np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0), sides)
    once = [*range(len(points)), 0]
    return grid(points[once, None] + radius * around[once], around[once], color)


def _turned(profile: Array, normals: Array, colors: Sequence[Color], sides: int) -> list[Mesh]:
    """A smooth part of the profile of `sectors`, turned about z."""
    ends = np.linspace(0.0, 2.0 * math.pi, len(colors) + 1)
    pieces = []
    for first, last, color in zip(ends[:-1], ends[1:], colors, strict=True):
        angle = np.linspace(first, last, sides // len(colors) + 1)
        out = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
        up = np.array([0.0, 0.0, 1.0])
        points, outward = (
            rows[:, None, :1] * out + rows[:, None, 1:] * up for rows in (profile, normals)
        )
        pieces.append(grid(points, outward, color))
    return pieces


def _cap(polar: tuple[float, float], azimuth: tuple[float, float], m: int, n: int) -> Array:
    """Points of a part of the unit sphere, upwards and about z, shape (m + 1, n + 1, 3)."""
    theta = np.linspace(polar[1], polar[0], m + 1)[:, None]
    phi = np.linspace(azimuth[0], azimuth[1], n + 1)[None]
    s = np.sin(theta)
    return np.stack([s * np.cos(phi), s * np.sin(phi), np.cos(theta) + 0.0 * phi], axis=-1)


def _round(along: Array, sides: int) -> Array:
    """Unit circles across a curve of these directions, without twist, (k, sides + 1, 3)."""
    angle = np.linspace(0.0, 2.0 * math.pi, sides + 1)[:, None]
    frames = np.array(list(_frames(along)))
    first, second = frames[:, None, 0], frames[:, None, 1]
    return np.asarray(np.cos(angle) * first + np.sin(angle) * second)


def _frames(along: Array) -> Iterator[tuple[Array, Array]]:
    """Two directions across each one along; (across, across', along) is right-handed."""
    across = np.eye(3)[int(np.argmin(np.abs(along[0])))]
    for direction in along:
        tangent = direction / np.linalg.norm(direction)
        across = across - (across @ tangent) * tangent
        across = across / np.linalg.norm(across)
        yield across, np.cross(tangent, across)


# Colours of the views: those of Okabe and Ito, which the colour-blind can tell apart, and greys.
#
# Yellow is a little darker than theirs: in full light no colour may be brighter than white.
#
# Source: Okabe & Ito 2008, "Color universal design", https://jfly.uni-koeln.de/color/.


def _rgb(red: int, green: int, blue: int) -> Color:
    return red / 255.0, green / 255.0, blue / 255.0


ORANGE, SKY, GREEN = _rgb(230, 159, 0), _rgb(86, 180, 233), _rgb(0, 158, 115)
YELLOW, BLUE, RED, PURPLE = (
    _rgb(224, 212, 60),
    _rgb(0, 114, 178),
    _rgb(213, 94, 0),
    _rgb(204, 121, 167),
)
DARK, STEEL, GREY = _rgb(45, 50, 60), _rgb(105, 115, 130), _rgb(160, 168, 180)
LIGHT, CREAM = _rgb(212, 217, 224), _rgb(226, 223, 215)

OCTANTS = (YELLOW, ORANGE, SKY, CREAM, RED, BLUE, GREEN, PURPLE)
"""Octants of a ball at (x < 0) + 2 (y < 0) + 4 (z < 0): the upper half is light."""

OMEGA, MOMENTUM, INPUT, PATH = RED, BLUE, PURPLE, DARK
"""Angular velocity, angular momentum, what is controlled, path of a point."""

GHOST = 0.45
"""Opacity of a goal."""


def level_floor(height: float, size: float, cell: float = 1.0) -> Floor:
    """Chequered floor.

    Args:
        height: z of the floor [m].
        size: side [m].
        cell: side of a cell [m].
    """
    return Floor(height, size, cell)


# Meshes of balls, wheels and tops, of radius 1 where they roll, and of what they stand on.
#
# Each is made once in a process.


@functools.cache
def octant_ball() -> Mesh:
    """Ball of radius 1 with octants in eight colours."""
    return octants(1.0, OCTANTS)


@functools.cache
def goal_ball() -> Mesh:
    """Ball of radius 1 in one colour: a place, whatever the attitude."""
    return ball(1.0, GREEN, n=14)


@functools.cache
def goal_disk() -> Mesh:
    """Thin disk of radius 1 across z, with a bright middle: a place on a plane."""
    outer, inner = cylinder(1.0, 0.004, GREEN, 48), cylinder(0.5, 0.008, CREAM, 32)
    return join(outer, inner)


@functools.cache
def goal_ring() -> Mesh:
    """Flat ring of radius 1 across z, open, seen from above."""
    return lathe([(1.015, 0.0), (0.985, 0.0)], GREEN, 96)


@functools.cache
def edge_ring() -> Mesh:
    """Flat ring of radius 1 across z, open, seen from above: a border."""
    return lathe([(1.01, 0.0), (0.99, 0.0)], RED, 96)


@functools.cache
def dome() -> Mesh:
    """Equator and two meridians of the upper half of the unit sphere, thin."""
    angle = np.linspace(0.0, math.pi, 31)
    arc = np.stack([np.cos(angle), 0.0 * angle, np.sin(angle)], axis=-1)
    circle = np.stack([np.cos(2.0 * angle), np.sin(2.0 * angle), 0.0 * angle], axis=-1)[:-1]
    other = arc[:, [1, 0, 2]]
    bars = [tube(half, 0.004, LIGHT, 3) for half in (arc, other)]
    return join(loop(circle, 0.004, LIGHT, 3), *bars)


@functools.cache
def goal_hoop() -> Mesh:
    """Thin hoop of radius 1 about z."""
    angle = np.linspace(0.0, 2.0 * math.pi, 64, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
    return loop(circle, 0.022, GREEN, 6)


@functools.cache
def goal_cone() -> Mesh:
    """Open cone from the origin to the unit circle at z = 1, seen from both sides."""
    angle = np.linspace(0.0, 2.0 * math.pi, 49)
    rim = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle + 1.0], axis=-1)
    outward = rim * (1.0, 1.0, -1.0)
    return _two_sided(grid([0.0 * rim, rim], [outward, outward], GREEN))


@functools.cache
def rod() -> Mesh:
    """Thin round bar from the origin to z = 1."""
    return frustum(0.02, 0.02, 1.0, GREEN, 12)


@functools.cache
def coin() -> Mesh:
    """Coin of radius 1 about z: gold with a square, silver with a cross, a red mark at +y."""
    front = moved(box((0.7, 0.7, 0.02), [CREAM]), (0.0, 0.0, 0.07))
    bar = box((1.1, 0.22, 0.02), [CREAM])
    cross = join(bar, moved(bar, rotation=[[0, -1, 0], [1, 0, 0], [0, 0, 1]]))
    back = [(0.0, -0.06), (0.9, -0.06), (0.9, -0.08), (1.0, -0.08), (1.0, 0.0)]
    face = [(r, -z) for r, z in back[::-1]]
    halves = [lathe(back, BLUE, 64), lathe(face, ORANGE, 64)]
    return join(*halves, front, moved(cross, (0.0, 0.0, -0.07)), _mark(0.17))


@functools.cache
def disk() -> Mesh:
    """Disk of radius 1 about z with sectors, orange on +z, blue on -z, a red mark at +y."""
    below = [(0.0, -0.05), (0.93, -0.05), (1.0, -0.02), (1.0, 0.0)]
    above = [(1.0, 0.0), (1.0, 0.02), (0.93, 0.05), (0.0, 0.05)]
    return join(
        sectors(below, [BLUE, CREAM] * 4, 64),
        sectors(above, [ORANGE, CREAM] * 4, 64),
        cylinder(0.12, 0.2, STEEL, 20),
        _mark(0.12),
    )


@functools.cache
def spoked_wheel() -> Mesh:
    """Wheel of radius 1 about z with six spokes and a red mark at +y."""
    spokes = []
    for k in range(6):
        x, y = math.cos(k * math.pi / 3.0), math.sin(k * math.pi / 3.0)
        spokes.append(tube([(0.1 * x, 0.1 * y, 0.0), (0.9 * x, 0.9 * y, 0.0)], 0.03, GREY, 8))
    rim = ring(0.86, 1.0, 0.3, STEEL, 72)
    return join(rim, cylinder(0.14, 0.4, DARK, 24), *spokes, _mark(0.34))


@functools.cache
def goal_wheel() -> Mesh:
    """Ring of radius 1 about z: where a wheel is to be."""
    return ring(0.84, 1.0, 0.3, GREEN, 48)


@functools.cache
def mass() -> Mesh:
    """Small ball that slides on a spoke, of radius 0.12."""
    return ball(0.12, RED, n=10)


@functools.cache
def top() -> Mesh:
    """Top of height 1.5 about z, its point at the origin; a rotor of radius 1 with sectors."""
    shaft = [(0.0, 0.0), (0.06, 0.16), (0.06, 1.4), (0.04, 1.46), (0.0, 1.5)]
    below = [(0.0, 0.5), (0.95, 0.66), (1.0, 0.7), (1.0, 0.75)]
    above = [(1.0, 0.75), (1.0, 0.8), (0.95, 0.84), (0.0, 0.95)]
    return join(
        lathe(shaft, DARK, 20),
        sectors(below, [BLUE, SKY] * 3, 48),
        sectors(above, [ORANGE, CREAM, *[BLUE, CREAM] * 2], 48),
    )


@functools.cache
def stand() -> Mesh:
    """Stand of height 1 whose point is at the origin."""
    profile = [(0.0, -1.0), (0.4, -1.0), (0.4, -0.95), (0.1, -0.9), (0.07, -0.08), (0.0, 0.0)]
    return lathe(profile, STEEL, 24)


@functools.cache
def puck() -> Mesh:
    """Sliding carriage of height 0.2 whose upper face is at z = 0."""
    profile = [(0.0, -0.2), (0.42, -0.2), (0.45, -0.16), (0.45, -0.1), (0.14, -0.04), (0.0, 0.0)]
    return lathe(profile, STEEL, 32)


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
    return join(*rings, lathe([(0.0, low), (radius, low), (radius, 0.0)], STEEL, 48))


@functools.cache
def goal_cell() -> Mesh:
    """Square of side 1 across z, with a border."""
    border = moved(box((1.0, 1.0, 1.0), [GREEN]), (0.0, 0.0, -0.5))
    inner = moved(box((0.8, 0.8, 1.0), [CREAM]), (0.0, 0.0, -0.4))
    return join(border, inner)


@functools.cache
def slab() -> Mesh:
    """Board of side 1 below z = 0."""
    return moved(box((1.0, 1.0, 1.0), [LIGHT]), (0.0, 0.0, -0.5))


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
    edges = [_arc(-rim - 0.08, -rim, GREEN), _arc(rim, rim + 0.08, GREEN)]
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
    return moved(box((0.16, 0.12, width), [RED]), (0.0, 0.945, 0.0))


def _two_sided(mesh: Mesh) -> Mesh:
    """The mesh and its reverse: an open surface that is seen from both sides."""
    back = Mesh(mesh.vertices, -mesh.normals, mesh.colors, mesh.triangles[:, ::-1])
    return join(mesh, back)
