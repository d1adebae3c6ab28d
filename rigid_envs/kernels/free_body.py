"""Free rigid body under a body torque.

State y = (q, omega): attitude (w, x, y, z) and angular velocity in body axes [rad/s].
Inputs u = (tau_1, tau_2, tau_3), torque in body axes [N m].
Parameters p = (I1, I2, I3, and what `derive` makes of them).
"""

from rigid_envs.kernels import batch
from rigid_envs.kernels.algebra import Quaternion, Row, Vector, compose, normalize, rotate
from rigid_envs.kernels.batch import Array
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.composition import SUZUKI
from rigid_envs.kernels.elementary import fma
from rigid_envs.kernels.turns import cayley, tangent

__all__ = [
    "INVARIANTS",
    "SHAPES",
    "WEIGHTS",
    "derive",
    "free_rotation",
    "invariants",
    "restore",
    "rhs",
    "rotor",
    "step",
]

STATE = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
INPUTS = (0.0,) * 3
PARAMETERS = (1.0,) * 12
SHAPES = (STATE, INPUTS, PARAMETERS)
WEIGHTS = SUZUKI
INVARIANTS = ("energy", "L_squared", "L_world_x", "L_world_y", "L_world_z")

Turned = tuple[Quaternion, float, float]


@scalar
def rotor(I1: float, I2: float, I3: float) -> Row:
    """Ratios of the moments that the free rotation needs."""
    return (1.0 - I1 / I2, 1.0 - I3 / I2, I1 / I2, I2 / I1, I2 / I3, I3 / I2)


@scalar
def derive(raw: Row) -> Row:
    """Parameter row p of the moments (I1, I2, I3) [kg m^2]."""
    I1, I2, I3 = raw
    return (I1, I2, I3, 1.0 / I1, 1.0 / I2, 1.0 / I3, *rotor(I1, I2, I3))


@scalar
def rhs(y: Row, u: Row, p: Row) -> Row:
    """Euler's equations I omega' = I omega x omega + tau, and q' = q (0, omega) / 2.

    Landau & Lifshitz, *Mechanics*, section 36.
    """
    w, x, y_, z, w1, w2, w3 = y
    I1, I2, I3 = p[0], p[1], p[2]
    return (
        -0.5 * (x * w1 + y_ * w2 + z * w3),
        0.5 * (w * w1 + y_ * w3 - z * w2),
        0.5 * (w * w2 + z * w1 - x * w3),
        0.5 * (w * w3 + x * w2 - y_ * w1),
        ((I2 - I3) * w2 * w3 + u[0]) / I1,
        ((I3 - I1) * w3 * w1 + u[1]) / I2,
        ((I1 - I2) * w1 * w2 + u[2]) / I3,
    )


@scalar
def free_rotation(q: Quaternion, omega: Vector, ratios: Row, h: float) -> tuple[Quaternion, Vector]:
    """One symmetric second-order step of the free rotation: (c q, omega) after h [s].

    The energy is split into three parts that can each be integrated exactly,
    ``|L|^2 / 2 I2  +  L1^2 / 2 (1/I1 - 1/I2)  +  L3^2 / 2 (1/I3 - 1/I2)``: the first turns the
    attitude about L and leaves L in the body unchanged, the others turn the body about e1 and e3
    (McLachlan 1993, doi:10.1103/PhysRevLett.71.3043; Hairer, Lubich & Wanner, section VII.5).
    Each turn is the quaternion (1, a e) with a near tan(angle / 2): exactly a rotation for any a,
    so |L| and the angular momentum in space are kept to rounding, without a call to sin or cos.
    The quaternion grows by the factor c > 1; the caller rescales it.
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
def step(y: Row, u: Row, p: Row, h: float) -> Row:
    """Half a kick by the torque, the free rotation, half a kick: symmetric, second order.

    The quaternion returned is not of unit length; `restore` makes it so.
    """
    k1, k2, k3 = 0.5 * h * p[3], 0.5 * h * p[4], 0.5 * h * p[5]
    kicked = (fma(k1, u[0], y[4]), fma(k2, u[1], y[5]), fma(k3, u[2], y[6]))
    ratios = (p[6], p[7], p[8], p[9], p[10], p[11])
    q, omega = free_rotation((y[0], y[1], y[2], y[3]), kicked, ratios, h)
    return (*q, fma(k1, u[0], omega[0]), fma(k2, u[1], omega[1]), fma(k3, u[2], omega[2]))


@scalar
def restore(y: Row) -> Row:
    """The same state with a quaternion of unit length."""
    return (*normalize((y[0], y[1], y[2], y[3])), y[4], y[5], y[6])


@scalar
def invariants(y: Row, p: Row) -> Row:
    """Kinetic energy [J], |L|^2 and L in world axes [N m s]: constant without torque."""
    omega = (y[4], y[5], y[6])
    L = (p[0] * omega[0], p[1] * omega[1], p[2] * omega[2])
    energy = 0.5 * fma(L[0], omega[0], fma(L[1], omega[1], L[2] * omega[2]))
    square = fma(L[0], L[0], fma(L[1], L[1], L[2] * L[2]))
    L_world = rotate((y[0], y[1], y[2], y[3]), L)
    return (energy, square, L_world[0], L_world[1], L_world[2])


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
