"""Episodes that somebody plays, in real time, beside the reference from the same start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from rigid_envs.envs.lookup import checked_id, task_of
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.policies import untrained_policy
from rigid_envs.scores.starts import Tally, metrics_of
from rigid_envs.scores.theory import limit_of
from rigid_envs.tasks.core import Moment
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tasks.task import Task
from rigid_envs.watch.films import figure, play_episode
from rigid_envs.watch.replays.episode import Episode, play_again
from rigid_envs.watch.scene import Interpolation

_ROUNDING = 1e-9  # share of a step that is none
_TURN = 0.35  # time in which a move on the grid is shown [s]


@dataclass(frozen=True)
class Rival:
    """What theory and the reference controller make of the same start.

    Attributes:
        name: of the reference controller; empty if the id has none.
        text: its result in words.
        bound: what nothing can beat, in words; empty where nothing is known.
    """

    name: str
    text: str
    bound: str


class Game:
    """One environment, steered from outside.

    Args:
        env_id: Gymnasium's id.
        seed: of the first start; the next ones follow.
        config: hyperparameters of the task.

    Attributes:
        task: the task.
        seed: of the present start.
        rival: what others make of it.
        over: whether the episode has ended.
        tally: figures of the episode.
        episodes: all that was played and had a step, the present one not included.
    """

    def __init__(self, env_id: str, seed: int = 0, config: Mapping[str, Any] | None = None) -> None:
        """Begin the first episode."""
        self.env_id, self._config = checked_id(env_id), dict(config or {})
        self.task: Task = task_of(self.env_id, self._config)  # refuses what is no setting
        self._env: Any = gym.make(self.env_id, disable_env_checker=True, **self._config)
        self.episodes: list[Episode] = []
        self._actions: list[npt.NDArray[Any]] = []
        self._ends = (False, False)
        self.begin(seed)

    @property
    def period(self) -> float:
        """Time in which a step is shown [s]: real time, but for moves on a grid."""
        return min(self.task.dt, _TURN) if self.task.n_choices else self.task.dt

    def begin(self, seed: int) -> None:
        """Begin an episode from the start that `reset(seed=seed)` gives."""
        self._keep()
        self.seed = seed
        self.rival = rival_of(self.env_id, seed, self._config)
        self._env.reset(seed=seed)
        self._start = {name: part.copy() for name, part in self._inner.get_state().items()}
        self._actions, self._ends, self.over = [], (False, False), False
        record = ENVIRONMENTS[self.env_id]
        limit = self._env.spec.max_episode_steps or record.max_episode_steps
        self.tally = Tally([seed], record.error, limit)
        moment = self._inner.moment()
        self._motion = Interpolation(self._inner.system, moment, moment)
        self._share = 1.0  # of the step that is shown; 1: the next one can be made

    @property
    def waiting(self) -> bool:
        """Whether the step is shown to its end, and the next one can be made."""
        return self._share >= 1.0 and not self.over

    @property
    def left(self) -> float:
        """Time for which the step is still shown [s]."""
        return (1.0 - self._share) * self.period

    def step(self, action: Any) -> None:
        """Make a step, which `advance` then shows.

        Args:
            action: as the environment takes it.
        """
        _, reward, terminated, truncated, info = self._env.step(action)
        self._actions.append(np.atleast_1d(np.array(action)))
        self.tally.add(reward, terminated, truncated, info)
        self._ends = bool(terminated), bool(truncated)
        inner = self._inner
        self._motion = Interpolation(inner.system, self._motion.at(1.0), inner.moment())
        self._share = 0.0
        self.over = terminated or truncated

    def advance(self, seconds: float) -> None:
        """Let time [s] pass in what is shown, to the end of the step at most."""
        share = self._share + seconds / self.period
        self._share = 1.0 if share > 1.0 - _ROUNDING else share

    @property
    def moment(self) -> Moment:
        """What is to be seen now."""
        return self._motion.at(self._share)

    @property
    def score(self) -> str:
        """Own result so far, in words."""
        value = self.tally.value(metrics_of(self.env_id)[0], self.task)
        return figure(self.env_id, self.task, value) if self._actions else "-"

    @property
    def verdict(self) -> str:
        """How the episode ended; empty while it runs."""
        if not self.over:
            return ""
        if self.tally.success:
            return "success"
        return "failed" if self._ends[0] else "time is over"

    @property
    def _inner(self) -> Any:
        return self._env.unwrapped

    def close(self) -> None:
        """Keep the present episode, and close the environment."""
        self._keep()
        self._env.close()

    def _keep(self) -> None:
        if self._actions:
            terminated, truncated = self._ends
            self.episodes.append(
                play_again(
                    self.task,
                    self._start,
                    np.stack(self._actions),
                    "you",
                    terminated=terminated,
                    truncated=truncated,
                )
            )
        self._actions = []


def rival_of(env_id: str, seed: int, config: Mapping[str, Any]) -> Rival:
    """Result of the best reference controller from a start, and what theory knows of it.

    Args:
        env_id: Gymnasium's id.
        seed: of the start.
        config: hyperparameters of the task.
    """
    metric = metrics_of(env_id)[0]
    name, text = "", ""
    if ENVIRONMENTS[env_id].controllers:
        policy = untrained_policy(env_id, "reference")
        name, played = policy.name, play_episode(policy, env_id, seed, config, policy.name)
        text = figure(env_id, played.task, played.value) if played.tally.success else "no success"
    limit, bound = limit_of(env_id, metric.name), ""
    if limit is not None:
        envs = make_rows(env_id, 1, config)
        envs.reset(seed=[seed])
        side = "at most" if metric.higher_is_better else "at least"
        value, unit = float(limit.values(envs)[0]), metric.unit(envs.task)
        bound = f"{side} {value:.3g} {unit}".rstrip()
        envs.close()
    return Rival(name, text, bound)
