"""Open-loop plans, made for each row at the start of its episode."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.envs import RigidVectorEnv
from rigid_envs.kernels.layout import CLOCK

__all__ = ["Plan", "Script"]

Array = npt.NDArray[Any]
Rows = npt.NDArray[np.int64]

Plan = Callable[[RigidVectorEnv, Rows], npt.NDArray[np.float64]]
"""Entries for each step from now on, shape (T, n, ...), of n given rows; the last one stays."""


class Script:
    """Entries of open-loop plans: each row's plan is made when its episode begins.

    Rows may begin at any time: it also works across automatic resets. A row that `play` counts no
    more keeps its last plan, for planning may take long.
    """

    def __init__(self, plan: Plan, period: float = math.inf) -> None:
        """A script without entries.

        Args:
            plan: Makes the plans of rows.
            period: Number of steps after which a row's plan is made again.
        """
        self._plan, self._period = plan, period
        self._entries: Array | None = None

    def __call__(self, envs: RigidVectorEnv) -> Array:
        """The entries that are due now, shape (N, ...)."""
        elapsed = envs.get_state()["clock"][:, CLOCK.elapsed].astype(np.int64)
        begins = elapsed % self._period == 0
        if self._entries is None:
            begins[:] = True
            self._begun = np.zeros_like(elapsed)
        self._begun[begins] = elapsed[begins]
        over = getattr(envs, "uncounted", None)
        new = np.flatnonzero(begins if over is None else begins & ~over)
        if len(new):
            self._write(self._plan(envs, new), new, envs.num_envs)
        assert self._entries is not None
        step = np.minimum(elapsed - self._begun, len(self._entries) - 1)
        return np.asarray(self._entries[step, np.arange(envs.num_envs)])

    def _write(self, entries: Array, rows: Rows, n: int) -> None:
        if self._entries is None:
            self._entries = np.zeros((1, n, *entries.shape[2:]))
        last = max(len(entries), len(self._entries))
        self._entries = _prolonged(self._entries, last)
        self._entries[:, rows] = _prolonged(entries, last)


def _prolonged(entries: Array, n: int) -> Array:
    """The last entry repeated up to n of them."""
    more = np.repeat(entries[-1:], n - len(entries), axis=0)
    return np.concatenate([entries, more])
