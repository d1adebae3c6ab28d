"""Base class of the physical systems: the NumPy interface of the compiled kernels."""

from __future__ import annotations

import abc
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import array, integer, number
from rigid_envs.systems.equations import Equations
from rigid_envs.systems.eventful import simulate_with_events
from rigid_envs.systems.events import EventFunction
from rigid_envs.systems.integration import Input, integrate, integrate_interval
from rigid_envs.systems.schedule import Schedule, intervals, step_schedule
from rigid_envs.systems.trajectory import Trajectory

__all__ = ["System"]

Array = npt.NDArray[np.float64]


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
            plan.weights,
            self.parameters,
            inputs,
            plan.per_stage,
            plan.h,
            plan.n_substeps,
            y,
        )
        return y.reshape(len(y), *y0.shape)
