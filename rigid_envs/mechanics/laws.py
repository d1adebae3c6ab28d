"""The frame of laws: claims with a bound, differences, and the laws of all systems."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from rigid_envs.base.checks import Array
from rigid_envs.mechanics.system import System

# A physical law as a claim with an error bound, and the outcome of its check.

Measure = Callable[[], float]


@dataclass(frozen=True)
class Law:
    """A physical claim whose error is measured.

    Attributes:
        subject: name of its subject.
        name: the claim, in words.
        compared: the two sides that are compared.
        bound: largest error with which the law holds.
        why: reason for the bound.
        measure: computes the error; its docstring is the statement.
    """

    subject: str
    name: str
    compared: str
    bound: float
    why: str
    measure: Measure


@dataclass(frozen=True)
class Outcome:
    """Result of the check of a law.

    Attributes:
        law: the law that was checked.
        error: measured error; NaN if an exception was raised.
        seconds: wall-clock time of the check [s].
        message: the exception that was raised; empty if none was.
    """

    law: Law
    error: float
    seconds: float
    message: str = ""

    @property
    def holds(self) -> bool:
        """Whether the error is within the bound; NaN never is."""
        return not self.message and self.error <= self.law.bound


@dataclass(frozen=True)
class Subject:
    """Laws about one system or module; the file of the same name adds them with `law`.

    Attributes:
        name: name on the command line.
        title: one line of description.
        laws: in the order of the checks, fast ones first.
    """

    name: str
    title: str
    laws: list[Law] = field(default_factory=list)

    def law(self, compared: str, *, bound: float, why: str) -> Callable[[Measure], Measure]:
        """Decorator: add a law. The function measures its error, the function's name is the claim.

        Args:
            compared: the two sides that are compared.
            bound: largest error with which the law holds.
            why: reason for the bound.
        """

        def add(measure: Measure) -> Measure:
            claim = measure.__name__.replace("_", " ")
            self.laws.append(Law(self.name, claim, compared, bound, why, measure))
            return measure

        return add


def check(law: Law) -> Outcome:
    """Measure the error of a law; an exception counts as a failure."""
    start = time.perf_counter()
    error, message = float("nan"), ""
    try:
        error = float(law.measure())
    except Exception as raised:
        message = f"{type(raised).__name__}: {raised}"
    return Outcome(law, error, time.perf_counter() - start, message)


# Numerical helpers of the laws: largest error, rotation matrices by SciPy, random states.

EPS = float(np.finfo(np.float64).eps)


def max_abs(*values: npt.ArrayLike) -> float:
    """Largest absolute value of all arrays; NaN if one has a NaN."""
    return float(np.max([np.max(np.abs(value)) for value in values]))


def matrices(q: npt.ArrayLike) -> Array:
    """Rotation matrices of quaternions (w, x, y, z) by SciPy, shape (..., 4) to (..., 3, 3)."""
    rows = np.asarray(q, dtype=np.float64)
    found = Rotation.from_quat(rows.reshape(-1, 4), scalar_first=True).as_matrix()
    return np.asarray(found.reshape(*rows.shape[:-1], 3, 3))


def quaternion(y: Array) -> Array:
    """The attitude q, with which states begin, shape (..., 4)."""
    return y[..., :4]


def attitudes(y: Array) -> Array:
    """Rotation matrices of states that begin with q, shape (..., 3, 3)."""
    return matrices(quaternion(y))


def axis(y: Array) -> Array:
    """The axis e3 of states that begin with q, in world axes, shape (..., 3)."""
    return np.array(attitudes(y)[..., :, 2])


def horizontal(pair: Array, height: float = 0.0) -> Array:
    """Vectors (x, y, height), shape (..., 3), of pairs (x, y), shape (..., 2)."""
    return np.concatenate([pair, np.full_like(pair[..., :1], height)], axis=-1)


def random_states(system: System, n: int, size: float = 1.0) -> tuple[Array, Array]:
    """Random states and inputs, without any symmetry.

    Args:
        system: its states and inputs.
        n: number of states; also the seed.
        size: standard deviation of the normal state entries, bound of the uniform inputs.

    Returns:
        y of shape (n, n_state), attitudes uniform over all rotations, and u of shape (n, n_input).
    """
    rng = np.random.default_rng(n)
    y = size * rng.normal(size=(n, len(system.state_entries)))
    if "q" in system.components:
        q = y[:, system.components["q"]]
        q /= np.linalg.norm(q, axis=-1, keepdims=True)
    return y, size * rng.uniform(-1.0, 1.0, (n, len(system.input_entries)))


# Time derivatives of a simulated motion by central differences of order eight.
#
# Source: Fornberg 1988, doi:10.1090/S0025-5718-1988-0935077-0.

_H = 0.01  # [s] see `stencil`
_FIRST = np.array([3, -32, 168, -672, 0, 672, -168, 32, -3]) / 840.0
_SECOND = np.array([-9, 128, -1008, 8064, -14350, 8064, -1008, 128, -9]) / 5040.0
_MIDDLE = 4


@dataclass(frozen=True)
class Stencil:
    """States at nine times, 0.01 s apart, under a constant input; derivatives at the middle one.

    Attributes:
        system: what is simulated.
        y: states, shape (9, ..., n_state).
        u: input, shape (..., n_input).
    """

    system: System
    y: Array
    u: Array

    @property
    def middle(self) -> Array:
        """The state at the middle time, shape (..., n_state)."""
        return np.array(self.y[_MIDDLE])

    def rate(self, values: Array) -> Array:
        """First time derivative of values at all nine times, shape (9, ...) to (...)."""
        return np.asarray(np.tensordot(_FIRST, values, 1) / _H)

    def acceleration(self, values: Array) -> Array:
        """Second time derivative of values at all nine times, shape (9, ...) to (...)."""
        return np.asarray(np.tensordot(_SECOND, values, 1) / _H**2)

    def omega(self) -> Array:
        """Angular velocity in world axes [rad/s] from R' R^T, shape (..., 3)."""
        R = self.system.accessors["R"](self.y)
        return axial(self.rate(R) @ np.swapaxes(R[_MIDDLE], -1, -2))


