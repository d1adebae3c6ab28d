"""Spheroids on a plane: sliding balls, nutation without friction, rising and tumbling."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from rigid_envs.base import checks
from rigid_envs.base.checks import Array

# A ball that slides: its slip keeps its direction, and what it loses of it, in the part
# beta / (1 + beta), goes into the velocity of its centre.


@dataclass(frozen=True)
class Slide:
    """A ball that slides on the level, at given times; world axes, z up.

    Attributes:
        position: of the centre, from its start, shape (..., 2) [m].
        velocity: of the centre, shape (..., 2) [m/s].
        omega: angular velocity, shape (..., 3) [rad/s].
        slip: velocity of the ball's point at the contact, shape (..., 2) [m/s].
    """

    position: Array
    velocity: Array
    omega: Array
    slip: Array


def slide_with_drag(
    t: ArrayLike,
    velocity: ArrayLike,
    omega: ArrayLike,
    *,
    beta: float,
    radius: float,
    drag: float,
    g: float,
) -> Slide:
    """A ball under viscous friction -drag N u at the slip u = v + omega x (-radius e_z).

    u' = -k u with k = drag g (1 + 1 / beta): the slip decays exponentially.

    Args:
        t: times, any shape [s].
        velocity: of the centre at t = 0, shape (2,) [m/s], world.
        omega: angular velocity at t = 0, shape (3,) [rad/s], world; omega_z does not change.
        beta: inertia ratio I / (m radius^2).
        radius: of the ball [m].
        drag: coefficient of viscous friction [s/m].
        g: gravity [m/s^2].

    Raises:
        ValueError: a wrong shape, or a parameter that is not positive.

    Source: Newton's and Euler's laws; Sommerfeld, Mechanics, par. 27, with another friction.
    """
    checks.all_positive(drag=drag, g=g)
    ball, times = _ball(velocity, omega, beta, radius), checks.array(t, "t")
    rate = drag * g * (1.0 + 1.0 / beta)
    return ball.at(times, np.exp(-rate * times), -np.expm1(-rate * times) / rate)


def slide_with_friction(
    t: ArrayLike,
    velocity: ArrayLike,
    omega: ArrayLike,
    *,
    beta: float,
    radius: float,
    mu: float,
    slip_speed: float,
    g: float,
) -> Slide:
    """A ball under the friction -mu N u / sqrt(u^2 + slip_speed^2), u its slip.

    With w = sqrt(u^2 + s^2), s the slip_speed, u' = -k u / w with k = mu g (1 + 1 / beta), so that

        k t = G(u0) - G(u),   G = w + s log(u / (w + s)),
        k int u dt = H(u0) - H(u),   H = (u w + s^2 arsinh(u / s)) / 2.

    For s -> 0 it is Coulomb's friction: the slip falls linearly, and is gone at the time
    abs(u0) / k. G is convex in log(u), so that Newton's method finds u from its start.

    Args:
        t: times from 0 on, any shape [s].
        velocity: of the centre at t = 0, shape (2,) [m/s], world.
        omega: angular velocity at t = 0, shape (3,) [rad/s], world; omega_z does not change.
        beta: inertia ratio I / (m radius^2).
        radius: of the ball [m].
        mu: coefficient of sliding friction.
        slip_speed: slip below which friction falls [m/s].
        g: gravity [m/s^2].

    Raises:
        ValueError: a wrong shape, a negative time, or a parameter that is not positive.

    Source: Newton's and Euler's laws; Sommerfeld, Mechanics, par. 27, where s = 0.
    """
    checks.all_positive(mu=mu, slip_speed=slip_speed, g=g)
    ball, times = _ball(velocity, omega, beta, radius), checks.array(t, "t")
    checks.require(times >= 0.0, times, "t", "at least 0, the start [s]")
    rate = mu * g * (1.0 + 1.0 / beta) / slip_speed
    start = float(np.hypot(*ball.slip)) / slip_speed
    if start == 0.0:
        return ball.at(times, np.zeros_like(times), np.zeros_like(times))
    y = np.full_like(times, math.log(start))
    goal = _lag(y) - rate * times
    for _ in range(_ROUNDS):
        y = y - (_lag(y) - goal) / np.hypot(np.exp(y), 1.0)
    u = np.exp(y)
    path = 0.5 * (start * math.hypot(start, 1.0) - u * np.hypot(u, 1.0))
    path = (path + 0.5 * (math.asinh(start) - np.arcsinh(u))) / (rate * start)
    return ball.at(times, u / start, path)


_ROUNDS = 100  # of Newton's method; the slip falls at most by the factor e in each of the first


def _lag(y: Array) -> Array:
    """G / s = w + log(u / (w + 1)) at u = exp(y), w = sqrt(u^2 + 1)."""
    w = np.hypot(np.exp(y), 1.0)
    return np.asarray(w + y - np.log1p(w))


@dataclass(frozen=True)
class _Ball:
    """Motion and slip of a ball at t = 0, and what a lost unit of slip does to the rest."""

    velocity: Array
    omega: Array
    slip: Array
    beta: float
    radius: float

    def at(self, t: Array, left: Array, path: Array) -> Slide:
        """The motion when a part is left of the slip, and its integral over time is path [s]."""
        lost, share = (1.0 - left)[..., None] * self.slip, self.beta / (1.0 + self.beta)
        slipped = (t - path)[..., None] * self.slip
        torque = np.stack([-lost[..., 1], lost[..., 0], 0.0 * left], axis=-1)
        return Slide(
            position=t[..., None] * self.velocity - share * slipped,
            velocity=self.velocity - share * lost,
            omega=self.omega + torque / ((1.0 + self.beta) * self.radius),
            slip=left[..., None] * self.slip,
        )


def _ball(velocity: ArrayLike, omega: ArrayLike, beta: float, radius: float) -> _Ball:
    checks.all_positive(beta=beta, radius=radius)
    v, w = checks.exact_array(velocity, "velocity", 2), checks.exact_array(omega, "omega", 3)
    return _Ball(v, w, v + radius * np.array([-w[1], w[0]]), beta, radius)


# Without friction: nutation of a body on a smooth plane.


@dataclass(frozen=True)
class Nutation:
    """The nodding of a body of revolution on a smooth plane.

    Attributes:
        energy: kinetic and potential, without that of the horizontal velocity [J].
        p_phi: vertical momentum [N m s].
        p_psi: spin momentum about the axis [N m s].
        theta_min: smallest angle of the axis from the vertical [rad].
        theta_max: largest such angle [rad].
        period: time from one smallest angle to the next [s].
    """

    energy: float
    p_phi: float
    p_psi: float
    theta_min: float
    theta_max: float
    period: float


_GRID, _NODES = 4000, 512


def nutation(
    theta: float,
    phi_rate: float,
    omega3: float,
    *,
    m: float,
    radius: float,
    half_height: float,
    offset: float,
    i_perp: float,
    i3: float,
    g: float,
) -> Nutation:
    """Find turning points and period of the tilt on a smooth plane, started where it turns.

    The centre of mass moves straight on above the plane, z = h - offset cos(theta) high, with
    h^2 = radius^2 sin^2 + half_height^2 cos^2, and p_phi and p_psi are kept:

        (A + m z'(theta)^2) theta'^2 / 2 + V(theta) = E,
        V = (p_phi - p_psi cos(theta))^2 / (2 A sin^2(theta)) + p_psi^2 / (2 C) + m g z(theta).

    The other turning point is the next zero of E - V. The period is 2 int dtheta / theta', by the
    trapezoidal rule in the angle s of theta = mean + half the swing times sin(s), in which it
    converges geometrically. It is good to some eps / (swing^2).

    Args:
        theta: angle of the axis from the vertical where theta' = 0, above 0, below pi [rad].
        phi_rate: phi' there [rad/s].
        omega3: axial angular velocity psi' + phi' cos(theta) [rad/s]; not 0.
        m: mass [kg].
        radius: semi-axis across the axis [m].
        half_height: semi-axis along it [m].
        offset: of the centre of mass from the centre, against the axis [m].
        i_perp: A, moment across the axis about the centre of mass [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter outside its range, or no turning point between 0 and pi is another.

    Source: Landau & Lifshitz, Mechanics, par. 35, for a top; Routh, Advanced Part, par. 246.
    """
    body = _Body.checked(m, radius, half_height, offset, i_perp, i3, g)
    angle = float(checks.between(checks.number(theta, "theta"), "theta", 0.0, math.pi))
    rate, spin = checks.number(phi_rate, "phi_rate"), checks.number(omega3, "omega3")
    checks.require(spin != 0.0, omega3, "omega3", "a spin: without one, it may fall through 0")
    b = i3 / i_perp * spin
    a = rate * math.sin(angle) ** 2 + b * math.cos(angle)
    level = body.potential(angle, a, b)
    unit = max(a * a, b * b, m / i_perp * g * radius)

    def kinetic(x: float) -> float:
        return float((level - body.potential(x, a, b)) / unit)

    other = _other_turn(angle, kinetic)
    low, high = min(angle, other), max(angle, other)
    s = (np.arange(_NODES) + 0.5) * (math.pi / _NODES) - 0.5 * math.pi
    half = 0.5 * (high - low)
    x = low + half * (1.0 + np.sin(s))
    slope = body.rise(x)
    speed = np.sqrt(2.0 * (level - body.potential(x, a, b)) / (1.0 + m / i_perp * slope * slope))
    period = 2.0 * math.pi / _NODES * float(np.sum(half * np.cos(s) / speed))
    energy = i_perp * float(level) + 0.5 * i3 * spin * spin
    return Nutation(energy, i_perp * a, i_perp * b, low, high, period)


def _other_turn(start: float, kinetic: Callable[[float], float]) -> float:
    """The zero of a function next to one that it has already, on the side where it is positive."""
    step = 1e-5
    way = 1.0 if kinetic(start + step) > kinetic(start - step) else -1.0
    end = math.pi if way > 0.0 else 0.0
    steps = start + (end - start) * np.linspace(0.0, 1.0, _GRID + 1)[1:-1]
    before = start + way * min(step, 0.5 * abs(end - start))
    for x in steps:
        if kinetic(x) < 0.0:
            expected = "a tilt further from that of a steady precession"
            checks.require(kinetic(before) > 0.0, start, "theta", expected)
            return float(brentq(kinetic, before, x, xtol=1e-15, rtol=1e-15))
        before = x if abs(x - start) > step else before
    raise ValueError(f"theta = {start}; expected a tilt that has another turning point beside it")


@dataclass(frozen=True)
class _Body:
    """A spheroid with its moments, checked."""

    m: float
    radius: float
    half_height: float
    offset: float
    i_perp: float
    i3: float
    g: float

    @classmethod
    def checked(
        cls,
        m: float,
        radius: float,
        half_height: float,
        offset: float,
        i_perp: float,
        i3: float,
        g: float,
    ) -> "_Body":
        """The body, unless a number is none, or none of its kind."""
        checks.all_positive(m=m, radius=radius, half_height=half_height)
        checks.all_positive(i_perp=i_perp, i3=i3, g=g)
        inside = f"from {-half_height} to {half_height} m: the body holds its own centre"
        ok = abs(checks.number(offset, "offset")) < half_height
        checks.require(ok, offset, "offset", inside)
        return cls(m, radius, half_height, offset, i_perp, i3, g)

    def height(self, theta: ArrayLike) -> Array:
        """Height of the centre of mass [m]."""
        c, s = np.cos(theta), np.sin(theta)
        return np.asarray(np.hypot(self.radius * s, self.half_height * c) - self.offset * c)

    def rise(self, theta: ArrayLike) -> Array:
        """Its derivative by theta [m]."""
        c, s = np.cos(theta), np.sin(theta)
        r, h = self.radius, self.half_height
        return np.asarray((r - h) * (r + h) * s * c / np.hypot(r * s, h * c) + self.offset * s)

    def potential(self, theta: ArrayLike, a: float, b: float) -> Array:
        """V without the constant part, over A, where p_phi = A a and p_psi = A b [1/s^2]."""
        turn = (a - b * np.cos(theta)) / np.sin(theta)
        weight = self.m * self.g / self.i_perp
        return np.asarray(0.5 * turn * turn + weight * self.height(theta))


# Small tilts of a body that spins upright with viscous friction.


def upright_exponents(
    spin: float,
    *,
    m: float,
    radius: float,
    half_height: float,
    offset: float,
    i_perp: float,
    i3: float,
    drag: float,
    g: float,
) -> tuple[complex, complex, complex]:
    """Exponents of the small motions of a body that spins about its vertical axis.

    The axis has the complex tilt w = e_x + i e_y, the centre of mass the velocity V. With the
    radius of curvature R = radius^2 / half_height at the contact, the height z = half_height -
    offset, the spin n and k = drag g the slip is u = V - z w' + i n R w, and

        V' = -k u,   A w'' - i C n w' + m g (R - z) w = m k z u,

    so that w = exp(x t), V = -k u / x with

        (x + k) (A x^2 - i C n x + m g (R - z)) + m k z x (z x - i n R) = 0.

    Where x = i n R / z is a root the body rolls without slip: that is the threshold of stability.
    A body upside down is one whose offset has the other sign.

    Args:
        spin: n, about the upward vertical [rad/s].
        m: mass [kg].
        radius: semi-axis across the axis [m].
        half_height: semi-axis along it [m].
        offset: of the centre of mass from the centre, downwards [m].
        i_perp: A, moment across the axis about the centre of mass [kg m^2].
        i3: C, axial moment [kg m^2].
        drag: slope of friction over m g at small slip, with mu that of `Spheroid` it is
            drag + mu / slip_speed [s/m].
        g: gravity [m/s^2].

    Returns:
        Exponents [1/s], the one that grows fastest first.

    Raises:
        ValueError: a parameter outside its range.

    Source: Cohen 1977, doi:10.1119/1.10926; Bou-Rabee, Marsden & Romero 2004, SIAM J. Appl. Dyn.
        Syst. 3:352, doi:10.1137/030601351.
    """
    body = _Body.checked(m, radius, half_height, offset, i_perp, i3, g)
    checks.positive(drag, "drag")
    n, k = checks.number(spin, "spin"), drag * body.g
    R, z = radius * (radius / half_height), half_height - offset
    share, gyro, pull = m / i_perp * z, i3 / i_perp * n, m / i_perp * g * (R - z)
    unit = max(k * (1.0 + share * z), abs(n), math.sqrt(abs(pull)))  # roots of numbers near 1
    k, n, gyro, pull = k / unit, n / unit, gyro / unit, pull / unit / unit
    polynomial = [
        1.0,
        k - 1j * gyro + share * z * k,
        pull - 1j * k * gyro - 1j * k * share * n * R,
        k * pull,
    ]
    first, second, third = sorted(np.roots(polynomial) * unit, key=lambda x: (-x.real, x.imag))
    return complex(first), complex(second), complex(third)


# Motions of a loaded sphere without slip, at a given value of Jellett's integral.


@dataclass(frozen=True)
class Tumbling:
    """A steady motion of a loaded sphere without slip: it turns about a line that rests.

    Attributes:
        theta: tilt of its axis [rad].
        omega: angular velocity, along the line from the contact to the centre of mass [rad/s].
        energy: above that of a centre of mass at the height of the centre of the sphere [J].
        stable: whether friction leads there.
    """

    theta: float
    omega: float
    energy: float
    stable: bool


def no_slip_potential(
    theta: ArrayLike,
    p_jellett: float,
    *,
    m: float,
    radius: float,
    offset: float,
    i_perp: float,
    i3: float,
    g: float,
) -> Array:
    """Least energy of a loaded sphere at a tilt, at a value J of Jellett's integral [J].

    The integral is given over the radius: p_jellett = L . (e_z - offset / r e3).

    V = J^2 / (2 D) - m g offset cos(theta), D = A r^2 sin^2(theta) + C (r cos(theta) - offset)^2:
    that of a turn about the line from the contact to the centre of mass, where nothing slips.
    Friction keeps J = L . (r e_z - offset e3) and lowers the energy, so that the motion ends at
    a minimum of V.

    Args:
        theta: tilt of the axis, any shape [rad].
        p_jellett: J / r [N m s].
        m: mass [kg].
        radius: r, of the sphere [m].
        offset: of the centre of mass from the centre of the sphere, below the radius [m].
        i_perp: A, moment across the axis about the centre of mass [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Raises:
        ValueError: a parameter outside its range.

    Source: Ebenfeld & Scheck 1995, Ann. Phys. 243:195, doi:10.1006/aphy.1995.1097; Jellett 1872,
        A Treatise on the Theory of Friction, chapter 8.
    """
    angle, p = checks.array(theta, "theta"), checks.number(p_jellett, "p_jellett")
    body = _Body.checked(m, radius, radius, offset, i_perp, i3, g)
    c, s = np.cos(angle), np.sin(angle)
    share = _share(body, c, s)
    turning = p / i_perp
    return np.asarray(i_perp * (0.5 * turning * turning / share - m / i_perp * g * offset * c))


def _share(body: _Body, c: ArrayLike, s: ArrayLike) -> Array:
    """D / (A r^2)."""
    arm = np.asarray(c) - body.offset / body.radius
    return np.asarray(np.square(s) + body.i3 / body.i_perp * arm * arm)


def tumbling(
    p_jellett: float,
    *,
    m: float,
    radius: float,
    offset: float,
    i_perp: float,
    i3: float,
    g: float,
) -> tuple[Tumbling, ...]:
    """Find the steady motions without slip between upright and upside down.

    They are the extrema of the `no_slip_potential`: with x = cos(theta),

        m g offset D(x)^2 = J^2 r ((A - C) r x + C offset),

    a quartic. Minima are stable.

    Args:
        p_jellett: J / r [N m s].
        m: mass [kg].
        radius: r, of the sphere [m].
        offset: of the centre of mass from the centre of the sphere, below the radius [m].
        i_perp: A, moment across the axis about the centre of mass [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Returns:
        The motions by rising tilt; none where the axis goes to one of the verticals.

    Raises:
        ValueError: a parameter outside its range.

    Source: Ebenfeld & Scheck 1995, doi:10.1006/aphy.1995.1097; Bou-Rabee, Marsden & Romero 2004,
        doi:10.1137/030601351.
    """
    checks.number(p_jellett, "p_jellett")
    sphere = _Body.checked(m, radius, radius, offset, i_perp, i3, g)
    e, c = offset / radius, i3 / i_perp
    turning, weight = p_jellett / i_perp, m / i_perp * g * offset
    square, unit = turning * turning, max(turning * turning, abs(weight))
    share = np.array([c - 1.0, -2.0 * c * e, 1.0 + c * e * e])
    # dV / dtheta is sin(theta) slope(x) / D^2
    slope = np.polysub(
        weight / unit * np.polymul(share, share), square / unit * np.array([1.0 - c, c * e])
    )
    found = []
    for x in _roots_inside(np.asarray(slope, dtype=np.float64)):
        D = float(_share(sphere, x, math.sqrt(1.0 - x * x)))
        found.append(
            Tumbling(
                theta=math.acos(x),
                omega=turning / D * math.sqrt(1.0 - 2.0 * e * x + e * e),
                energy=i_perp * (0.5 * square / D - weight * x),
                stable=bool(np.polyval(np.polyder(slope), x) < 0.0),
            )
        )
    return tuple(found)


def _roots_inside(polynomial: Array) -> list[float]:
    """Simple real roots between -1 and 1, the largest first."""
    rising = np.polyder(polynomial)
    found = []
    for root in np.roots(polynomial):
        x = float(root.real)
        for _ in range(3):  # the rounding of the eigenvalues
            x -= float(np.polyval(polynomial, x) / np.polyval(rising, x))
        if abs(root.imag) < 1e-6 and abs(x) < 1.0:
            found.append(x)
    return sorted(found, reverse=True)


def jellett_thresholds(
    *, m: float, radius: float, offset: float, i_perp: float, i3: float, g: float
) -> tuple[float, float]:
    """Values of Jellett's integral above which a loaded sphere rises, and stands upside down.

    V of `no_slip_potential` has a maximum at theta = 0 if J is above the first, and a minimum at
    pi if it is above the second:

        J^2 r (A r - C (r - a)) = m g a C^2 (r - a)^4,
        J^2 r (C (r + a) - A r) = m g a C^2 (r + a)^4.

    A tippe top turns over if J is above both.

    Args:
        m: mass [kg].
        radius: r, of the sphere [m].
        offset: a, of the centre of mass from the centre of the sphere, positive and below r [m].
        i_perp: A, moment across the axis about the centre of mass [kg m^2].
        i3: C, axial moment [kg m^2].
        g: gravity [m/s^2].

    Returns:
        Both values of J / r [N m s]; infinite where there is none.

    Raises:
        ValueError: a parameter outside its range.

    Source: Cohen 1977, doi:10.1119/1.10926; Ebenfeld & Scheck 1995, doi:10.1006/aphy.1995.1097.
    """
    _Body.checked(m, radius, radius, checks.positive(offset, "offset"), i_perp, i3, g)
    e, c = offset / radius, i3 / i_perp
    weight = math.sqrt(m / i_perp * g * offset)
    found = []
    for arm, lever in ((1.0 - e, 1.0 - c * (1.0 - e)), (1.0 + e, c * (1.0 + e) - 1.0)):
        rate = weight * c * arm * arm / math.sqrt(lever) if lever > 0.0 else math.inf
        found.append(i_perp * rate)
    rise, stand = found
    return rise, stand


# A spinning egg: gyroscopic balance.


def gyroscopic_spin(
    theta: ArrayLike,
    p_jellett: float,
    *,
    radius: float,
    half_height: float,
    i_perp: float,
    i3: float,
) -> tuple[Array, Array]:
    """Precession and axial spin of a fast spheroid that does not nod.

    Its angular momentum A Omega is vertical, C omega3 = A Omega cos(theta); gravity and friction
    are weak beside it. Friction then keeps Jellett's integral

        J = A Omega h(theta),  h^2 = radius^2 sin^2(theta) + half_height^2 cos^2(theta),

    and takes energy, J^2 / (2 A h^2), so that h grows: an egg rises. It holds to the part
    m g radius / (A Omega^2), and so far as friction changes little in a turn.

    Args:
        theta: tilt of the axis, any shape [rad].
        p_jellett: J / r [N m s].
        radius: semi-axis across the axis [m].
        half_height: semi-axis along it [m].
        i_perp: A, moment across the axis about the centre [kg m^2].
        i3: C, axial moment [kg m^2].

    Returns:
        Omega and omega3, of the shape of theta [rad/s].

    Raises:
        ValueError: a parameter outside its range.

    Source: Moffatt & Shimomura 2002, doi:10.1038/416385a.
    """
    checks.all_positive(radius=radius, half_height=half_height, i_perp=i_perp, i3=i3)
    angle, p = checks.array(theta, "theta"), checks.number(p_jellett, "p_jellett")
    h = np.hypot(radius * np.sin(angle), half_height * np.cos(angle))
    precession = p / i_perp * (radius / h)
    return precession, i_perp / i3 * precession * np.cos(angle)
