"""Bodies whose density varies: integrals of it over a region, by Gauss quadrature."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.bodies.body import Body
from rigid_envs.bodies.points import point_masses
from rigid_envs.bodies.regions import Region
from rigid_envs.checks import Array, array, exact_array, require

__all__ = ["from_density"]

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
