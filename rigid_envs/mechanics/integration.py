"""Integration of a system in time, and the trajectory that comes of it."""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, Integers, array, exact_array, positive, require
from rigid_envs.engine.algebra import SUZUKI
from rigid_envs.mechanics import rotations

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rigid_envs.mechanics.system import System

# Step size selection: the intervals of a simulation divided into equal integrator steps.

_MOST = 1e9  # steps
SLACK = 1e-9  # differences of times are rounded: no second step for an excess this small


@dataclass(frozen=True)
class Schedule:
    """Interval m is covered by ``n_substeps[m]`` steps of length ``h[m]`` [s]."""

    h: Array
    n_substeps: Integers
    weights: Array
    per_stage: bool = False

    @classmethod
    def constant(cls, h: float, n_substeps: int, weights: tuple[float, ...]) -> Schedule:
        """A single interval."""
        return cls(np.array([h]), np.array([n_substeps]), np.array(weights))

    def sampled(self) -> Schedule:
        """The same steps, fourth order also for an input that changes: one for every stage."""
        return replace(self, weights=np.array(SUZUKI), per_stage=True)

    def stage_times(self, start: float) -> Array:
        """Midpoint of every stage [s], of intervals that follow each other from `start` on."""
        inside = np.cumsum(self.weights) - 0.5 * self.weights
        steps = np.repeat(self.h, self.n_substeps)
        begin = start + np.concatenate([[0.0], np.cumsum(steps)[:-1]])
        return np.ravel(begin[:, None] + steps[:, None] * inside)


def step_schedule(
    system: System, y: Array, u: Array, dt: Array, max_step: float | None, limit: float = math.inf
) -> Schedule:
    """Divide intervals dt [s] that begin with the state y into steps.

    Args:
        system: physical system.
        y: states, shape (..., n_state).
        u: inputs that act, shape (..., n_input).
        dt: lengths of the intervals [s], shape (M,).
        max_step: largest step [s], or None for one that resolves the fastest rate.
        limit: largest step [s] where `max_step` is None.

    Raises:
        ValueError: `max_step` is not positive, or outside the stability envelope; more steps than
            can be counted.
    """
    rate = system.rate_bound(y, u, float(np.max(np.abs(dt), initial=0.0)))
    if max_step is None:
        largest = min(limit, system.default_step_angle / rate if rate > 0 else math.inf)
    else:
        largest = _checked_step(system, max_step, rate)
    with np.errstate(over="ignore"):
        n = np.maximum(1.0, np.ceil(np.abs(dt) / largest * (1.0 - SLACK)))
    expected = (
        f"at most {_MOST:g}, which take minutes, at rates up to {rate:.6g} rad/s: "
        "take a shorter time, or a larger max_step"
    )
    require(bool(np.sum(n) <= _MOST), float(np.sum(n)), "number of steps", expected)
    return Schedule(dt / n, n.astype(np.int64), np.array(system.weights))


def intervals(t: Array) -> Array:
    """Differences of times, shape (M - 1,).

    Raises:
        ValueError: the times are no sequence, not strictly monotone, or infinitely far apart.
    """
    with np.errstate(over="ignore"):
        dt = np.diff(exact_array(t, "t", "M"))
    require(bool(np.all(np.isfinite(dt))), t, "t", "times whose differences are finite [s]")
    expected = "strictly increasing or decreasing times [s]"
    require(bool(np.all(dt > 0) or np.all(dt < 0)), t, "t", expected)
    return dt


def _checked_step(system: System, max_step: float, rate: float) -> float:
    if rate * positive(max_step, "max_step", "s") > system.envelope * (1.0 + SLACK):
        raise ValueError(
            f"max_step = {max_step}; expected at most {system.envelope / rate:.6g} s at rates up "
            f"to {rate:.6g} rad/s"
        )
    return float(max_step)


# Integration with step size control: the rates of the motion decide on the next steps.

Input = npt.ArrayLike | Callable[[float], npt.ArrayLike]
InputsAt = Callable[[int, Array], Array]  # of an interval, at times in it
_CHUNK = 4096  # states that are kept at once, to be checked
_SAMPLES = 2000  # steps over the whole time span, at least, where the input is a function of time


class MotionEnds(ValueError):
    """The motion reaches a state that is none: a disk that lies flat."""


