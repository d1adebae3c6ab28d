"""Free rigid body under a body torque.

State y = (q, omega): attitude (w, x, y, z) and angular velocity in body axes [rad/s].
"""

from typing import Any, NamedTuple

from rigid_envs.engine.algebra import (
    Quaternion,
    Row,
    Vector,
    attitude,
    cayley,
    compose,
    dot,
    normalize,
    rotate,
    tangent,
    turning,
)
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.dynamics import Dynamics
from rigid_envs.engine.elementary import fma, sqrt


class State(NamedTuple):
    """Attitude q = (w, x, y, z) and angular velocity in body axes [rad/s]."""

    w: float = 1.0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    omega1: float = 0.0
    omega2: float = 0.0
    omega3: float = 0.0


class Input(NamedTuple):
    """Torque in body axes [N m]."""

    tau1: float
    tau2: float
    tau3: float


class Parameters(NamedTuple):
    """Principal moments [kg m^2], their inverses, and the ratios of `rotor`."""

    I1: float
    I2: float
    I3: float
    inverse1: float
    inverse2: float
    inverse3: float
    k1: float
    k3: float
    r12: float
    r21: float
    r23: float
    r32: float


class Invariants(NamedTuple):
    """Conserved without torque: kinetic energy [J], |L|^2, and L in world axes [N m s]."""

    energy: float
    L_squared: float
    L_world_x: float
    L_world_y: float
    L_world_z: float


Turned = tuple[Quaternion, float, float]


@scalar
def rotor(I1: float, I2: float, I3: float) -> Row:
    """Ratios (k1, k3, r12, r21, r23, r32) of the moments that the free rotation needs."""
    return (1.0 - I1 / I2, 1.0 - I3 / I2, I1 / I2, I2 / I1, I2 / I3, I3 / I2)


@scalar
def derive(I1: float, I2: float, I3: float) -> Parameters:
    """Parameter row of the principal moments [kg m^2]."""
    k1, k3, r12, r21, r23, r32 = rotor(I1, I2, I3)
    return Parameters(I1, I2, I3, 1.0 / I1, 1.0 / I2, 1.0 / I3, k1, k3, r12, r21, r23, r32)


@scalar
def rhs(y: State, u: Input, p: Parameters) -> State:
    """Euler's equations I omega' = I omega x omega + tau, and q' = q (0, omega) / 2.

    Landau & Lifshitz, *Mechanics*, section 36.
    """
    w1, w2, w3 = y.omega1, y.omega2, y.omega3
    return State(
        *turning(attitude(y), (w1, w2, w3)),
        ((p.I2 - p.I3) * w2 * w3 + u.tau1) / p.I1,
        ((p.I3 - p.I1) * w3 * w1 + u.tau2) / p.I2,
        ((p.I1 - p.I2) * w1 * w2 + u.tau3) / p.I3,
    )


@scalar
def free_rotation(q: Quaternion, omega: Vector, ratios: Row, h: float) -> tuple[Quaternion, Vector]:
    """One symmetric second-order step of the free rotation: (c q, omega) after h [s].

    The energy is split into three parts that can each be integrated exactly, ``|L|^2 / 2 I2 + L1^2
    / 2 (1/I1 - 1/I2) + L3^2 / 2 (1/I3 - 1/I2)``: the first turns the attitude about L and leaves L
    in the body unchanged, the others turn the body about e1 and e3 (McLachlan 1993,
    doi:10.1103/PhysRevLett.71.3043; Hairer, Lubich & Wanner, section VII.5). Each turn is the
    quaternion (1, a e) with a near tan(angle / 2): a rotation for any a, so |L| and the angular
    momentum in space are conserved to rounding, without a call to sin or cos. The quaternion grows
    by the factor c > 1; the caller rescales it.
    """
    k1, k3, r12, r21, r23, r32 = ratios
    q, w2, w3 = _turn_about_1(q, omega, 0.25 * h * k1 * omega[0], r23, r32)
    q = _turn_about_momentum(q, (r12 * omega[0], w2, r32 * w3), 0.5 * h)
    q, w1, w2 = _turn_about_3(q, (omega[0], w2, w3), 0.5 * h * k3 * w3, r12, r21)
    q, w2, w3 = _turn_about_1(q, (w1, w2, w3), 0.25 * h * k1 * w1, r23, r32)
    return q, (w1, w2, w3)


