"""Events along a trajectory."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, array, between, non_negative, number, require
from rigid_envs.mechanics.equations import Equations, RollingContact, gamma
from rigid_envs.mechanics.integration import (
    SLACK,
    Input,
    MotionEnds,
    Trajectory,
    input_of,
    integrate,
)

if TYPE_CHECKING:
    from rigid_envs.mechanics.system import System

# Events of a motion: where a function of time and state passes zero, located and recorded.

EventFunction = Callable[[float, Array], float]


@dataclass(frozen=True)
class Event:
    """A function g(t, y) whose zeros are events, in the convention of `scipy.integrate.solve_ivp`.

    `System.simulate` and `solve_ivp` take it, and likewise any function g(t, y) with or without the
    two attributes.

    Attributes:
        function: g of a time [s] and a state, shape (n_state,); continuous along the motion.
        terminal: whether the motion stops there, or after how many of them.
        direction: 1 for zeros at which g rises, -1 where it falls, 0 for both.
    """

    function: EventFunction
    terminal: bool | int = False
    direction: float = 0.0

    def __call__(self, t: float, y: Array) -> float:
        """The value of g."""
        return self.function(t, y)


def flat(sine: float = 1e-3, *, terminal: bool | int = True) -> Event:
    """A disk has fallen flat: sin(theta) of the angle between axis and vertical falls to `sine`.

    Args:
        sine: between 1e-6, where a motion ends by itself, and 1.
        terminal: as of `Event`.

    Raises:
        ValueError: a sine that is none of these.
    """
    least = float(between(number(sine, "sine"), "sine", 1e-6, 1.0))
    return Event(lambda t, y: math.hypot(*gamma(y)[:2]) - least, terminal, -1.0)


def lift_off(
    system: RollingContact, u: Input | None = None, *, terminal: bool | int = True
) -> Event:
    """A rolling body leaves its ground: the normal force falls to 0.

    Args:
        system: that rolls.
        u: input that acts: none, a row held for ever or a function of time.
        terminal: as of `Event`.
    """
    return Event(lambda t, y: float(system.normal_force(y, _at(u, t))), terminal, -1.0)


def slip(
    system: RollingContact, mu: float, u: Input | None = None, *, terminal: bool | int = True
) -> Event:
    """A rolling body begins to slip: what friction can give falls below what rolling needs.

    g is mu times the normal force less the friction [N].

    Args:
        system: that rolls.
        mu: coefficient of friction.
        u: input that acts: none, a row held for ever or a function of time.
        terminal: as of `Event`.

    Raises:
        ValueError: mu is negative.
    """
    coefficient = non_negative(mu, "mu", "1")

    def spare(t: float, y: Array) -> float:
        force = system.contact_force(y, _at(u, t))
        return float(coefficient * force[-1] - np.linalg.norm(force[:-1]))

    return Event(spare, terminal, -1.0)


def crossing(
    system: Equations,
    name: str,
    entry: int | None = None,
    *,
    value: float = 0.0,
    direction: float = 0.0,
    terminal: bool | int = False,
) -> Event:
    """A named quantity of a state passes a value: a section through the motion.

    Args:
        system: whose accessors know the name. Angles that jump at pi are no good: a jump is taken
            for a passage.
        name: as in ``trajectory[name]``.
        entry: of a quantity that has several.
        value: that is passed.
        direction: as of `Event`.
        terminal: as of `Event`.

    Raises:
        ValueError: an unknown name, or a quantity that is no number for want of `entry`.
    """
    known = ", ".join(system.accessors)
    require(name in system.accessors, name, "name", f"one of {known}")
    level, measure = number(value, "value"), system.accessors[name]

    def beyond(t: float, y: Array) -> float:
        quantity = measure(y) if entry is None else measure(y)[entry]
        require(np.ndim(quantity) == 0, entry, "entry", f"which of {np.shape(quantity)} of {name}")
        return float(quantity) - level

    return Event(beyond, terminal, direction)


def checked_events(events: EventFunction | Sequence[EventFunction]) -> tuple[Event, ...]:
    """Events as a tuple, with the attributes that functions have or the defaults.

    Raises:
        ValueError: one that cannot be called.
    """
    given = (events,) if callable(events) else tuple(events)
    for event in given:
        require(callable(event), event, "events", "functions g(t, y), as `Event` is one")
    return tuple(
        Event(event, getattr(event, "terminal", False), getattr(event, "direction", 0.0))
        for event in given
    )


def _at(u: Input | None, t: float) -> npt.ArrayLike | None:
    """The input at a time."""
    return u(t) if callable(u) else u


def value_of(event: Event, t: float, y: Array) -> float:
    """g(t, y), a finite number.

    Raises:
        ValueError: what the function gives is none.
    """
    value = array(event(t, y), "g(t, y)")
    require(value.size == 1, list(value.shape), "shape of g(t, y)", "one number")
    return float(value.item())


# Simulation with events: nodes along the motion, sign changes between them, and where they are.

_TURN = 0.125  # rad of the fastest rate between nodes, at which signs are compared
_PARTS = 8  # of an interval, at least: what is at rest may be about to move
_ROUNDING = 4.0 * np.finfo(np.float64).eps  # of event times: of brentq, the least that it takes


Node = tuple[float, Array]
Place = Callable[[float], Array]


@dataclass
class Watch:
    """A motion under an input, and its events as they are found."""

    system: System
    events: tuple[Event, ...]
    times: Array
    u: Input | None
    max_step: float | None

    def __post_init__(self) -> None:
        """None found yet."""
        self.t: list[list[float]] = [[] for _ in self.events]
        self.y: list[list[Array]] = [[] for _ in self.events]

    def arrays(self, n: int) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        """Times (K,) and states (K, n) of each event."""
        return tuple(map(np.array, self.t)), tuple(np.reshape(y, (-1, n)) for y in self.y)

    def nodes(self, y: Array) -> Iterator[tuple[Node, bool, bool]]:
        """Nodes (t, y) of the motion, whether each is one of the times, and whether it ends it."""
        now = float(self.times[0])
        values = self._values(now, y)
        for m, end in enumerate(self.times[1:].tolist()):
            u, longest = input_of(self.u, m), abs(end - now) / _PARTS
            while now != end:
                left = end - now
                span = min(longest, self._spacing(y, u, now))
                after = now + math.copysign(span, left) if span < abs(left) * (1.0 - SLACK) else end
                place = partial(self._place, y, u, now)
                moved = place(after)
                new = self._values(after, moved)
                stop = self._record(self._passages(values, new, (now, after), place))
                if stop is not None:
                    yield stop, False, True
                    return
                now, y, values = after, moved, new
                yield (now, y), now == end, False

    def _values(self, t: float, y: Array) -> list[float]:
        return [value_of(event, t, y) for event in self.events]

    def _record(self, found: list[tuple[float, int, Array]]) -> Node | None:
        """Keep events in the order of time; the one that ends the motion, if there is one."""
        for t, k, y in found:
            self.t[k].append(t)
            self.y[k].append(y)
            terminal = self.events[k].terminal
            if terminal and len(self.t[k]) >= int(terminal):
                return t, y
        return None

    def _place(self, y: Array, u: Input | None, start: float, t: float) -> Array:
        """The state at the time t of the motion that passes y at the time `start`."""
        if t == start:
            return y
        span = float(self.times[-1] - self.times[0])
        ends = np.array([start, t])
        return np.asarray(integrate(self.system, y, ends, u, self.max_step, span)[-1])

    def _spacing(self, y: Array, u: Input | None, now: float) -> float:
        """Time [s] in which the fastest rate turns by what is between two nodes."""
        row = np.abs(self.system.checked_input(_at(u, now)))
        rate = self.system.rate_bound(y, row, 0.0)
        return min(_TURN / rate if rate > 0.0 else math.inf, self.system.horizon(y, row))

    def _passages(
        self, before: list[float], after: list[float], ends: tuple[float, float], place: Place
    ) -> list[tuple[float, int, Array]]:
        """Time, number and state of the events between two nodes, in the order of time."""
        found = []
        for k, (event, g0, g1) in enumerate(zip(self.events, before, after, strict=True)):
            rises, falls = g0 < 0.0 <= g1, g1 <= 0.0 < g0
            if (rises and event.direction >= 0.0) or (falls and event.direction <= 0.0):
                t = _located(event, ends, place)
                found.append((t, k, place(t)))
        sense = math.copysign(1.0, ends[1] - ends[0])
        return sorted(found, key=lambda passage: sense * passage[0])


def _located(event: Event, ends: tuple[float, float], place: Place) -> float:
    """Time at which g passes zero, by Brent's method on the motion integrated anew."""
    from scipy.optimize import brentq  # slow to import, and few ask for events

    tolerance = _ROUNDING * max(map(abs, ends))
    return float(
        brentq(lambda s: value_of(event, s, place(s)), *ends, xtol=tolerance, rtol=_ROUNDING)
    )


def simulate_with_events(
    system: System,
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
    watch = Watch(system, checked_events(events), t, u, max_step)
    times, states, status, message = [float(t[0])], [y0], 0, "the end of the times was reached"
    last = times[0], y0
    try:
        for node, reached, end in watch.nodes(y0):
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
    t_events, y_events = watch.arrays(len(y0))
    return Trajectory(
        system, np.array(times), np.stack(states), u, max_step, t_events, y_events, status, message
    )
