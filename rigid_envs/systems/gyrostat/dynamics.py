"""Gyrostat: a rigid body, the carrier, with up to three wheels along its principal axes.

State y = (q, omega, wheel): attitude (w, x, y, z), angular velocity of the carrier in body axes and
rates of the wheels relative to it [rad/s].
"""

from typing import NamedTuple

from rigid_envs.engine.algebra import (
    Quaternion,
    Vector,
    attitude,
    cayley,
    compose,
    dot,
    normalize,
    rotate,
    scaled,
    tangent,
    turning,
)
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.dynamics import Dynamics
from rigid_envs.engine.elementary import fma, select, sqrt


class State(NamedTuple):
    """Attitude q = (w, x, y, z), angular velocity, rates of the wheels on the carrier [rad/s]."""

    w: float = 1.0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    omega1: float = 0.0
    omega2: float = 0.0
    omega3: float = 0.0
    wheel1: float = 0.0
    wheel2: float = 0.0
    wheel3: float = 0.0


class Input(NamedTuple):
    """Torques of the motors on the wheels, torque on the carrier in body axes [N m]."""

    u1: float
    u2: float
    u3: float
    tau1: float
    tau2: float
    tau3: float


class Parameters(NamedTuple):
    """Principal moments with locked wheels, axial moments of the wheels [kg m^2]; what follows.

    A = I - J are the moments that the carrier has about the axes of its free wheels; of a wheel
    that is not there, J = 0, the mark `has` and 1 / J are 0.
    """

    I1: float
    I2: float
    I3: float
    J1: float
    J2: float
    J3: float
    A1: float
    A2: float
    A3: float
    per_A1: float
    per_A2: float
    per_A3: float
    per_J1: float
    per_J2: float
    per_J3: float
    has1: float
    has2: float
    has3: float


class Invariants(NamedTuple):
    """Conserved without torques: energy [J], |L|^2, L in world axes, spin momenta [N m s]."""

    energy: float
    L_squared: float
    L_world_x: float
    L_world_y: float
    L_world_z: float
    spin_momentum1: float
    spin_momentum2: float
    spin_momentum3: float


Turned = tuple[Quaternion, Vector]


@scalar
def derive(I1: float, I2: float, I3: float, J1: float, J2: float, J3: float) -> Parameters:
    """Parameter row of the moments [kg m^2]."""
    A1, A2, A3 = I1 - J1, I2 - J2, I3 - J3
    has1, has2, has3 = _has(J1), _has(J2), _has(J3)
    inverses = (1.0 / A1, 1.0 / A2, 1.0 / A3)
    per_J = (has1 / _or_one(J1), has2 / _or_one(J2), has3 / _or_one(J3))
    return Parameters(I1, I2, I3, J1, J2, J3, A1, A2, A3, *inverses, *per_J, has1, has2, has3)


@scalar
def _has(J: float) -> float:
    return select(J > 0.0, 1.0, 0.0)


@scalar
def _or_one(J: float) -> float:
    return select(J > 0.0, J, 1.0)


@scalar
def spin_momenta(y: State, p: Parameters) -> Vector:
    """Spin momenta l = J (omega + wheel) [N m s] of the wheels along their axes, in space."""
    return (
        p.J1 * (y.omega1 + y.wheel1),
        p.J2 * (y.omega2 + y.wheel2),
        p.J3 * (y.omega3 + y.wheel3),
    )


@scalar
def momentum(y: State, p: Parameters) -> Vector:
    """L = A omega + l in body axes [N m s]: the angular momentum of carrier and wheels."""
    l1, l2, l3 = spin_momenta(y, p)
    return fma(p.A1, y.omega1, l1), fma(p.A2, y.omega2, l2), fma(p.A3, y.omega3, l3)


@scalar
def rhs(y: State, u: Input, p: Parameters) -> State:
    """L' = L x omega + tau with L = A omega + l, and l' = u; q' = q (0, omega) / 2.

    Hughes, *Spacecraft Attitude Dynamics*, sections 3.4 and 6.1.
    """
    w1, w2, w3 = y.omega1, y.omega2, y.omega3
    L1, L2, L3 = momentum(y, p)
    u1, u2, u3 = p.has1 * u.u1, p.has2 * u.u2, p.has3 * u.u3
    a1 = (L2 * w3 - L3 * w2 + u.tau1 - u1) * p.per_A1
    a2 = (L3 * w1 - L1 * w3 + u.tau2 - u2) * p.per_A2
    a3 = (L1 * w2 - L2 * w1 + u.tau3 - u3) * p.per_A3
    return State(
        *turning(attitude(y), (w1, w2, w3)),
        a1,
        a2,
        a3,
        u1 * p.per_J1 - p.has1 * a1,
        u2 * p.per_J2 - p.has2 * a2,
        u3 * p.per_J3 - p.has3 * a3,
    )


@scalar
def _turn_1(turned: Turned, half: float) -> Turned:
    """Carrier turned about e1 by an angle; L, in its axes, turns back. `half` is half the angle."""
    q, L = turned
    a = half * tangent(half * half)
    m, s = cayley(a)
    q = (fma(-a, q[1], q[0]), fma(a, q[0], q[1]), fma(a, q[3], q[2]), fma(-a, q[2], q[3]))
    return q, (L[0], fma(s, L[2], -m * L[1]) + L[1], fma(-s, L[1], -m * L[2]) + L[2])


