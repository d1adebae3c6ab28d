"""Heavy top: a rigid body turning about a pivot on its axis e3, in gravity; the pivot may move.

State y = (q, omega, pivot): attitude (w, x, y, z), angular velocity in body axes [rad/s], and
the pivot's horizontal position and velocity (X, Y, VX, VY) [m, m/s]. No Euler angle occurs, so
the upright top (theta = 0) is a state like any other.
Inputs u = (tau_body, tau_world, a): torque about the pivot, three components in body axes and
three in world axes [N m], and the pivot's horizontal acceleration (aX, aY) [m/s^2].
Parameters p = (I1, I2, I3 about the pivot, m, g, ell, and what `derive` makes of them); the
centre of mass stands at ell e3.
"""

from rigid_envs.kernels import batch
from rigid_envs.kernels.algebra import (
    Quaternion,
    Row,
    Vector,
    normalize,
    rotate,
    rotate_inverse,
    vertical,
)
from rigid_envs.kernels.batch import Array
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.composition import SUZUKI
from rigid_envs.kernels.elementary import fma
from rigid_envs.kernels.free_body import free_rotation, rotor

__all__ = ["INVARIANTS", "SHAPES", "WEIGHTS", "derive", "invariants", "restore", "rhs", "step"]

STATE = (1.0,) + (0.0,) * 10
INPUTS = (0.0,) * 8
PARAMETERS = (1.0,) * 15
SHAPES = (STATE, INPUTS, PARAMETERS)
WEIGHTS = SUZUKI
INVARIANTS = ("energy", "L_vertical", "L_spin", "pivot_velocity_x", "pivot_velocity_y")


@scalar
def derive(raw: Row) -> Row:
    """Parameter row p of (I1, I2, I3 [kg m^2], m [kg], g [m/s^2], ell [m])."""
    I1, I2, I3, m, g, ell = raw
    return (I1, I2, I3, m, g, ell, 1.0 / I1, 1.0 / I2, 1.0 / I3, *rotor(I1, I2, I3))


@scalar
def torque(q: Quaternion, u: Row, p: Row) -> Vector:
    """Total torque about the pivot in body axes [N m].

    Gravity and the inertial force of the moving pivot act at the centre of mass:
    tau = tau_body + R^T tau_world + ell e3 x R^T m (-aX, -aY, -g).
    """
    m, g, ell = p[3], p[4], p[5]
    f = rotate_inverse(q, (-m * u[6], -m * u[7], -m * g))
    t = rotate_inverse(q, (u[3], u[4], u[5]))
    return (u[0] + t[0] - ell * f[1], u[1] + t[1] + ell * f[0], u[2] + t[2])


@scalar
def rhs(y: Row, u: Row, p: Row) -> Row:
    """Euler's equations with the torque about the pivot; q' = q (0, omega) / 2; X' = V, V' = a.

    Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7, written without Euler angles.
    """
    w, x, y_, z, w1, w2, w3 = y[0], y[1], y[2], y[3], y[4], y[5], y[6]
    I1, I2, I3 = p[0], p[1], p[2]
    tau = torque((w, x, y_, z), u, p)
    return (
        -0.5 * (x * w1 + y_ * w2 + z * w3),
        0.5 * (w * w1 + y_ * w3 - z * w2),
        0.5 * (w * w2 + z * w1 - x * w3),
        0.5 * (w * w3 + x * w2 - y_ * w1),
        ((I2 - I3) * w2 * w3 + tau[0]) / I1,
        ((I3 - I1) * w3 * w1 + tau[1]) / I2,
        ((I1 - I2) * w1 * w2 + tau[2]) / I3,
        y[9],
        y[10],
        u[6],
        u[7],
    )


@scalar
def step(y: Row, u: Row, p: Row, h: float) -> Row:
    """Half a kick by all torques, the free rotation, half a kick: symmetric, second order.

    Gravity turns nothing about the vertical and nothing about e3, so the vertical momentum and
    (I1 = I2) the spin momentum are kept to rounding; the energy error stays bounded.
    """
    q = (y[0], y[1], y[2], y[3])
    omega = _kick(q, (y[4], y[5], y[6]), u, p, 0.5 * h)
    q, omega = free_rotation(q, omega, (p[9], p[10], p[11], p[12], p[13], p[14]), h)
    q = normalize(q)
    omega = _kick(q, omega, u, p, 0.5 * h)
    x, y_ = y[7] + h * fma(0.5 * h, u[6], y[9]), y[8] + h * fma(0.5 * h, u[7], y[10])
    return (*q, *omega, x, y_, fma(h, u[6], y[9]), fma(h, u[7], y[10]))


@scalar
def restore(y: Row) -> Row:
    """The same state with a quaternion of unit length: `step` has seen to that."""
    return y


@scalar
def _kick(q: Quaternion, omega: Vector, u: Row, p: Row, h: float) -> Vector:
    tau = torque(q, u, p)
    return (
        fma(h * p[6], tau[0], omega[0]),
        fma(h * p[7], tau[1], omega[1]),
        fma(h * p[8], tau[2], omega[2]),
    )


@scalar
def invariants(y: Row, p: Row) -> Row:
    """Energy [J], vertical and spin momentum [N m s] in the pivot's frame, pivot velocity [m/s].

    Constant without input; the spin momentum I3 omega3 for I1 = I2 only.
    """
    q, omega = (y[0], y[1], y[2], y[3]), (y[4], y[5], y[6])
    L = (p[0] * omega[0], p[1] * omega[1], p[2] * omega[2])
    kinetic = 0.5 * fma(L[0], omega[0], fma(L[1], omega[1], L[2] * omega[2]))
    energy = fma(p[3] * p[4] * p[5], vertical(q)[2], kinetic)
    return (energy, rotate(q, L)[2], L[2], y[9], y[10])


@kernel
def evaluate_rows(y: Array, u: Array, p: Array, out: Array) -> None:
    """`batch.evaluate` of this system."""
    batch.evaluate(rhs, SHAPES, y, u, p, out)


@kernel
def measure_rows(y: Array, p: Array, out: Array) -> None:
    """`batch.measure` of this system."""
    batch.measure(invariants, SHAPES, y, p, out)


@kernel
def simulate_rows(
    weights: Array,
    p: Array,
    u: Array,
    u_per_stage: bool,
    h: Array,
    n_substeps: Array,
    y: Array,
) -> None:
    """`batch.simulate` of this system."""
    batch.simulate(step, restore, weights, SHAPES, p, u, u_per_stage, h, n_substeps, y)
