"""Euler's disk: the disk that rolls without slipping, with friction where it touches the plane.

psi' = w3 - wn cot(theta) is the rate at which the contact runs along the rim. Friction opposes it:
a generalised torque ``Q = -contour sign(psi') - drag psi'^3`` of the angle psi, which does no work
on precession and fall. As a couple it is ``Q (e3 - cot(theta) n)``, perpendicular to the vertical;
its power is Q psi'. Names are those of `dynamics`.
"""

from typing import Any, NamedTuple

from rigid_envs.engine import algebra
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.dynamics import Dynamics, unchanged
from rigid_envs.engine.elementary import fma, select, sign, sqrt
from rigid_envs.systems.rolling_disk import dynamics as rolling
from rigid_envs.systems.rolling_disk.dynamics import Input, Invariants, State

# The functions of the rolling disk read a row of parameters by name, p: Any where it is this one.


class Parameters(NamedTuple):
    """Those of `dynamics.Parameters`, after mu contour [N m] and drag [N m s^3]."""

    m: float
    radius: float
    I1: float
    I3: float
    g: float
    mu: float
    contour: float
    drag: float
    I1_contact: float
    I3_contact: float
    inverse1: float
    inverse1_contact: float
    inverse3_contact: float
    ratio: float
    rim_ratio: float
    mgr: float


class Sliding(NamedTuple):
    """Upward radius n = (n1, n2) in body axes, cot(theta), psi' and its rate for Q = 1 N m."""

    n1: float
    n2: float
    cot: float
    spin: float
    yields: float


@scalar
def derive(
    m: float, radius: float, I1: float, I3: float, g: float, mu: float, contour: float, drag: float
) -> Parameters:
    """Parameter row of `dynamics.derive`, contour [N m] and drag [N m s^3]."""
    p = rolling.derive(m, radius, I1, I3, g, mu)
    return Parameters(
        *(m, radius, I1, I3, g, p.mu, contour, drag),
        *(p.I1_contact, p.I3_contact, p.inverse1, p.inverse1_contact, p.inverse3_contact),
        *(p.ratio, p.rim_ratio, p.mgr),
    )


@scalar
def _sliding(y: State, p: Parameters) -> Sliding:
    """What friction sees: ``psi'' = Q (1 / (I3 + m r^2) + cot(theta)^2 / I1)`` of it alone."""
    n1, n2, s, c = rolling.inclination(algebra.attitude(y))
    cot = c / s
    spin = y.omega3 - cot * (n1 * y.omega1 + n2 * y.omega2)
    return Sliding(n1, n2, cot, spin, p.inverse3_contact + p.inverse1 * cot * cot)


@scalar
def braked(y: State, u: Input, p: Parameters) -> Input:
    """The input, to which the couple of friction is added."""
    at = _sliding(y, p)
    torque = -p.contour * sign(at.spin) - p.drag * at.spin * at.spin * at.spin
    return Input(u.tau_steer - at.cot * torque, u.tau_lean, u.tau_drive + torque)


@scalar
def rhs(y: State, u: Input, p: Any) -> State:
    """`dynamics.rhs` with the couple of friction; where psi' = 0 there is none."""
    return rolling.rhs(y, braked(y, u, p), p)


@scalar
def step(y: State, u: Input, p: Any, h: float) -> State:
    """Friction for half a step, a step of rolling, friction: symmetric, second order."""
    return _rubbed(rolling.step(_rubbed(y, p, 0.5 * h), u, p, h), p, 0.5 * h)


@scalar
def _rubbed(y: State, p: Parameters, h: float) -> State:
    """Friction alone for a time h, each law exactly: attitude and contact stay, psi' decays.

    Dry friction takes the same from psi' in equal times, until it rests; under the drag ``1 /
    psi'^2`` grows steadily. Backwards, in one stage of a composed step, what rests still does.
    """
    at = _sliding(y, p)
    loss, damping = 0.5 * h * at.yields * p.contour, 2.0 * h * at.yields * p.drag
    spin = _slowed(at.spin, loss)
    spin = _slowed(spin / sqrt(fma(damping * spin, spin, 1.0)), loss)
    impulse = (spin - at.spin) / at.yields
    turn = -p.inverse1 * at.cot * impulse
    return State(
        *(y.w, y.x, y.y, y.z),
        fma(at.n1, turn, y.omega1),
        fma(at.n2, turn, y.omega2),
        fma(p.inverse3_contact, impulse, y.omega3),
        *(y.X, y.Y),
    )


@scalar
def _slowed(spin: float, loss: float) -> float:
    """The spin, nearer to 0 by the loss; 0 for one that is not above the size of the loss."""
    return select(abs(spin) > abs(loss), spin - sign(spin) * loss, 0.0)


@scalar
def rate(y: State, p: Any) -> float:
    """`dynamics.rate`, and the relative rate at which the drag takes from psi' [rad/s]."""
    at = _sliding(y, p)
    total: float = rolling.rate(y, p) + at.yields * p.drag * at.spin * at.spin
    return total


@scalar
def ground_force(y: State, u: Input, p: Any) -> algebra.Vector:
    """`dynamics.ground_force` with the couple of friction, which is no part of it [N]."""
    return rolling.ground_force(y, braked(y, u, p), p)


EULER_DISK = Dynamics(
    State,
    Input,
    Parameters,
    Invariants,
    derive,
    rhs,
    step,
    unchanged,
    rolling.invariants,
    rate=rate,
    contact=algebra.on_ground(ground_force, 3),
)
