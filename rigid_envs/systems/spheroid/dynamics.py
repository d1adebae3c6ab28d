"""Spheroid with friction on the plane z = 0: tippe top, spinning egg, ball that slides.

State y = (q, omega, X, Y, VX, VY): attitude, angular velocity in body axes, position and velocity
of the centre of mass. The axis is e3; the centre of mass is at -offset e3 from the centre of the
spheroid. The body touches the plane always: its height follows from gamma = R^T e_z, and its
vertical velocity from the rate of that.

With the semi-axes b (across e3) and c (along it), h = sqrt(b^2 (1 - gamma3^2) + c^2 gamma3^2) is
the height of the centre of the spheroid, and the contact lies at rho = kappa e3 - (b^2 / h) gamma
from the centre of mass, in body axes, kappa = offset + (b^2 - c^2) gamma3 / h. The normal force N
has the moment N rho x gamma = N kappa e, with e = e3 x gamma; the centre of mass is
b^2 / h - kappa gamma3 high, and rises at -kappa gamma3'.
"""

from typing import NamedTuple

from rigid_envs.engine import algebra
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.dynamics import Dynamics, unchanged
from rigid_envs.engine.elementary import fma, sign, sqrt


class State(NamedTuple):
    """Attitude q, angular velocity in body axes [rad/s], centre of mass [m] and its velocity."""

    w: float = 1.0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    omega1: float = 0.0
    omega2: float = 0.0
    omega3: float = 0.0
    X: float = 0.0
    Y: float = 0.0
    VX: float = 0.0
    VY: float = 0.0


class Input(NamedTuple):
    """Torque in body axes [N m], horizontal force at the centre of mass [N]."""

    tau1: float
    tau2: float
    tau3: float
    FX: float
    FY: float


class Parameters(NamedTuple):
    """m [kg], semi-axes and offset [m], I1, I3 [kg m^2], g [m/s^2], friction, and more.

    Friction is ``-(mu / sqrt(v^2 + slip_speed^2) + drag) N v`` at the slip v; see `derive`.
    """

    m: float
    radius: float
    half_height: float
    offset: float
    I1: float
    I3: float
    g: float
    mu: float
    slip_speed: float
    drag: float
    inverse_m: float
    inverse1: float
    inverse3: float
    ratio: float
    square: float
    flatness: float
    stiffness: float
    natural: float


class Invariants(NamedTuple):
    """Energy [J], vertical and spin momentum [N m s]; Jellett's integral [N m^2 s]."""

    energy: float
    L_vertical: float
    L_spin: float
    jellett: float


@scalar
def derive(
    m: float,
    radius: float,
    half_height: float,
    offset: float,
    I1: float,
    I3: float,
    g: float,
    mu: float,
    slip_speed: float,
    drag: float,
) -> Parameters:
    """Parameter row of the physical parameters.

    It adds 1 / m, 1 / I1, 1 / I3, I3 / I1, b^2, b^2 - c^2, the larger ratio of the semi-axes, and
    a rate: of the pendulum that gravity makes, and of the decay of slip by friction.
    """
    square, flatness = radius * radius, radius * radius - half_height * half_height
    least, most = min(radius, half_height), max(radius, half_height)
    swing = sqrt(m * g * (abs(offset) + abs(flatness) / least) / I1)
    arm = most + abs(offset)
    decay = g * (mu / slip_speed + drag) * (1.0 + m * arm * arm / min(I1, I3))
    return Parameters(
        *(m, radius, half_height, offset, I1, I3, g, mu, slip_speed, drag),
        *(1.0 / m, 1.0 / I1, 1.0 / I3, I3 / I1),
        *(square, flatness, most / least, swing + decay),
    )


class Place(NamedTuple):
    """Geometry of the contact at an attitude: gamma, kappa, b^2 / h, 1 / h, and sin(theta)^2."""

    g1: float
    g2: float
    g3: float
    kappa: float
    reach: float
    inverse_h: float
    s2: float


