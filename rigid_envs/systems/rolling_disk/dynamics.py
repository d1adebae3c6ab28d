"""Thin disk or hoop that rolls on the plane z = 0 without slipping.

State y = (q, omega, X, Y): e3 is the axis of the disk, (X, Y) the point of contact. The velocity of
the centre is not a state: it follows from omega, so the disk cannot slip. Torque acts about n, l
and e3, where n is the radius that points up and l = e3 x n the horizontal direction of travel.

With the angle theta between e3 and the vertical, the vertical is sin(theta) n + cos(theta) e3 and
the contact lies at -radius n. Components of omega along n, l, e3 are written wn, wl, w3; then
theta' = -wl, phi' = wn / sin(theta) and psi' = w3 - wn cot(theta). A flat disk has no point of
contact: sin(theta) = 0 is not a state of this system.
"""

from typing import NamedTuple

from rigid_envs.engine import algebra
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.dynamics import Dynamics, unchanged
from rigid_envs.engine.elementary import fma, sqrt


class State(NamedTuple):
    """Attitude q, angular velocity in body axes [rad/s], point of contact [m]; upright at rest."""

    w: float = 0.7071067811865476
    x: float = 0.7071067811865476
    y: float = 0.0
    z: float = 0.0
    omega1: float = 0.0
    omega2: float = 0.0
    omega3: float = 0.0
    X: float = 0.0
    Y: float = 0.0


class Input(NamedTuple):
    """Torque about n, l and e3 [N m]."""

    tau_steer: float
    tau_lean: float
    tau_drive: float


class Parameters(NamedTuple):
    """m [kg], radius [m], I1, I3 [kg m^2], g [m/s^2], mu, and derived quantities; see `derive`."""

    m: float
    radius: float
    I1: float
    I3: float
    g: float
    mu: float
    I1_contact: float
    I3_contact: float
    inverse1: float
    inverse1_contact: float
    inverse3_contact: float
    ratio: float
    rim_ratio: float
    mgr: float


class Invariants(NamedTuple):
    """Energy [J]."""

    energy: float


@scalar
def derive(m: float, radius: float, I1: float, I3: float, g: float, mu: float) -> Parameters:
    """Parameter row of m [kg], radius [m], I1, I3 [kg m^2], g [m/s^2] and mu.

    It adds: moments I1 + m r^2 and I3 + m r^2 about the contact, their inverses and that of I1, the
    ratios I3 / I1 and m r^2 / (I3 + m r^2), and m g r.
    """
    rim = m * radius * radius
    return Parameters(
        *(m, radius, I1, I3, g, mu),
        I1 + rim,
        I3 + rim,
        1.0 / I1,
        1.0 / (I1 + rim),
        1.0 / (I3 + rim),
        I3 / I1,
        rim / (I3 + rim),
        m * g * radius,
    )


@scalar
def inclination(q: algebra.Quaternion) -> algebra.Row:
    """Upward radius n, (n1, n2) in body axes, and sin and cos of theta."""
    g1, g2, g3 = algebra.vertical(q)
    s = sqrt(g1 * g1 + g2 * g2)
    return (g1 / s, g2 / s, s, g3)


@scalar
def heading(q: algebra.Quaternion, s: float) -> tuple[float, float]:
    """Horizontal direction l = e3 x n in world axes: (e3_y, -e3_x) / sin(theta)."""
    w, x, y, z = q
    return 2.0 * fma(y, z, -w * x) / s, -2.0 * fma(x, z, w * y) / s


@scalar
def rhs(y: State, u: Input, p: Parameters) -> State:
    """Newton's and Euler's laws without the contact force; q' = q (0, omega) / 2.

    Along n, l, e3, in body axes (terms with m r^2 come from the contact force): ``I1 wn' = (I1 -
    I3) wl w3 + tau_n``, ``(I1 + m r^2) wl' = (I3 - I1) wn w3 + m r^2 cot(theta) wn^2 + m g r
    cos(theta) + tau_l``, ``(I3 + m r^2) w3' = -m r^2 wn wl + tau_3``; the contact moves along l at
    r psi'.

    Routh, *Advanced Rigid Dynamics*, section 244; Borisov, Mamaev & Kilin 2003, "Dynamics of
    rolling disk", Regular and Chaotic Dynamics 8:201.
    """
    w1, w2, w3 = y.omega1, y.omega2, y.omega3
    m, radius, I1, I3, g = p.m, p.radius, p.I1, p.I3, p.g
    n1, n2, s, c = inclination(algebra.attitude(y))
    rim = m * radius * radius
    wn, wl = n1 * w1 + n2 * w2, n1 * w2 - n2 * w1
    turn = ((I1 - I3) * wl * w3 + u.tau_steer) / I1
    push = rim * (c / s) * wn * wn + m * g * radius * c
    lean = ((I3 - I1) * wn * w3 + push + u.tau_lean) / (I1 + rim)
    roll = radius * (w3 - wn * (c / s))
    lx, ly = heading(algebra.attitude(y), s)
    return State(
        *algebra.turning(algebra.attitude(y), (w1, w2, w3)),
        n1 * turn - n2 * lean,
        n2 * turn + n1 * lean,
        (u.tau_drive - rim * wn * wl) / (I3 + rim),
        roll * lx,
        roll * ly,
    )


