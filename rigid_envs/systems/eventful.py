"""Simulation with events: nodes along the motion, sign changes between them, and where they are."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import require
from rigid_envs.systems.events import Event, EventFunction, checked_events, value_of
from rigid_envs.systems.integration import Input, MotionEnds, integrate
from rigid_envs.systems.schedule import SLACK
from rigid_envs.systems.trajectory import Measured, Trajectory, input_of

__all__ = ["simulate_with_events"]

Array = npt.NDArray[np.float64]
_TURN = 0.125  # rad of the fastest rate between nodes, at which signs are compared
_PARTS = 8  # of an interval, at least: what is at rest may be about to move
_ROUNDING = 4.0 * np.finfo(np.float64).eps  # of event times: of brentq, the least that it takes


class Recorder:
    """Events as they are found, and whether they end the motion."""

    def __init__(self, events: Sequence[Event]) -> None:
        """None found yet."""
        self.events = events
        self.t: list[list[float]] = [[] for _ in events]
        self.y: list[list[Array]] = [[] for _ in events]

    def record(self, found: list[tuple[float, int, Array]]) -> tuple[float, Array] | None:
        """Keep events in the order of time; the one that ends the motion, if there is one."""
        for t, k, y in found:
            self.t[k].append(t)
            self.y[k].append(y)
            terminal = self.events[k].terminal
            if terminal and len(self.t[k]) >= int(terminal):
                return t, y
        return None

    def arrays(self, n: int) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        """Times (K,) and states (K, n) of each event."""
        return tuple(map(np.array, self.t)), tuple(np.reshape(y, (-1, n)) for y in self.y)


def simulate_with_events(
    system: Measured,
    y0: Array,
    t: Array,
    u: Input | None,
    max_step: float | None,
    events: EventFunction | Sequence[EventFunction],
) -> Trajectory:
    """`System.simulate` with events.

    Raises:
        ValueError: as `System.simulate`; also a batch of states, events that are no functions.
    """
    require(y0.ndim == 1, list(y0.shape), "shape of y0", "one state, where there are events")
    recorder = Recorder(checked_events(events))
    times, states, status, message = [float(t[0])], [y0], 0, "the end of the times was reached"
    last = times[0], y0
    try:
        for node, reached, end in _nodes(system, y0, t, u, max_step, recorder):
            if reached or end:
                times, states = [*times, node[0]], [*states, node[1]]
            if end:
                status, message = 1, "an event ended the motion"
                break
            last = node
    except MotionEnds as error:
        status, message = -1, str(error)
        if last[0] != times[-1]:
            times, states = [*times, last[0]], [*states, last[1]]
    t_events, y_events = recorder.arrays(len(y0))
    return Trajectory(
        system, np.array(times), np.stack(states), u, max_step, t_events, y_events, status, message
    )


def _nodes(
    system: Measured,
    y0: Array,
    t: Array,
    u: Input | None,
    max_step: float | None,
    recorder: Recorder,
) -> Iterator[tuple[tuple[float, Array], bool, bool]]:
    """Nodes (t, y) of the motion, whether each is one of the times t, and whether it ends it."""
    now, y = float(t[0]), y0
    values = [value_of(event, now, y) for event in recorder.events]
    for m, end in enumerate(t[1:].tolist()):
        given, longest = input_of(u, m), abs(end - now) / _PARTS
        while now != end:
            left = end - now
            span = min(longest, _spacing(system, y, given, now))
            after = now + math.copysign(span, left) if span < abs(left) * (1.0 - SLACK) else end
            place = partial(_place, system, y, given, max_step, float(t[-1] - t[0]), now)
            moved = place(after)
            new = [value_of(event, after, moved) for event in recorder.events]
            found = _passages(recorder.events, values, new, (now, after), place)
            stop = recorder.record(found)
            if stop is not None:
                yield stop, False, True
                return
            now, y, values = after, moved, new
            yield (now, y), now == end, False


def _place(
    system: Measured,
    y: Array,
    u: Input | None,
    max_step: float | None,
    span: float,
    start: float,
    t: float,
) -> Array:
    """The state at the time t of the motion that passes y at the time `start`."""
    if t == start:
        return y
    end: Array = integrate(system, y, np.array([start, t]), u, max_step, span)[-1]
    return end


def _spacing(system: Measured, y: Array, u: Input | None, now: float) -> float:
    """Time [s] in which the fastest rate turns by what is between two nodes."""
    row = system.checked_input(u(now) if callable(u) else u)
    rate = system.rate_bound(y, np.abs(row), 0.0)
    return min(_TURN / rate if rate > 0.0 else math.inf, system.horizon(y, np.abs(row)))


def _passages(
    events: Sequence[Event],
    before: list[float],
    after: list[float],
    ends: tuple[float, float],
    place: Callable[[float], Array],
) -> list[tuple[float, int, Array]]:
    """Time, number and state of the events between two nodes, in the order of time."""
    found = []
    for k, (event, g0, g1) in enumerate(zip(events, before, after, strict=True)):
        rises, falls = g0 < 0.0 <= g1, g1 <= 0.0 < g0
        if (rises and event.direction >= 0.0) or (falls and event.direction <= 0.0):
            t = _located(event, ends, place)
            found.append((t, k, place(t)))
    sense = math.copysign(1.0, ends[1] - ends[0])
    return sorted(found, key=lambda passage: sense * passage[0])


def _located(event: Event, ends: tuple[float, float], place: Callable[[float], Array]) -> float:
    """Time at which g passes zero, by Brent's method on the motion integrated anew."""
    from scipy.optimize import brentq  # slow to import, and few ask for events

    tolerance = _ROUNDING * max(map(abs, ends))
    return float(
        brentq(lambda s: value_of(event, s, place(s)), *ends, xtol=tolerance, rtol=_ROUNDING)
    )
