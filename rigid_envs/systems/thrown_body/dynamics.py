"""Thrown rigid body: free rotation, and a centre of mass that falls.

State y = (q, omega, position, velocity): attitude, angular velocity in body axes, and the motion of
the centre of mass in the world, whose z points up.
"""

from typing import Any, NamedTuple

from rigid_envs.engine.algebra import Row, attitude, dot
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.dynamics import Dynamics
from rigid_envs.engine.elementary import fma
from rigid_envs.systems.free_body import dynamics as free
from rigid_envs.systems.free_body.dynamics import rate, rotor

# The functions of the free body read input and parameters by name, u and p: Any where they do.


class State(NamedTuple):
    """Attitude q, angular velocity in body axes [rad/s], position [m] and velocity [m/s]."""

    w: float = 1.0
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    omega1: float = 0.0
    omega2: float = 0.0
    omega3: float = 0.0
    X: float = 0.0
    Y: float = 0.0
    Z: float = 0.0
    VX: float = 0.0
    VY: float = 0.0
    VZ: float = 0.0


class Input(NamedTuple):
    """Torque in body axes [N m]; force in world axes, through the centre of mass [N]."""

    tau1: float
    tau2: float
    tau3: float
    FX: float
    FY: float
    FZ: float


class Parameters(NamedTuple):
    """Moments [kg m^2], m [kg], g [m/s^2], inverses, and the ratios of `free_body`'s `rotor`."""

    I1: float
    I2: float
    I3: float
    m: float
    g: float
    inverse1: float
    inverse2: float
    inverse3: float
    inverse_m: float
    k1: float
    k3: float
    r12: float
    r21: float
    r23: float
    r32: float


class Invariants(NamedTuple):
    """Kept in flight: energy [J], |L|^2, L in world axes [N m s], horizontal velocity [m/s]."""

    energy: float
    L_squared: float
    L_world_x: float
    L_world_y: float
    L_world_z: float
    velocity_x: float
    velocity_y: float


@scalar
def derive(I1: float, I2: float, I3: float, m: float, g: float) -> Parameters:
    """Parameter row of the principal moments [kg m^2], m [kg] and g [m/s^2]."""
    inverses = (1.0 / I1, 1.0 / I2, 1.0 / I3, 1.0 / m)
    return Parameters(I1, I2, I3, m, g, *inverses, *rotor(I1, I2, I3))


@scalar
def _turning(y: State) -> free.State:
    return free.State(*attitude(y), y.omega1, y.omega2, y.omega3)


@scalar
def _state(turn: free.State, centre: Row) -> State:
    """State of a turn, and of position and velocity of the centre of mass; rates likewise."""
    return State(*attitude(turn), turn.omega1, turn.omega2, turn.omega3, *centre)


@scalar
def _acceleration(u: Input, p: Parameters) -> Row:
    return (u.FX * p.inverse_m, u.FY * p.inverse_m, fma(u.FZ, p.inverse_m, -p.g))


@scalar
def rhs(y: State, u: Any, p: Any) -> State:
    """Euler's equations of the free body; ``m x'' = F - m g z``."""
    flight = (y.VX, y.VY, y.VZ, *_acceleration(u, p))
    return _state(free.rhs(_turning(y), u, p), flight)


@scalar
def step(y: State, u: Any, p: Any, h: float) -> State:
    """A step of the free body, and the exact parabola of its centre of mass."""
    aX, aY, aZ = _acceleration(u, p)
    flight = (
        y.X + h * fma(0.5 * h, aX, y.VX),
        y.Y + h * fma(0.5 * h, aY, y.VY),
        y.Z + h * fma(0.5 * h, aZ, y.VZ),
        fma(h, aX, y.VX),
        fma(h, aY, y.VY),
        fma(h, aZ, y.VZ),
    )
    return _state(free.step(_turning(y), u, p, h), flight)


@scalar
def restore(y: State) -> State:
    """State with q normalised."""
    return _state(free.restore(_turning(y)), (y.X, y.Y, y.Z, y.VX, y.VY, y.VZ))


@scalar
def invariants(y: State, p: Any) -> Invariants:
    """Energy of rotation and flight, angular momentum about the centre of mass, what flies on."""
    turn, velocity = free.invariants(_turning(y), p), (y.VX, y.VY, y.VZ)
    energy = turn.energy + p.m * fma(0.5, dot(velocity, velocity), p.g * y.Z)
    L = (turn.L_world_x, turn.L_world_y, turn.L_world_z)
    return Invariants(energy, turn.L_squared, *L, y.VX, y.VY)


THROWN_BODY = Dynamics(
    State, Input, Parameters, Invariants, derive, rhs, step, restore, invariants, rate=rate
)
