"""Roller: a wheel, sphere or hoop that rolls without slipping on an incline or in a valley.

State y = (s, v): arc length of the centre along its path, positive downhill at s = 0, and velocity.
The ratio beta is I / (m r^2); the path descends by the angle slope - curvature * s, a straight line
or a circular arc. The motion does not depend on mu, the coefficient of friction.
"""

from typing import NamedTuple

from rigid_envs.engine.algebra import on_ground
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.dynamics import Dynamics, unchanged
from rigid_envs.engine.elementary import fma, sincos, sine_ratio


class State(NamedTuple):
    """Arc length of the centre along its path [m], and velocity [m/s]."""

    s: float = 0.0
    v: float = 0.0


class Input(NamedTuple):
    """Force along the path [N], and addition to the inertia ratio."""

    force: float
    beta_change: float


class Parameters(NamedTuple):
    """m [kg], radius [m], beta, g [m/s^2], slope [rad], curvature [1/m], mu; see `derive`."""

    m: float
    radius: float
    beta: float
    g: float
    slope: float
    curvature: float
    mu: float
    share: float
    inverse_m: float


class Invariants(NamedTuple):
    """Energy [J]."""

    energy: float


@scalar
def derive(
    m: float, radius: float, beta: float, g: float, slope: float, curvature: float, mu: float
) -> Parameters:
    """Parameter row of the physical parameters, 1 / (1 + beta) and 1 / m."""
    return Parameters(
        m, radius, beta, g, slope, curvature, mu, share=1.0 / (1.0 + beta), inverse_m=1.0 / m
    )


@scalar
def acceleration(s: float, u: Input, p: Parameters) -> float:
    """Acceleration along the path [m/s^2], with the rotational inertia of rolling.

    ``(1 + beta + beta_change) v' = g sin(slope - curvature s) + force / m``.
    """
    pull = p.share * fma(p.g, sincos(fma(-p.curvature, s, p.slope))[0], u.force * p.inverse_m)
    return pull / fma(p.share, u.beta_change, 1.0)


@scalar
def rhs(y: State, u: Input, p: Parameters) -> State:
    """Rates s' = v and v'. Goldstein, Poole & Safko, *Classical Mechanics*, section 2.4."""
    return State(y.v, acceleration(y.s, u, p))


@scalar
def step(y: State, u: Input, p: Parameters, h: float) -> State:
    """Half a kick, a drift, half a kick: symplectic, second order; exact on an incline."""
    v = fma(0.5 * h, acceleration(y.s, u, p), y.v)
    s = fma(h, v, y.s)
    return State(s, fma(0.5 * h, acceleration(s, u, p), v))


@scalar
def invariants(y: State, p: Parameters) -> Invariants:
    """Energy (1 + beta) m v^2 / 2 + m g height [J], the height 0 at s = 0; constant without input.

    The descent from s = 0 is sin(x) / x sin(slope - curvature s / 2) s, with x = curvature s / 2.
    """
    x = 0.5 * p.curvature * y.s
    mean = sincos(p.slope - x)[0]
    sunk = y.s * mean * sine_ratio(x)
    return Invariants(p.m * fma(0.5 * (1.0 + p.beta) * y.v, y.v, -p.g * sunk))


@scalar
def rate(y: State, p: Parameters) -> float:
    """Rate at which the angle of descent changes, v curvature [rad/s]."""
    return abs(y.v * p.curvature)


@scalar
def ground_force(y: State, u: Input, p: Parameters) -> tuple[float, float]:
    """Friction along the path, which turns the body, and normal force, which bends the path [N].

    ``-(beta + beta_change) m v'`` and ``m g cos(slope - curvature s) + m v^2 curvature``.
    """
    c = sincos(fma(-p.curvature, y.s, p.slope))[1]
    friction = -(p.beta + u.beta_change) * p.m * acceleration(y.s, u, p)
    return (friction, p.m * fma(p.g, c, p.curvature * y.v * y.v))


ROLLER = Dynamics(
    State,
    Input,
    Parameters,
    Invariants,
    derive,
    rhs,
    step,
    unchanged,
    invariants,
    rate=rate,
    contact=on_ground(ground_force, 2),
)
