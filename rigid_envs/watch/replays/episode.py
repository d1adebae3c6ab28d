"""Episodes in replays."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, Bools, printable, require
from rigid_envs.tasks.core import Core, Moment
from rigid_envs.tasks.task import Task
from rigid_envs.watch.scene import Interpolation

# Episode: what happened in one episode of a row, from the start to the end.

ARRAYS = ("y", "u", "actions", "applied", "rewards", "costs", "success", "times", "aux")
"""Attributes of an `Episode` that are arrays over its T steps or T + 1 moments."""

_LABEL_LIMIT = 200  # characters


@dataclass(frozen=True, eq=False)
class Episode:
    """T steps of one row.

    The start and the actions determine all the rest, to the bit: `play_again` computes it.

    Attributes:
        label: Who acted, as "policy" or "reference"; one line of text.
        start: Complete state at the start, as `get_state` of the environment gives it.
        parameters: Parameters of the system, by name.
        y: Physical states, shape (T + 1, n_state); y[0] is the start.
        u: Physical inputs of the steps, shape (T, n_input).
        actions: Actions as they were given, float32 (T, n_action).
        applied: Actions after clipping, noise and delay, shape (T, n_action).
        rewards: Rewards of the steps, shape (T,).
        costs: Costs of the steps, in ``task.cost_unit``, shape (T,).
        success: `info["is_success"]` of the steps, bool (T,).
        times: Times since the reset [s], shape (T + 1,).
        aux: Auxiliary states of the task, shape (T + 1, n_aux).
        terminated: Whether the task ended the episode.
        truncated: Whether the time limit ended it; neither where it was left unfinished.
    """

    label: str
    start: Mapping[str, Array]
    parameters: Mapping[str, float]
    y: Array
    u: Array
    actions: npt.NDArray[np.float32]
    applied: Array
    rewards: Array
    costs: Array
    success: Bools
    times: Array
    aux: Array
    terminated: bool = False
    truncated: bool = False

    def __len__(self) -> int:
        """Number of steps T."""
        return len(self.rewards)

    def moment(self, k: int, task: Task) -> Moment:
        """The row after k steps; as after a reset for k = 0.

        Args:
            k: Number of steps, from 0 to T.
            task: The task of the episode.
        """
        begun = k > 0
        return Moment(
            y=self.y[k],
            u=self.u[k - 1] if begun else np.zeros(self.u.shape[1]),
            parameters=self.parameters,
            aux=dict(zip(task.aux_names, self.aux[k].tolist(), strict=True)),
            action=self.applied[k - 1] if begun else np.zeros(self.applied.shape[1]),
            time=float(self.times[k]),
            reward=float(self.rewards[k - 1]) if begun else 0.0,
            cost=float(self.costs[k - 1]) if begun else 0.0,
            success=bool(begun and self.success[k - 1]),
        )


def checked_label(label: Any, name: str = "label") -> str:
    """A label that can be printed, drawn and read again.

    Args:
        label: The label.
        name: What a refusal names it.

    Raises:
        ValueError: It is no text, too long, or of several lines.
    """
    ok = isinstance(label, str) and len(label) <= _LABEL_LIMIT
    require(ok, label, name, f"at most {_LABEL_LIMIT} letters")
    return str(printable(label, name))


def play_again(
    task: Task,
    start: Mapping[str, npt.ArrayLike],
    actions: npt.ArrayLike,
    label: str = "",
    *,
    terminated: bool = False,
    truncated: bool = False,
) -> Episode:
    """The episode of a start and a sequence of actions, by the compiled step of the environments.

    Args:
        task: The task.
        start: Complete state of one row, as `get_state` of a single environment gives it.
        actions: Shape (T, n_action), finite.
        label: Who acted.
        terminated: How the episode ended.
        truncated: Likewise.

    Raises:
        ValueError: A start of another task or outside an episode, or an action that is not finite.
    """
    core = Core(task, 1)
    core.set_state({name: np.asarray(part)[None] for name, part in start.items()})
    running = bool(core.running[0])
    require(running, start["clock"], "start['clock']", "that of an episode: call reset first")
    rows = np.asarray(actions, dtype=np.float32).reshape(-1, core.actions.shape[1])
    moments = [core.moment(0)]
    for k, action in enumerate(rows):
        core.actions[0] = action
        require(core.step() >= 0, action, f"actions[{k}]", "finite numbers")
        moments.append(core.moment(0))
    found = {name: np.array(part, dtype=np.float64) for name, part in start.items()}
    return _episode(label, found, rows, moments, terminated=terminated, truncated=truncated)


def same_bits(one: Episode, other: Episode) -> bool:
    """Whether all arrays of two episodes agree to the bit, and the parameters."""
    return one.parameters == other.parameters and all(
        getattr(one, name).tobytes() == getattr(other, name).tobytes() for name in ARRAYS
    )


def _episode(
    label: str,
    start: Mapping[str, Array],
    actions: npt.NDArray[np.float32],
    moments: Sequence[Moment],
    *,
    terminated: bool,
    truncated: bool,
) -> Episode:
    """The episode of T actions and T + 1 moments."""
    first, steps = moments[0], moments[1:]
    n = len(steps)
    return Episode(
        label=label,
        start=start,
        parameters=dict(first.parameters),
        y=np.array([moment.y for moment in moments]),
        u=np.array([moment.u for moment in steps]).reshape(n, len(first.u)),
        actions=actions.copy(),
        applied=np.array([moment.action for moment in steps]).reshape(n, actions.shape[1]),
        rewards=np.array([moment.reward for moment in steps], dtype=np.float64),
        costs=np.array([moment.cost for moment in steps], dtype=np.float64),
        success=np.array([moment.success for moment in steps], dtype=np.bool_),
        times=np.array([moment.time for moment in moments]),
        aux=np.array([list(moment.aux.values()) for moment in moments]).reshape(n + 1, -1),
        terminated=terminated,
        truncated=truncated,
    )


# Moments between the steps of an episode, so that motion is smooth and its paths are curves.

_PERIOD = 0.04  # s between moments, at most
_TURN = 0.4  # rad between moments, at most
_MOST = 24  # moments in a step
_ROUNDING = 1e-6  # of a step


def moments(task: Task, episode: Episode, budget: int) -> list[Moment]:
    """Moments of an episode and between, in order; those of the steps are exact.

    Args:
        task: Its task.
        episode: The episode.
        budget: How many there may be; there are never fewer than T + 1.
    """
    system = task.system(episode.parameters)
    steps = [episode.moment(k, task) for k in range(len(episode) + 1)]
    motions = [Interpolation(system, one, other) for one, other in pairwise(steps)]
    angle = max((float(np.linalg.norm(motion.turn)) for motion in motions), default=0.0)
    wanted = max(math.ceil(task.dt / _PERIOD), math.ceil(angle / _TURN))
    n = max(1, min(wanted, _MOST, budget // max(len(episode), 1)))
    found = steps[:1]
    for motion in motions:
        found += [motion.at(j / n) for j in range(1, n + 1)]
    return found


def moment_at(task: Task, episode: Episode, time: float) -> Moment:
    """Moment of an episode at any time [s]; its end after that."""
    steps = min(time / task.dt, float(len(episode)))
    k = min(int(steps + _ROUNDING), len(episode))
    one = episode.moment(k, task)
    share = steps - k
    if share < _ROUNDING or k == len(episode):
        return one
    return Interpolation(task.system(episode.parameters), one, episode.moment(k + 1, task)).at(
        share
    )
