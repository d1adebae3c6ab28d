"""Ball that rolls on the plane z = 0 without slipping, at a given velocity.

State y = (q, X, Y): attitude (w, x, y, z) and position of the centre [m].
"""

from typing import NamedTuple

from rigid_envs.engine.algebra import (
    EXACT,
    Vector,
    attitude,
    compose,
    half_turn,
    normalize_near_unit,
)
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.dynamics import Dynamics
from rigid_envs.engine.elementary import fma


class State(NamedTuple):
    """Attitude q = (w, x, y, z) and position of the centre [m]."""

    w: float = 1.0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    X: float = 0.0
    Y: float = 0.0


class Input(NamedTuple):
    """Velocity of the centre [m/s], angular velocity about the vertical [rad/s]."""

    VX: float
    VY: float
    spin: float


class Parameters(NamedTuple):
    """Radius [m] and its inverse [1/m]."""

    radius: float
    inverse_radius: float


class Invariants(NamedTuple):
    """Squared norm of q; a kinematic system has no energy, and `rhs` satisfies the constraint."""

    q_squared: float


@scalar
def derive(radius: float) -> Parameters:
    """Parameter row of the radius [m]."""
    return Parameters(radius, 1.0 / radius)


@scalar
def rolling_rate(u: Input, p: Parameters) -> Vector:
    """Angular velocity of rolling in world axes [rad/s], from v_centre = omega x radius e_z."""
    return (-u.VY * p.inverse_radius, u.VX * p.inverse_radius, u.spin)


@scalar
def rhs(y: State, u: Input, p: Parameters) -> State:
    """Rates q' = (0, omega_world) q / 2, X' = VX, Y' = VY.

    Jurdjevic, "The geometry of the plate-ball problem" (1993), doi:10.1007/BF00375605.
    """
    w, x, y_, z = attitude(y)
    a, b, c = rolling_rate(u, p)
    return State(
        -0.5 * (a * x + b * y_ + c * z),
        0.5 * (a * w + b * z - c * y_),
        0.5 * (b * w + c * x - a * z),
        0.5 * (c * w + a * y_ - b * x),
        u.VX,
        u.VY,
    )


@scalar
def step(y: State, u: Input, p: Parameters, h: float) -> State:
    """Exact flow for constant input: one rotation about a fixed world axis.

    The rotation is exact to rounding for turns up to pi / 2 per step.
    """
    half = 0.5 * h
    omega = rolling_rate(u, p)
    turn = half_turn((half * omega[0], half * omega[1], half * omega[2]))
    return State(*compose(turn, attitude(y)), fma(h, u.VX, y.X), fma(h, u.VY, y.Y))


@scalar
def restore(y: State) -> State:
    """State with q normalised, against the accumulation of rounding errors."""
    return State(*normalize_near_unit(attitude(y)), y.X, y.Y)


@scalar
def invariants(y: State, p: Parameters) -> Invariants:
    """Squared norm of q."""
    w, x, y_, z = attitude(y)
    return Invariants(fma(w, w, fma(x, x, fma(y_, y_, z * z))))


ROLLING_BALL = Dynamics(
    State, Input, Parameters, Invariants, derive, rhs, step, restore, invariants, weights=EXACT
)
