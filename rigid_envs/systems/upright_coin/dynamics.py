"""Upright coin: a wheel held upright that rolls and is steered on a plane, level or inclined.

The axis e3 is parallel to the plane: R = Rz(phi) Rx(pi/2) Rz(psi). World z is the normal of the
plane; gravity is g (sin(slope), 0, -cos(slope)), so that x points downhill.
"""

from typing import NamedTuple

from rigid_envs.engine import algebra
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.dynamics import Dynamics, unchanged
from rigid_envs.engine.elementary import fma, sincos


class State(NamedTuple):
    """Attitude q, point of contact [m], rates phi' about the normal and psi' about e3 [rad/s]."""

    w: float = 0.7071067811865476
    x: float = 0.7071067811865476
    y: float = 0.0
    z: float = 0.0
    X: float = 0.0
    Y: float = 0.0
    steer_rate: float = 0.0
    roll_rate: float = 0.0


class Input(NamedTuple):
    """Torque about the normal and about the axis [N m]."""

    tau_steer: float
    tau_drive: float


class Parameters(NamedTuple):
    """m [kg], radius [m], I1, I3 [kg m^2], g [m/s^2], slope [rad], mu; see `derive`."""

    m: float
    radius: float
    I1: float
    I3: float
    g: float
    slope: float
    mu: float
    inverse1: float
    inverse_contact: float
    pull: float


class Invariants(NamedTuple):
    """Energy [J] and steer rate [rad/s]."""

    energy: float
    steer_rate: float


@scalar
def derive(
    m: float, radius: float, I1: float, I3: float, g: float, slope: float, mu: float
) -> Parameters:
    """Parameter row: physical, 1 / I1, 1 / (I3 + m r^2), m g sin(slope) r / (I3 + m r^2).

    The moment about the contact is I3 + m r^2.
    """
    inertia = I3 + m * radius * radius
    pull = m * g * sincos(slope)[0] * radius / inertia
    return Parameters(m, radius, I1, I3, g, slope, mu, 1.0 / I1, 1.0 / inertia, pull)


@scalar
def heading(q: algebra.Quaternion) -> tuple[float, float]:
    """Direction of travel l = e3 x e_z = (e3_y, -e3_x): (-cos phi, -sin phi)."""
    w, x, y, z = q
    return 2.0 * fma(y, z, -w * x), -2.0 * fma(x, z, w * y)


@scalar
def rhs(y: State, u: Input, p: Parameters) -> State:
    """Equations of steering and rolling, and the velocity of the contact.

    ``I1 phi'' = tau_steer``, ``(I3 + m r^2) psi'' = tau_drive + m g sin(slope) r l_x``, and
    ``(X', Y') = r psi' l``.

    Bloch, *Nonholonomic Mechanics and Control*, sections 1.4 and 1.6.
    """
    w, x, y_, z = algebra.attitude(y)
    steer, roll = y.steer_rate, y.roll_rate
    lx, ly = heading(algebra.attitude(y))
    inertia = p.I3 + p.m * p.radius * p.radius
    return State(
        -0.5 * (steer * z + roll * z),
        0.5 * (-steer * y_ + roll * y_),
        0.5 * (steer * x - roll * x),
        0.5 * (steer * w + roll * w),
        p.radius * roll * lx,
        p.radius * roll * ly,
        u.tau_steer / p.I1,
        (u.tau_drive + p.m * p.g * sincos(p.slope)[0] * p.radius * lx) / inertia,
    )


@scalar
def step(y: State, u: Input, p: Parameters, h: float) -> State:
    """Half a kick, the exact arc at constant rates, half a kick: symmetric, second order."""
    q = algebra.attitude(y)
    lx, ly = heading(q)
    steer = fma(0.5 * h * p.inverse1, u.tau_steer, y.steer_rate)
    roll = fma(0.5 * h, fma(p.inverse_contact, u.tau_drive, p.pull * lx), y.roll_rate)
    half_phi, half_psi = 0.5 * h * steer, 0.5 * h * roll
    stretch = algebra.tangent(half_phi * half_phi)
    a, b = half_phi * stretch, half_psi * algebra.tangent(half_psi * half_psi)
    q = algebra.normalize(
        algebra.compose((1.0, 0.0, 0.0, a), algebra.compose(q, (1.0, 0.0, 0.0, b)))
    )
    versine, sine = algebra.cayley(a)
    after_x = fma(-sine, ly, -versine * lx) + lx
    after_y = fma(sine, lx, -versine * ly) + ly
    # The mean of l over the arc is the mean of its ends times tan(x) / x, x half the turn.
    chord = 0.5 * h * p.radius * roll * stretch
    X, Y = fma(chord, lx + after_x, y.X), fma(chord, ly + after_y, y.Y)
    steer = fma(0.5 * h * p.inverse1, u.tau_steer, steer)
    roll = fma(0.5 * h, fma(p.inverse_contact, u.tau_drive, p.pull * after_x), roll)
    return State(*q, X, Y, steer, roll)


@scalar
def invariants(y: State, p: Parameters) -> Invariants:
    """Energy (I1 phi'^2 + (I3 + m r^2) psi'^2) / 2 - m g sin(slope) X [J], steer rate [rad/s]."""
    inertia = fma(p.m * p.radius, p.radius, p.I3)
    kinetic = 0.5 * fma(p.I1 * y.steer_rate, y.steer_rate, inertia * y.roll_rate * y.roll_rate)
    return Invariants(fma(-p.pull * inertia / p.radius, y.X, kinetic), y.steer_rate)


@scalar
def ground_force(y: State, u: Input, p: Parameters) -> algebra.Vector:
    """Force of the plane, m v' - m g, in world axes [N]; v' = radius (psi'' l + phi' psi' e_z x l).

    The normal force is constant, as the centre stays at the same height.
    """
    lx, ly = heading(algebra.attitude(y))
    push = p.m * p.radius
    ahead, aside = push * rhs(y, u, p).roll_rate, push * y.steer_rate * y.roll_rate
    s, c = sincos(p.slope)
    weight = p.m * p.g
    return (ahead * lx - aside * ly - weight * s, ahead * ly + aside * lx, weight * c)


UPRIGHT_COIN = Dynamics(
    State,
    Input,
    Parameters,
    Invariants,
    derive,
    rhs,
    step,
    unchanged,
    invariants,
    contact=algebra.on_ground(ground_force, 3),
)