@scalar
def place(gamma: algebra.Vector, p: Parameters) -> Place:
    """The contact where the vertical is gamma, in body axes."""
    g1, g2, g3 = gamma
    inverse_h = 1.0 / sqrt(fma(-p.flatness * g3, g3, p.square))
    kappa = fma(p.flatness * g3, inverse_h, p.offset)
    return Place(g1, g2, g3, kappa, p.square * inverse_h, inverse_h, fma(g1, g1, g2 * g2))


@scalar
def slip(omega: algebra.Vector, v: algebra.Vector, at: Place) -> algebra.Vector:
    """Velocity of the material point at the contact, in body axes [m/s].

    Args:
        omega: Angular velocity in body axes [rad/s].
        v: Horizontal velocity of the centre of mass in body axes [m/s].
        at: The contact.
    """
    w1, w2, w3 = omega
    g1, g2, g3, kappa, reach, _, _ = at
    rho3, rise = fma(-reach, g3, kappa), kappa * fma(g1, w2, -g2 * w1)  # -z'
    return (
        v[0] + fma(w2, rho3, reach * w3 * g2) - rise * g1,
        v[1] - fma(w1, rho3, reach * w3 * g1) - rise * g2,
        v[2] + reach * fma(w2, g1, -w1 * g2) - rise * g3,
    )


@scalar
def weight(omega: algebra.Vector, across: float, at: Place, p: Parameters) -> float:
    """Normal force without friction, of a body that could not turn away [N].

    The height z keeps to gamma3: ``m (g + h'' gamma3'^2 - kappa b)``, where b is what gamma3'' is
    without forces of the plane. By the moment of the normal force, the body turns away: that takes
    the part 1 / (1 + m kappa^2 s^2 / I1) of it.

    Args:
        omega: Angular velocity in body axes [rad/s].
        across: Applied torque along e = e3 x gamma [N m].
        at: The contact.
        p: Parameters.
    """
    w1, w2, w3 = omega
    rise = fma(at.g1, w2, -at.g2 * w1)
    turn = p.ratio * w3 * fma(at.g1, w1, at.g2 * w2) - at.g3 * fma(w1, w1, w2 * w2)
    bend = p.flatness * p.square * at.inverse_h * at.inverse_h * at.inverse_h  # -h''
    return p.m * (p.g - bend * rise * rise - at.kappa * fma(across, p.inverse1, turn))


@scalar
def forces(
    omega: algebra.Vector, v: algebra.Vector, across: float, at: Place, p: Parameters
) -> tuple[algebra.Vector, float]:
    """Friction -f N v at the slip v, in body axes, and the normal force N [N].

    Friction has a moment too, z f N v3 along e, so that N stands on both sides:
    ``N (1 + m kappa^2 s^2 / I1 - m kappa z f v3 / I1)`` is the `weight`. Where that is negative,
    the plane would have to pull, and there is no friction.

    Args:
        omega: Angular velocity in body axes [rad/s].
        v: Horizontal velocity of the centre of mass in body axes [m/s].
        across: Applied torque along e = e3 x gamma [N m].
        at: The contact.
        p: Parameters.
    """
    v1, v2, v3 = slip(omega, v, at)
    square = fma(v1, v1, fma(v2, v2, v3 * v3))
    pressed = weight(omega, across, at, p)
    f = p.mu / sqrt(fma(p.slip_speed, p.slip_speed, square)) + p.drag
    f = 0.5 * (1.0 + sign(pressed)) * f
    height, share = fma(-at.kappa, at.g3, at.reach), p.m * at.kappa * p.inverse1
    N = pressed / (1.0 + share * fma(at.kappa, at.s2, -height * f * v3))
    push = -f * N
    return (push * v1, push * v2, push * v3), N


@scalar
def moment(force: algebra.Vector, at: Place) -> algebra.Vector:
    """Moment rho x F about the centre of mass of a force at the contact, in body axes [N m]."""
    reach = at.reach
    rho = (-reach * at.g1, -reach * at.g2, fma(-reach, at.g3, at.kappa))
    return algebra.cross(rho, force)


