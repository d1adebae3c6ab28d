"""A coin that is held upright and rolls without slip: circles, driven paths, and an incline.

The coin has z-x-z Euler angles phi, pi / 2 and psi: phi about the vertical is its heading, psi its
phase. It rolls by v = omega x (contact to centre), so that

    x' = -radius psi' cos(phi),    y' = -radius psi' sin(phi).

Sources: Bloch, Nonholonomic Mechanics and Control, sec. 1.4 (vertical disk) and 1.6 (knife edge);
Neimark & Fufaev, Dynamics of Nonholonomic Systems, ch. I.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import roots_legendre

from rigid_envs.base import checks
from rigid_envs.mechanics import special
from rigid_envs.mechanics.special import phi1, phi2

# Nodes that integrate a polynomial of degree 47: with them a phase of 2 radians is at rounding.
_NODES = 24


class CoinMotion(NamedTuple):
    """Motion of the coin at given times.

    Attributes:
        place: of the centre and of the contact, shape (..., 2) [m], world.
        phi: heading [rad], not reduced.
        psi: phase [rad], not reduced.
        attitude: Rz(phi) Rx(pi / 2) Rz(psi), unit (w, x, y, z), body to world, shape (..., 4).
    """

    place: checks.Array
    phi: checks.Array
    psi: checks.Array
    attitude: checks.Array


class InclineMotion(NamedTuple):
    """Motion of a blade or coin on an incline at given times.

    Attributes:
        place: downhill and across, shape (..., 2) [m].
        speed: along the heading [m/s].
        heading: from downhill towards across [rad], not reduced.
    """

    place: checks.Array
    speed: checks.Array
    heading: checks.Array


def roll_coin(
    t: ArrayLike,
    *,
    radius: float,
    phi_rate: float,
    psi_rate: float,
    phi: float = 0.0,
    psi: float = 0.0,
    place: ArrayLike = (0.0, 0.0),
) -> CoinMotion:
    """Roll and steer at constant rates: a circle of radius abs(radius psi' / phi').

    x + i y = z0 - radius psi' t exp(i phi) phi_1(phi' t) with phi_1(x) = (exp(i x) - 1) / (i x):
    without steering a straight line.

    Args:
        t: times, any shape [s].
        radius: of the coin [m].
        phi_rate: constant phi' [rad/s].
        psi_rate: constant psi' [rad/s].
        phi: heading at t = 0 [rad].
        psi: phase at t = 0 [rad].
        place: of the contact at t = 0, shape (2,) [m], world.

    Raises:
        ValueError: a radius that is not positive, a wrong shape, or a number that is not finite.

    Source: Bloch, sec. 1.4.
    """
    checks.positive(radius, "radius")
    checks.all_finite(phi_rate=phi_rate, psi_rate=psi_rate, phi=phi, psi=psi)
    times, start = checks.array(t, "t"), complex(*checks.exact_array(place, "place", 2))
    z = start - radius * psi_rate * times * np.exp(1j * phi) * phi1(phi_rate * times)
    return _coin(z, phi + phi_rate * times, psi + psi_rate * times)


def drive_coin(
    t: ArrayLike,
    *,
    m: float,
    radius: float,
    i_perp: float,
    i3: float,
    torques: ArrayLike,
    phi_rate: float = 0.0,
    psi_rate: float = 0.0,
    phi: float = 0.0,
    psi: float = 0.0,
    place: ArrayLike = (0.0, 0.0),
) -> CoinMotion:
    """Roll and steer under constant torques.

    i_perp phi'' = tau_phi,  (i3 + m radius^2) psi'' = tau_psi: phi and psi are parabolas in t, and
    the path a Fresnel integral, int (psi' + psi'' s) exp(i phi(s)) ds. By its closed form it would
    be a difference of numbers without bound as phi'' vanishes; it is evaluated by Gauss's rule with
    as many nodes as its phase asks for, to rounding.

    Args:
        t: times, any shape [s].
        m: mass [kg].
        radius: of the coin [m].
        i_perp: moment about a diameter [kg m^2].
        i3: axial moment [kg m^2].
        torques: tau_phi about the vertical and tau_psi about the axis, shape (2,) [N m].
        phi_rate: phi' at t = 0 [rad/s].
        psi_rate: psi' at t = 0 [rad/s].
        phi: heading at t = 0 [rad].
        psi: phase at t = 0 [rad].
        place: of the contact at t = 0, shape (2,) [m], world.

    Raises:
        ValueError: a parameter that is not positive, a wrong shape, or a number that is not finite.

    Source: Bloch, sec. 1.4.
    """
    checks.all_positive(m=m, radius=radius, i_perp=i_perp, i3=i3)
    checks.all_finite(phi_rate=phi_rate, psi_rate=psi_rate, phi=phi, psi=psi)
    times, start = checks.array(t, "t"), complex(*checks.exact_array(place, "place", 2))
    inertias = np.array([i_perp, i3 + m * radius * radius])
    steering, rolling = (checks.exact_array(torques, "torques", 2) / inertias).tolist()

    def heading(s: checks.Array) -> checks.Array:
        return np.asarray(phi + s * (phi_rate + 0.5 * steering * s))

    reach = float(np.max(np.abs(times), initial=0.0))
    swept = reach * (abs(phi_rate) + abs(steering) * reach)
    nodes, weights = roots_legendre(_NODES + math.ceil(swept))
    s = 0.5 * times[..., np.newaxis] * (1.0 + nodes)
    speed = psi_rate + rolling * s
    path = 0.5 * times * np.sum(weights * speed * np.exp(1j * heading(s)), axis=-1)
    phase = psi + times * (psi_rate + 0.5 * rolling * times)
    return _coin(start - radius * path, heading(times), phase)


def steer_on_incline(
    t: ArrayLike,
    *,
    slope: float,
    beta: float,
    g: float,
    steering_rate: float,
    speed: float = 0.0,
    heading: float = 0.0,
) -> InclineMotion:
    """Glide or roll on an incline while the heading turns at a constant rate.

    v' = g sin(slope) / (1 + beta) cos(heading), heading' = w. With G = g sin(slope) / (1 + beta),
    E = t exp(i heading) phi_1(w t), phi_1(x) = (exp(i x) - 1) / (i x) and
    phi_2(x) = (exp(i x) - 1 - i x) / (i x)^2,

        v = v0 + G Re E,    x + i y = v0 E + G / 2 (E^2 / 2 + t^2 phi_2(w t)).

    It never runs away downhill, but drifts across the slope: see `drift_across_slope`.

    Args:
        t: times, any shape [s].
        slope: of the incline [rad].
        beta: inertia ratio I3 / (m r^2) of the coin; 0 is a blade, the knife edge.
        g: gravity [m/s^2].
        steering_rate: w, constant rate of the heading [rad/s].
        speed: along the heading at t = 0 [m/s].
        heading: at t = 0, from downhill towards across [rad].

    Raises:
        ValueError: a number outside its range.

    Source: Bloch, sec. 1.6.
    """
    checks.all_non_negative(beta=beta, g=g)
    times = checks.array(t, "t")
    angle = checks.number(steering_rate, "steering_rate") * times
    pull = g * np.sin(checks.number(slope, "slope")) / (1.0 + beta)
    way = times * np.exp(1j * checks.number(heading, "heading")) * phi1(angle)
    z = checks.number(speed, "speed") * way + 0.5 * pull * (0.5 * way**2 + times**2 * phi2(angle))
    place = np.stack([z.real, z.imag], axis=-1)
    return InclineMotion(place, speed + pull * way.real, heading + angle)


def drift_across_slope(*, slope: float, beta: float, g: float, steering_rate: float) -> float:
    """Mean velocity across an incline at a constant steering rate w, from any start [m/s].

    g sin(slope) / (2 w (1 + beta)).

    Args:
        slope: of the incline [rad].
        beta: inertia ratio I3 / (m r^2) of the coin; 0 is a blade.
        g: gravity [m/s^2].
        steering_rate: w, not 0 [rad/s].

    Raises:
        ValueError: no steering, or a number outside its range.

    Source: Bloch, sec. 1.6.
    """
    checks.all_non_negative(beta=beta, g=g)
    rate = checks.number(steering_rate, "steering_rate")
    expected = "a rate other than 0 [rad/s]: unsteered it runs downhill"
    checks.require(rate != 0.0, steering_rate, "steering_rate", expected)
    return 0.5 * g * math.sin(checks.number(slope, "slope")) / (rate * (1.0 + beta))


def _coin(z: ArrayLike, phi: checks.Array, psi: checks.Array) -> CoinMotion:
    """Motion from the place x + i y and the two angles."""
    place = np.stack([np.real(z), np.imag(z)], axis=-1)
    upright = np.broadcast_to(np.sqrt([0.5, 0.5, 0.0, 0.0]), (*phi.shape, 4))
    turned = special.product(upright, special.about_vertical(psi))
    attitude = special.product(special.about_vertical(phi), turned)
    return CoinMotion(place, phi, psi, attitude)
