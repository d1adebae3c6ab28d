"""Step size selection: the intervals of a simulation divided into equal integrator steps."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import exact_array, positive, require
from rigid_envs.kernels.composition import SUZUKI

__all__ = ["SLACK", "RateBounded", "Schedule", "intervals", "step_schedule"]

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
_MOST = 1e9  # steps
SLACK = 1e-9  # differences of times are rounded: no second step for an excess this small


class RateBounded(Protocol):
    """Part of the interface of `System` that step size selection needs."""

    @property
    def envelope(self) -> float:
        """Largest rate times step [rad] at which the integrator is accurate."""

    @property
    def default_step_angle(self) -> float:
        """Rate times step [rad] of `simulate`."""

    @property
    def weights(self) -> tuple[float, ...]:
        """Lengths of the stages of one step."""

    def rate_bound(self, y: Array, u: Array, duration: float) -> float:
        """Largest angular rate [rad/s] that any row can reach."""


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

    def sampled(self) -> Schedule:
        """The same steps, fourth order also for an input that changes: one for every stage."""
        return replace(self, weights=np.array(SUZUKI), per_stage=True)

    def stage_times(self, start: float) -> Array:
        """Midpoint of every stage [s], of intervals that follow each other from `start` on."""
        inside = np.cumsum(self.weights) - 0.5 * self.weights
        steps = np.repeat(self.h, self.n_substeps)
        begin = start + np.concatenate([[0.0], np.cumsum(steps)[:-1]])
        return np.ravel(begin[:, None] + steps[:, None] * inside)


def step_schedule(
    system: RateBounded,
    y: Array,
    u: Array,
    dt: Array,
    max_step: float | None,
    limit: float = math.inf,
) -> Schedule:
    """Divide intervals dt [s] that begin with the state y into steps.

    Args:
        system: physical system.
        y: states, shape (..., n_state).
        u: inputs that act, shape (..., n_input).
        dt: lengths of the intervals [s], shape (M,).
        max_step: largest step [s], or None for one that resolves the fastest rate.
        limit: largest step [s] where `max_step` is None.

    Raises:
        ValueError: `max_step` is not positive, or outside the stability envelope; more steps than
            can be counted.
    """
    rate = system.rate_bound(y, u, float(np.max(np.abs(dt), initial=0.0)))
    if max_step is None:
        largest = min(limit, system.default_step_angle / rate if rate > 0 else math.inf)
    else:
        largest = _checked_step(system, max_step, rate)
    with np.errstate(over="ignore"):
        n = np.maximum(1.0, np.ceil(np.abs(dt) / largest * (1.0 - SLACK)))
    expected = (
        f"at most {_MOST:g}, which take minutes, at rates up to {rate:.6g} rad/s: "
        "take a shorter time, or a larger max_step"
    )
    require(bool(np.sum(n) <= _MOST), float(np.sum(n)), "number of steps", expected)
    return Schedule(dt / n, n.astype(np.int64), np.array(system.weights))


def intervals(t: Array) -> Array:
    """Differences of times, shape (M - 1,).

    Raises:
        ValueError: the times are no sequence, not strictly monotone, or infinitely far apart.
    """
    with np.errstate(over="ignore"):
        dt = np.diff(exact_array(t, "t", "M"))
    require(bool(np.all(np.isfinite(dt))), t, "t", "times whose differences are finite [s]")
    expected = "strictly increasing or decreasing times [s]"
    require(bool(np.all(dt > 0) or np.all(dt < 0)), t, "t", expected)
    return dt


def _checked_step(system: RateBounded, max_step: float, rate: float) -> float:
    if rate * positive(max_step, "max_step", "s") > system.envelope * (1.0 + SLACK):
        raise ValueError(
            f"max_step = {max_step}; expected at most {system.envelope / rate:.6g} s at rates up "
            f"to {rate:.6g} rad/s"
        )
    return float(max_step)