@scalar
def _turn_about_1(q: Quaternion, omega: Vector, a: float, r23: float, r32: float) -> Turned:
    m, s = cayley(a)
    turned = (fma(-a, q[1], q[0]), fma(a, q[0], q[1]), fma(a, q[3], q[2]), fma(-a, q[2], q[3]))
    w2 = fma(s * r32, omega[2], -m * omega[1]) + omega[1]
    w3 = fma(-s * r23, omega[1], -m * omega[2]) + omega[2]
    return turned, w2, w3


@scalar
def _turn_about_3(q: Quaternion, omega: Vector, x: float, r12: float, r21: float) -> Turned:
    a = x * tangent(x * x)
    m, s = cayley(a)
    turned = (fma(-a, q[3], q[0]), fma(a, q[2], q[1]), fma(-a, q[1], q[2]), fma(a, q[0], q[3]))
    w1 = fma(s * r21, omega[1], -m * omega[0]) + omega[0]
    w2 = fma(-s * r12, omega[0], -m * omega[1]) + omega[1]
    return turned, w1, w2


@scalar
def _turn_about_momentum(q: Quaternion, rate: Vector, half: float) -> Quaternion:
    x, y, z = half * rate[0], half * rate[1], half * rate[2]
    t = tangent(fma(x, x, fma(y, y, z * z)))
    return compose(q, (1.0, t * x, t * y, t * z))


@scalar
def step(y: State, u: Input, p: Parameters, h: float) -> State:
    """Half a kick by the torque, the free rotation, half a kick: symmetric, second order.

    The returned quaternion is not normalised; `restore` normalises it.
    """
    k1, k2, k3 = 0.5 * h * p.inverse1, 0.5 * h * p.inverse2, 0.5 * h * p.inverse3
    kicked = (fma(k1, u.tau1, y.omega1), fma(k2, u.tau2, y.omega2), fma(k3, u.tau3, y.omega3))
    ratios = (p.k1, p.k3, p.r12, p.r21, p.r23, p.r32)
    q, omega = free_rotation(attitude(y), kicked, ratios, h)
    return State(
        *q, fma(k1, u.tau1, omega[0]), fma(k2, u.tau2, omega[1]), fma(k3, u.tau3, omega[2])
    )


@scalar
def restore(y: State) -> State:
    """State with q normalised."""
    return State(*normalize(attitude(y)), y.omega1, y.omega2, y.omega3)


@scalar
def invariants(y: State, p: Parameters) -> Invariants:
    """Energy and angular momentum."""
    omega = (y.omega1, y.omega2, y.omega3)
    L = (p.I1 * omega[0], p.I2 * omega[1], p.I3 * omega[2])
    energy = 0.5 * fma(L[0], omega[0], fma(L[1], omega[1], L[2] * omega[2]))
    square = fma(L[0], L[0], fma(L[1], L[1], L[2] * L[2]))
    return Invariants(energy, square, *rotate(attitude(y), L))


@scalar
def rate(y: Any, p: Any) -> float:
    """Larger one of norm(omega) and norm(L) / I2, the rate of the turn about L [rad/s].

    It is that of every body whose step contains `free_rotation`.
    """
    omega = (y.omega1, y.omega2, y.omega3)
    momentum = (p.r12 * y.omega1, y.omega2, p.r32 * y.omega3)
    return sqrt(max(dot(omega, omega), dot(momentum, momentum)))


FREE_BODY = Dynamics(
    State, Input, Parameters, Invariants, derive, rhs, step, restore, invariants, rate=rate
)
