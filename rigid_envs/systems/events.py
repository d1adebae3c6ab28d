"""Events of a motion: where a function of time and state passes zero, located and recorded."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import array, between, non_negative, number, require
from rigid_envs.systems.accessors import gamma
from rigid_envs.systems.contact import RollingContact
from rigid_envs.systems.equations import Equations
from rigid_envs.systems.integration import Input

__all__ = ["Event", "EventFunction", "crossing", "flat", "lift_off", "slip"]

Array = npt.NDArray[np.float64]
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
