"""Open-loop plans, made for each row at the start of its episode."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.kernels.layout import CLOCK
from rigid_envs.scores.controllers import States

__all__ = ["Memory", "Plan", "Rows", "Script"]

Array = npt.NDArray[Any]
Bools = npt.NDArray[np.bool_]
Rows = npt.NDArray[np.int64]

Plan = Callable[[Any, Rows], npt.NDArray[np.float64]]
"""From `States` and the indices of n rows their entries for each step from now on, (T, n, ...).

The last entry stays.
"""


class Memory(NamedTuple):
    """The plans of N rows.

    Attributes:
        entries: Shape (T, N, ...).
        age: Steps since the plan of each row was made, shape (N,).
    """

    entries: Array
    age: Rows


class Script:
    """A controller by plans: that of each row is made when its episode begins.

    Rows may begin at any time: it also works across automatic resets. A row that `play` counts no
    more keeps its last plan, for planning may take long.
    """

    def __init__(
        self,
        plan: Plan,
        follow: Callable[[Any, Array], Array] = lambda states, due: due,
        period: float = math.inf,
    ) -> None:
        """A script without plans.

        Args:
            plan: Makes the plans of rows.
            follow: Actions from `States` and the entries that are due; those entries, if left out.
            period: Number of steps after which a row's plan is made again.
        """
        self._plan, self._follow, self._period = plan, follow, period
        self._memory: Memory | None = None

    def act(self, states: States, memory: Memory | None, begins: Bools) -> tuple[Array, Memory]:
        """Actions of all rows, and the plans that they follow.

        Args:
            states: Of the rows.
            memory: From the step before; None where there was none. It is left as it is.
            begins: Rows whose episode begins, shape (N,).
        """
        n = len(begins)
        if memory is None:
            memory, begins = Memory(np.zeros((0, n)), np.zeros(n, np.int64)), np.ones(n, np.bool_)
        entries, age = memory
        new = np.flatnonzero(begins | (age >= self._period))
        if len(new):
            entries = _written(entries, np.asarray(self._plan(states, new)), new)
            age = age.copy()
            age[new] = 0
        due = entries[np.minimum(age, len(entries) - 1), np.arange(n)]
        return np.asarray(self._follow(states, due)), Memory(entries, age + 1)

    def __call__(self, envs: Any) -> Array:
        """Actions of native rows, whose clocks say when episodes begin; it keeps the plans."""
        begins = envs.get_state()["clock"][:, CLOCK.elapsed] == 0
        over = getattr(envs, "uncounted", None)
        actions, self._memory = self.act(
            envs, self._memory, begins if over is None else begins & ~over
        )
        return actions


def _written(entries: Array, new: Array, rows: Rows) -> Array:
    """Entries with those of some rows replaced; the shorter ones go on with their last."""
    length = max(len(entries), len(new))
    if not len(entries):
        entries = np.zeros((1, entries.shape[1], *new.shape[2:]))
    written = _prolonged(entries, length)
    written[:, rows] = _prolonged(new, length)
    return written


def _prolonged(entries: Array, n: int) -> Array:
    """The last entry repeated up to n of them, in a new array."""
    more = np.repeat(entries[-1:], n - len(entries), axis=0)
    return np.concatenate([entries, more])