@scalar
def _turn_2(turned: Turned, half: float) -> Turned:
    q, L = turned
    a = half * tangent(half * half)
    m, s = cayley(a)
    q = (fma(-a, q[2], q[0]), fma(-a, q[3], q[1]), fma(a, q[0], q[2]), fma(a, q[1], q[3]))
    return q, (fma(-s, L[2], -m * L[0]) + L[0], L[1], fma(s, L[0], -m * L[2]) + L[2])


@scalar
def _turn_3(turned: Turned, half: float) -> Turned:
    q, L = turned
    a = half * tangent(half * half)
    m, s = cayley(a)
    q = (fma(-a, q[3], q[0]), fma(a, q[2], q[1]), fma(-a, q[1], q[2]), fma(a, q[0], q[3]))
    return q, (fma(s, L[1], -m * L[0]) + L[0], fma(-s, L[0], -m * L[1]) + L[1], L[2])


@scalar
def free_turn(q: Quaternion, L: Vector, l: Vector, p: Parameters, h: float) -> Turned:  # noqa: E741
    """Symmetric second-order step of the rotation without torques: (c q, L) after h [s].

    With constant spin momenta l the energy of the carrier, sum (L_k - l_k)^2 / 2 A_k, is that of a
    sphere, |L|^2 / 2 A2, plus a function of each entry of L. The first turns the attitude about L
    and leaves L in the carrier unchanged, the others turn the carrier about e1, e2 and e3 at rates
    L_k (1 / A_k - 1 / A2) - l_k / A_k that they do not change. Each turn is a rotation, so |L| and
    L in space are conserved to rounding. The quaternion grows by c > 1; the caller rescales it.
    """
    half = 0.5 * h
    k1, k3 = half * (p.per_A1 - p.per_A2), half * (p.per_A3 - p.per_A2)
    b1, b2, b3 = half * p.per_A1 * l[0], half * p.per_A2 * l[1], half * p.per_A3 * l[2]
    turned = _turn_1((q, L), 0.5 * fma(k1, L[0], -b1))
    turned = _turn_2(turned, -0.5 * b2)
    along = scaled(half * p.per_A2, turned[1])
    t = tangent(dot(along, along))
    turned = (compose(turned[0], (1.0, *scaled(t, along))), turned[1])
    turned = _turn_3(turned, fma(k3, turned[1][2], -b3))
    turned = _turn_2(turned, -0.5 * b2)
    return _turn_1(turned, 0.5 * fma(k1, turned[1][0], -b1))


@scalar
def step(y: State, u: Input, p: Parameters, h: float) -> State:
    """Half a kick by the torques, the turn without them, half a kick: symmetric, second order.

    The torques of the motors change l alone, and L not at all: it is kept to rounding under them.
    The returned quaternion is not normalised; `restore` normalises it.
    """
    half = 0.5 * h
    motor = (half * p.has1 * u.u1, half * p.has2 * u.u2, half * p.has3 * u.u3)
    kick = (half * u.tau1, half * u.tau2, half * u.tau3)
    l0, L0 = spin_momenta(y, p), momentum(y, p)
    spins = (l0[0] + motor[0], l0[1] + motor[1], l0[2] + motor[2])
    L = (L0[0] + kick[0], L0[1] + kick[1], L0[2] + kick[2])
    q, turned = free_turn(attitude(y), L, spins, p, h)
    # changes, for roundings of what is divided and multiplied again add up
    d1 = ((turned[0] - L[0]) + 2.0 * (kick[0] - motor[0])) / p.A1
    d2 = ((turned[1] - L[1]) + 2.0 * (kick[1] - motor[1])) / p.A2
    d3 = ((turned[2] - L[2]) + 2.0 * (kick[2] - motor[2])) / p.A3
    return State(
        *q,
        y.omega1 + d1,
        y.omega2 + d2,
        y.omega3 + d3,
        y.wheel1 + (2.0 * motor[0] * p.per_J1 - p.has1 * d1),
        y.wheel2 + (2.0 * motor[1] * p.per_J2 - p.has2 * d2),
        y.wheel3 + (2.0 * motor[2] * p.per_J3 - p.has3 * d3),
    )


@scalar
def restore(y: State) -> State:
    """State with q normalised."""
    wheels = (y.wheel1, y.wheel2, y.wheel3)
    return State(*normalize(attitude(y)), y.omega1, y.omega2, y.omega3, *wheels)


@scalar
def invariants(y: State, p: Parameters) -> Invariants:
    """Energy of carrier and wheels, angular momentum, spin momenta."""
    omega, spins, L = (y.omega1, y.omega2, y.omega3), spin_momenta(y, p), momentum(y, p)
    carrier = (p.A1 * omega[0], p.A2 * omega[1], p.A3 * omega[2])
    wheels = (p.per_J1 * spins[0], p.per_J2 * spins[1], p.per_J3 * spins[2])
    energy = 0.5 * (dot(carrier, omega) + dot(wheels, spins))
    return Invariants(energy, dot(L, L), *rotate(attitude(y), L), *spins)


@scalar
def rate(y: State, p: Parameters) -> float:
    """Largest of norm(omega), and the rates of the turns about L and about the axes [rad/s].

    These turn the carrier at L / A2, and at omega - L / A2.
    """
    omega, sphere = (y.omega1, y.omega2, y.omega3), scaled(p.per_A2, momentum(y, p))
    rest = (omega[0] - sphere[0], omega[1] - sphere[1], omega[2] - sphere[2])
    return sqrt(max(dot(omega, omega), max(dot(sphere, sphere), dot(rest, rest))))


GYROSTAT = Dynamics(
    State, Input, Parameters, Invariants, derive, rhs, step, restore, invariants, rate=rate
)
