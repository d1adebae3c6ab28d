"""Parts of observations by name, and what is decoded from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.settings import refusal
from rigid_envs.systems import System
from rigid_envs.tasks import Task
from rigid_envs.tasks.entries import attitude_entries

__all__ = ["Decoded", "Decoder", "Part", "attitude", "entries", "goal_attitude", "numbers"]

Array = npt.NDArray[np.float64]

Part = Callable[[Array], Array]
"""Part of the numbers of observations, shape (N, n)."""

GoalPart = Literal["achieved_goal", "desired_goal", "observation"]
"""Part of an observation of a goal environment."""

_COLUMNS = ("R11", "R21", "R31", "R12", "R22", "R32")
_GOALS = ("achieved_goal", "desired_goal", "observation")


@dataclass(frozen=True, eq=False)
class Decoded:
    """States found in observations, as controllers read them (`rigid_envs.scores.States`).

    Attributes:
        system: The physical system with the middle of each range.
        y: Physical states, shape (N, n_state); what no controller reads is at rest.
        known: Parts of the auxiliary state by name, each of shape (N,).
    """

    system: System
    y: Array
    known: Mapping[str, Array] = field(default_factory=dict)

    @property
    def systems(self) -> list[System]:
        """The physical system of every row."""
        return [self.system] * len(self.y)

    def auxiliary(self, *names: str) -> Array:
        """Parts of the auxiliary state, by name: shape (N,), or (N, k) of k > 1 names."""
        columns = [self.known[name] for name in names]
        return columns[0] if len(columns) == 1 else np.stack(columns, axis=-1)


Decoder = Callable[[Array], Decoded]
"""From the numbers of observations, shape (N, n), in the order of `Task.observations`."""


def numbers(task: Task, observation: Any) -> tuple[Array, bool]:
    """The numbers of observations in the order of `Task.observations`.

    Args:
        task: The task.
        observation: One or a batch; a dictionary of such from a goal environment.

    Returns:
        Shape (N, n), and whether it is one alone.

    Raises:
        ValueError: Another shape, a part that is missing, or a number that is not finite.
    """
    n = len(task.observations())
    if task.n_goal:
        if not isinstance(observation, Mapping) or not set(_GOALS) <= set(observation):
            raise ValueError(f"observation: expected a dictionary of {', '.join(_GOALS)}")
        observation = np.concatenate([np.asarray(observation[name]) for name in _GOALS], axis=-1)
    seen = np.asarray(observation, dtype=np.float64)
    if seen.shape[-1:] != (n,) or seen.ndim > 2 or not np.isfinite(seen).all():
        raise ValueError(
            f"observation of shape {seen.shape}: expected ({n},) or (N, {n}), every entry finite"
        )
    return np.atleast_2d(seen), seen.ndim == 1


def entries(
    task: Task,
    *symbols: str,
    part: GoalPart = "observation",
) -> Part:
    """Reader of entries of an observation by their symbols in `Task.features`.

    Args:
        task: The task.
        *symbols: The symbols.
        part: Of a goal environment.

    Returns:
        A function to shape (N,) for one symbol, (N, k) for k > 1.
    """
    first = task.n_goal * _GOALS.index(part)
    known = [entry.symbol for entry in task.features()]
    at = [known.index(symbol, first) for symbol in symbols]
    return lambda seen: seen[:, at[0]] if len(at) == 1 else seen[:, at]


def attitude(task: Task, needed: bool = True) -> Part:
    """Reader of the attitude q, shape (N, 4), in any representation; of one that noise has moved.

    Args:
        task: The task.
        needed: Whether it is refused that the attitude is not observed; else it is upright then.

    Raises:
        ConfigError: It is not observed.
    """
    symbols = [entry.symbol for entry in attitude_entries(task.rotation)]
    first = len(task.features())
    if not symbols:
        if needed:
            raise refusal("rotation", "none", "an attitude that is seen: 'matrix', 'quat', ...")
        return lambda seen: np.tile(rotations.identity(), (len(seen), 1))
    if task.rotation == "quat":
        return lambda seen: rotations.normalize(seen[:, first : first + 4])
    if task.rotation == "euler":
        return lambda seen: rotations.quaternion_from_euler(seen[:, first : first + 3])
    at = [first + symbols.index(symbol) for symbol in _COLUMNS]
    return lambda seen: _from_columns(seen[:, at])


def goal_attitude(task: Task, part: GoalPart) -> Part:
    """Reader of the attitude q, shape (N, 4), in a goal.

    Args:
        task: The task.
        part: The goal.
    """
    columns = entries(task, *_COLUMNS, part=part)
    return lambda seen: _from_columns(columns(seen))


def _from_columns(columns: Array) -> Array:
    """Attitudes q, shape (N, 4), of the first two columns of R, shape (N, 6)."""
    return rotations.quaternion_from_matrix(rotations.matrix_from_rot6d(columns))