def integrate(
    system: System,
    start: Array,
    t: Array,
    u: Input | None,
    max_step: float | None,
    span: float | None = None,
) -> Array:
    """States at the times t, shape (M, ..., n_state), stepped as `System.simulate` says.

    Args:
        system: physical system.
        start: state at ``t[0]``.
        t: times [s].
        u: input.
        max_step: largest step [s].
        span: time span [s] that a function u is sampled over, if t is only part of it.

    Raises:
        ValueError: see `System.simulate`; also if the motion reaches a state that is none.
    """
    inputs_at = _sampled(system, u) if callable(u) else _held(system, u, len(t) - 1)
    limit = abs(span or t[-1] - t[0]) / _SAMPLES if callable(u) else math.inf
    y = [start]
    for m in range(len(t) - 1):
        y.append(_interval(system, y[-1], t[m : m + 2], inputs_at, m, max_step, limit))
        if m == 0:
            y[0] = np.broadcast_to(start, y[1].shape)
    return np.stack(y)


def _interval(
    system: System,
    y: Array,
    ends: Array,
    inputs_at: InputsAt,
    m: int,
    max_step: float | None,
    limit: float,
) -> Array:
    """The state at the end of interval m, in spans that are no longer than the system's horizon."""
    now, end = ends
    while now != end:
        largest = np.max(np.abs(inputs_at(m, np.linspace(now, end, 5))), axis=0)
        span = end - now
        if max_step is None:
            span = math.copysign(min(abs(span), system.horizon(y, largest)), span)
        expected = "longer: the rates of the motion grow faster than time is resolved there"
        require(bool(now + span != now), span, f"span [s] from t = {now:.6g} s on", expected)
        plan = step_schedule(system, y, largest, np.array([span]), max_step, limit)
        if limit < math.inf:
            plan = plan.sampled()
        y = integrate_interval(system, y, inputs_at(m, plan.stage_times(now)), plan, now)
        now = end if span == end - now else now + span
    return y


