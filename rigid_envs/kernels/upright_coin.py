"""Upright coin: a wheel held upright that rolls and is steered on a plane, level or inclined.

State y = (q, X, Y, steer_rate, roll_rate): attitude (w, x, y, z), point of contact [m], and the
rates phi' about the normal of the plane and psi' about the axis e3 [rad/s]. The axis stays in the
plane: R = Rz(phi) Rx(pi/2) Rz(psi).
Inputs u = (tau_steer, tau_drive): torque about the normal and about the axis [N m].
Parameters p = (m, radius, I1, I3, g, slope, 1 / I1, 1 / (I3 + m r^2), m g sin(slope) r / (I3 + m
r^2)). World z is the normal of the plane; gravity is g (sin(slope), 0, -cos(slope)), so that x
points downhill.
"""

from rigid_envs.kernels import batch
from rigid_envs.kernels.algebra import Quaternion, Row, compose, normalize
from rigid_envs.kernels.batch import Array
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.composition import SUZUKI
from rigid_envs.kernels.elementary import fma, sincos
from rigid_envs.kernels.turns import cayley, tangent

__all__ = ["INVARIANTS", "SHAPES", "WEIGHTS", "derive", "invariants", "restore", "rhs", "step"]

STATE = (0.7071067811865476, 0.7071067811865476) + (0.0,) * 6
INPUTS = (0.0,) * 2
PARAMETERS = (1.0,) * 9
SHAPES = (STATE, INPUTS, PARAMETERS)
WEIGHTS = SUZUKI
INVARIANTS = ("energy", "steer_rate")


@scalar
def derive(raw: Row) -> Row:
    """Parameter row p of (m [kg], radius [m], I1, I3 [kg m^2], g [m/s^2], slope [rad])."""
    m, radius, I1, I3, g, slope = raw
    inertia = I3 + m * radius * radius
    pull = m * g * sincos(slope)[0] * radius / inertia
    return (m, radius, I1, I3, g, slope, 1.0 / I1, 1.0 / inertia, pull)


@scalar
def heading(q: Quaternion) -> tuple[float, float]:
    """The direction of travel l = e3 x e_z = (e3_y, -e3_x): (-cos phi, -sin phi)."""
    w, x, y, z = q
    return 2.0 * fma(y, z, -w * x), -2.0 * fma(x, z, w * y)


@scalar
def rhs(y: Row, u: Row, p: Row) -> Row:
    """Steering, rolling, and the way of the contact.

    ``I1 phi'' = tau_steer``, ``(I3 + m r^2) psi'' = tau_drive + m g sin(slope) r l_x``, and
    ``(X', Y') = r psi' l``.

    Bloch, *Nonholonomic Mechanics and Control*, sections 1.4 and 1.6.
    """
    w, x, y_, z, steer, roll = y[0], y[1], y[2], y[3], y[6], y[7]
    lx, ly = heading((w, x, y_, z))
    inertia = p[3] + p[0] * p[1] * p[1]
    return (
        -0.5 * (steer * z + roll * z),
        0.5 * (-steer * y_ + roll * y_),
        0.5 * (steer * x - roll * x),
        0.5 * (steer * w + roll * w),
        p[1] * roll * lx,
        p[1] * roll * ly,
        u[0] / p[2],
        (u[1] + p[0] * p[4] * sincos(p[5])[0] * p[1] * lx) / inertia,
    )


@scalar
def step(y: Row, u: Row, p: Row, h: float) -> Row:
    """Half a kick, the exact arc at constant rates, half a kick: symmetric, second order."""
    q = (y[0], y[1], y[2], y[3])
    lx, ly = heading(q)
    steer = fma(0.5 * h * p[6], u[0], y[6])
    roll = fma(0.5 * h, fma(p[7], u[1], p[8] * lx), y[7])
    half_phi, half_psi = 0.5 * h * steer, 0.5 * h * roll
    stretch = tangent(half_phi * half_phi)
    a, b = half_phi * stretch, half_psi * tangent(half_psi * half_psi)
    q = normalize(compose((1.0, 0.0, 0.0, a), compose(q, (1.0, 0.0, 0.0, b))))
    versine, sine = cayley(a)
    after_x = fma(-sine, ly, -versine * lx) + lx
    after_y = fma(sine, lx, -versine * ly) + ly
    # The mean of l over the arc is the mean of its ends times tan(x) / x, x half the turn.
    way = 0.5 * h * p[1] * roll * stretch
    x, y_ = fma(way, lx + after_x, y[4]), fma(way, ly + after_y, y[5])
    steer = fma(0.5 * h * p[6], u[0], steer)
    roll = fma(0.5 * h, fma(p[7], u[1], p[8] * after_x), roll)
    return (*q, x, y_, steer, roll)


@scalar
def restore(y: Row) -> Row:
    """The same state with a quaternion of unit length: `step` has seen to that."""
    return y


@scalar
def invariants(y: Row, p: Row) -> Row:
    """Energy (I1 phi'^2 + (I3 + m r^2) psi'^2) / 2 - m g sin(slope) X [J], steer rate [rad/s]."""
    inertia = fma(p[0] * p[1], p[1], p[3])
    kinetic = 0.5 * fma(p[2] * y[6], y[6], inertia * y[7] * y[7])
    return (fma(-p[8] * inertia / p[1], y[4], kinetic), y[6])


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