def stencil(system: System, y: Array, u: Array) -> Stencil:
    """The motion through a state, from 0.04 s before to 0.04 s after.

    Derivatives of what changes at a rate w have truncation errors h^8 w^9 / 630 and h^8 w^10 / 3150
    and rounding errors of some eps / h and 10 eps / h^2: 2e-12 and 2e-11 at 6 rad/s. `simulate`
    adds 1e-11 per radian, times w and w^2.
    """
    inputs = np.broadcast_to(u, (4, *u.shape))
    ahead = system.simulate(y, _H * np.arange(5), inputs).y
    behind = system.simulate(y, -_H * np.arange(5), inputs).y
    return Stencil(system, np.concatenate([behind[:0:-1], ahead]), u)


# Rotation of a rigid body by Newton's law in world axes, integrated by SciPy.


def integrate_newton(
    moments: Array,
    R0: Array,
    omega0: Array,
    dt: float,
    inputs: Array,
    torque: Callable[[Array, Array], Array],
) -> tuple[Array, Array]:
    """Attitude and angular velocity of a body about a fixed point, under piecewise constant inputs.

    In world axes ``L' = torque(R, u)``, ``omega = R I^-1 R^T L`` and ``R' = [omega] R``: neither
    Euler's equations nor quaternions. DOP853 with a relative tolerance of 1e-12 per step.

    Args:
        moments: along the body axes, about the fixed point, shape (3,) [kg m^2].
        R0: initial rotation matrix, shape (3, 3).
        omega0: initial angular velocity, body axes, shape (3,) [rad/s].
        dt: time that each input is held [s].
        inputs: one row per interval, shape (n, n_input).
        torque: about the fixed point, in world axes [N m], of R and u.

    Returns:
        R, shape (n, 3, 3), and omega_body [rad/s], shape (n, 3), at the end of each interval.
    """

    def rate(_: float, z: Array, u: Array) -> Array:
        R = z[:9].reshape(3, 3)
        omega = R @ ((R.T @ z[9:]) / moments)
        return np.concatenate([np.ravel(np.cross(omega, R.T).T), torque(R, u)])

    z = np.concatenate([np.ravel(R0), R0 @ (moments * omega0)])
    ends = []
    for u in inputs:
        z = solve_ivp(rate, (0.0, dt), z, "DOP853", args=(u,), rtol=1e-12, atol=1e-14).y[:, -1]
        ends.append(z)
    R, L = np.array(ends)[:, :9].reshape(-1, 3, 3), np.array(ends)[:, 9:]
    return R, np.einsum("nji,nj->ni", R, L) / moments


# D'Alembert's principle for a rigid body of mass points, in world axes.
#
#     sum over all points of (m x'' - f) . dx = 0
#
# for every virtual displacement dx that the constraints admit: constraint forces do no virtual
# work. For a rigid body of mass m with centre r and attitude R it reads
#
#     (m r'' - F) . dr + (D - tau) . dtheta = 0,    D_i = eps_ijk (R J R''^T)_jk,
#
# where J is the second moment of the mass, in body axes: D, the sum of x cross m x'', is the rate
# of the angular momentum. Neither angular velocities nor Euler's equations occur in it.
#
# Source: Lanczos, *The Variational Principles of Mechanics*, chapter IV.

Vectors = Callable[[Array, Array], Array]

VIRTUAL_ROTATIONS = np.eye(3)[:, None]
"""Virtual rotations dtheta of a body without constraint on its attitude, shape (3, 1, 3)."""


