"""Ball rolling on the plane z = 0 without slipping, its velocity given.

State y = (q, X, Y): attitude (w, x, y, z) and position of the centre [m].
Inputs u = (VX, VY, spin): velocity of the centre [m/s], angular velocity about the vertical
[rad/s]. Parameters p = (radius [m], 1 / radius).
"""

from rigid_envs.kernels import batch
from rigid_envs.kernels.algebra import Row, Vector, compose, normalize_near_unit
from rigid_envs.kernels.batch import Array
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.composition import EXACT
from rigid_envs.kernels.elementary import fma
from rigid_envs.kernels.turns import half_turn

__all__ = [
    "INVARIANTS",
    "SHAPES",
    "WEIGHTS",
    "derive",
    "invariants",
    "restore",
    "rhs",
    "rolling_rate",
    "step",
]

STATE = (1.0,) + (0.0,) * 5
INPUTS = (0.0,) * 3
PARAMETERS = (1.0,) * 2
SHAPES = (STATE, INPUTS, PARAMETERS)
WEIGHTS = EXACT
INVARIANTS = ("q_squared",)


@scalar
def derive(raw: Row) -> Row:
    """Parameter row p of (radius [m],)."""
    return (raw[0], 1.0 / raw[0])


@scalar
def rolling_rate(u: Row, p: Row) -> Vector:
    """Angular velocity in world axes [rad/s] that rolls: v_centre = omega x radius e_z."""
    return (-u[1] * p[1], u[0] * p[1], u[2])


@scalar
def rhs(y: Row, u: Row, p: Row) -> Row:
    """The rates q' = (0, omega_world) q / 2, X' = VX, Y' = VY.

    Jurdjevic, "The geometry of the plate-ball problem" (1993), doi:10.1007/BF00375605.
    """
    w, x, y_, z = y[0], y[1], y[2], y[3]
    a, b, c = rolling_rate(u, p)
    return (
        -0.5 * (a * x + b * y_ + c * z),
        0.5 * (a * w + b * z - c * y_),
        0.5 * (b * w + c * x - a * z),
        0.5 * (c * w + a * y_ - b * x),
        u[0],
        u[1],
    )


@scalar
def step(y: Row, u: Row, p: Row, h: float) -> Row:
    """Exact flow for constant input: one rotation about a fixed world axis.

    The rotation is exact to rounding for turns up to pi / 2 per step.
    """
    half = 0.5 * h
    omega = rolling_rate(u, p)
    turn = half_turn((half * omega[0], half * omega[1], half * omega[2]))
    q = compose(turn, (y[0], y[1], y[2], y[3]))
    return (*q, fma(h, u[0], y[4]), fma(h, u[1], y[5]))


@scalar
def restore(y: Row) -> Row:
    """The same state with a quaternion of unit length: roundings of many turns add up."""
    return (*normalize_near_unit((y[0], y[1], y[2], y[3])), y[4], y[5])


@scalar
def invariants(y: Row, p: Row) -> Row:
    """Squared norm of q; the ball is kinematic, its only constraint is built into `rhs`."""
    return (fma(y[0], y[0], fma(y[1], y[1], fma(y[2], y[2], y[3] * y[3]))),)


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