@scalar
def rhs(y: State, u: Input, p: Parameters) -> State:
    """Newton's and Euler's laws about the centre of mass; q' = q (0, omega) / 2.

    ``I omega' = I omega x omega + tau + rho x (N gamma + R^T friction)``, ``m V' = F + friction``.

    Cohen 1977, doi:10.1119/1.10926 (tippe top); Moffatt & Shimomura 2002, doi:10.1038/416385a
    (egg).
    """
    q, (w1, w2, w3) = algebra.attitude(y), (y.omega1, y.omega2, y.omega3)
    omega, at = (w1, w2, w3), place(algebra.vertical(q), p)
    v = algebra.rotate_inverse(q, (y.VX, y.VY, 0.0))
    friction, N = forces(omega, v, at.g1 * u.tau2 - at.g2 * u.tau1, at, p)
    tau = moment(friction, at)
    pushed = algebra.rotate(q, friction)
    up = N * at.kappa
    return State(
        *algebra.turning(q, omega),
        ((p.I1 - p.I3) * w2 * w3 + u.tau1 + tau[0] - up * at.g2) / p.I1,
        ((p.I3 - p.I1) * w3 * w1 + u.tau2 + tau[1] + up * at.g1) / p.I1,
        (u.tau3 + tau[2]) / p.I3,
        y.VX,
        y.VY,
        (u.FX + pushed[0]) / p.m,
        (u.FY + pushed[1]) / p.m,
    )


Motion = tuple[algebra.Vector, algebra.Vector]


@scalar
def step(y: State, u: Input, p: Parameters, h: float) -> State:
    """Half a kick by friction and input, the motion without them, half a kick: second order.

    Without friction and input the vertical momentum and the spin momentum are kept to rounding, the
    energy error is bounded. A kick adds impulses at the contact, and so keeps Jellett's integral of
    a sphere to rounding, whatever the friction is.
    """
    q = algebra.attitude(y)
    at = place(algebra.vertical(q), p)
    velocity = (y.VX, y.VY, 0.0)
    omega, v = _kick((y.omega1, y.omega2, y.omega3), velocity, q, at, u, p, 0.5 * h)
    X, Y = fma(h, v[0], y.X), fma(h, v[1], y.Y)
    q, omega, at = _glide(q, omega, at, p, h)
    omega, v = _kick(omega, v, q, at, u, p, 0.5 * h)
    return State(*q, *omega, X, Y, v[0], v[1])


@scalar
def _kick(
    omega: algebra.Vector,
    v: algebra.Vector,
    q: algebra.Quaternion,
    at: Place,
    u: Input,
    p: Parameters,
    h: float,
) -> Motion:
    """Angular velocity and velocity after h [s] of friction and input at a fixed attitude.

    Kutta's method of fourth order. The plane keeps the height, with a moment along e.
    """
    force = algebra.rotate_inverse(q, (u.FX, u.FY, 0.0))
    push = (u.tau1, u.tau2, u.tau3, *force)
    start = (*omega, *algebra.rotate_inverse(q, v))
    a = _pushed(start, push, at, p)
    b = _pushed(_later(start, a, 0.5 * h), push, at, p)
    c = _pushed(_later(start, b, 0.5 * h), push, at, p)
    d = _pushed(_later(start, c, h), push, at, p)
    end = _later(_later(start, a, h / 6.0), d, h / 6.0)
    w1, w2, w3, v1, v2, v3 = _later(_later(end, b, h / 3.0), c, h / 3.0)
    return (w1, w2, w3), algebra.rotate(q, (v1, v2, v3))


Rates = tuple[float, float, float, float, float, float]


