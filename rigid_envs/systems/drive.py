"""Simulation under an input: the state decides on the next steps."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rigid_envs.systems.schedule import schedule

if TYPE_CHECKING:
    from rigid_envs.systems.base import System

__all__ = ["Input", "drive"]

Array = npt.NDArray[np.float64]
Input = npt.ArrayLike | Callable[[float], npt.ArrayLike]
InputsAt = Callable[[int, Array], Array]  # of an interval, at times in it
_SAMPLES = 2000  # steps over the whole time span, at least, where the input is a function of time


def drive(system: System, start: Array, t: Array, u: Input, max_step: float | None) -> Array:
    """States at the times t, shape (M, ..., n_state), stepped as `System.simulate` says.

    Raises:
        ValueError: see `System.simulate`; also if the motion reaches a state that is none.
    """
    inputs_at = _sampled(system, u) if callable(u) else _held(system, u, len(t) - 1)
    limit = abs(t[-1] - t[0]) / _SAMPLES if callable(u) else math.inf
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
        plan = schedule(system, y, largest, np.array([span]), max_step, limit)
        if limit < math.inf:
            plan = plan.sampled()
        u = inputs_at(m, plan.stage_times(now))
        now = end if span == end - now else now + span
        y = _checked(system, system.run(*_aligned(y, u), plan)[-1], now)
    return y


def _aligned(y: Array, u: Array) -> tuple[Array, Array]:
    """State (..., n_state) and inputs (stages, ..., n_input) with the same leading axes."""
    lead = np.broadcast_shapes(y.shape[:-1], u.shape[1:-1])
    missing = (1,) * (len(lead) + 2 - u.ndim)  # leading axes stand after the stages
    u = u.reshape(len(u), *missing, *u.shape[1:])
    return (
        np.broadcast_to(y, (*lead, y.shape[-1])),
        np.broadcast_to(u, (len(u), *lead, u.shape[-1])),
    )


def _checked(system: System, y: Array, t: float) -> Array:
    """The state itself.

    Raises:
        ValueError: it is none; says when.
    """
    try:
        return system.checked_state(y)
    except ValueError as error:
        raise ValueError(f"at t = {t:.6g} s the motion ends: {error}") from None


def _sampled(system: System, u: Callable[[float], npt.ArrayLike]) -> InputsAt:
    """Inputs at given times, shape (len(times), ..., n_input)."""
    return lambda _, times: np.stack([system.checked_input(u(float(s))) for s in times])


def _held(system: System, u: npt.ArrayLike, n_intervals: int) -> InputsAt:
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
