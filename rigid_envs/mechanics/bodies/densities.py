"""Bodies from a closed mesh, or from a density in a region."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigid_envs.base.checks import Array, array, exact_array, positive, require
from rigid_envs.mechanics.bodies.body import Body, distance, hollow, inertia_of, point_masses

# Mass properties of homogeneous polyhedra: exact integrals over a closed triangle mesh.

Faces = NDArray[np.intp]


def from_mesh(vertices: ArrayLike, faces: ArrayLike, density: float) -> Body:
    """Return the homogeneous body inside a closed triangle mesh.

    It is the signed sum of the tetrahedra between a point and the faces; each has the volume
    V = a . (b x c) / 6 and int r r^T dV = V / 20 (a a^T + b b^T + c c^T + s s^T), s = a + b + c.
    A cavity is a surface inside the other that looks inwards.

    What several surfaces enclose is counted for each of them: parts that overlap count twice where
    they do, which is not detected. Unite them first, or `compose` bodies that do not overlap.

    Args:
        vertices: corners [m], (n, 3); those that no face has do not count.
        faces: rows of three indices of vertices, counter-clockwise seen from outside, (k, 3).
        density: of the solid [kg/m^3].

    Returns:
        The body, in the axes of the vertices.

    Raises:
        ValueError: if the mesh is not closed (an edge has no second face), not consistently
            oriented (two faces run along an edge in the same direction), inside out, or without
            volume; the message names the edge and its faces.

    Source:
        Mirtich, J. Graphics Tools 1(2) (1996) 31, for the integrals; Tonon, J. Math. Stat. 1
        (2005) 8, for a tetrahedron.
    """
    x = exact_array(vertices, "vertices", "n", 3)
    triangles = _triangles(faces, len(x))
    _check_closed(triangles)
    middle = x[np.unique(triangles)].mean(axis=0)  # tetrahedra as large as the body, wherever it is
    corners = x[triangles] - middle
    volumes = _volumes(corners)
    volume = float(volumes.sum())
    _check_volume(volume, corners)
    com = volumes @ corners.sum(axis=1) / (4.0 * volume)
    rho = positive(density, "density", "kg/m^3")
    return Body(rho * volume, rho * inertia_of(_second_moments(corners - com)), middle + com)


def _volumes(corners: Array) -> Array:
    """Return the signed volumes of the tetrahedra between the origin and triangles (k, 3, 3)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.asarray(np.sum(a * np.cross(b, c), axis=-1) / 6.0)


def _second_moments(corners: Array) -> Array:
    """Return the integral of r r^T over the polyhedron of these triangles, (3, 3)."""
    points = np.concatenate([corners, corners.sum(axis=1, keepdims=True)], axis=1)
    weights = _volumes(corners)[:, None, None] / 20.0
    return np.asarray(np.einsum("kpi,kpj->ij", weights * points, points))


def _triangles(faces: ArrayLike, n: int) -> Faces:
    """Return faces as indices of n vertices, each triangle with three different ones."""
    rows = exact_array(faces, "faces", "k", 3)
    indices = (rows == np.round(rows)) & (rows >= 0) & (rows < n)
    require(indices, rows, "faces", f"the index of one of {n} vertices, counted from 0")
    triangles = rows.astype(np.intp)
    different = np.all(triangles != np.roll(triangles, 1, axis=1), axis=1)
    expected = "three different vertices: leave it out if it closes nothing"
    require(different, triangles, "faces", expected)
    return triangles


