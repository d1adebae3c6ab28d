"""Steady circles of a rolling disk: theta, phi' and omega3 constant."""

import math
from dataclasses import dataclass

from rigid_envs.analytic.rolling_disk._disk import Disk, disk_of
from rigid_envs.checks import all_positive, between, number, positive, require

__all__ = [
    "SteadyCircle",
    "lean_frequency_squared",
    "stationary_centre_precession",
    "steady_circle",
    "steady_precession",
]


@dataclass(frozen=True)
class SteadyCircle:
    """A disk that rolls round a circle at constant lean.

    Attributes:
        precession: phi' [rad/s].
        omega3: axial angular velocity psi' + phi' cos(theta) [rad/s].
        spin: psi' [rad/s].
        contact_radius: of the circle of the contact, -radius psi' / phi' [m]; negative where the
            contact lies on the other side of the circle's centre.
        centre_radius: of the circle of the disk's centre, contact_radius - radius cos(theta) [m].
        frequency_squared: of small oscillations of the lean [1/s^2]; unstable where negative.
    """

    precession: float
    omega3: float
    spin: float
    contact_radius: float
    centre_radius: float
    frequency_squared: float


def steady_circle(
    theta: float,
    contact_radius: float,
    *,
    m: float,
    radius: float,
    i_perp: float,
    i3: float,
    g: float,
) -> SteadyCircle:
    """Find the steady motion with a given lean on a given circle, with phi' > 0.

    Rolling is psi' = -phi' contact_radius / radius, and with B = C + m radius^2

        phi'^2 sin(theta) (A cos(theta) + B (contact_radius / radius - cos(theta)))
            = m g radius cos(theta).

    The mirror image, all rates negative, is the other one.

    Args:
        theta: angle of the axis from the vertical, above 0 and below pi [rad].
        contact_radius: of the circle that the contact runs on [m].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter outside its range, or no rate balances the lean on this circle.

    Source: O'Reilly (1996); Routh, Advanced Part, par. 244.
    """
    disk = _checked(theta, m, radius, i_perp, i3, g)
    sine, cosine = math.sin(theta), math.cos(theta)
    apart = number(contact_radius, "contact_radius") / radius - cosine
    grip = disk.i_perp * cosine + disk.axial * apart
    expected = (
        f"one further outside at theta = {theta}: there the disk's inertia turns it down as its "
        "weight does"
    )
    require(cosine * grip > 0.0, contact_radius, "contact_radius", expected)
    precession = math.sqrt(g / radius * cosine / (sine * grip))
    return _circle(theta, precession, -precession * apart, disk, g)


def steady_precession(
    theta: float, omega3: float, *, m: float, radius: float, i_perp: float, i3: float, g: float
) -> tuple[SteadyCircle, SteadyCircle]:
    """Find both steady motions with a given lean and axial angular velocity.

    The roots of A sin(theta) cos(theta) phi'^2 - B omega3 sin(theta) phi' = m g radius cos(theta),
    of opposite signs: the slow one, near -m g radius cot(theta) / (B omega3) for fast rolling, and
    the fast one, near B omega3 / (A cos(theta)).

    Args:
        theta: angle of the axis from the vertical, above 0, below pi, not upright [rad].
        omega3: axial angular velocity [rad/s]; at 0 the centre stands still, turning either way.
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Returns:
        The slow motion and the fast one.

    Raises:
        ValueError: a parameter outside its range.

    Source: O'Reilly (1996); Routh, Advanced Part, par. 244.
    """
    disk = _checked(theta, m, radius, i_perp, i3, g)
    sine, cosine = math.sin(theta), math.cos(theta)
    weight, square = g / radius * cosine, disk.i_perp * sine * cosine
    push = disk.axial * number(omega3, "omega3") * sine
    # Both roots from the one sum that does not cancel.
    total = push + math.copysign(math.sqrt(push * push + 4.0 * square * weight), push)
    rates = -2.0 * weight / total, total / (2.0 * square)
    slow, fast = (_circle(theta, rate, omega3, disk, g) for rate in rates)
    return slow, fast


def stationary_centre_precession(
    theta: float, *, m: float, radius: float, i_perp: float, g: float
) -> float:
    """Precession rate phi' of a disk whose centre is at rest [rad/s].

    A phi'^2 sin(theta) = m g radius with omega3 = 0: 4 g / (radius sin(theta)) for a disk, Euler's
    disk, which quickens as it settles. The contact runs round a circle of radius
    radius cos(theta), and the face turns only with phi' (1 - cos(theta)).

    Args:
        theta: angle of the axis from the vertical, which is that of the disk from the floor [rad].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter outside its range.

    Source: Moffatt (2000), Nature 404:833, doi:10.1038/35009017.
    """
    all_positive(m=m, radius=radius, i_perp=i_perp, g=g)
    between(number(theta, "theta"), "theta", 0.0, math.pi)
    return math.sqrt(m * g * radius / (i_perp * math.sin(theta)))


def lean_frequency_squared(
    theta: float,
    precession: float,
    omega3: float,
    *,
    m: float,
    radius: float,
    i_perp: float,
    i3: float,
    g: float,
) -> float:
    """Square of the frequency of small oscillations of the lean about a steady motion [1/s^2].

    J frequency^2 = B C / A omega3^2 - (B + 2 C) p omega3 cot(theta)
        + (m radius^2 + A + 3 A cot^2(theta)) p^2 - m g radius sin(theta),  p = phi' sin(theta).

    Args:
        theta: angle of the axis from the vertical, above 0 and below pi [rad].
        precession: phi' [rad/s].
        omega3: axial angular velocity [rad/s].
        m: mass [kg].
        radius: of the rim [m].
        i_perp: A, moment about a diameter [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter outside its range.

    Source: O'Reilly (1996).
    """
    disk = _checked(theta, m, radius, i_perp, i3, g)
    rate, axial = number(precession, "precession"), number(omega3, "omega3")
    return _frequency_squared(theta, rate, axial, disk, g)


def _checked(theta: float, m: float, radius: float, i_perp: float, i3: float, g: float) -> Disk:
    """The disk, after lean and gravity are checked, too."""
    positive(g, "g")
    between(number(theta, "theta"), "theta", 0.0, math.pi)
    return disk_of(m=m, radius=radius, i_perp=i_perp, i3=i3)


def _circle(theta: float, precession: float, omega3: float, disk: Disk, g: float) -> SteadyCircle:
    """All numbers of the steady motion with these three."""
    spin = omega3 - precession * math.cos(theta)
    return SteadyCircle(
        precession=precession,
        omega3=omega3,
        spin=spin,
        contact_radius=-disk.radius * spin / precession,
        centre_radius=-disk.radius * omega3 / precession,
        frequency_squared=_frequency_squared(theta, precession, omega3, disk, g),
    )


def _frequency_squared(
    theta: float, precession: float, omega3: float, disk: Disk, g: float
) -> float:
    """The curvature of the effective potential over J, at given rates."""
    sine, cotangent = math.sin(theta), math.cos(theta) / math.sin(theta)
    p = precession * sine
    turning = (
        disk.axial * disk.i3 / disk.i_perp * omega3 * omega3
        - (disk.axial + 2.0 * disk.i3) * p * omega3 * cotangent
        + (disk.tipping + 3.0 * disk.i_perp * cotangent * cotangent) * p * p
    )
    return (turning - g / disk.radius * sine) / disk.tipping
