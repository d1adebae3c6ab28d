"""How long trainings that hang are waited for."""

from __future__ import annotations

from collections.abc import Mapping
from time import monotonic
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .training import Training

__all__ = ["PATIENCE", "Patience"]

PATIENCE = 3600.0
"""Seconds for which a training may write nothing. Each update writes, and takes far less."""

_LONGEST = 5.0
"""Seconds that count between two looks: longer ones are of this process, stopped or asleep too."""


class Patience:
    """Watches what trainings write, and says which have written nothing for too long."""

    def __init__(self, seconds: float) -> None:
        """Watch none yet.

        Args:
            seconds: How long a training may write nothing.
        """
        self._seconds, self._looked = seconds, monotonic()
        self._signs: dict[int, float] = {}  # time of the last one that was seen
        self._silent: dict[int, float] = {}  # seconds since then

    def lost(self, running: Mapping[int, Training]) -> list[int]:
        """Look at them.

        Args:
            running: Those that train now, each with its number.

        Returns:
            Numbers of those that have written nothing for too long, though a process works in their
            run: what waits in a queue is let be. They are counted anew from here on.
        """
        now = monotonic()
        passed, self._looked = min(now - self._looked, _LONGEST), now
        for number, training in running.items():
            sign = training.last_sign()
            is_silent = sign == self._signs.get(number)
            self._silent[number] = self._silent.get(number, 0.0) + passed if is_silent else 0.0
            self._signs[number] = sign
        for number in self._signs.keys() - running.keys():
            del self._signs[number], self._silent[number]
        late = [number for number, silent in self._silent.items() if silent > self._seconds]
        self._silent.update(dict.fromkeys(late, 0.0))
        return [number for number in late if running[number].is_in_use()]
