"""The two linear integrals of the falling disk, and the potential that they leave to the lean."""

import math

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic.rolling_disk._conical import conical
from rigid_envs.analytic.rolling_disk._disk import Disk, disk_of
from rigid_envs.checks import Array, all_finite, between, number, positive

__all__ = ["effective_potential", "legendre_constants", "potential", "solution", "spins"]


def legendre_constants(
    theta: float,
    phi_rate: float,
    omega3: float,
    *,
    m: float,
    radius: float,
    i_perp: float,
    i3: float,
) -> tuple[float, float]:
    """Integrals c1 and c2 of the rolling disk: its spins depend on the lean alone.

    omega3 = c1 F(x) + c2 F(1 - x) with x = (1 - cos(theta)) / 2 and F = F(xi, 1 - xi; 1; x), the
    solution of Legendre's equation that is 1 at x = 0 and infinite at x = 1, with
    xi (1 - xi) = m radius^2 C / (A B); p = phi' sin(theta) follows as B / (m radius^2) times the
    derivative of omega3 by theta. Without c2 the disk can fall flat.

    Args:
        theta: angle of the axis from the vertical, above 0 and below pi [rad].
        phi_rate: phi' [rad/s].
        omega3: axial angular velocity [rad/s].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].

    Returns:
        c1 and c2 [rad/s].

    Raises:
        ValueError: a parameter outside its range.

    Source: Appell (1900); Korteweg (1900); Borisov, Mamaev & Kilin (2003), Reg. Chaotic Dyn. 8:201,
        doi:10.1070/RD2003v008n02ABEH000237.
    """
    disk = disk_of(m=m, radius=radius, i_perp=i_perp, i3=i3)
    between(number(theta, "theta"), "theta", 0.0, math.pi)
    spin = number(phi_rate, "phi_rate") * math.sin(theta)
    axial, across = _basis(np.asarray(theta), disk)
    c1, c2 = np.linalg.solve(np.stack([axial, across]), [number(omega3, "omega3"), spin])
    return float(c1), float(c2)


def spins(
    theta: ArrayLike,
    c1: float,
    c2: float,
    *,
    m: float,
    radius: float,
    i_perp: float,
    i3: float,
) -> tuple[Array, Array]:
    """Precession and axial spin at any lean, from the two integrals of the motion.

    Args:
        theta: angle of the axis from the vertical, above 0 and below pi, any shape [rad].
        c1: first of `legendre_constants` [rad/s].
        c2: second of `legendre_constants` [rad/s].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].

    Returns:
        phi' and omega3, of the shape of theta [rad/s].

    Raises:
        ValueError: a parameter outside its range.

    Source: as `legendre_constants`.
    """
    all_finite(c1=c1, c2=c2)
    angle = between(theta, "theta", 0.0, math.pi)
    p, axial = solution(angle, c1, c2, disk_of(m=m, radius=radius, i_perp=i_perp, i3=i3))
    return p / np.sin(angle), axial


def effective_potential(
    theta: ArrayLike,
    c1: float,
    c2: float,
    *,
    m: float,
    radius: float,
    i_perp: float,
    i3: float,
    g: float,
) -> Array:
    """Potential in which the lean moves, J theta'^2 / 2 + V(theta) = E.

    V = (A p^2 + B omega3^2) / 2 + m g radius sin(theta), p and omega3 from `spins`.

    Args:
        theta: angle of the axis from the vertical, above 0 and below pi, any shape [rad].
        c1: first of `legendre_constants` [rad/s].
        c2: second of `legendre_constants` [rad/s].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Returns:
        V, of the shape of theta [J].

    Raises:
        ValueError: a parameter outside its range.

    Source: O'Reilly (1996).
    """
    positive(g, "g")
    all_finite(c1=c1, c2=c2)
    angle = between(theta, "theta", 0.0, math.pi)
    disk = disk_of(m=m, radius=radius, i_perp=i_perp, i3=i3)
    return disk.joules(potential(angle, *solution(angle, c1, c2, disk), disk, g))


def potential(theta: ArrayLike, p: ArrayLike, omega3: ArrayLike, disk: Disk, g: float) -> Array:
    """(A p^2 + B omega3^2) / 2 + m g radius sin(theta), as a multiple of m radius^2 [1/s^2]."""
    spinning = disk.i_perp * np.square(p) + disk.axial * np.square(omega3)
    return np.asarray(0.5 * spinning + g / disk.radius * np.sin(theta))


def solution(theta: Array, c1: float, c2: float, disk: Disk) -> tuple[Array, Array]:
    """The spins p = phi' sin(theta) and omega3 at any lean [rad/s]."""
    axial, across = _basis(theta, disk)
    return c1 * across[..., 0] + c2 * across[..., 1], c1 * axial[..., 0] + c2 * axial[..., 1]


def _basis(theta: Array, disk: Disk) -> tuple[Array, Array]:
    """omega3 and p of the two solutions (1, 0) and (0, 1), each of shape (..., 2)."""
    low, high = np.sin(0.5 * theta) ** 2, np.cos(0.5 * theta) ** 2
    mu = disk.i3 / (disk.i_perp * disk.axial)
    first, first_slope = conical(low, high, mu)
    second, second_slope = conical(high, low, mu)
    lever = 0.5 * disk.axial * np.sin(theta)
    across = np.stack([lever * first_slope, -lever * second_slope], axis=-1)
    return np.stack([first, second], axis=-1), across