def integrate_interval(system: System, y: Array, u: Array, plan: Schedule, start: float) -> Array:
    """The state at the end of a schedule of one interval; every step is checked on the way.

    Args:
        system: physical system.
        y: state, shape (..., n_state).
        u: inputs, shape (1 or number of stages, ..., n_input).
        plan: steps of one length that is within the envelope at the beginning.
        start: time of the beginning [s], for messages.

    Raises:
        ValueError: the motion becomes too fast for the step, or reaches a state that is none.
    """
    y, u = _aligned(y, u)
    largest = np.max(np.abs(u), axis=0)
    if math.isinf(system.horizon(y, largest)):
        return np.asarray(system.run(y, u, plan)[-1])
    h, n, n_stages = float(plan.h[0]), int(plan.n_substeps[0]), len(plan.weights)
    chunk = max(1, _CHUNK * y.shape[-1] // max(y.size, 1))
    for done in range(0, n, chunk):
        k = min(chunk, n - done)
        part = u[done * n_stages : (done + k) * n_stages] if plan.per_stage else u
        piece = replace(plan, h=np.full(k, h), n_substeps=np.ones(k, dtype=np.int64))
        states = system.run(y, part, piece)
        _check_steps(system, states[1:], largest, h, start + done * h)
        y = states[-1]
    return y


def _check_steps(system: System, states: Array, u: Array, h: float, start: float) -> None:
    """Refuse states of successive steps whose rates are too large for the step length h.

    Raises:
        ValueError: says when the first one was reached, and the remedy.
    """
    limit = system.envelope * (1.0 + SLACK)
    try:
        if system.rate_bound(system.checked_state(states), u, 0.0) * abs(h) <= limit:
            return
    except ValueError:
        pass  # the loop below finds the state and its time
    for k, y in enumerate(states):
        now = start + (k + 1) * h
        try:
            rate = system.rate_bound(system.checked_state(y), u, 0.0)
        except ValueError as error:
            raise MotionEnds(f"at t = {now:.6g} s the motion ends: {error}") from None
        if rate * abs(h) > limit:
            raise ValueError(
                f"from t = {now:.6g} s on: step = {abs(h):.6g}; expected at most "
                f"{system.envelope / rate:.6g} s at rates up to {rate:.6g} rad/s"
            )


def _aligned(y: Array, u: Array) -> tuple[Array, Array]:
    """State (..., n_state) and inputs (stages, ..., n_input) with the same leading axes."""
    lead = np.broadcast_shapes(y.shape[:-1], u.shape[1:-1])
    missing = (1,) * (len(lead) + 2 - u.ndim)  # leading axes stand after the stages
    u = u.reshape(len(u), *missing, *u.shape[1:])
    return (
        np.broadcast_to(y, (*lead, y.shape[-1])),
        np.broadcast_to(u, (len(u), *lead, u.shape[-1])),
    )


def _sampled(system: System, u: Callable[[float], npt.ArrayLike]) -> InputsAt:
    """Inputs at given times, shape (len(times), ..., n_input).

    Raises:
        ValueError: the function returns no inputs, or not always of one shape.
    """

    def inputs_at(_: int, times: Array) -> Array:
        values: list[Any] = [u(float(s)) for s in times]
        with suppress(ValueError):
            rows = system.checked_input(values)  # all at once, in a tenth of the time
            if rows.ndim > 1:  # else a number for each time, as many as an input has entries
                return rows
        return _one_by_one(system, values, times)

    return inputs_at


def _one_by_one(system: System, values: list[Any], times: Array) -> Array:
    """The same, checked so that a message is about the value at one time."""
    for s, value in zip(times, values, strict=True):
        require(value is not None, None, f"u({s:.6g})", "an input: return zeros for none")
    rows = [system.checked_input(value) for value in values]
    first, *others = {row.shape for row in rows}
    require(not others, [first, *others], "shapes of u(t)", "one shape for all times")
    return np.stack(rows)


def _held(system: System, u: npt.ArrayLike | None, n_intervals: int) -> InputsAt:
    """The one input of an interval, shape (1, ..., n_input).

    Raises:
        ValueError: `u` is neither one row nor one for each interval.
    """
    rows = system.checked_input(u)
    if rows.ndim == 1:
        return lambda *_: rows[None]
    if len(rows) != n_intervals:
        raise ValueError(
            f"u has shape {rows.shape}; expected ({rows.shape[-1]},) or "
            f"({n_intervals}, ..., {rows.shape[-1]}), one row for each interval of t"
        )
    return lambda m, _: rows[m : m + 1]


# The result of a simulation.

_SHOWING = "rigid_envs.watch.replays.motion"
"""What shows a trajectory: it stands above this room, and is found by its name when it is used."""


@dataclass(frozen=True)
class Trajectory:
    """States of a system at given times, with named access: ``trajectory["omega_body"]``.

    ``trajectory(t)`` are the states at any times between. Jupyter shows a trajectory as the page of
    `replay`.

    Attributes:
        system: of the simulation.
        t: times [s], shape (M,).
        y: states, shape (M, ..., n_state); ``y[0]`` is the first state.
        u: input of the simulation.
        max_step: of the simulation [s].
        t_events: times of each event [s], (K,).
        y_events: states there, (K, n_state).
        status: 0 if the end of the times was reached, 1 if an event ended the motion, -1 if it
            ended by itself.
        message: the same in words.
    """

    system: System
    t: Array
    y: Array
    u: Input | None = None
    max_step: float | None = None
    t_events: tuple[Array, ...] = ()
    y_events: tuple[Array, ...] = ()
    status: int = 0
    message: str = "the end of the times was reached"

    def __call__(self, t: npt.ArrayLike) -> Array:
        """States at any times from the first to the last, shape (*t.shape, ..., n_state).

        The motion is integrated anew from the time before, with the input that acted: as exact as
        the trajectory itself, and no interpolation.

        Raises:
            ValueError: times beyond the trajectory.
        """
        wanted = array(t, "t")
        low, high = np.sort(self.t[[0, -1]])
        expected = f"times of the trajectory, from {low:.9g} to {high:.9g} s"
        require((wanted >= low) & (wanted <= high), wanted, "t", expected)
        sense = 1.0 if len(self.t) < 2 or self.t[1] > self.t[0] else -1.0
        flat = wanted.ravel()
        order = np.argsort(sense * flat, kind="stable")
        nodes = np.searchsorted(sense * self.t, sense * flat[order], side="right") - 1
        states = np.empty((len(flat), *self.y.shape[1:]))
        for k in np.unique(nodes):
            rows = order[nodes == k]
            states[rows] = self._after(int(k), flat[rows])
        return states.reshape(*wanted.shape, *self.y.shape[1:])

    def _after(self, k: int, t: Array) -> Array:
        """States at times from node k on, which follow each other."""
        times, inverse = np.unique(np.append(self.t[k], t), return_inverse=True)
        if len(times) == 1:
            return np.broadcast_to(self.y[k], (len(t), *self.y.shape[1:]))
        if self.t[-1] < self.t[0]:
            times, inverse = times[::-1], len(times) - 1 - inverse
        u = input_of(self.u, k)
        if isinstance(u, np.ndarray) and u.ndim > 1:  # of a batch: held over each new interval
            u = np.broadcast_to(u, (len(times) - 1, *u.shape))
        span = float(self.t[-1] - self.t[0])
        states = integrate(self.system, self.y[k], times, u, self.max_step, span)
        return np.asarray(states[inverse.ravel()[1:]])

    def __getitem__(self, name: str) -> Array:
        """The named quantity at all times, shape (M, ...) or (M, ..., n)."""
        try:
            accessor = self.system.accessors[name]
        except KeyError:
            known = ", ".join(self.system.accessors)
            raise KeyError(f"name = {name!r}; expected one of {known}") from None
        return accessor(self.y)

    def __iter__(self) -> Iterator[str]:
        """The names that ``trajectory[name]`` knows."""
        return iter(self.system.accessors)

    def __len__(self) -> int:
        """Number of times."""
        return len(self.t)

    @property
    def invariants(self) -> dict[str, Array]:
        """The system's conserved quantities at all times, each of shape (M, ...)."""
        return self.system.invariants(self.y)

    def input_at(self, t: npt.ArrayLike) -> Array:
        """The input at some times, shape (K, ..., n_input); where it changes, the new one.

        Args:
            t: times [s], shape (K,).

        Raises:
            ValueError: no finite numbers, or another shape.
        """
        times = exact_array(t, "t", "K")
        if callable(self.u):
            rows = np.stack([self.system.checked_input(self.u(float(s))) for s in times])
        else:
            rows = np.atleast_2d(self.system.checked_input(self.u))
            sense = math.copysign(1.0, self.t[-1] - self.t[0])
            after = np.searchsorted(sense * self.t, sense * times, side="right")
            rows = rows[np.clip(after - 1, 0, len(rows) - 1)]
        inner = (1,) * (self.y.ndim - rows.ndim)
        rows = rows.reshape(len(times), *inner, *rows.shape[1:])
        return np.broadcast_to(rows, (len(times), *self.y.shape[1:-1], rows.shape[-1]))

    @property
    def omega_world(self) -> Array:
        """Angular velocity in world axes [rad/s], shape (M, ..., 3).

        Raises:
            AttributeError: a system without attitude.
        """
        if "omega_world" in self.system.accessors:
            return self["omega_world"]
        if "q" not in self.system.components:
            raise AttributeError(f"a {type(self.system).__name__} has no attitude, and no omega")
        given = cast(Any, self.system).omega_world(self.input_at(self.t))  # of kinematic rolling
        return np.asarray(given)

    @property
    def omega_body(self) -> Array:
        """Angular velocity in body axes [rad/s], shape (M, ..., 3).

        Raises:
            AttributeError: a system without attitude.
        """
        if "omega_body" in self.system.accessors:
            return self["omega_body"]
        world = self.omega_world
        return rotations.rotate_inverse(self["q"], world)

    def plot(self) -> Figure:
        """Angular velocity, attitude, path and errors of what is conserved, over time.

        Of up to four motions, by the style of their lines.

        Returns:
            A figure of matplotlib.

        Raises:
            DependencyNotInstalled: matplotlib is missing; names the command that installs it.
            ValueError: no two times, or more than four motions.
        """
        return cast("Figure", importlib.import_module(_SHOWING).plot(self))

    def replay(self, path: str | Path, title: str = "") -> Path:
        """Write a page that shows the motion in a browser, without server or network.

        Up to four motions stand side by side.

        Args:
            path: file, ending with .html; missing folders are made.
            title: heading of the page; the name of the system if left out.

        Returns:
            The path that was written.

        Raises:
            ValueError: no two times, more than four motions, or more than fits a page.
        """
        return Path(importlib.import_module(_SHOWING).write(self, path, title))

    def _repr_html_(self) -> str | None:
        """The page of `replay` in a frame, for Jupyter; None where there is none."""
        return cast("str | None", importlib.import_module(_SHOWING).inline(self))


def input_of(u: Input | None, k: int) -> Input | None:
    """The input of interval k: a function of time, or a row that is held."""
    if u is None or callable(u) or np.ndim(u) == 1:
        return u
    return np.asarray(np.asarray(u, dtype=np.float64)[k])
