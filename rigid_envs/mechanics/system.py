"""What every physical system has: parameters, states by name, simulation."""

from __future__ import annotations

import abc
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, array, integer, number, positive, require
from rigid_envs.mechanics.equations import Equations
from rigid_envs.mechanics.events import EventFunction, simulate_with_events
from rigid_envs.mechanics.integration import (
    Input,
    Schedule,
    Trajectory,
    integrate,
    integrate_interval,
    intervals,
    step_schedule,
)

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
        plan = Schedule.constant(h, n_substeps, self.weights)
        return integrate_interval(self, y_rows, u_rows[None], plan, 0.0)

    def simulate(
        self,
        y0: npt.ArrayLike,
        t: npt.ArrayLike,
        u: Input | None = None,
        *,
        max_step: float | None = None,
        events: EventFunction | Sequence[EventFunction] | None = None,
    ) -> Trajectory:
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
        dt = intervals(times)
        start = self.checked_state(y0)
        if events is not None:
            return simulate_with_events(self, start, times, u, max_step, events)
        rest = self.checked_input(None)
        if u is not None or math.isfinite(self.horizon(start, rest)):
            given = rest if u is None else u
            return Trajectory(
                self, times, integrate(self, start, times, given, max_step), u, max_step
            )
        plan = step_schedule(self, start, rest, dt, max_step)
        return Trajectory(self, times, self.run(start, rest[None], plan), None, max_step)

    def run(self, y0: Array, u: Array, plan: Schedule) -> Array:
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
