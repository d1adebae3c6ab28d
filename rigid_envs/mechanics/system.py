"""Physical systems: the base class, and the envelope in which steps are stable."""

from __future__ import annotations

import abc
import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, array, integer, number, positive, require
from rigid_envs.mechanics import integration
from rigid_envs.mechanics.equations import Equations
from rigid_envs.mechanics.events import EventFunction, checked_events, simulate_with_events
from rigid_envs.mechanics.integration import Input

# Lyapunov exponents and Poincare sections of motions without closed form.

_TURN = 1.0 / 16.0  # rad of the fastest rate in a step of the linearised equations
_BETWEEN = 16  # steps between two orthogonalisations: a growth of e at most, typically
_CHUNK = 4096  # steps whose Jacobians are kept at once


def lyapunov_exponents(
    system: System, y0: npt.ArrayLike, duration: float, u: npt.ArrayLike | None = None
) -> Array:
    """Mean rates at which neighbouring motions separate along a motion, the largest first.

    Benettin's method: orthonormal departures from the motion obey d' = A(y(t)) d with the Jacobian
    A of `linearize`; a QR decomposition every second radian keeps them apart, and the logarithms
    of the diagonal of R add up. Departures are those of states: the one along the unit quaternion,
    which is none, is left out. The motion is that of `simulate`, the departures are integrated by
    the classical Runge-Kutta method of fourth order.

    They converge slowly: a motion that is not chaotic has exponents near ln(T) / T after a time T.
    Compare two durations.

    Args:
        system: any.
        y0: state at t = 0, shape (n_state,).
        duration: T [s].
        u: input that is held, shape (n_input,); zero if left out.

    Returns:
        Exponents [1/s], shape (n_state,), or (n_state - 1,) where a quaternion is part of y.

    Raises:
        ValueError: bad shapes or numbers, as `simulate`.

    Source:
        Benettin, Galgani, Giorgilli & Strelcyn 1980, Meccanica 15:9 and 15:21,
        doi:10.1007/BF02128236, doi:10.1007/BF02128237.
    """
    y, time = system.checked_state(y0), positive(duration, "duration", "s")
    require(y.ndim == 1, list(y.shape), "shape of y0", "one state")
    basis, now = _tangent(system, y), 0.0
    logs = np.zeros(basis.shape[1])
    while now < time:
        y, basis, grown, span = _stretched(system, y, basis, u, time - now)
        logs, now = logs + grown, now + span
    return np.asarray(np.sort(logs / time)[::-1])


def poincare_section(
    system: System,
    y0: npt.ArrayLike,
    section: EventFunction,
    duration: float,
    u: Input | None = None,
) -> tuple[Array, Array]:
    """Times and states at which a motion passes a section, in the direction of the event.

    Args:
        system: any.
        y0: state at t = 0, shape (n_state,).
        section: function g(t, y) that is 0 on the section, as `crossing` makes them.
        duration: of the motion [s].
        u: input as of `simulate`: none, a row held for ever or a function of time.

    Returns:
        Times [s], (K,), exact to rounding, and states, (K, n_state).

    Raises:
        ValueError: bad shapes or numbers, as `simulate`; a motion that ends by itself.
    """
    event = dataclasses.replace(checked_events(section)[0], terminal=False)
    times = [0.0, positive(duration, "duration", "s")]
    motion = system.simulate(y0, times, u, events=event)
    require(motion.status == 0, motion.message, "motion", "one that lasts for the duration")
    return motion.t_events[0], motion.y_events[0]


def _tangent(system: System, y: Array) -> Array:
    """Orthonormal departures from a state, shape (n_state, k)."""
    basis = np.eye(len(y))
    if "q" not in system.components:
        return basis
    where = system.components["q"]
    frame = np.linalg.qr(np.column_stack([y[where], np.eye(4)]))[0]
    basis[where, where] = frame
    return np.delete(basis, where.start, axis=1)