@dataclass(frozen=True)
class RigidBodyModel:
    """Mass, applied forces and constraints of a system that is one rigid body.

    States y have shape (..., n_state), inputs u (..., n_input); vectors are in world axes, shape
    (..., 3).

    Attributes:
        mass: [kg].
        moments: about the centre of mass, along the body axes, shape (3,) [kg m^2].
        centre: centre of mass [m], of y.
        force: sum of the applied forces [N], of y and u.
        torque: applied torque about the centre of mass [N m], of y and u.
        displacements: basis of the virtual displacements dr [m] and dtheta [rad], of y: k of each,
            shape (k, ..., 3); see `turns_about`.
    """

    mass: float
    moments: Array
    centre: Callable[[Array], Array]
    force: Vectors
    torque: Vectors
    displacements: Callable[[Array], tuple[Array, Array]]


def constant(*vector: float) -> Vectors:
    """A force or torque that depends on nothing."""
    return lambda *_: np.array(vector)


def turns_about(arm: Callable[[Array], Array]) -> Callable[[Array], tuple[Array, Array]]:
    """Virtual displacements of a body that turns in any way about a point.

    Args:
        arm: from the point to the centre of mass, of y [m].
    """
    return lambda y: (np.cross(VIRTUAL_ROTATIONS, arm(y)), VIRTUAL_ROTATIONS)


def constraint_wrench(body: RigidBodyModel, motion: Stencil) -> tuple[Array, Array]:
    """Force m r'' - F [N] and torque D - tau [N m] of the constraints, each of shape (..., 3)."""
    R = motion.system.accessors["R"](motion.y)
    R_middle = motion.system.accessors["R"](motion.middle)
    second_moment = np.diag(0.5 * np.sum(body.moments) - body.moments)
    p_rate = body.mass * motion.acceleration(body.centre(motion.y))
    L_rate = -2.0 * axial(R_middle @ second_moment @ np.swapaxes(motion.acceleration(R), -1, -2))
    y, u = motion.middle, motion.u
    return p_rate - body.force(y, u), L_rate - body.torque(y, u)


def axial(matrix: Array) -> Array:
    """The vector v of the odd part of a matrix, v x = odd part, shape (..., 3)."""
    odd = 0.5 * (matrix - np.swapaxes(matrix, -1, -2))
    return np.stack([odd[..., 2, 1], odd[..., 0, 2], odd[..., 1, 0]], axis=-1)


# Reasons of bounds that laws of several systems have.

AS_RHS = "as for rhs, times momenta up to 10 N m s"
HUNDREDS = "some hundred roundings of numbers near 1"
LONG_RUN = "20 turns to a step: a random walk of 2e6 roundings, or a drift of 1e-16 per step"
RADIANS = "1e-11 per radian, some 50 radians"
ROUNDED = "a rounding or two of numbers up to 1"
SLOPES = "differences of order 8 in steps of 0.01 s"


def ten_roundings(largest: float) -> str:
    """The reason of a bound that a few roundings of numbers reach."""
    return f"some ten roundings of numbers up to {largest:g}"


# Laws that hold for every system.
#
# Each function adds one law to a subject, for a system at states y of shape (n, n_state), with
# rates up to 6 rad/s, and inputs u of shape (n, n_input); `numerics.random_states` makes both.


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
        motion = stencil(system, y, u)
        force, torque = constraint_wrench(body, motion)
        dr, dtheta = body.displacements(motion.middle)
        return max_abs(np.sum(force * dr, axis=-1) + np.sum(torque * dtheta, axis=-1))


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


def laws_of_every_system(
    subject: Subject, system: System, y: Array, u: Array, reversible: System | None = None
) -> None:
    """`rhs`, `parameters`, `linearize` and the steps of a system agree with its motion.

    Args:
        subject: gets the laws.
        system: what is simulated.
        y: states.
        u: inputs.
        reversible: the system without friction, whose steps can be undone, where it has friction.
    """
    undone = reversible or system

    @subject.law(
        "rhs with differences of simulate",
        bound=1e-10,
        why="differences of order 8 in steps of 0.01 s: 1e-11; simulate: 1e-11 per radian",
    )
    def rhs_is_the_rate_of_the_motion() -> float:
        """The rates are y' = rhs(y, u)."""
        motion = stencil(system, y, u)
        return max_abs(system.rhs(y, u) - motion.rate(motion.y))

    @subject.law("parameters with the fields of the system", bound=0.0, why="they are copied")
    def kernels_get_the_parameters() -> float:
        """The row of parameters begins with the fields, in their order."""
        fields = [getattr(system, name) for name in system.parameter_names()]
        return max_abs(system.parameters[: len(fields)] - np.array(fields))

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

    @subject.law(
        "advance forth and back, 0.2 s in 24 steps",
        bound=1e-13,
        why="steps are symmetric: a few hundred roundings are left",
    )
    def time_can_be_reversed() -> float:
        """The step by -h undoes the step by h."""
        there = undone.advance(y, u, 0.2, 24)
        return max_abs(undone.advance(there, u, -0.2, 24) - y)


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
