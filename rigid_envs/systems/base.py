"""Base class of the physical systems: the NumPy interface of the compiled kernels."""

from __future__ import annotations

import abc
import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import astuple, dataclass, fields
from functools import cached_property, partial
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import array, integer, number, require, unit_quaternion
from rigid_envs.kernels.dynamics import Dynamics
from rigid_envs.systems.integration import Input, integrate, integrate_interval
from rigid_envs.systems.schedule import Schedule, intervals, step_schedule
from rigid_envs.systems.trajectory import Trajectory

__all__ = ["System"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class System(abc.ABC):
    """A physical system with state y, input u and the parameters that are its fields.

    States and inputs are rows: arrays of shape (..., n) with any leading axes, float64. Frames and
    units of the entries are in `state_entries` and `input_entries`.
    """

    dynamics: ClassVar[Dynamics]
    """Rows and compiled functions: equations of motion, one step, invariants."""
    state_entries: ClassVar[tuple[str, ...]]
    input_entries: ClassVar[tuple[str, ...]]
    components: ClassVar[Mapping[str, slice]]
    """The named parts that a state consists of, and where they stand in y."""
    envelope: ClassVar[float] = 0.5
    """Largest rate times step [rad] at which the integrator keeps its stated accuracy."""
    default_step_angle: ClassVar[float] = 1.0 / 64.0
    """Rate times step [rad] of `simulate`: truncation error near 1e-11 per radian of that rate,
    5e-11 for a top that swings like a pendulum, 1e-10 where the moments are very unequal."""

    def __init_subclass__(cls) -> None:
        """Check that the fields are the physical parameters of the dynamics.

        Raises:
            TypeError: other names, or another order.
        """
        super().__init_subclass__()
        if "dynamics" not in cls.__dict__:
            return
        cls.state_entries = cls.dynamics.State._fields
        cls.input_entries = cls.dynamics.Input._fields
        annotated = inspect.get_annotations(cls)
        names = tuple(name for name, kind in annotated.items() if "ClassVar" not in str(kind))
        if names != cls.dynamics.raw_names:
            raise TypeError(
                f"{cls.__name__} has fields {names}; "
                f"expected the arguments of its derive, {cls.dynamics.raw_names}"
            )

    @property
    def accessors(self) -> Mapping[str, Callable[[npt.ArrayLike], Array]]:
        """Named quantities of a state: each maps y, shape (..., n_state), to (...) or (..., k).

        Its components, unless a system says more.
        """
        return {name: partial(_component, part) for name, part in self.components.items()}

    @abc.abstractmethod
    def rate_bound(self, y: Array, u: Array, duration: float) -> float:
        """Largest angular rate [rad/s] that any row can reach under input u for a time [s].

        No more than `horizon` is looked ahead.
        """

    def horizon(self, y: Array, u: Array) -> float:
        """Time [s] for which `rate_bound` holds; then `simulate` chooses its steps anew."""
        return math.inf

    @classmethod
    def state(cls, **components: npt.ArrayLike) -> Array:
        """State row of named components; those left out are at rest.

        Args:
            **components: any of `components`, each of shape (..., k), or (...) where k is 1,
                broadcast together.

        Returns:
            y of shape (..., n_state).

        Raises:
            ValueError: unknown name, wrong last axis, NaN or inf, q not of unit length.
        """
        parts = {}
        known = f"some of {', '.join(cls.components)}"
        for name, value in components.items():
            require(name in cls.components, name, "component", known)
            entries = cls.state_entries[cls.components[name]]
            n, layout = len(entries), ", ".join(entries)
            rows = array(value, name, *([n] if n > 1 else []), entries=layout)
            parts[name] = rows if n > 1 else rows[..., None]
        lead = np.broadcast_shapes(*(part.shape[:-1] for part in parts.values()))
        y = np.broadcast_to(np.array(cls.dynamics.State()), (*lead, len(cls.state_entries))).copy()
        for name, part in parts.items():
            y[..., cls.components[name]] = part
        if "q" in cls.components:
            unit_quaternion(y[..., :4], "q")
        return y

    @property
    def weights(self) -> tuple[float, ...]:
        """Lengths of the stages of one composed step, relative to the step."""
        return self.dynamics.weights

    @cached_property
    def parameters(self) -> Array:
        """The parameter row p of the kernels: the fields, then what is derived from them."""
        return np.array(self.dynamics.derive(*map(float, astuple(self))), dtype=np.float64)

    @classmethod
    def parameter_names(cls) -> tuple[str, ...]:
        """Names of the physical parameters, in the order of the fields."""
        return tuple(field.name for field in fields(cls))

    def rhs(self, y: npt.ArrayLike, u: npt.ArrayLike | None = None) -> Array:
        """Time derivative of the state, y' = f(y, u).

        Args:
            y: state, shape (..., n_state).
            u: input, shape (..., n_input), broadcast against y; zero if left out.

        Returns:
            Array of the shape of y (after broadcasting) [units of y per second].

        Raises:
            ValueError: wrong last axis, NaN or inf, or a quaternion that is not a unit one.
        """
        y_rows, u_rows = self._broadcast(self.checked_state(y), self.checked_input(u))
        return self._evaluate(y_rows, u_rows, np.float64)

    def linearize(self, y: npt.ArrayLike, u: npt.ArrayLike | None = None) -> tuple[Array, Array]:
        """Jacobians A = df/dy and B = df/du of `rhs`, exact to rounding.

        Differentiated by complex step (Squire & Trapp 1998, doi:10.1137/S003614459631241X) through
        the very equations that are simulated. The four quaternion entries count as independent.

        Returns:
            A of shape (..., n_state, n_state) and B of shape (..., n_state, n_input).
        """
        y_rows, u_rows = self._broadcast(self.checked_state(y), self.checked_input(u))
        tiny = 1e-100
        n, m = y_rows.shape[-1], u_rows.shape[-1]
        seeds = tiny * 1j * np.eye(n + m)
        columns = self._evaluate(
            y_rows[..., None, :] + seeds[:, :n], u_rows[..., None, :] + seeds[:, n:], np.complex128
        )
        jacobian = np.swapaxes(columns.imag / tiny, -1, -2)
        return jacobian[..., :n].copy(), jacobian[..., n:].copy()

    def invariants(self, y: npt.ArrayLike) -> dict[str, Array]:
        """Quantities that are constant without input, each of shape (...)."""
        rows = self.checked_state(y)
        flat = np.ascontiguousarray(rows.reshape(-1, rows.shape[-1]))
        names = self.dynamics.Invariants._fields
        out = np.empty((len(flat), len(names)))
        self.dynamics.measure_rows(flat, self.parameters, out)
        return {name: out[:, k].reshape(rows.shape[:-1]) for k, name in enumerate(names)}

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

        Returns:
            `Trajectory` with ``t`` (M,), ``y`` (M, ..., n_state) and named access.

        Raises:
            ValueError: bad shapes or numbers, times that are not monotone, a step outside the
                stability envelope.
        """
        times = array(t, "t")
        dt = intervals(times)
        start = self.checked_state(y0)
        rest = self.checked_input(None)
        if u is not None or math.isfinite(self.horizon(start, rest)):
            given = rest if u is None else u
            return Trajectory(self, times, integrate(self, start, times, given, max_step))
        plan = step_schedule(self, start, rest, dt, max_step)
        return Trajectory(self, times, self.run(start, rest[None], plan))

    @classmethod
    def checked_state(cls, y: npt.ArrayLike) -> Array:
        """The state y as float64 of shape (..., n_state).

        Raises:
            ValueError: wrong last axis, NaN or inf, or a quaternion that is not a unit one.
        """
        rows = array(y, "y", len(cls.state_entries), entries=", ".join(cls.state_entries))
        if "q" in cls.components:
            unit_quaternion(rows[..., :4], "q")
        return rows

    @classmethod
    def checked_input(cls, u: npt.ArrayLike | None) -> Array:
        """The input u as float64 of shape (..., n_input); zeros for None.

        Raises:
            ValueError: wrong last axis, NaN or inf.
        """
        n = len(cls.input_entries)
        return np.zeros(n) if u is None else array(u, "u", n, entries=", ".join(cls.input_entries))

    @staticmethod
    def _broadcast(y: Array, u: Array) -> tuple[Array, Array]:
        lead = np.broadcast_shapes(y.shape[:-1], u.shape[:-1])
        return (
            np.broadcast_to(y, (*lead, y.shape[-1])),
            np.broadcast_to(u, (*lead, u.shape[-1])),
        )

    def _evaluate(self, y: npt.NDArray[Any], u: npt.NDArray[Any], dtype: type) -> npt.NDArray[Any]:
        y_rows: npt.NDArray[Any] = np.array(y, dtype=dtype, order="C").reshape(-1, y.shape[-1])
        u_rows: npt.NDArray[Any] = np.array(u, dtype=dtype, order="C").reshape(-1, u.shape[-1])
        out = np.empty_like(y_rows)
        self.dynamics.evaluate_rows(y_rows, u_rows, self.parameters.astype(dtype), out)
        return out.reshape(y.shape)

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


def _component(part: slice, y: npt.ArrayLike) -> Array:
    """The entries of a component of y, shape (..., k), or (...) where k is 1."""
    rows = np.array(np.asarray(y, dtype=np.float64)[..., part])
    return rows[..., 0] if rows.shape[-1] == 1 else rows