def _level(system: System, y: Array, basis: Array) -> Array:
    """Departures without their part along the quaternion.

    That is rounding, but it neither grows nor shrinks, and would take the place of what shrinks.
    """
    if "q" in system.components:
        where = system.components["q"]
        basis[where] -= np.outer(y[where], y[where] @ basis[where])
    return basis


def _stretched(
    system: System, y: Array, basis: Array, u: npt.ArrayLike | None, left: float
) -> tuple[Array, Array, Array, float]:
    """State, departures, logarithms of their growth and time [s] after some of the motion."""
    row = system.checked_input(u)
    rate = system.rate_bound(y, np.abs(row), 0.0)
    span = min(left, _CHUNK * _TURN / rate if rate > 0.0 else left, system.horizon(y, np.abs(row)))
    n = max(1, int(np.ceil(span * rate / _TURN)))
    h, motion = span / n, system.simulate(y, np.linspace(0.0, span, 2 * n + 1), u).y
    A, logs = system.linearize(motion, u)[0], np.zeros(basis.shape[1])
    for k in range(n):
        basis = _runge_kutta(A[2 * k], A[2 * k + 1], A[2 * k + 2], basis, h)
        if k % _BETWEEN == _BETWEEN - 1 or k == n - 1:
            basis, R = np.linalg.qr(_level(system, motion[2 * k + 2], basis))
            logs += np.log(np.abs(np.diag(R)))
    return motion[-1], basis, logs, span


def _runge_kutta(start: Array, middle: Array, end: Array, d: Array, h: float) -> Array:
    """One step of d' = A(t) d, with A at its beginning, middle and end."""
    k1 = start @ d
    k2 = middle @ (d + 0.5 * h * k1)
    k3 = middle @ (d + 0.5 * h * k2)
    k4 = end @ (d + h * k3)
    return np.asarray(d + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4))


# Checks of moments and inertia ratios: those that a distribution of mass can have.
#
# Each condition is monotone in every parameter by itself, so that it holds throughout ranges of
# parameters if it holds at all their corners.

_ROUNDING = 1e-9  # relative; admits moments written with ten digits


def principal_moments(I1: float, I2: float, I3: float) -> None:
    """Refuse moments that no distribution of mass has.

    Each moment is at most the sum of the other two (Landau & Lifshitz, *Mechanics*, section 32).

    Raises:
        ValueError: a moment that is not positive, or that breaks the triangle inequality by more
            than rounding.
    """
    moments = {"I1": I1, "I2": I2, "I3": I3}
    for name, value in moments.items():
        positive(value, name, "kg m^2")
    for name, value in moments.items():
        others = " + ".join(other for other in moments if other != name)
        rest = I1 + I2 + I3 - value
        expected = f"{name} <= {others} = {rest:.9g}: no rigid body has such principal moments"
        excess = 2.0 * value - (I1 + I2 + I3)
        require(bool(excess <= _ROUNDING * value), value, name, expected)


def pivot_distance(I1: float, I2: float, I3: float, m: float, ell: float) -> None:
    """Refuse a centre of mass so far along e3 that moments about the pivot leave none about it.

    Those about the centre of mass are I1 - m ell^2, I2 - m ell^2 and I3 (Steiner). As the moments
    about the pivot are those of a body, I3 <= I1 + I2 - 2 m ell^2 is all that is left to ask: signs
    and the other two inequalities follow. Equality is a lamina, or a rod on its end if I3 is small.

    Raises:
        ValueError: the inequality is broken by more than rounding.
    """
    room = I1 + I2 - I3
    longest = math.sqrt(max(room, 0.0) / 2.0 / m)
    expected = (
        f"at most sqrt((I1 + I2 - I3) / (2 m)) = {longest:.9g} m: I1 and I2 are about the pivot, "
        "m ell^2 more than about the centre of mass"
    )
    require(bool(2.0 * m * ell * ell <= room + _ROUNDING * (I1 + I2)), ell, "ell", expected)


