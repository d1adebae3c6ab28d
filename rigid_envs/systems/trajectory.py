"""The result of a simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import array, require
from rigid_envs.systems.integration import Input, Integrable, integrate

__all__ = ["Measured", "Trajectory", "input_of"]

Array = npt.NDArray[np.float64]


class Measured(Integrable, Protocol):
    """Part of the interface of `System` that a trajectory needs."""

    @property
    def accessors(self) -> Mapping[str, Callable[[npt.ArrayLike], Array]]:
        """Named quantities of a state."""

    def invariants(self, y: npt.ArrayLike) -> dict[str, Array]:
        """Conserved quantities of a state."""


@dataclass(frozen=True)
class Trajectory:
    """States of a system at given times, with named access: ``trajectory["omega_body"]``.

    ``trajectory(t)`` are the states at any times between.

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

    system: Measured
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


def input_of(u: Input | None, k: int) -> Input | None:
    """The input of interval k: a function of time, or a row that is held."""
    if u is None or callable(u) or np.ndim(u) == 1:
        return u
    row: Array = np.asarray(u, dtype=np.float64)[k]
    return row
