"""Heavy top: a rigid body that turns about a pivot on its axis e3, in gravity; the pivot can move.

State y = (q, omega, pivot): attitude, angular velocity in body axes and the pivot's horizontal
motion. There are no Euler angles, so the upright top (theta = 0) is not singular. The centre of
mass is at ell e3.
"""

from typing import NamedTuple

from rigid_envs.engine import algebra
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.dynamics import Dynamics, unchanged
from rigid_envs.engine.elementary import fma
from rigid_envs.systems.free_body.dynamics import free_rotation, rate, rotor


class State(NamedTuple):
    """Attitude q, angular velocity in body axes [rad/s], position and velocity of the pivot [m]."""

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
    """Torque about the pivot, in body and in world axes [N m]; pivot's acceleration [m/s^2]."""

    tau_body1: float
    tau_body2: float
    tau_body3: float
    tau_world_x: float
    tau_world_y: float
    tau_world_z: float
    aX: float
    aY: float


class Parameters(NamedTuple):
    """Moments about the pivot [kg m^2], m [kg], g [m/s^2], ell [m]; inverses, ratios of `rotor`."""

    I1: float
    I2: float
    I3: float
    m: float
    g: float
    ell: float
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
    """Energy [J], vertical and spin momentum [N m s] in the pivot's frame, pivot velocity [m/s]."""

    energy: float
    L_vertical: float
    L_spin: float
    pivot_velocity_x: float
    pivot_velocity_y: float


@scalar
def derive(I1: float, I2: float, I3: float, m: float, g: float, ell: float) -> Parameters:
    """Parameter row of moments about the pivot [kg m^2], m [kg], g [m/s^2], ell [m]."""
    k1, k3, r12, r21, r23, r32 = rotor(I1, I2, I3)
    inverses = (1.0 / I1, 1.0 / I2, 1.0 / I3)
    return Parameters(I1, I2, I3, m, g, ell, *inverses, k1, k3, r12, r21, r23, r32)


@scalar
def torque(q: algebra.Quaternion, u: Input, p: Parameters) -> algebra.Vector:
    """Total torque about the pivot in body axes [N m].

    Gravity and the inertial force of the moving pivot act at the centre of mass:
    tau = tau_body + R^T tau_world + ell e3 x R^T m (-aX, -aY, -g).
    """
    ell = p.ell
    f = algebra.rotate_inverse(q, (-p.m * u.aX, -p.m * u.aY, -p.m * p.g))
    t = algebra.rotate_inverse(q, (u.tau_world_x, u.tau_world_y, u.tau_world_z))
    return (
        u.tau_body1 + t[0] - ell * f[1],
        u.tau_body2 + t[1] + ell * f[0],
        u.tau_body3 + t[2],
    )


@scalar
def rhs(y: State, u: Input, p: Parameters) -> State:
    """Euler's equations with the torque about the pivot; q' = q (0, omega) / 2; X' = V, V' = a.

    Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7, written without Euler angles.
    """
    w1, w2, w3 = y.omega1, y.omega2, y.omega3
    tau = torque(algebra.attitude(y), u, p)
    return State(
        *algebra.turning(algebra.attitude(y), (w1, w2, w3)),
        ((p.I2 - p.I3) * w2 * w3 + tau[0]) / p.I1,
        ((p.I3 - p.I1) * w3 * w1 + tau[1]) / p.I2,
        ((p.I1 - p.I2) * w1 * w2 + tau[2]) / p.I3,
        y.VX,
        y.VY,
        u.aX,
        u.aY,
    )


@scalar
def step(y: State, u: Input, p: Parameters, h: float) -> State:
    """Half a kick by all torques, the free rotation, half a kick: symmetric, second order.

    Gravity has no torque about the vertical and none about e3, so the vertical momentum and (I1 =
    I2) the spin momentum are conserved to rounding; the energy error stays bounded.
    """
    omega = _kick(algebra.attitude(y), (y.omega1, y.omega2, y.omega3), u, p, 0.5 * h)
    ratios = (p.k1, p.k3, p.r12, p.r21, p.r23, p.r32)
    q, omega = free_rotation(algebra.attitude(y), omega, ratios, h)
    q = algebra.normalize(q)
    omega = _kick(q, omega, u, p, 0.5 * h)
    X, Y = y.X + h * fma(0.5 * h, u.aX, y.VX), y.Y + h * fma(0.5 * h, u.aY, y.VY)
    return State(*q, *omega, X, Y, fma(h, u.aX, y.VX), fma(h, u.aY, y.VY))


@scalar
def _kick(
    q: algebra.Quaternion, omega: algebra.Vector, u: Input, p: Parameters, h: float
) -> algebra.Vector:
    tau = torque(q, u, p)
    return (
        fma(h * p.inverse1, tau[0], omega[0]),
        fma(h * p.inverse2, tau[1], omega[1]),
        fma(h * p.inverse3, tau[2], omega[2]),
    )


@scalar
def invariants(y: State, p: Parameters) -> Invariants:
    """Energy [J], vertical and spin momentum [N m s] in the pivot's frame, pivot velocity [m/s].

    Conserved without input; the spin momentum I3 omega3 for I1 = I2 only.
    """
    q, omega = algebra.attitude(y), (y.omega1, y.omega2, y.omega3)
    L = (p.I1 * omega[0], p.I2 * omega[1], p.I3 * omega[2])
    kinetic = 0.5 * fma(L[0], omega[0], fma(L[1], omega[1], L[2] * omega[2]))
    energy = fma(p.m * p.g * p.ell, algebra.vertical(q)[2], kinetic)
    return Invariants(energy, algebra.rotate(q, L)[2], L[2], y.VX, y.VY)


HEAVY_TOP = Dynamics(
    State, Input, Parameters, Invariants, derive, rhs, step, unchanged, invariants, rate=rate
)