@scalar
def step(y: State, u: Input, p: Parameters, h: float) -> State:
    """Half a step of falling, a step of rolling, half a step of falling: symmetric, second order.

    Steady rolling on a circle is exact for any step size. With the Euler angles of q, w + i z is
    cos(theta / 2) exp(i (phi + psi) / 2) and x + i y is sin(theta / 2) exp(i (phi - psi) / 2):
    rolling rotates these two complex numbers, and falling scales them.
    """
    w, x, y_, z = algebra.attitude(y)
    wx, wy, xz, yz = w * x, w * y_, x * z, y_ * z
    g1, g2 = xz - wy, yz + wx  # along n, sin(theta) / 2 long
    half_s = sqrt(fma(g1, g1, g2 * g2))
    k = 1.0 / half_s
    rates = (fma(g1, y.omega1, g2 * y.omega2) * k, fma(g1, y.omega2, -g2 * y.omega1) * k, y.omega3)
    place = (2.0 * half_s, fma(w, w, z * z) - fma(x, x, y_ * y_), 0.5 * k)
    rates, place, first = _fall(rates, place, p, 0.5 * h)
    rates, (a, b), chord = _roll(rates, place, u, p, h)
    (wn, wl, w3), _, last = _fall(rates, place, p, 0.5 * h)
    w, z = _turned(_turned((w, z), a), b)
    x, y_ = _turned(_turned((x, y_), a), -b)
    high, low = first[0] * last[0], first[1] * last[1]
    q = algebra.normalize((high * w, low * x, low * y_, high * z))
    versine, sine = algebra.cayley(b)
    n1, n2 = g1 * k, g2 * k
    n1, n2 = fma(sine, n2, -versine * n1) + n1, fma(-sine, n1, -versine * n2) + n2
    ahead, aside = _turned(((yz - wx) * k, -(xz + wy) * k), a)  # l and half the precession
    return State(
        *q,
        fma(n1, wn, -n2 * wl),
        fma(n2, wn, n1 * wl),
        w3,
        fma(chord, ahead, y.X),
        fma(chord, aside, y.Y),
    )


Rates = tuple[float, float, float]
Place = tuple[float, float, float]
Pair = tuple[float, float]


@scalar
def _turned(v: Pair, a: float) -> Pair:
    """Product (v0 + i v1) (1 + i a): v turned by arctan(a) and scaled by sqrt(1 + a^2)."""
    return fma(-a, v[1], v[0]), fma(a, v[0], v[1])


@scalar
def _fall(rates: Rates, place: Place, p: Parameters, h: float) -> tuple[Rates, Place, Pair]:
    """Rotation about l at the constant rate wl, which changes theta, wn and w3.

    ``d(wn sin(theta)) / dtheta = (I3 / I1) w3 sin(theta)`` and ``dw3 / dtheta = wn m r^2 / (I3 + m
    r^2)``, the latter by the trapezoidal rule. The contact and l are constant. Returned are the
    rates, the place (sin, cos and 1 / sin of theta), and the factors of cos(theta / 2) and
    sin(theta / 2), times sqrt(d).
    """
    wn, wl, w3 = rates
    s, c, r = place
    x = 0.5 * h * wl
    a = x * algebra.tangent(x * x)
    d = fma(a, a, 1.0)
    stands, rise = fma(-a, fma(a, s, 2.0 * c), s), 2.0 * a * fma(-a, c, s)
    inverse = 1.0 / (d * stands)  # sin(theta) becomes stands / d, and cos(theta) grows by rise / d
    w3 = fma(-p.rim_ratio * x, wn, w3)
    wn = fma(d * s, wn, -p.ratio * rise * w3) * (d * inverse)
    w3 = fma(-p.rim_ratio * x, wn, w3)
    part = stands * inverse  # 1 / d
    place = (stands * part, fma(rise, part, c), d * d * inverse)
    m = a * r
    mean = fma(-m, c, 1.0)
    return (wn, wl, w3), place, (mean + m, mean - m)


