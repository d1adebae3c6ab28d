"""Poinsot's construction: the ellipsoid of inertia rolls on the invariable plane.

omega ends on the energy ellipsoid, omega . I omega = 2 T, which is fixed in the body and whose
normal there is I omega = L. So it touches, at omega, the plane with normal L at the distance
omega . L / norm(L) = 2 T / L from the centre; and since omega is also the axis about which the body
turns, it rolls on that plane without slip. In the body the contact runs through the polhode, on
the plane through the herpolhode.

Sources: Goldstein, Classical Mechanics, sec. 5.6; Landau & Lifshitz, Mechanics, par. 37.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.analytic import _quaternion, elliptic
from rigid_envs.analytic.free_body._body_attitude import precession
from rigid_envs.analytic.free_body._polhode import Polhode, polhode
from rigid_envs.checks import Array, exact_array

__all__ = ["Poinsot", "herpolhode", "invariable_plane", "poinsot"]


@dataclass(frozen=True)
class Poinsot:
    """Measures of the rolling ellipsoid.

    Attributes:
        momentum: L, magnitude of the angular momentum [kg m^2/s].
        energy: T, kinetic energy [J].
        distance: of the invariable plane from the centre, 2 T / L, which is the constant component
            of omega along L [rad/s]. 0 at rest.
        ellipsoid_distance: the same for the ellipsoid of inertia rho . I rho = 1, whose contact is
            rho = omega / sqrt(2 T): sqrt(2 T) / L [kg^-1/2 m^-1]. At rest the limit of a slow spin.
        radius_min: smallest distance of the herpolhode from the foot of L on the plane [rad/s].
        radius_max: largest one [rad/s]; both are 0 where omega does not change.
        period: of the polhode, 4 K / p [s]; the herpolhode has the same shape twice in it.
        advance: angle about L by which the contact advances in that time [rad]; infinite where the
            period is.
    """

    momentum: float
    energy: float
    distance: float
    ellipsoid_distance: float
    radius_min: float
    radius_max: float
    period: float
    advance: float


def poinsot(moments: ArrayLike, omega0: ArrayLike) -> Poinsot:
    """Find the invariable plane and the ring in which the herpolhode lies.

    The contact is norm(omega x L) / L away from the foot of L, and in the normal frame of
    `Polhode`, where nothing cancels,

        r_max = abs(J3 - J1) a1 a3 / L at cn = 1,
        r_min = abs(J3 - J2) a2 a3 sqrt(1 - m) / L at sn = 1.

    Args:
        moments: principal moments of inertia, shape (3,) [kg m^2], any order.
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.

    Raises:
        ValueError: a wrong shape, a moment that is not positive, or a number that is not finite.

    Source: Landau & Lifshitz, par. 37; Whittaker, Analytical Dynamics, ch. VI.
    """
    path = polhode(moments, omega0)
    (j1, j2, j3), (a1, a2, _) = path.moments, path.amplitudes
    momentum, share = path.momentum, _shares(path)[2]
    rates = exact_array(omega0, "omega0", 3)
    distance = float(rates @ _direction(path, exact_array(moments, "moments", 3) * rates))
    return Poinsot(
        momentum=momentum,
        energy=0.5 * momentum * distance,
        distance=distance,
        ellipsoid_distance=math.sqrt(distance / momentum if momentum else 1.0 / j3),
        radius_min=a2 * math.sqrt(path.m1) * (abs(j3 - j2) * share),
        radius_max=a1 * (abs(j3 - j1) * share) if math.isfinite(path.start) else 0.0,
        period=path.period,
        advance=_advance(path),
    )


def invariable_plane(moments: ArrayLike, omega0: ArrayLike, q0: ArrayLike) -> tuple[Array, float]:
    """Place of the invariable plane in the world: normal . omega_world = distance at all times.

    Args:
        moments: principal moments of inertia, shape (3,) [kg m^2], any order.
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.
        q0: attitude at t = 0, shape (4,), unit (w, x, y, z), body to world.

    Returns:
        The normal L / norm(L), shape (3,), world, and the distance 2 T / norm(L) from the centre
        [rad/s]. At rest the distance is 0 and the normal one of the body axes.

    Raises:
        ValueError: bad numbers as in `poinsot`, or a quaternion that is not unit.

    Source: Goldstein, sec. 5.6.
    """
    path, q = polhode(moments, omega0), _quaternion.normalized(q0, "q0")
    inertia, rates = exact_array(moments, "moments", 3), exact_array(omega0, "omega0", 3)
    body = _direction(path, inertia * rates)
    pure = np.concatenate([np.zeros(1), body])
    world = _quaternion.product(_quaternion.product(q, pure), _quaternion.conjugate(q))[1:]
    return world, float(body @ rates)


def herpolhode(t: ArrayLike, moments: ArrayLike, omega0: ArrayLike) -> tuple[Array, Array]:
    """Curve of the contact on the invariable plane, in polar coordinates about the foot of L.

    The angle is the precession of the third axis of the normal frame about L and, on top of it, the
    angle at L between that axis and omega,

        tan = (J2 - J1) L a2 sn cn / (J1 (J1 - J3) a1 a3 dn),

    which swings to and fro and never turns round, because dn > 0.

    Args:
        t: times, any shape [s].
        moments: principal moments of inertia, shape (3,) [kg m^2], any order.
        omega0: angular velocity at t = 0, shape (3,) [rad/s], principal body axes.

    Returns:
        Radius [rad/s] and angle about L since t = 0, continuous [rad], each of the shape of t.

    Raises:
        ValueError: bad numbers as in `poinsot`.

    Source: Landau & Lifshitz, par. 37.
    """
    path = polhode(moments, omega0)
    u = path.argument(t)
    angle = precession(path, u, t) + _lead(path, u)
    start = precession(path, path.argument(0.0), 0.0) + _lead(path, path.argument(0.0))
    return _radius(path, u), angle - start


def _direction(path: Polhode, momentum: Array) -> Array:
    """Unit vector along L in the body; at rest along the axis that the normal frame has third."""
    if path.momentum == 0.0:
        return path.to_body(np.array([0.0, 0.0, 1.0]))
    return momentum / path.momentum


def _advance(path: Polhode) -> float:
    """Precession during one period of the polhode [rad]."""
    if math.isinf(path.period):
        return math.inf
    whole = math.copysign(4.0 * elliptic.quarter_period(path.m1), path.rate)
    return float(precession(path, np.array(whole), path.period))


def _radius(path: Polhode, u: Array) -> Array:
    """Distance of the contact from the foot of L, norm(omega x L) / L [rad/s]."""
    (j1, j2, j3), (a1, a2, _) = path.moments, path.amplitudes
    share1, _, share3 = _shares(path)
    sn, cn, dn = elliptic.jacobi(u, path.m1)
    cross = (
        a2 * ((j3 - j2) * share3) * sn * dn,
        a1 * ((j3 - j1) * share3) * cn * dn,
        a2 * ((j2 - j1) * share1) * sn * cn,
    )
    return np.hypot(np.hypot(cross[0], cross[1]), cross[2])


def _lead(path: Polhode, u: Array) -> Array:
    """Angle about L from the third axis of the normal frame, or its opposite, to omega [rad]."""
    (j1, j2, j3), (share1, share2, share3) = path.moments, _shares(path)
    sn, cn, dn = elliptic.jacobi(u, path.m1)
    across = math.copysign(1.0, j1 - j3) * (j2 - j1) * share2 * sn * cn
    return np.asarray(np.arctan2(across, (abs(j1 - j3) * share1) * (j1 * share3) * dn))


def _shares(path: Polhode) -> tuple[float, float, float]:
    """a1 / L, a2 / L and a3 / L, for products that neither under- nor overflow; 0 at rest."""
    a1, a2, a3 = (a / (path.momentum or 1.0) for a in path.amplitudes)
    return a1, a2, a3
