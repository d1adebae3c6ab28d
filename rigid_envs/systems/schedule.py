"""How the times of a simulation are divided into steps of the integrator."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rigid_envs.kernels.composition import SUZUKI

if TYPE_CHECKING:
    from rigid_envs.systems.base import System

__all__ = ["Schedule", "schedule"]

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
_SAMPLES = 2000  # steps over the whole time span where the input is a function of time
_SLACK = 1e-9  # differences of times are rounded: no second step for an excess this small


@dataclass(frozen=True)
class Schedule:
    """Interval m is covered by ``n_substeps[m]`` steps of length ``h[m]`` [s]."""

    h: Array
    n_substeps: Integers
    weights: Array
    per_stage: bool = False

    @classmethod
    def constant(cls, h: float, n_substeps: int, weights: tuple[float, ...]) -> Schedule:
        """A single interval."""
        return cls(np.array([h]), np.array([n_substeps]), np.array(weights))

    def sampled(self, weights: Array) -> Schedule:
        """The same steps with an input of its own for every stage."""
        return replace(self, weights=weights, per_stage=True)

    def u_first(self, n_inputs: int) -> Integers:
        """Index of the first input of every interval."""
        if self.per_stage:
            stages = self.n_substeps * len(self.weights)
            return np.concatenate([[0], np.cumsum(stages)[:-1]]).astype(np.int64)
        if n_inputs == 1:
            return np.zeros(len(self.h), dtype=np.int64)
        return np.arange(len(self.h), dtype=np.int64)

    def stage_times(self, start: float) -> Array:
        """Midpoint of every stage of the Suzuki composition [s]: where an input is sampled."""
        weights = np.array(SUZUKI)
        inside = np.cumsum(weights) - 0.5 * weights
        steps = np.repeat(self.h, self.n_substeps)
        begin = start + np.concatenate([[0.0], np.cumsum(steps)[:-1]])
        return np.ravel(begin[:, None] + steps[:, None] * inside)


def schedule(
    system: System,
    y0: Array,
    t: Array,
    held: Array | None,
    sampled: Callable[[float], npt.ArrayLike] | None,
    max_step: float | None,
) -> Schedule:
    """Divide the intervals of t; see `System.simulate` for the rules and the errors."""
    dt = _intervals(t)
    if max_step is not None and not (math.isfinite(max_step) and max_step > 0):
        raise ValueError(f"max_step = {max_step}; expected a positive time [s]")
    span = float(np.sum(np.abs(dt)))
    probe = _probe(system, t, held, sampled)
    rate = system.rate_bound(y0, probe, span if held is not None or sampled is not None else 0.0)
    largest = system._fine / rate if rate > 0 else math.inf
    if sampled is not None:
        largest = min(largest, span / _SAMPLES)
    if max_step is not None:
        largest = max_step
        if rate * largest > system.envelope and sampled is None and held is None:
            raise ValueError(
                f"max_step = {max_step} s at rates up to {rate:.6g} rad/s: expected a product "
                f"of at most {system.envelope}; take max_step <= {system.envelope / rate:.6g}"
            )
    n = np.maximum(1, np.ceil(np.abs(dt) / largest * (1.0 - _SLACK))).astype(np.int64)
    return Schedule(dt / n, n, np.array(system._kernels.WEIGHTS))


def _intervals(t: Array) -> Array:
    if t.ndim != 1 or len(t) < 1:
        raise ValueError(f"t has shape {t.shape}; expected (M,) with M >= 1 times")
    dt = np.diff(t)
    if not (np.all(dt > 0) or np.all(dt < 0)):
        raise ValueError("t is not monotone; expected strictly increasing or decreasing times")
    return dt


def _probe(
    system: System,
    t: Array,
    held: Array | None,
    sampled: Callable[[float], npt.ArrayLike] | None,
) -> Array:
    """The largest input that will act, entry by entry."""
    if sampled is not None:
        held = np.stack([system._input(sampled(float(s))) for s in np.linspace(t[0], t[-1], 65)])
    n = len(system.input_entries)
    return np.zeros(n) if held is None else np.max(np.abs(held.reshape(-1, n)), axis=0)
