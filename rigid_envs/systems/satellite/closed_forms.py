"""Motion of satellites in closed form: pitch, librations, spin, precession, detumbling."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.base import checks
from rigid_envs.base.checks import Array
from rigid_envs.mechanics import special

# Pitch: rotation about the orbit's normal, by Jacobi elliptic functions.
#
# Moments are about the axes of roll (along the velocity), pitch (along the orbit's normal) and yaw
# (along the vertical) at theta = 0. Theta turns the body about the normal, relative to the orbit:
#
#     theta'' = -(3 / 2) n^2 ((I1 - I3) / I2) sin 2 theta.
#
# Twice the angle from the nearest stable orientation is that of a pendulum of the small frequency
# p = n sqrt(3 |I1 - I3| / I2). With W^2 = theta'^2 + p^2 sin^2 and the angle phi from there
#
#     sin phi = (W / p) sn, cos phi = dn, phi' = W cn    of p t, m = (W / p)^2, where it librates,
#     sin phi = sn, cos phi = cn, phi' = W dn            of W t, m = (p / W)^2, where it rotates.
#
# Source: Hughes, Spacecraft Attitude Dynamics, ch. 9.


@dataclass(frozen=True)
class Pitch:
    """Pitch in Jacobi functions of u = start + rate t.

    Attributes:
        middle: stable orientation from which the angle is counted, or that of rest [rad].
        sense: 1 or -1, that of a rotation; 0 for a libration.
        speed: W, largest rate relative to the orbit [rad/s].
        rate: of u [rad/s].
        start: u at t = 0.
        m1: complementary parameter 1 - m of the elliptic functions, 0 on the separatrix.
        amplitude: largest angle from the middle [rad]; inf for a rotation.
        period: of a libration, or time in which a rotation makes half a turn [s]; inf where none.
    """

    middle: float
    sense: float
    speed: float
    rate: float
    start: float
    m1: float
    amplitude: float
    period: float


def pitch_motion(pitch0: float, pitch_rate0: float, *, moments: ArrayLike, n: float) -> Pitch:
    """Constants of the pitch motion.

    Args:
        pitch0: theta at t = 0 [rad].
        pitch_rate0: theta' at t = 0, relative to the orbit [rad/s].
        moments: about the axes of roll, pitch and yaw, shape (3,) [kg m^2].
        n: mean motion [rad/s].

    Returns:
        Constants; those of rest in a stable orientation have the period of small librations.

    Raises:
        ValueError: a wrong shape, a moment or n that is not positive, or no finite number.

    Source: Hughes, ch. 9; Byrd & Friedman, Handbook of Elliptic Integrals, 110.
    """
    checks.all_finite(pitch0=pitch0, pitch_rate0=pitch_rate0)
    checks.all_positive(n=n)
    I1, I2, I3 = checks.positive_array(moments, "moments", "kg m^2", 3)
    p = n * math.sqrt(3.0 * abs(I1 - I3) / I2)
    base = 0.0 if I1 >= I3 else 0.5 * math.pi
    middle = base + math.pi * round((pitch0 - base) / math.pi)
    phi, fast = pitch0 - middle, abs(pitch_rate0)
    s, c = math.sin(phi), max(math.cos(phi), 0.0)
    W, least = math.hypot(p * s, fast), p * c  # the rate that just reaches the unstable orientation
    if W == 0.0:
        rest = 2.0 * math.pi / p if p > 0.0 else math.inf
        return Pitch(pitch0, 0.0, 0.0, p, 0.0, 1.0, 0.0, rest)
    if fast < least:
        m1 = _complement((least - fast) / p * ((least + fast) / p))
        quarter = special.quarter_period(m1)
        start = float(special.argument(p * s / W, fast / W, c))
        start = 2.0 * quarter - start if pitch_rate0 < 0.0 else start
        amplitude = math.atan2(W / p, math.sqrt(m1))
        return Pitch(middle, 0.0, W, p, start, m1, amplitude, 4.0 * quarter / p)
    m1 = _complement((fast - least) / W * ((fast + least) / W))
    sense = math.copysign(1.0, pitch_rate0)
    start = float(special.argument(sense * s, c, fast / W))
    half_turn = 2.0 * special.quarter_period(m1) / W
    return Pitch(middle, sense, W, W, start, m1, math.inf, half_turn)


def _complement(m1: float) -> float:
    return m1 if m1 > special.SMALLEST else 0.0


def pitch(
    t: ArrayLike, pitch0: float, pitch_rate0: float, *, moments: ArrayLike, n: float
) -> tuple[Array, Array]:
    """Pitch angle and its rate, relative to the orbit.

    Args:
        t: times [s], any shape.
        pitch0: theta at t = 0 [rad].
        pitch_rate0: theta' at t = 0, relative to the orbit [rad/s].
        moments: about the axes of roll, pitch and yaw, shape (3,) [kg m^2].
        n: mean motion [rad/s].

    Returns:
        theta, which counts turns [rad], and theta' [rad/s], each of the shape of t.

    Raises:
        ValueError: as `pitch_motion`.

    Source: Hughes, ch. 9; Byrd & Friedman, 110.
    """
    motion = pitch_motion(pitch0, pitch_rate0, moments=moments, n=n)
    u = motion.start + motion.rate * checks.array(t, "t")
    if motion.sense == 0.0:
        sn, cn, dn = special.jacobi(u, motion.m1)
        size = motion.speed / motion.rate if motion.speed > 0.0 else 0.0
        return motion.middle + np.arctan2(size * sn, dn), motion.speed * cn
    halves, v = special.split_half_periods(u, motion.m1)
    sn, cn, dn = special.jacobi(v, motion.m1)
    turned = np.pi * halves + np.arctan2(sn, cn)
    return motion.middle + motion.sense * turned, motion.sense * motion.speed * dn


# Small librations about the orientation at rest in the orbit, and their stability.
#
# With k1 = (I2 - I3) / I1 of roll, k3 = (I2 - I1) / I3 of yaw and x = (lambda / n)^2 exponents
# lambda obey
#
#     x = -3 (I1 - I3) / I2                                    of pitch,
#     x^2 + (1 + 3 k1 + k1 k3) x + 4 k1 k3 = 0                 of roll and yaw.
#
# Sources: DeBra & Delp (1961), Journal of the Astronautical Sciences 8:14; Hughes, ch. 9.

Pair = tuple[complex, complex]


@dataclass(frozen=True)
class Librations:
    """Exponents of small librations.

    Attributes:
        roll_ratio: k1 = (I2 - I3) / I1.
        yaw_ratio: k3 = (I2 - I1) / I3.
        pitch_squared: lambda^2 of pitch [1/s^2].
        roll_yaw_squared: both lambda^2 of roll and yaw, the one of larger real part first [1/s^2].
        region: of stability: "Lagrange" where I2 > I1 > I3, "DeBra-Delp", or "unstable".
    """

    roll_ratio: float
    yaw_ratio: float
    pitch_squared: float
    roll_yaw_squared: Pair
    region: str


def librations(moments: ArrayLike, n: float) -> Librations:
    """Exponents of small departures from rest in the orbit, and whether it is stable.

    It is stable if pitch is, and if both roots x of roll and yaw are negative and differ. Roll and
    yaw of the region of DeBra and Delp are at a maximum of the energy: damping makes them unstable.

    Args:
        moments: about the axes of roll, pitch and yaw, shape (3,) [kg m^2].
        n: mean motion [rad/s].

    Returns:
        Ratios, exponents and region.

    Raises:
        ValueError: a wrong shape, a moment or n that is not positive, or no finite number.

    Source: DeBra & Delp 1961, Journal of the Astronautical Sciences 8:14.
    """
    checks.all_positive(n=n)
    I1, I2, I3 = (float(x) for x in checks.positive_array(moments, "moments", "kg m^2", 3))
    k1, k3 = (I2 - I3) / I1, (I2 - I1) / I3
    turning, pull = 1.0 + 3.0 * k1 + k1 * k3, 4.0 * k1 * k3
    roots, calm = _quadratic(turning, pull)
    squares = (roots[0] * n**2, roots[1] * n**2)
    region = ("Lagrange" if k1 > 0.0 else "DeBra-Delp") if calm and I1 > I3 else "unstable"
    return Librations(k1, k3, -3.0 * (I1 - I3) / I2 * n**2, squares, region)


def _quadratic(b: float, c: float) -> tuple[Pair, bool]:
    """Roots of x^2 + b x + c, the larger first, and whether both are negative and differ."""
    square = b * b - 4.0 * c
    if square < 0.0:
        part = 0.5 * math.sqrt(-square)
        return (complex(-0.5 * b, part), complex(-0.5 * b, -part)), False
    far = -0.5 * (b + math.copysign(math.sqrt(square), b))
    near = c / far if far != 0.0 else 0.0
    low, high = sorted((far, near))
    return (complex(high), complex(low)), low < high < 0.0


def libration_frequencies(moments: ArrayLike, n: float) -> Array:
    """Frequencies of small librations about rest in the orbit.

    Args:
        moments: about the axes of roll, pitch and yaw, shape (3,) [kg m^2].
        n: mean motion [rad/s].

    Returns:
        Of pitch, n sqrt(3 (I1 - I3) / I2), and of roll and yaw, the slower first, shape (3,)
        [rad/s].

    Raises:
        ValueError: as `librations`, or moments with which rest is unstable.

    Source: DeBra & Delp 1961, Journal of the Astronautical Sciences 8:14.
    """
    found = librations(moments, n)
    calm = found.region != "unstable"
    checks.require(calm, moments, "moments", "roll, pitch, yaw with which rest is stable")
    slow, fast = found.roll_yaw_squared
    return np.sqrt([-found.pitch_squared, -slow.real, -fast.real])


# Steady spin of a symmetric satellite about its axis, which is along the orbit's normal.
#
# Of a body with the moment C about its axis and A across, and the spin omega3 in space, take
# s = C / A and h = s omega3 / n. Small departures of the axis, seen in the orbit, have exponents
# with x = (lambda / n)^2 and
#
#     x^2 + (h^2 - 2 h + 3 s - 1) x + (h - 1) (h + 3 s - 4) = 0.
#
# Sources: Thomson (1962), Journal of the Astronautical Sciences 9:31; Hughes, ch. 10.


@dataclass(frozen=True)
class NormalSpin:
    """Small departures of the axis from the orbit's normal.

    Attributes:
        squares: both lambda^2 of the axis, seen in the orbit, the larger real part first [1/s^2].
        stable: whether both are negative and differ.
    """

    squares: Pair
    stable: bool


def normal_spin(*, i_perp: float, i3: float, omega3: float, n: float) -> NormalSpin:
    """Exponents of a symmetric satellite that spins about the orbit's normal.

    Args:
        i_perp: moment across the axis of symmetry [kg m^2].
        i3: moment about it [kg m^2].
        omega3: spin in space, positive in the sense of the orbit [rad/s].
        n: mean motion [rad/s].

    Returns:
        Exponents of the axis, and whether the spin is stable.

    Raises:
        ValueError: a moment or n that is not positive, or no finite number.

    Source: Thomson 1962, Journal of the Astronautical Sciences 9:31.
    """
    checks.all_positive(i_perp=i_perp, i3=i3, n=n)
    checks.all_finite(omega3=omega3)
    s = i3 / i_perp
    h = s * (omega3 / n)
    b, c = h * h - 2.0 * h + 3.0 * s - 1.0, (h - 1.0) * (h + 3.0 * s - 4.0)
    (high, low), stable = _quadratic(b, c)
    return NormalSpin((high * n**2, low * n**2), stable)


# Regression of a fast symmetric body, by the torque averaged over the orbit of what pulls it.
#
# Whether the body goes round the Earth, or Sun and Moon go round the body, is the same. The mean
# torque of a far mass on a circle is that of a ring, along the line of nodes of the equator:
# (3 / 2) n^2 (C - A) sin eps cos eps. The axis goes round the orbit's normal, at the tilt eps.
#
# Source: Goldstein, Poole & Safko, Classical Mechanics, sec. 5.8.


def regression(tilt: ArrayLike, *, i_perp: float, i3: float, omega3: float, n: float) -> Array:
    """Rate at which the axis of a fast symmetric satellite goes round the orbit's normal, averaged.

    (3 / 2) (n^2 / omega3) ((C - A) / C) cos(eps), up to parts of the order n / omega3.

    Args:
        tilt: eps, of the axis from the orbit's normal [rad], any shape.
        i_perp: A, moment across the axis of symmetry [kg m^2].
        i3: C, moment about it [kg m^2].
        omega3: spin [rad/s].
        n: mean motion [rad/s].

    Returns:
        Rate, of the shape of tilt [rad/s]: positive against the sense of the orbit.

    Raises:
        ValueError: a moment or n that is not positive, no spin, or no finite number.

    Source: Goldstein, Poole & Safko, sec. 5.8.
    """
    checks.all_positive(i_perp=i_perp, i3=i3, n=n)
    checks.require(checks.number(omega3, "omega3") != 0.0, omega3, "omega3", "a spin, not 0 rad/s")
    eps = checks.array(tilt, "tilt")
    return np.asarray(1.5 * (n / omega3) * n * ((i3 - i_perp) / i3) * np.cos(eps))


def precession_of_equinoxes(
    pulls: ArrayLike,
    eccentricities: ArrayLike,
    inclinations: ArrayLike,
    *,
    flattening: float,
    spin: float,
    obliquity: float,
) -> Array:
    """Rates at which far bodies make the equinoxes of a planet regress, averaged over their orbits.

    (3 / 2) (H / omega) cos(eps) K (1 - e^2)^(-3/2) (1 - (3/2) sin^2 i) with K = G M / a^3: of the
    Earth about 16 arcseconds a year by the Sun and 34 by the Moon.

    Args:
        pulls: K of each body, shape (k,) [1/s^2].
        eccentricities: e of their orbits, shape (k,).
        inclinations: i of their orbits to the ecliptic, shape (k,) [rad]; their nodes go round.
        flattening: H = (C - A) / C of the planet.
        spin: omega of the planet [rad/s].
        obliquity: eps, of the axis from the normal of the ecliptic [rad].

    Returns:
        Rates by each body, shape (k,) [rad/s], positive where retrograde.

    Raises:
        ValueError: wrong shapes, a pull that is not positive, an eccentricity that is not from 0 to
            below 1, no spin, or no finite number.

    Source: Goldstein, Poole & Safko, sec. 5.8.
    """
    checks.all_finite(flattening=flattening, obliquity=obliquity)
    checks.require(checks.number(spin, "spin") != 0.0, spin, "spin", "a spin, not 0 rad/s")
    K = checks.exact_array(pulls, "pulls", "n")
    checks.require(K > 0.0, K, "pulls", "positive numbers [1/s^2]")
    e = checks.exact_array(eccentricities, "eccentricities", len(K))
    i = checks.exact_array(inclinations, "inclinations", len(K))
    checks.require((e >= 0.0) & (e < 1.0), e, "eccentricities", "from 0 to below 1")
    mean = (1.0 - e * e) ** -1.5 * (1.0 - 1.5 * np.sin(i) ** 2)
    return np.asarray(1.5 * flattening * math.cos(obliquity) * (K / spin) * mean)


# Detumbling by the magnetic field: a dipole that is the gain k times omega x B.
#
# Its torque k (omega x B) x B = -k (B^2 omega - (B . omega) B) takes what is across the field, and
# works at -k |omega x B|^2. A magnetometer on the body sees B change at dB/dt = D - omega x B, with
# D what the field changes by itself, in space. The law m = -k dB/dt works at
#
#     T' = m x B . omega = -k |omega x B|^2 + k D . (omega x B),
#
# so the kinetic energy T falls where |omega x B| > |D|. It need not where the body turns as slowly
# as the field.
#
# Sources: Stickler & Alfriend (1976), Journal of Spacecraft and Rockets 13:282.


def detumble(
    t: ArrayLike, omega0: ArrayLike, field: ArrayLike, *, gain: float, moment: float
) -> Array:
    """Angular velocity of a sphere under m = k omega x B in a field that is fixed in space.

    The part along B stays, the part across decays as exp(-k B^2 t / I).

    Args:
        t: times [s], any shape.
        omega0: angular velocity at t = 0, world axes, shape (3,) [rad/s].
        field: B, world axes, shape (3,) [T].
        gain: k [A m^2 s/T].
        moment: I, about any axis [kg m^2].

    Returns:
        omega, world axes, shape (..., 3) [rad/s].

    Raises:
        ValueError: a wrong shape, a gain or moment that is not positive, no field, or no finite
            number.

    Source: Stickler & Alfriend 1976, Journal of Spacecraft and Rockets 13:282.
    """
    checks.all_positive(gain=gain, moment=moment)
    start, B = checks.exact_array(omega0, "omega0", 3), checks.exact_array(field, "field", 3)
    checks.require(bool(np.any(B != 0.0)), B, "field", "a field that is not 0 T")
    e = B / np.linalg.norm(B)
    along = (e @ start) * e
    rate = gain * float(B @ B) / moment
    left = np.exp(-rate * checks.array(t, "t"))
    return np.asarray(along + left[..., None] * (start - along))


def detumbling_power(omega: ArrayLike, field: ArrayLike, field_rate: ArrayLike) -> Array:
    """Power T' / k of the law m = -k dB/dt, where B is seen to change in the body.

    -|omega x B|^2 + D . (omega x B). With D = 0 it is that of the law m = k omega x B: never
    positive.

    Args:
        omega: angular velocity, shape (..., 3) [rad/s].
        field: B, in the same axes, shape (..., 3) [T].
        field_rate: D, change of B in space, in the same axes, shape (..., 3) [T/s].

    Returns:
        Power on the kinetic energy per gain, shape (...) [T^2/s^2].

    Raises:
        ValueError: a wrong shape, or no finite number.

    Source: Stickler & Alfriend 1976, Journal of Spacecraft and Rockets 13:282.
    """
    rates, B = checks.array(omega, "omega", 3), checks.array(field, "field", 3)
    seen = np.cross(rates, B)
    return np.asarray(np.sum((checks.array(field_rate, "field_rate", 3) - seen) * seen, axis=-1))