@scalar
def _roll(
    rates: Rates, place: Place, u: Input, p: Parameters, h: float
) -> tuple[Rates, Pair, float]:
    """Precession about the vertical and spin about e3 at constant theta; gravity changes wl.

    Returned are the rates, the tangents (a, b) of half the two angles, and the chord of the
    contact's arc divided by the norm of l + a l', where l' is l turned by a right angle.
    """
    wn, wl, w3 = rates
    _, c, r = place
    kick_n = 0.5 * h * p.inverse1 * u.tau_steer
    kick_3 = 0.5 * h * p.inverse3_contact * u.tau_drive
    wn, w3 = wn + kick_n, w3 + kick_3
    cot = c * r
    spin = fma(-wn, cot, w3)
    moment = fma(wn, fma(p.I3_contact, w3, -p.I1 * cot * wn), fma(p.mgr, c, u.tau_lean))
    half_phi, half_psi = 0.5 * h * r * wn, 0.5 * h * spin
    stretch = algebra.tangent(half_phi * half_phi)
    a, b = half_phi * stretch, half_psi * algebra.tangent(half_psi * half_psi)
    # The mean of l over the arc is sin(x) / x times l at mid-arc, x = half_phi.
    chord = 2.0 * p.radius * half_psi * stretch / fma(a, a, 1.0)
    return (wn + kick_n, fma(h * p.inverse1_contact, moment, wl), w3 + kick_3), (a, b), chord


@scalar
def invariants(y: State, p: Parameters) -> Invariants:
    """Energy [J], conserved without input.

    ``(I1 wn^2 + (I1 + m r^2) wl^2 + (I3 + m r^2) w3^2) / 2 + m g r sin(theta)``.
    """
    n1, n2, s, _ = inclination(algebra.attitude(y))
    wn, wl = fma(n1, y.omega1, n2 * y.omega2), fma(n1, y.omega2, -n2 * y.omega1)
    w3 = y.omega3
    kinetic = 0.5 * fma(p.I1 * wn, wn, fma(p.I1_contact * wl, wl, p.I3_contact * w3 * w3))
    return Invariants(fma(p.m * p.g * p.radius, s, kinetic))


@scalar
def rate(y: State, p: Parameters) -> float:
    """Sum of the rates of spin, of precession and fall, and of sqrt(g / radius) [rad/s].

    Precession and fall count 1 / sin(theta) times: that is how fast heading and sin(theta) change.
    """
    _, _, s, _ = inclination(algebra.attitude(y))
    across = sqrt(fma(y.omega1, y.omega1, y.omega2 * y.omega2))
    return abs(y.omega3) + across / s + sqrt(p.g / p.radius)


@scalar
def ground_force(y: State, u: Input, p: Parameters) -> algebra.Vector:
    """Force of the plane, m (v' + g e_z), in world axes [N].

    Along n, l, e3 the acceleration of the centre, ``v = radius omega x n``, is ``radius (-wl^2 - wn
    w3 cot(theta), w3' + wn wl, wn^2 cot(theta) - wl')``, where the rates of omega are those in body
    axes. Horizontal are l and ``h = cos(theta) n - sin(theta) e3``.
    """
    n1, n2, s, c = inclination(algebra.attitude(y))
    rates = rhs(y, u, p)
    wn, wl = n1 * y.omega1 + n2 * y.omega2, n1 * y.omega2 - n2 * y.omega1
    wl_rate = n1 * rates.omega2 - n2 * rates.omega1
    push = p.m * p.radius
    along_n = -push * (wl * wl + wn * y.omega3 * (c / s))
    along_3 = push * (wn * wn * (c / s) - wl_rate)
    ahead, aside = push * (rates.omega3 + wn * wl), c * along_n - s * along_3
    lx, ly = heading(algebra.attitude(y), s)
    normal = s * along_n + c * along_3 + p.m * p.g
    return (ahead * lx + aside * ly, ahead * ly - aside * lx, normal)


ROLLING_DISK = Dynamics(
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
