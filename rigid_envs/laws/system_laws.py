"""Laws that every system obeys, whatever it is.

Each function writes one down for a system, at states and inputs of no symmetry: states y of shape
(n, n_state) with rates up to 6 rad/s, inputs u of shape (n, n_input), all of them at work.
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from rigid_envs.laws.dalembert import Body, imbalance, missing
from rigid_envs.laws.law import Subject
from rigid_envs.laws.stencil import largest, window
from rigid_envs.systems import System

__all__ = [
    "law_of_contact",
    "law_of_dalembert",
    "law_of_order",
    "law_of_parameters",
    "law_of_rates",
    "law_of_return",
    "law_of_slopes",
]

Array = npt.NDArray[np.float64]


def law_of_dalembert(subject: Subject, system: System, y: Array, u: Array, body: Body) -> None:
    """Simulated motions balance inertia and applied forces."""

    @subject.law(
        "simulate with d'Alembert's principle for mass points",
        bound=1e-9,
        why="second differences in steps of 0.01 s: roundings 1e-14 / 1e-4, truncation 1e-11",
    )
    def motions_obey_dalemberts_principle() -> float:
        """Sum of (m x'' - f) . dx = 0 for every displacement dx that the constraints admit."""
        return imbalance(body, window(system, y, u))


def law_of_contact(
    subject: Subject,
    system: System,
    y: Array,
    u: Array,
    body: Body,
    contact: Callable[[Array, Array], tuple[Array, Array]],
) -> None:
    """The contact force is all that Newton's law lacks.

    Args:
        subject: writes it down.
        system: what rolls.
        y: states.
        u: inputs.
        body: what d'Alembert's principle has to know.
        contact: force at the contact, and the place of that from the centre of mass, of y and u.
    """

    @subject.law(
        "contact_force with what Newton's law lacks",
        bound=1e-8,
        why="as for d'Alembert's principle, with forces of some 10 N",
    )
    def the_contact_force_makes_the_balance() -> float:
        """The rates of both momenta: C = m r'' - F and arm x C = dL/dt - tau."""
        force, torque = missing(body, window(system, y, u))
        found, arm = contact(y, u)
        return largest(found - force, np.cross(arm, found) - torque)


def law_of_rates(subject: Subject, system: System, y: Array, u: Array) -> None:
    """`rhs` is the rate of the simulated motion."""

    @subject.law(
        "rhs with differences of simulate",
        bound=1e-10,
        why="differences of order 8 in steps of 0.01 s: 1e-11; simulate: 1e-11 per radian",
    )
    def rhs_is_the_rate_of_the_motion() -> float:
        """The rates are y' = rhs(y, u)."""
        around = window(system, y, u)
        return largest(system.rhs(y, u) - around.rate(around.y))


def law_of_parameters(subject: Subject, system: System) -> None:
    """Kernels are given the parameters of the system."""

    @subject.law("parameters with the fields of the system", bound=0.0, why="they are copied")
    def kernels_get_the_parameters() -> float:
        """The row of parameters begins with the fields, in their order."""
        fields = [getattr(system, name) for name in system.parameter_names()]
        return largest(system.parameters[: len(fields)] - np.array(fields))


def law_of_slopes(subject: Subject, system: System, y: Array, u: Array) -> None:
    """`linearize` is the slope of `rhs`."""

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
        return largest(np.concatenate([A, B], axis=-1) - np.stack(slopes, axis=-1))


def law_of_return(subject: Subject, system: System, y: Array, u: Array) -> None:
    """Steps can be undone."""

    @subject.law(
        "advance forth and back, 0.2 s in 24 steps",
        bound=1e-13,
        why="steps are symmetric: a few hundred roundings are left",
    )
    def time_can_be_reversed() -> float:
        """The step by -h undoes the step by h."""
        there = system.advance(y, u, 0.2, 24)
        return largest(system.advance(there, u, -0.2, 24) - y)


def law_of_order(
    subject: Subject, system: System, y: Array, u: Array, duration: float = 0.8
) -> None:
    """Steps converge with the fourth power of their length; so long that rate x step is 0.2."""

    @subject.law(
        "order of advance in 24, 48 and 96 steps with 4",
        bound=0.1,
        why="terms of the next order, rate x step of 0.2",
    )
    def the_order_is_four() -> float:
        """log2 of the ratio of errors at h and h / 2."""
        ends = [system.advance(y, u, duration, n) for n in (24, 48, 96, 768)]
        errors = [largest(end - ends[-1]) for end in ends[:-1]]
        return largest(np.log2(np.divide(errors[:-1], errors[1:])) - 4.0)
