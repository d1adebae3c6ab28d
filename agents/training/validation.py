"""Evaluations during training, on fixed held-out starts; they choose the best policy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_envs.scores.starts import row_seeds

from ..config.by_algorithm import Config
from ..environments.factory import make
from ..evaluation.evaluate import Episodes, SupportsPredict, play
from ..storage.evaluations import write_evaluations

__all__ = ["VALIDATION_SEED", "Validation"]

VALIDATION_SEED = 271828
"""Seed of the starts of the evaluations during training, which choose the best policy."""

_TYPES = {"results": np.float64, "ep_lengths": np.int64, "successes": bool, "costs": np.float64}


class Validation:
    """The evaluations of a run so far.

    Attributes:
        timesteps: Age of the run at each evaluation.
        best: Success rate of the best policy, and its mean return less the price of its cost at the
            end of the run; None before the first evaluation.
    """

    def __init__(self, config: Config) -> None:
        """Make the environment.

        Args:
            config: What to evaluate on, and how often.
        """
        self._venv = make(config.env_id, config.env_kwargs, config.eval_episodes)
        self._seeds = row_seeds(VALIDATION_SEED, config.eval_episodes, "validation")
        self._every = config.eval_every
        self._price = config.price_at(config.total_timesteps)
        self._columns: dict[str, list[NDArray[Any]]] = {name: [] for name in _TYPES}
        self.timesteps: list[int] = []
        self.best: tuple[float, float] | None = None

    def is_due(self, before: int, now: int, total: int) -> bool:
        """Whether an evaluation belongs between two ages of the run.

        Args:
            before: Age before the last update [steps].
            now: Age after it.
            total: Age at the end, where there always is one.
        """
        return now // self._every > before // self._every or now >= total

    def ages(self, updates: int, config: Config) -> list[int]:
        """Ages of a run at all its evaluations [steps].

        Args:
            updates: Updates that it has made.
            config: Its config.
        """
        update, total = config.steps_per_update, config.total_timesteps
        ages = range(update, updates * update + 1, update)
        return [age for age in ages if self.is_due(age - update, age, total)]

    def run(self, policy: SupportsPredict, timesteps: int) -> tuple[Episodes, bool]:
        """Evaluate a policy.

        Args:
            policy: The policy.
            timesteps: Age of the run [steps].

        Returns:
            The episodes, and whether no policy before was as good.
        """
        episodes = play(policy, self._venv, self._seeds)
        self.timesteps.append(timesteps)
        rows = (episodes.returns, episodes.lengths, episodes.successes, episodes.costs)
        for column, row in zip(self._columns.values(), rows, strict=True):
            column.append(row)
        score = self._score(episodes.successes, episodes.returns, episodes.costs)
        better = self.best is None or score > self.best
        self.best = score if better else self.best
        return episodes, better

    def arrays(self) -> dict[str, NDArray[Any]]:
        """All evaluations, one row each, under the names of SB3's `evaluations.npz`."""
        n = len(self._seeds)
        stacked = {
            k: np.array(v, dtype=_TYPES[k]).reshape(len(v), n) for k, v in self._columns.items()
        }
        return {"timesteps": np.array(self.timesteps, dtype=np.int64), **stacked}

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Restore the evaluations of `arrays`."""
        self.timesteps = arrays["timesteps"].tolist()
        for key in self._columns:
            self._columns[key] = list(arrays[key])
        rows = zip(arrays["successes"], arrays["results"], arrays["costs"], strict=True)
        self.best = max((self._score(*row) for row in rows), default=None)

    def save(self, path: Path) -> None:
        """Write `evaluations.npz`, atomically.

        Args:
            path: Where to write.
        """
        write_evaluations(path, self.arrays())

    def _score(
        self, won: NDArray[Any], returns: NDArray[Any], costs: NDArray[Any]
    ) -> tuple[float, float]:
        return float(won.mean()), float(returns.mean() - self._price * costs.mean())

    def close(self) -> None:
        """Close the environment."""
        self._venv.close()