def _check_closed(triangles: Faces) -> None:
    """Refuse a mesh that is not closed and consistently oriented."""
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    n = edges.max() + 1
    forward, backward = edges @ [n, 1], edges @ [1, n]  # each edge as one number
    values, count = np.unique(forward, return_counts=True)
    if np.any(count > 1):
        row = int(np.argmax(forward == values[np.argmax(count > 1)]))
        sharing = (np.flatnonzero(forward == forward[row]) // 3).tolist()
        expected = (
            f"its edge {edges[row].tolist()} once in each direction, but faces {sharing} have it "
            "in the same one: reverse the order of the vertices of those that look inwards, or "
            "give parts that only touch there vertices of their own"
        )
        require(False, triangles[row // 3], f"faces[{row // 3}]", expected)
    closed = np.isin(forward, backward)
    if not np.all(closed):
        row = int(np.argmin(closed))
        expected = (
            f"a second face that has the edge {edges[row].tolist()}, backwards: close the hole "
            "there, or merge vertices that are one point"
        )
        require(False, triangles[row // 3], f"faces[{row // 3}]", expected)


def _check_volume(volume: float, corners: Array) -> None:
    """Refuse a mesh that is inside out, or flat to rounding."""
    size = float(np.prod(np.linalg.norm(corners, axis=-1), axis=1).sum()) / 6.0
    flat = abs(volume) <= 16 * np.finfo(np.float64).eps * size
    require(not flat, volume, "volume", "more than rounding [m^3]")
    expected = (
        "a positive volume [m^3], of faces counter-clockwise seen from outside: this mesh is "
        "inside out, pass faces[:, ::-1]"
    )
    require(volume > 0.0, volume, "volume", expected)


# Solids as images of boxes of coordinates, over which a density can be integrated.

Place = Callable[[Array], tuple[Array, Array]]
_TURN = (0.0, 2.0 * math.pi)


@dataclass(frozen=True)
class Region:
    """The solid that a box of three coordinates is mapped to.

    The constructors put solids where `rigid_envs.mechanics.bodies` has them: the special axis along
    z, the middle in the origin, but the apex of a cone and the flat side of a hemisphere. Any other
    solid is `Region(sides, place)`; `place` must be smooth, and reach each point once.

    Attributes:
        sides: lowest and highest value of each coordinate.
        place: of coordinates (3, n), gives points [m], (n, 3), and the volume [m^3] per volume of
            coordinates there, (n,): the absolute value of the Jacobian determinant.
    """

    sides: tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
    place: Place

    @classmethod
    def box(cls, lx: float, ly: float, lz: float) -> Region:
        """Cuboid with sides of these lengths [m], centred on the origin.

        Raises:
            ValueError: if a number is not positive.
        """
        x, y, z = (0.5 * distance(s, f"l{k}") for k, s in zip("xyz", (lx, ly, lz), strict=True))
        return cls(((-x, x), (-y, y), (-z, z)), _cartesian)

    @classmethod
    def ellipsoid(cls, a: float, b: float, c: float) -> Region:
        """Ellipsoid with these semi-axes [m], centred on the origin; a ball where all are equal.

        Raises:
            ValueError: if a number is not positive.
        """
        x, y, z = distance(a, "a"), distance(b, "b"), distance(c, "c")
        return cls(((0.0, 1.0), (0.0, math.pi), _TURN), _spherical(x, y, z))

    @classmethod
    def thick_shell(cls, inner_radius: float, outer_radius: float) -> Region:
        """Ball between two radii [m], centred on the origin.

        Raises:
            ValueError: if the outer radius is not positive, or the inner one not below it.
        """
        return cls((_thick(inner_radius, outer_radius), (0.0, math.pi), _TURN), _spherical(1, 1, 1))

    @classmethod
    def hemisphere(cls, radius: float) -> Region:
        """Half a ball of this radius [m], flat side in the plane z = 0, dome above.

        Raises:
            ValueError: if the radius is not positive.
        """
        r = distance(radius, "radius")
        return cls(((0.0, r), (0.0, 0.5 * math.pi), _TURN), _spherical(1, 1, 1))

    @classmethod
    def cylinder(cls, inner_radius: float, outer_radius: float, height: float) -> Region:
        """Tube along z between two radii, of this height [m]; a full cylinder from radius 0.

        Raises:
            ValueError: if outer radius or height is not positive, or the inner radius not below.
        """
        half = 0.5 * distance(height, "height")
        return cls((_thick(inner_radius, outer_radius), _TURN, (-half, half)), _cylindrical)

    @classmethod
    def cone(cls, radius: float, height: float) -> Region:
        """Cone, apex in the origin, base of this radius in the plane z = height [m].

        Raises:
            ValueError: if a number is not positive.
        """
        slope = distance(radius, "radius") / distance(height, "height")
        return cls(((0.0, slope), _TURN, (0.0, float(height))), _conical)

    @classmethod
    def torus(cls, major_radius: float, minor_radius: float) -> Region:
        """Ring of round section around z, of radii to the middle of the section and of it [m].

        Raises:
            ValueError: if a number is not positive, or the minor radius above the major one.
        """
        R = distance(major_radius, "major_radius")
        r = distance(minor_radius, "minor_radius")
        require(r <= R, r, "minor_radius", f"at most major_radius = {R} [m]: swap them")
        return cls(((0.0, r), _TURN, _TURN), _toroidal(R))


def _thick(inner_radius: float, outer_radius: float) -> tuple[float, float]:
    """Radii of a body with a volume."""
    inner, outer = hollow(inner_radius, outer_radius)
    expected = f"below outer_radius = {outer} [m]: what is thin has no volume for a density"
    require(inner < outer, inner, "inner_radius", expected)
    return inner, outer


def _cartesian(x: Array) -> tuple[Array, Array]:
    """Coordinates x, y, z."""
    return x.T, np.ones(x.shape[1])


def _cylindrical(x: Array) -> tuple[Array, Array]:
    """Coordinates radius, angle, z."""
    r, phi, z = x
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1), r


def _conical(x: Array) -> tuple[Array, Array]:
    """Coordinates radius over z, angle, z."""
    s, phi, z = x
    return np.stack([s * z * np.cos(phi), s * z * np.sin(phi), z], axis=-1), s * z * z


def _spherical(a: float, b: float, c: float) -> Place:
    """Coordinates radius, angle from z, angle about z, stretched by a, b and c."""

    def place(x: Array) -> tuple[Array, Array]:
        r, theta, phi = x
        across = r * np.sin(theta)
        points = [a * across * np.cos(phi), b * across * np.sin(phi), c * r * np.cos(theta)]
        return np.stack(points, axis=-1), a * b * c * r * across

    return place


def _toroidal(R: float) -> Place:
    """Coordinates distance from the middle of the section, angle around it, angle about z."""

    def place(x: Array) -> tuple[Array, Array]:
        s, chi, phi = x
        r = R + s * np.cos(chi)
        return np.stack([r * np.cos(phi), r * np.sin(phi), s * np.sin(chi)], axis=-1), s * r

    return place


# Bodies whose density varies: integrals of it over a region, by Gauss quadrature.

_NODES = (8, 16, 32, 64)  # along each side
_TOLERANCE = 1e-10  # relative; where the nodes are doubled once more, less than that is left


def from_density(density: Callable[[Array], ArrayLike], region: Region) -> Body:
    """Return the body of a density that varies smoothly: m = int rho dV, m com = int rho r dV.

    It is the body of the nodes of a Gauss-Legendre quadrature as point masses, 8 along each
    coordinate of the region and then twice as many until mass, centre and inertia change by less
    than 1e-10 of the mass, of sqrt(I / m) and of I, the largest moment. As the error of the
    quadrature falls exponentially, that of the result is near rounding.

    Args:
        density: rho [kg/m^3], at least 0: a function of points [m], (n, 3), that gives (n,), or one
            number for all.
        region: the solid.

    Returns:
        The body, in the axes of the region.

    Raises:
        ValueError: if the density is negative, zero everywhere, not finite, or not smooth enough
            for 64 nodes.

    Source:
        Davis & Rabinowitz, Methods of Numerical Integration (2nd ed.), section 5.6: products of
        Gauss rules.
    """
    require(callable(density), density, "density", "a function of points: lambda r: 1000.0")
    found, change = _cloud(density, region, _NODES[0]), np.inf
    for n in _NODES[1:]:
        coarse, found = found, _cloud(density, region, n)
        change = _change(coarse, found)
        if change <= _TOLERANCE:
            return found
    expected = (
        f"below {_TOLERANCE:g} with {_NODES[-1]} nodes along each side: where the density jumps or "
        "has a kink, take regions on both sides of it and compose them"
    )
    require(False, change, "change of the integrals of the density", expected)
    return found


def _cloud(density: Callable[[Array], ArrayLike], region: Region, n: int) -> Body:
    """Return the nodes of a quadrature, n along each side, with the mass that each stands for."""
    nodes, weights = np.polynomial.legendre.leggauss(n)
    low, high = np.transpose(region.sides)[..., None]
    half = 0.5 * (high - low)
    axes, shares = 0.5 * (low + high) + half * nodes, half * weights
    coordinates = np.stack(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)
    points, volumes = region.place(coordinates)
    volumes = volumes * np.einsum("i,j,k->ijk", *shares).ravel()
    rho = array(density(points), "density(points)")
    rho = exact_array(np.full(len(points), rho) if rho.ndim == 0 else rho, "density(points)", n**3)
    require(rho >= 0.0, rho, "density(points)", "densities of at least 0 [kg/m^3]")
    some = rho > 0.0
    require(bool(np.any(some)), 0.0, "density(points)", "more than 0 somewhere [kg/m^3]")
    return point_masses((rho * volumes)[some], points[some])


def _change(coarse: Body, fine: Body) -> float:
    """Return the largest relative difference of mass, centre and inertia."""
    inertia = float(np.max(np.abs(fine.inertia)))
    length = math.sqrt(inertia / fine.mass)
    return max(
        abs(coarse.mass / fine.mass - 1.0),
        float(np.max(np.abs(coarse.com - fine.com))) / length,
        float(np.max(np.abs(coarse.inertia - fine.inertia))) / inertia,
    )
