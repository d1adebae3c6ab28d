"""Roller: a wheel, sphere or hoop that rolls without slipping on an incline or in a valley.

State y = (s, v): way of the centre along its path [m], positive downhill at s = 0, and velocity
[m/s]. Inputs u = (force, beta_change): force along the path, at the centre [N], and what is added
to the inertia ratio while the input is held.
Parameters p = (m, radius, beta, g, slope, curvature, mu, 1 / (1 + beta), 1 / m): beta is
I / (m r^2); the path descends by the angle slope - curvature * s, a straight line or a circular
arc; on mu, the coefficient of friction, the motion does not depend.
"""

from rigid_envs.kernels import batch
from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.batch import Array
from rigid_envs.kernels.compiler import kernel, scalar
from rigid_envs.kernels.composition import SUZUKI
from rigid_envs.kernels.elementary import fma, sincos

__all__ = ["INVARIANTS", "SHAPES", "WEIGHTS", "derive", "invariants", "restore", "rhs", "step"]

STATE = (0.0,) * 2
INPUTS = (0.0,) * 2
PARAMETERS = (1.0,) * 9
SHAPES = (STATE, INPUTS, PARAMETERS)
WEIGHTS = SUZUKI
INVARIANTS = ("energy",)


@scalar
def derive(raw: Row) -> Row:
    """Parameter row p of (m [kg], radius [m], beta, g [m/s^2], slope [rad], curvature, mu)."""
    m, radius, beta, g, slope, curvature, mu = raw
    return (m, radius, beta, g, slope, curvature, mu, 1.0 / (1.0 + beta), 1.0 / m)


@scalar
def acceleration(s: float, u: Row, p: Row) -> float:
    """``(1 + beta + beta_change) v' = g sin(slope - curvature s) + force / m``.

    Rolling turns the body, too.
    """
    pull = p[7] * fma(p[3], sincos(fma(-p[5], s, p[4]))[0], u[0] * p[8])
    return pull / fma(p[7], u[1], 1.0)


@scalar
def rhs(y: Row, u: Row, p: Row) -> Row:
    """The rates s' = v and v'. Goldstein, Poole & Safko, *Classical Mechanics*, section 2.4."""
    return (y[1], acceleration(y[0], u, p))


@scalar
def step(y: Row, u: Row, p: Row, h: float) -> Row:
    """Half a kick, a drift, half a kick: symplectic, second order; exact on an incline."""
    v = fma(0.5 * h, acceleration(y[0], u, p), y[1])
    s = fma(h, v, y[0])
    return (s, fma(0.5 * h, acceleration(s, u, p), v))


@scalar
def restore(y: Row) -> Row:
    """The same state: nothing is normalised here."""
    return y


@scalar
def invariants(y: Row, p: Row) -> Row:
    """Energy (1 + beta) m v^2 / 2 + m g height [J], the height 0 at s = 0; constant without input.

    The path has sunk by sin(x) / x sin(slope - curvature s / 2) s there, with x = curvature s / 2.
    """
    x = 0.5 * p[5] * y[0]
    mean = sincos(p[4] - x)[0]
    sunk = y[0] * mean * ratio(x)
    return (p[0] * fma(0.5 * (1.0 + p[2]) * y[1], y[1], -p[3] * sunk),)


@scalar
def ratio(x: float) -> float:
    """sin(x) / x, 1 at 0."""
    return sincos(x)[0] / x if x != 0.0 else 1.0


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
