"""Theoretical limits of metrics: optima and bounds from each start, in closed form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.tasks.registry import ENVIRONMENTS, load


@dataclass(frozen=True)
class TheoreticalLimit:
    """Best value of a metric that theory allows.

    Attributes:
        kind: "exact", the optimum, or a "bound", which may be out of reach.
        text: Formula or reason.
        values: Value of every start, shape (N,), of rows that have just begun.
    """

    kind: Literal["exact", "bound"]
    text: str
    values: Callable[[RigidVectorEnv], Array]


def least_time(length: Array, acceleration: npt.ArrayLike, speed: npt.ArrayLike) -> Array:
    """Least time [s] over a length from rest to a speed of at most w: 2 sqrt(A / a) - w / a.

    The speed is ``a t`` at most, and ``w + a t`` at most at the time t before the end; the area
    under the smaller of the two is ``a (T + w / a)^2 / 4 - w^2 / (2 a)``, so that
    ``A = length + w^2 / (2 a)``. A length below ``w^2 / (2 a)`` is run through without braking.

    Args:
        length: Lengths [m or rad], shape (...).
        acceleration: Largest acceleration a.
        speed: Largest speed w at the end.
    """
    a, w = np.asarray(acceleration, dtype=np.float64), np.asarray(speed, dtype=np.float64)
    braked = 2.0 * np.sqrt((length + 0.5 * w * w / a) / a) - w / a
    return np.asarray(np.where(length > 0.5 * w * w / a, braked, np.sqrt(2.0 * length / a)))


def _rows(envs: RigidVectorEnv, name: str) -> Array:
    """A parameter of the system of every row, shape (N,)."""
    return np.array([getattr(system, name) for system in envs.systems])


def limit_of(env_id: str, metric: str) -> TheoreticalLimit | None:
    """The theoretical limit of a metric of an id; None where none is known."""
    name = ENVIRONMENTS[env_id].limits.get(metric)
    limit: TheoreticalLimit | None = None if name is None else load(name)
    return limit