def axial_moment(I3: float, m: float, radius: float) -> None:
    """Refuse moments about the axis of what rolls on its rim: no mass lies beyond the rim.

    It would pass below the plane when the axis is level.

    Raises:
        ValueError: above m radius^2, which is a hoop, by more than rounding.
    """
    rim = m * radius * radius
    expected = (
        f"at most m radius^2 = {rim:.9g} kg m^2, all mass on the rim: RollingDisk.uniform and "
        "RollingDisk.hoop fit the moments to mass and radius"
    )
    require(bool(I3 <= rim * (1.0 + _ROUNDING)), I3, "I3", expected)


def ball_ratio(beta: float) -> None:
    """Refuse ratios I / (m radius^2) that no ball has: all mass lies within the radius.

    Raises:
        ValueError: not between 0 and 2/3.
    """
    expected = (
        "I / (m radius^2) of a ball, between 0 (all mass at the centre) and 2/3 (all on the "
        "surface)"
    )
    require(0.0 <= number(beta, "beta") <= 2.0 / 3.0 + _ROUNDING, beta, "beta", expected)


# Base class of the physical systems: the NumPy interface of the compiled kernels.


@dataclass(frozen=True)
class System(Equations):
    """A physical system: its equations of motion, and the integrator that keeps their structure.

    States and inputs are rows: arrays of shape (..., n) with any leading axes, float64. Frames and
    units of the entries are in `state_entries` and `input_entries`.
    """

    envelope: ClassVar[float] = 0.5
    """Largest rate times step [rad] at which the integrator keeps its stated accuracy."""
    default_step_angle: ClassVar[float] = 1.0 / 64.0
    """Rate times step [rad] of `simulate`: truncation error near 1e-11 per radian of that rate,
    5e-11 for a top that swings like a pendulum, 1e-10 where the moments are very unequal."""

    @abc.abstractmethod
    def rate_bound(self, y: Array, u: Array, duration: float) -> float:
        """Largest angular rate [rad/s] that any row can reach under input u for a time [s].

        No more than `horizon` is looked ahead.
        """

    def horizon(self, y: Array, u: Array) -> float:
        """Time [s] for which `rate_bound` holds; then `simulate` chooses its steps anew."""
        return math.inf

    @property
    def weights(self) -> tuple[float, ...]:
        """Lengths of the stages of one composed step, relative to the step."""
        return self.dynamics.weights

    def advance(
        self, y: npt.ArrayLike, u: npt.ArrayLike | None, dt: float, n_substeps: int = 1
    ) -> Array:
        """The state after a time dt [s] under constant input, in `n_substeps` integrator steps.

        This is the step of the environments: the same compiled function, the same bits.

        Raises:
            ValueError: see `rhs`; also if rate times step leaves the stability envelope.
        """
        n_substeps, dt = integer(n_substeps, "n_substeps", 1), number(dt, "dt", "s")
        y_rows, u_rows = self._broadcast(self.checked_state(y), self.checked_input(u))
        h = dt / n_substeps
        rate = self.rate_bound(y_rows, u_rows, abs(dt))
        if rate * abs(h) > self.envelope:
            raise ValueError(
                f"dt = {dt}; expected substeps of at most {self.envelope / rate:.6g} s, for rates "
                f"up to {rate:.6g} rad/s: take n_substeps >= "
                f"{math.ceil(rate * abs(dt) / self.envelope)}"
            )
        plan = integration.Schedule.constant(h, n_substeps, self.weights)
        return integration.integrate_interval(self, y_rows, u_rows[None], plan, 0.0)

    def simulate(
        self,
        y0: npt.ArrayLike,
        t: npt.ArrayLike,
        u: integration.Input | None = None,
        *,
        max_step: float | None = None,
        events: EventFunction | Sequence[EventFunction] | None = None,
    ) -> integration.Trajectory:
        """States at the times t, by the structure-preserving integrator of the system.

        Args:
            y0: state at ``t[0]``, shape (..., n_state).
            t: monotone times [s], shape (M,); may run backwards.
            u: input: None (zero), one row held for ever, an array (M - 1, ..., n_input) held over
                each interval, or a function of time returning (..., n_input), which is sampled
                inside every step so that the order stays four.
            max_step: largest step [s]. The default resolves the fastest rate so finely that the
                truncation error is near rounding; with a function u also 1/2000 of the time span.
                Smaller ones do not help: each stage rounds once, and where a number changes by few
                units of its last place in a step, all in the same sense, 1e-16 for a stage.
            events: functions g(t, y) of one motion, y0 of shape (n_state,), whose zeros are looked
                for, as in `scipy.integrate.solve_ivp`: see `Event`. Their times are exact to
                rounding. Signs are compared every 1/8 rad of the fastest rate: two passages
                between are missed. A motion that ends, by an event or by itself, is returned up to
                there, and its last time is that of the end.

        Returns:
            `Trajectory` with ``t`` (M,), ``y`` (M, ..., n_state) and named access.

        Raises:
            ValueError: bad shapes or numbers, times that are not monotone, a step outside the
                stability envelope, or more than 1e9 steps.
        """
        times = array(t, "t")
        dt = integration.intervals(times)
        start = self.checked_state(y0)
        if events is not None:
            return simulate_with_events(self, start, times, u, max_step, events)
        rest = self.checked_input(None)
        if u is not None or math.isfinite(self.horizon(start, rest)):
            given = rest if u is None else u
            return integration.Trajectory(
                self, times, integration.integrate(self, start, times, given, max_step), u, max_step
            )
        plan = integration.step_schedule(self, start, rest, dt, max_step)
        return integration.Trajectory(
            self, times, self.run(start, rest[None], plan), None, max_step
        )

    def run(self, y0: Array, u: Array, plan: integration.Schedule) -> Array:
        """All states of a schedule, shape (M, ..., n_state); u[0] is held, or one u per stage."""
        rows = y0.reshape(-1, y0.shape[-1])
        y = np.empty((len(plan.h) + 1, *rows.shape))
        y[0] = rows
        inputs = np.ascontiguousarray(u.reshape(len(u), -1, u.shape[-1]))
        self.dynamics.simulate_rows(
            plan.weights, self.parameters, inputs, plan.per_stage, plan.h, plan.n_substeps, y
        )
        return y.reshape(len(y), *y0.shape)


