"""Adaptive step sizes for systems whose rates no energy bounds: chosen anew as the rates grow."""

from __future__ import annotations

import abc

import numpy as np
import numpy.typing as npt

from rigid_envs.systems.base import System

__all__ = ["AdaptiveStepSystem"]

Array = npt.NDArray[np.float64]
_AHEAD = 0.25  # part of itself by which a rate may grow before the steps are chosen anew


class AdaptiveStepSystem(System):
    """A system with a bound on its rates only for a while, from its rate and the growth of that."""

    @abc.abstractmethod
    def rate_and_growth(self, y: Array, u: Array) -> tuple[float, float]:
        """Largest rate of any row [rad/s], positive, and its largest growth [rad/s^2]."""

    def rate_bound(self, y: Array, u: Array, duration: float) -> float:
        """Upper bound on the rate from its present growth [rad/s]."""
        rate, growth = self.rate_and_growth(y, u)
        return rate + min(growth * duration, _AHEAD * rate)

    def horizon(self, y: Array, u: Array) -> float:
        """Time [s] in which the rate grows by a quarter of itself."""
        rate, growth = self.rate_and_growth(y, u)
        return _AHEAD * rate / growth