@scalar
def _later(row: Rates, rate: Rates, h: float) -> Rates:
    return (
        fma(h, rate[0], row[0]),
        fma(h, rate[1], row[1]),
        fma(h, rate[2], row[2]),
        fma(h, rate[3], row[3]),
        fma(h, rate[4], row[4]),
        fma(h, rate[5], row[5]),
    )


@scalar
def _pushed(row: Rates, push: Rates, at: Place, p: Parameters) -> Rates:
    """Rates of omega and of the velocity in body axes by friction and input alone."""
    omega, v = (row[0], row[1], row[2]), (row[3], row[4], row[5])
    force, _ = forces(omega, v, fma(at.g1, push[1], -at.g2 * push[0]), at, p)
    tau = moment(force, at)
    t1, t2 = push[0] + tau[0], push[1] + tau[1]
    rim = p.m * at.kappa * at.kappa
    held = rim * fma(at.g1, t2, -at.g2 * t1) / fma(rim, at.s2, p.I1)
    return (
        p.inverse1 * fma(held, at.g2, t1),
        p.inverse1 * fma(-held, at.g1, t2),
        p.inverse3 * (push[2] + tau[2]),
        p.inverse_m * (push[3] + force[0]),
        p.inverse_m * (push[4] + force[1]),
        p.inverse_m * (push[5] + force[2]),
    )


@scalar
def _glide(
    q: algebra.Quaternion, omega: algebra.Vector, at: Place, p: Parameters, h: float
) -> tuple[algebra.Quaternion, algebra.Vector, Place]:
    """Motion on the plane without friction: an impulse of the plane, free flight, an impulse.

    The first impulse is such that the body touches the plane at the end, the second that it goes on
    to: RATTLE, symmetric and of second order (Andersen 1983, doi:10.1016/0021-9991(83)90014-1;
    Hairer, Lubich & Wanner, section VII.1.4).
    """
    moment = (p.I1 * omega[0], p.I1 * omega[1], p.I3 * omega[2])
    P = _impulse(moment, at, p, h)
    L1, L2 = fma(-P * at.kappa, at.g2, moment[0]), fma(P * at.kappa, at.g1, moment[1])
    rise = at.kappa * p.inverse1 * fma(moment[0], at.g2, -moment[1] * at.g1)
    rise = fma(p.inverse_m, P, fma(-h, p.g, rise))  # vertical velocity at the end
    half = 0.5 * h * p.inverse1
    size = half * algebra.tangent(half * half * fma(L1, L1, fma(L2, L2, moment[2] * moment[2])))
    spin = half * (1.0 - p.ratio) * omega[2] * p.I1
    a = spin * algebra.tangent(spin * spin)
    q = algebra.compose(q, (1.0, size * L1, size * L2, size * moment[2]))
    q = algebra.normalize(algebra.compose(q, (1.0, 0.0, 0.0, a)))
    versine, sine = algebra.cayley(a)
    L1, L2 = fma(sine, L2, -versine * L1) + L1, fma(-sine, L1, -versine * L2) + L2
    at = place(algebra.vertical(q), p)
    fall = at.kappa * p.inverse1 * fma(L1, at.g2, -L2 * at.g1)
    last = (fall - rise) / fma(at.kappa * at.kappa * at.s2, p.inverse1, p.inverse_m)
    w1 = p.inverse1 * fma(-last * at.kappa, at.g2, L1)
    w2 = p.inverse1 * fma(last * at.kappa, at.g1, L2)
    return q, (w1, w2, omega[2]), at


