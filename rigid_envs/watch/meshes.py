"""Meshes: simple solids, colours, and what several views show."""

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, require

Color = tuple[float, float, float]
"""Red, green and blue in [0, 1], sRGB."""


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


# Meshes of simple solids, and how to join, move and colour them.
#
# Each is closed unless its docstring says otherwise, its triangles counter-clockwise from outside.
# Lengths are in metres, colours sRGB. Vertices are repeated where faces meet at an edge.

_CREASE = math.cos(math.radians(35.0))  # two faces at a larger angle meet at a visible edge


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
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.linalg.norm(np.cross(one, other), axis=-1)
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

    Raises:
        ValueError: no colours, or sides that cannot be shared among them equally.
    """
    n = len(colors)
    require(n > 0 and sides % n == 0, n, "number of colors", f"a divisor of sides = {sides}")
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
            polar, azimuth = below * quarter, turn * quarter
            points = _cap((polar, polar + quarter), (azimuth, azimuth + quarter), n, n)
            x, y, _ = points[n // 2, n // 2]
            k = int(x < 0) + 2 * int(y < 0) + 4 * below
            pieces.append(grid(radius * points, points, colors[k]))
    return join(*pieces)


def box(size: npt.ArrayLike, colors: Sequence[Color]) -> Mesh:
    """Box about the origin.

    Args:
        size: lengths along x, y and z, shape (3,).
        colors: of the faces +x, -x, +y, -y, +z, -z, or one for all.

    Raises:
        ValueError: another number of colours.
    """
    require(len(colors) in (1, 6), len(colors), "number of colors", "1, or 6 for the faces")
    half = 0.5 * np.asarray(size, dtype=np.float64)
    six = colors if len(colors) == 6 else list(colors) * 6
    faces, axes = [], np.eye(3)
    for k, color in enumerate(six):
        n, u = (1.0 - 2.0 * (k % 2)) * axes[k // 2], axes[k // 2 - 1]
        v = np.cross(n, u)
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


def circle(n: int) -> Array:
    """Unit circle about z, its first point on x and again its last one, shape (n, 3)."""
    angle = np.linspace(0.0, 2.0 * math.pi, n)
    angle[-1] = 0.0
    return np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)


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
YELLOW, BLUE = _rgb(224, 212, 60), _rgb(0, 114, 178)
RED, PURPLE = _rgb(213, 94, 0), _rgb(204, 121, 167)
DARK, STEEL, GREY = _rgb(45, 50, 60), _rgb(105, 115, 130), _rgb(160, 168, 180)
LIGHT, CREAM = _rgb(212, 217, 224), _rgb(226, 223, 215)

OCTANTS = (YELLOW, ORANGE, SKY, CREAM, RED, BLUE, GREEN, PURPLE)
"""Octants of a ball at (x < 0) + 2 (y < 0) + 4 (z < 0): the upper half is light."""

OMEGA, MOMENTUM, INPUT, PATH = RED, BLUE, PURPLE, DARK
"""Angular velocity, angular momentum, what is controlled, path of a point."""

PALE, WARM = (0.80, 0.86, 0.92), (0.93, 0.89, 0.82)
"""Colours of a ball that only shows its attitude."""

GHOST = 0.45
"""Opacity of a goal."""


# Meshes that several views show, each made once in a process.


@functools.cache
def brick() -> Mesh:
    """Cube of side 1 with six colours."""
    return box((1.0, 1.0, 1.0), (ORANGE, YELLOW, SKY, BLUE, GREEN, PURPLE))


@functools.cache
def goal_disk() -> Mesh:
    """Thin disk of radius 1 across z, with a bright middle: a place on a plane."""
    return join(cylinder(1.0, 0.004, GREEN, 48), cylinder(0.5, 0.008, CREAM, 32))


@functools.cache
def edge_ring() -> Mesh:
    """Flat ring of radius 1 across z, open, seen from above: a border."""
    return lathe([(1.01, 0.0), (0.99, 0.0)], RED, 96)


@functools.cache
def chequered_ball() -> Mesh:
    """Ball of radius 1 whose octants have two colours in turn."""
    return octants(1.0, [WARM, PALE, PALE, WARM, PALE, WARM, WARM, PALE], n=12)


@functools.cache
def stand() -> Mesh:
    """Stand of height 1 whose point is at the origin."""
    profile = [(0.0, -1.0), (0.4, -1.0), (0.4, -0.95), (0.1, -0.9), (0.07, -0.08), (0.0, 0.0)]
    return lathe(profile, STEEL, 24)


def mark(width: float) -> Mesh:
    """Red mark at the rim of a wheel, at +y."""
    return moved(box((0.16, 0.12, width), [RED]), (0.0, 0.945, 0.0))


@functools.cache
def panelled_box() -> Mesh:
    """Satellite: box of side 1, panels along x."""
    faces = LIGHT, GREY, CREAM, GREY, CREAM, STEEL
    arms = box((1.6, 0.06, 0.06), [STEEL])
    return join(box((1.0, 1.0, 1.0), faces), arms, *panels())


def panels() -> list[Mesh]:
    """Panels of a satellite along x, with cells on +z, grey on -z, the end at +x red."""
    pieces = []
    for side, color in ((1.0, RED), (-1.0, LIGHT)):
        frame = box((0.9, 0.86, 0.04), [*[LIGHT] * 5, GREY])
        end = box((0.08, 0.86, 0.08), [color])
        pieces.append(moved(frame, (1.2 * side, 0.0, 0.0)))
        pieces.append(moved(end, (1.69 * side, 0.0, 0.0)))
        for k in range(3):
            cell = box((0.26, 0.78, 0.03), [BLUE])
            pieces.append(moved(cell, (side * (0.9 + 0.3 * k), 0.0, 0.012)))
    return pieces


# Shaft and head of an arrow.


@functools.cache
def arrow_shaft() -> Mesh:
    """Open cylinder of diameter 1 from z = 0 to z = 1, white."""
    return _mantle(0.5, slope=0.0)


@functools.cache
def arrow_head() -> Mesh:
    """Cone of diameter 1 from its base at z = 0 to its tip at z = 1, white."""
    return _mantle(0.0, slope=0.5)


def _mantle(top: float, slope: float) -> Mesh:
    """Side of a cone of which the tip is cut off where its radius is `top`."""
    around, up = circle(17), np.array([0.0, 0.0, 1.0])
    outward = around + slope * up
    return grid([0.5 * around, top * around + up], [outward, outward], (1.0, 1.0, 1.0))
