"""Time spent on a run."""

from __future__ import annotations

import time
from typing import NamedTuple

__all__ = ["Clock", "Spent"]


class Spent(NamedTuple):
    """Time spent on a run, all sessions together.

    Attributes:
        seconds: Of the clock on the wall [s].
        cpu_seconds: Of processors, user and system, all threads [s].
    """

    seconds: float
    cpu_seconds: float


_NOTHING = Spent(0.0, 0.0)


class Clock:
    """A clock that goes on from where an earlier session of a run stopped it."""

    def __init__(self, before: Spent = _NOTHING) -> None:
        """Start it.

        Args:
            before: Time spent in earlier sessions.
        """
        self._before, self._begin = before, _now()

    def spent(self) -> Spent:
        """Time spent so far."""
        now = _now()
        return Spent(*(b + n - a for b, n, a in zip(self._before, now, self._begin, strict=True)))


def _now() -> Spent:
    return Spent(time.perf_counter(), time.process_time())