@scalar
def _impulse(L: algebra.Vector, at: Place, p: Parameters, h: float) -> float:
    """Impulse of the plane after which free flight of h [s] ends on the plane, by Newton's method.

    Only gamma3 matters, which a flight changes by 2 (f^2 (L3 Lz - gamma3 |L|^2) - f (L x gamma)_3)
    / (1 + f^2 |L|^2), f |L| the tangent of half the angle that it turns about L. The slope is taken
    at constant f, which changes little: three rounds lead to rounding.
    """
    g1, g2, g3, kappa, _, inverse_h, s2 = at
    cross, square = fma(L[0], g2, -L[1] * g1), fma(L[0], L[0], fma(L[1], L[1], L[2] * L[2]))
    level = L[2] * fma(L[0], g1, fma(L[1], g2, L[2] * g3))
    arm, half, top = kappa * s2, 0.5 * h * p.inverse1, 1.0 / inverse_h
    omega = (p.inverse1 * L[0], p.inverse1 * L[1], p.inverse3 * L[2])
    P = 0.5 * h * weight(omega, 0.0, at, p) / (1.0 + p.m * p.inverse1 * kappa * arm)
    for _ in range(3):
        q = fma(P * kappa, fma(P, arm, -2.0 * cross), square)
        dq = 2.0 * kappa * fma(P, arm, -cross)
        f = half * algebra.tangent(half * half * q)
        side, up = fma(-P, arm, cross), fma(-g3, q, level)
        share = 1.0 / fma(f * f, q, 1.0)
        change = 2.0 * f * fma(f, up, -side) * share
        rate = share * f * fma(2.0, arm - f * g3 * dq, -change * f * dq)
        new = g3 + change
        h1 = sqrt(fma(-p.flatness * new, new, p.square))
        rise = -change * fma(p.flatness, (new + g3) / (h1 + top), p.offset)
        error = rise - h * fma(kappa * p.inverse1, cross, fma(p.inverse_m, P, -0.5 * h * p.g))
        lift = fma(p.flatness, new / h1, p.offset)
        P += error / fma(lift, rate, h * p.inverse_m)
    return P


@scalar
def invariants(y: State, p: Parameters) -> Invariants:
    """Energy [J], vertical and spin momentum [N m s]; Jellett's integral [N m^2 s].

    The first three are conserved without friction and input. Jellett's, ``-L . rho``, is conserved
    whatever the friction at the contact, if the body is a sphere.
    """
    omega = (y.omega1, y.omega2, y.omega3)
    L1, L2, L3 = p.I1 * omega[0], p.I1 * omega[1], p.I3 * omega[2]
    at = place(algebra.vertical(algebra.attitude(y)), p)
    level = fma(L1, at.g1, fma(L2, at.g2, L3 * at.g3))
    rise = at.kappa * fma(at.g1, omega[1], -at.g2 * omega[0])
    speed = fma(y.VX, y.VX, fma(y.VY, y.VY, rise * rise))
    kinetic = fma(p.m, speed, fma(L1, omega[0], fma(L2, omega[1], L3 * omega[2])))
    height = fma(-at.kappa, at.g3, at.reach)
    energy = fma(p.m * p.g, height, 0.5 * kinetic)
    return Invariants(energy, level, L3, fma(at.reach, level, -at.kappa * L3))


@scalar
def rate(y: State, p: Parameters) -> float:
    """Rate of the turns, times the ratio of the axes, and of gravity and friction [rad/s].

    Turns are those of the body and about its momentum.
    """
    across = fma(y.omega1, y.omega1, y.omega2 * y.omega2)
    spin = max(1.0, p.ratio) * y.omega3
    return fma(p.stiffness, sqrt(fma(spin, spin, across)), p.natural)


@scalar
def ground_force(y: State, u: Input, p: Parameters) -> algebra.Vector:
    """Friction in world axes, and the normal force [N]."""
    q = algebra.attitude(y)
    at = place(algebra.vertical(q), p)
    v = algebra.rotate_inverse(q, (y.VX, y.VY, 0.0))
    across = at.g1 * u.tau2 - at.g2 * u.tau1
    friction, N = forces((y.omega1, y.omega2, y.omega3), v, across, at, p)
    x, y_, _ = algebra.rotate(q, friction)
    return (x, y_, N)


SPHEROID = Dynamics(
    State,
    Input,
    Parameters,
    Invariants,
    derive,
    rhs,
    step,
    unchanged,
    invariants,
    rate=rate,
    contact=algebra.on_ground(ground_force, 3),
)
