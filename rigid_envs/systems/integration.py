"""Integration with step size control: the rates of the motion decide on the next steps."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import require
from rigid_envs.systems.schedule import SLACK, RateBounded, Schedule, step_schedule

__all__ = ["Input", "Integrable", "MotionEnds", "integrate", "integrate_interval"]

Array = npt.NDArray[np.float64]
Input = npt.ArrayLike | Callable[[float], npt.ArrayLike]
InputsAt = Callable[[int, Array], Array]  # of an interval, at times in it
_CHUNK = 4096  # states that are kept at once, to be checked
_SAMPLES = 2000  # steps over the whole time span, at least, where the input is a function of time


class MotionEnds(ValueError):
    """The motion reaches a state that is none: a disk that lies flat."""


class Integrable(RateBounded, Protocol):
    """Part of the interface of `System` that integration needs."""

    def horizon(self, y: Array, u: Array) -> float:
        """Time [s] for which `rate_bound` holds."""

    def checked_state(self, y: npt.ArrayLike) -> Array:
        """The state y, checked."""

    def checked_input(self, u: npt.ArrayLike | None) -> Array:
        """The input u, checked."""

    def run(self, y0: Array, u: Array, plan: Schedule) -> Array:
        """All states of a schedule."""


def integrate(
    system: Integrable,
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
    system: Integrable,
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


def integrate_interval(
    system: Integrable, y: Array, u: Array, plan: Schedule, start: float
) -> Array:
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
        end: Array = system.run(y, u, plan)[-1]
        return end
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


def _check_steps(system: Integrable, states: Array, u: Array, h: float, start: float) -> None:
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


def _sampled(system: Integrable, u: Callable[[float], npt.ArrayLike]) -> InputsAt:
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


def _one_by_one(system: Integrable, values: list[Any], times: Array) -> Array:
    """The same, checked so that a message is about the value at one time."""
    for s, value in zip(times, values, strict=True):
        require(value is not None, None, f"u({s:.6g})", "an input: return zeros for none")
    rows = [system.checked_input(value) for value in values]
    first, *others = {row.shape for row in rows}
    require(not others, [first, *others], "shapes of u(t)", "one shape for all times")
    return np.stack(rows)


def _held(system: Integrable, u: npt.ArrayLike | None, n_intervals: int) -> InputsAt:
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
