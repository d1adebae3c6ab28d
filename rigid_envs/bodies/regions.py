"""Solids as images of boxes of coordinates, over which a density can be integrated."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rigid_envs.bodies._arguments import distance, hollow
from rigid_envs.checks import Array, require

__all__ = ["Region"]

Place = Callable[[Array], tuple[Array, Array]]
_TURN = (0.0, 2.0 * math.pi)


@dataclass(frozen=True)
class Region:
    """The solid that a box of three coordinates is mapped to.

    The constructors put solids where `rigid_envs.bodies` has them: the special axis along z, the
    middle in the origin, but the apex of a cone and the flat side of a hemisphere. Any other solid
    is `Region(sides, place)`; `place` must be smooth, and reach each point once.

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
