"""Systems whose rates no energy bounds for ever: their steps are chosen anew as they speed up."""

from __future__ import annotations

import abc

import numpy as np
import numpy.typing as npt

from rigid_envs.systems.base import System

__all__ = ["PacedSystem"]

Array = npt.NDArray[np.float64]
_AHEAD = 0.25  # part of itself by which a rate may grow before the steps are chosen anew


class PacedSystem(System):
    """A system that says how fast it is, and how fast it may become faster."""

    @abc.abstractmethod
    def pace(self, y: Array, u: Array) -> tuple[float, float]:
        """Largest rate of any row [rad/s], positive, and its largest growth [rad/s^2]."""

    def rate_bound(self, y: Array, u: Array, duration: float) -> float:
        """The present rate, and what it gains at the present growth [rad/s]."""
        rate, gain = self.pace(y, u)
        return rate + min(gain * duration, _AHEAD * rate)

    def horizon(self, y: Array, u: Array) -> float:
        """Time [s] in which the rate grows by a quarter of itself."""
        rate, gain = self.pace(y, u)
        return _AHEAD * rate / gain
