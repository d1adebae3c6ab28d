"""Attitude of a free body by an elliptic integral of the third kind.

Sources: Landau & Lifshitz, Mechanics, par. 37; van Zon & Schofield (2007), J. Comput. Phys.
225:145, doi:10.1016/j.jcp.2006.11.019.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic import _quaternion, elliptic
from rigid_envs.analytic.free_body._polhode import Polhode, polhode
from rigid_envs.checks import Array

__all__ = ["attitude"]


def attitude(t: ArrayLike, moments: ArrayLike, omega0: ArrayLike, q0: ArrayLike) -> Array:
    """Attitude of a free body, continuous in t and equal to q0 at t = 0.

    In a space frame with z along L the attitude has z-x-z Euler angles: theta and psi from the
    direction n of L in the body, and the precession

        phi' = L / J2 + L (1 / J1 - 1 / J2) cn^2 / (1 + nu sn^2),
        nu = J3 (J2 - J1) / (J1 (J3 - J2)),

    which `elliptic.cn2_integral` integrates. The second term dies out at the separatrix, where the
    motion lingers; and since n3 >= 0 in the normal frame, the quaternion of the angles is smooth
    even where the angles are not.

    Args:
        t: times, any shape [s].
        moments: principal moments of inertia, shape (3,) [kg m^2], any order.
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.

    Returns:
        Attitude, shape t.shape + (4,), unit (w, x, y, z), body to world.

    Raises:
        ValueError: a wrong shape, a moment that is not positive, a quaternion that is not unit, or
            a number that is not finite.

    Source: Landau & Lifshitz, par. 37; van Zon & Schofield (2007).
    """
    path, q_start = polhode(moments, omega0), _quaternion.normalized(q0, "q0")
    turned = _quaternion.product(
        _quaternion.conjugate(_from_momentum(path, 0.0)), _from_momentum(path, t)
    )
    turned[..., 1:] = path.to_body(turned[..., 1:])
    return _quaternion.product(np.broadcast_to(q_start, turned.shape), turned)


def _from_momentum(path: Polhode, t: ArrayLike) -> Array:
    """Quaternion from the normal frame to a space frame with z along L, shape t.shape + (4,)."""
    u = path.argument(t)
    sn, cn, dn = elliptic.jacobi(u, path.m1)
    shares = np.array(path.amplitudes) / (path.momentum or 1.0)  # squares of slow rates underflow
    momentum = np.stack([cn, sn, dn], axis=-1) * shares * np.array(path.moments)
    if path.momentum == 0.0:
        momentum[..., 2] = 1.0  # at rest any direction will do
    momentum /= np.linalg.norm(momentum, axis=-1, keepdims=True)
    # The third component is never negative: nothing cancels, and theta <= 90 degrees.
    cos_half = np.sqrt(0.5 * (1.0 + momentum[..., 2]))
    sin_half = np.hypot(momentum[..., 0], momentum[..., 1]) / (2.0 * cos_half)
    phi, psi = precession(path, u, t), _spin(path, u)
    total, difference = 0.5 * (phi + psi), 0.5 * (phi - psi)
    parts = [
        cos_half * np.cos(total),
        sin_half * np.cos(difference),
        sin_half * np.sin(difference),
        cos_half * np.sin(total),
    ]
    return np.stack(parts, axis=-1)


def precession(path: Polhode, u: Array, t: ArrayLike) -> Array:
    """Euler angle phi about L [rad], up to a constant."""
    j1, j2, _ = path.moments
    steady = path.momentum / j2 * np.asarray(t, dtype=np.float64)
    if path.rate == 0.0 or j1 == j2:
        return steady
    factor = path.momentum / j2 / path.rate * ((j2 - j1) / j1)
    return steady + factor * elliptic.cn2_integral(u, _characteristic(path), path.m1)


def _spin(path: Polhode, u: Array) -> Array:
    """Euler angle psi [rad], with tan psi = n1 / n2, continuous in u."""
    n, v = elliptic.split_half_periods(u, path.m1)
    sn, cn, _ = elliptic.jacobi(v, path.m1)
    stretch = math.sqrt(1.0 + _characteristic(path))
    return np.pi * (0.5 - n) - np.arctan2(stretch * sn, cn)


def _characteristic(path: Polhode) -> float:
    """Return nu of the precession, minus the characteristic of Legendre's Pi."""
    j1, j2, j3 = path.moments
    return j3 / j1 * ((j2 - j1) / (j3 - j2)) if j3 != j2 else 0.0
