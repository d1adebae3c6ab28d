"""Laws that hold for every system.

Each function adds one law to a subject, for a system at states y of shape (n, n_state), with rates
up to 6 rad/s, and inputs u of shape (n, n_input); `numerics.random_states` makes both.
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from rigid_envs.laws.dalembert import RigidBodyModel, constraint_wrench, virtual_work
from rigid_envs.laws.law import Subject
from rigid_envs.laws.numerics import max_abs
from rigid_envs.laws.stencil import stencil
from rigid_envs.systems import System

__all__ = [
    "law_of_contact_force",
    "law_of_dalembert",
    "law_of_linearization",
    "law_of_order",
    "law_of_parameters",
    "law_of_reversibility",
    "law_of_rhs",
]

Array = npt.NDArray[np.float64]


def law_of_dalembert(
    subject: Subject, system: System, y: Array, u: Array, body: RigidBodyModel
) -> None:
    """Simulated motions obey d'Alembert's principle."""

    @subject.law(
        "simulate with d'Alembert's principle for mass points",
        bound=1e-9,
        why="second differences in steps of 0.01 s: roundings 1e-14 / 1e-4, truncation 1e-11",
    )
    def motions_obey_dalemberts_principle() -> float:
        """Sum of (m x'' - f) . dx = 0 for every displacement dx that the constraints admit."""
        return virtual_work(body, stencil(system, y, u))


def law_of_contact_force(
    subject: Subject,
    system: System,
    y: Array,
    u: Array,
    body: RigidBodyModel,
    contact: Callable[[Array, Array], tuple[Array, Array]],
) -> None:
    """The contact force is the constraint force, and its torque the constraint torque.

    Args:
        subject: gets the law.
        system: a rolling body.
        y: states.
        u: inputs.
        body: mass, applied forces and constraints of the system.
        contact: contact force [N], and the contact point from the centre of mass [m], of y and u;
            world axes.
    """

    @subject.law(
        "contact_force with what Newton's law lacks",
        bound=1e-8,
        why="as for d'Alembert's principle, with forces of some 10 N",
    )
    def the_contact_force_makes_the_balance() -> float:
        """The rates of both momenta: C = m r'' - F and arm x C = dL/dt - tau."""
        force, torque = constraint_wrench(body, stencil(system, y, u))
        found, arm = contact(y, u)
        return max_abs(found - force, np.cross(arm, found) - torque)


def law_of_rhs(subject: Subject, system: System, y: Array, u: Array) -> None:
    """`rhs` is the time derivative of the simulated motion."""

    @subject.law(
        "rhs with differences of simulate",
        bound=1e-10,
        why="differences of order 8 in steps of 0.01 s: 1e-11; simulate: 1e-11 per radian",
    )
    def rhs_is_the_rate_of_the_motion() -> float:
        """The rates are y' = rhs(y, u)."""
        motion = stencil(system, y, u)
        return max_abs(system.rhs(y, u) - motion.rate(motion.y))


def law_of_parameters(subject: Subject, system: System) -> None:
    """The parameter row of the kernels begins with the fields of the system, in their order."""

    @subject.law("parameters with the fields of the system", bound=0.0, why="they are copied")
    def kernels_get_the_parameters() -> float:
        """The row of parameters begins with the fields, in their order."""
        fields = [getattr(system, name) for name in system.parameter_names()]
        return max_abs(system.parameters[: len(fields)] - np.array(fields))


def law_of_linearization(subject: Subject, system: System, y: Array, u: Array) -> None:
    """`linearize` gives the Jacobians of `rhs`."""

    @subject.law(
        "linearize with differences of rhs",
        bound=1e-8,
        why="in steps of 5e-7, for quaternions must stay unit ones: roundings 1e-15 / 5e-7",
    )
    def linearize_is_the_slope_of_rhs() -> float:
        """A = df/dy and B = df/du."""
        h, n = 5e-7, y.shape[-1]
        slopes = []
        for step in h * np.eye(n + u.shape[-1]):
            ahead = system.rhs(y + step[:n], u + step[n:])
            behind = system.rhs(y - step[:n], u - step[n:])
            slopes.append((ahead - behind) / (2.0 * h))
        A, B = system.linearize(y, u)
        return max_abs(np.concatenate([A, B], axis=-1) - np.stack(slopes, axis=-1))


def law_of_reversibility(subject: Subject, system: System, y: Array, u: Array) -> None:
    """Steps are time-reversible."""

    @subject.law(
        "advance forth and back, 0.2 s in 24 steps",
        bound=1e-13,
        why="steps are symmetric: a few hundred roundings are left",
    )
    def time_can_be_reversed() -> float:
        """The step by -h undoes the step by h."""
        there = system.advance(y, u, 0.2, 24)
        return max_abs(system.advance(there, u, -0.2, 24) - y)


def law_of_order(
    subject: Subject, system: System, y: Array, u: Array, duration: float = 0.8
) -> None:
    """The integrator is of order four.

    Args:
        subject: gets the law.
        system: what is simulated.
        y: states.
        u: inputs.
        duration: such that rate x step is about 0.2 in 24 steps [s].
    """

    @subject.law(
        "order of advance in 24, 48 and 96 steps with 4",
        bound=0.1,
        why="terms of the next order, rate x step of 0.2",
    )
    def the_order_is_four() -> float:
        """log2 of the ratio of errors at h and h / 2."""
        ends = [system.advance(y, u, duration, n) for n in (24, 48, 96, 768)]
        errors = [max_abs(end - ends[-1]) for end in ends[:-1]]
        return max_abs(np.log2(np.divide(errors[:-1], errors[1:])) - 4.0)