# Free rigid body under body torques: Euler's equations and the attitude.


def fastest_turn(moments: Array) -> float:
    """Largest rate over sqrt(2 T) [1 / sqrt(kg m^2)] in the motion of a body and in its steps.

    The body turns at norm(omega) <= sqrt(2 T / I_min). Its integrator turns it about L at
    norm(L) / I2 <= sqrt(2 T I_max) / I2, faster than that where e2 is not the middle axis, and
    about e1 and e3 at less than one of the two.
    """
    return max(1.0 / math.sqrt(moments.min()), math.sqrt(moments.max()) / float(moments[1]))


# Adaptive step sizes for systems whose rates no energy bounds: chosen anew as the rates grow.

_AHEAD = 0.25  # part of itself by which a rate may grow before the steps are chosen anew


class AdaptiveStepSystem(System):
    """A system with a bound on its rates only for a while, from its rate and the growth of that."""

    @abc.abstractmethod
    def rate_and_growth(self, y: Array, u: Array) -> tuple[float, float]:
        """Largest rate of any row [rad/s], positive, and its largest growth [rad/s^2]."""

    def rate_bound(self, y: Array, u: Array, duration: float) -> float:
        """Upper bound on the rate from its present growth [rad/s]."""
        rate, growth = self.rate_and_growth(y, u)
        return rate + min(growth * duration, _AHEAD * rate)

    def horizon(self, y: Array, u: Array) -> float:
        """Time [s] in which the rate grows by a quarter of itself."""
        rate, growth = self.rate_and_growth(y, u)
        return _AHEAD * rate / growth
