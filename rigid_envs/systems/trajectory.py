"""The result of a simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

__all__ = ["Trajectory"]

Array = npt.NDArray[np.float64]


class Measured(Protocol):
    """Part of the interface of `System` that a trajectory needs."""

    @property
    def accessors(self) -> Mapping[str, Callable[[npt.ArrayLike], Array]]:
        """Named quantities of a state."""

    def invariants(self, y: npt.ArrayLike) -> dict[str, Array]:
        """Conserved quantities of a state."""


@dataclass(frozen=True)
class Trajectory:
    """States of a system at given times, with named access: ``trajectory["omega_body"]``.

    Attributes:
        system: of the simulation.
        t: times [s], shape (M,).
        y: states, shape (M, ..., n_state); ``y[0]`` is the first state.
    """

    system: Measured
    t: Array
    y: Array

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
