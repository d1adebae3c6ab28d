"""Episodes from many fixed starts, one from each, played together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
from gymnasium.vector import VectorEnv

from rigid_envs.registry import ErrorTerm

__all__ = ["ActionFunction", "Episodes", "Observations", "SupportsPredict", "play"]

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
Observations = npt.NDArray[Any] | dict[str, npt.NDArray[Any]]

ActionFunction = Callable[[Observations], npt.NDArray[Any]]
"""A function from the observations of all rows to their actions."""


class SupportsPredict(Protocol):
    """A policy of observations: a trained one, or a model of Stable-Baselines3."""

    def predict(
        self, observation: Observations, *, deterministic: bool = True
    ) -> tuple[npt.NDArray[Any], Any]:
        """Actions for a batch of observations."""


@dataclass(frozen=True)
class Episodes:
    """One episode from each start.

    Attributes:
        seeds: Seed of each start; `reset(seed=[...])` gives it again.
        returns: Sums of rewards, shape (n,).
        lengths: Numbers of steps, shape (n,).
        successes: `info["is_success"]` at the end, shape (n,).
        since: Step from which `info["is_success"]` was true to the end, shape (n,); where it is not
            true at the end, one step after it.
        terminated: Whether the task ended the episode, and not its time limit, shape (n,).
        costs: Sums of `info["cost"]`, in the unit that the task says, shape (n,).
        errors: Root mean squares of the error over the steps, shape (n,); None if none was asked
            for.
        bounds: Least cost that theory allows from each start, shape (n,); None if none is known.
        limit: Number of steps after which an episode is cut off.
    """

    seeds: list[int]
    returns: Array
    lengths: npt.NDArray[np.int64]
    successes: Bools
    since: npt.NDArray[np.int64]
    terminated: Bools
    costs: Array
    errors: Array | None
    bounds: Array | None
    limit: int


def play(
    act: ActionFunction,
    venv: VectorEnv[Any, Any, Any],
    seeds: list[int],
    error: ErrorTerm | None = None,
) -> Episodes:
    """Play exactly one episode in each row.

    Rows that are done go on with another episode, which is not counted: so every start weighs the
    same.

    Args:
        act: Actions of all rows.
        venv: A vector environment that resets in the same step.
        seeds: One seed per row.
        error: Reward term whose error is recorded; None for none.
    """
    n = venv.num_envs
    first_seeds: Any = seeds  # native environments take one seed for each row
    obs, _ = venv.reset(seed=first_seeds)
    bounds = _lower_bounds(venv)
    returns, costs, squares = np.zeros(n), np.zeros(n), np.zeros(n)
    lengths, failed = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
    running, over = np.ones(n, dtype=bool), np.zeros(n, dtype=bool)
    while running.any():
        obs, rewards, terminated, truncated, infos = venv.step(act(obs))
        ended = running & (terminated | truncated)
        lengths += running
        returns += np.where(running, rewards, 0.0)
        costs += np.where(running, _last(infos, "cost", ended), 0.0)
        missed = running & ~_last(infos, "is_success", ended).astype(bool)
        failed[missed] = lengths[missed]
        over |= ended & terminated
        if error is not None:
            # rows that are not running may hold anything
            term = np.where(running, _last(infos, f"reward/{error.term}", ended), 1.0)
            squares += ((1.0 / term - 1.0) / error.sharpness) ** 2
        running &= ~ended
    rms = None if error is None else np.sqrt(squares / lengths)
    won = failed < lengths
    limit = getattr(venv.spec, "max_episode_steps", None) or int(lengths.max())
    return Episodes(seeds, returns, lengths, won, failed + 1, over, costs, rms, bounds, limit)


def _last(infos: Mapping[str, Any], key: str, ended: Bools) -> npt.NDArray[Any]:
    """An info entry of the step itself, also in rows that started anew within it."""
    values = np.asarray(infos.get(key, np.zeros(len(ended))))
    if ended.any():
        values = np.where(ended, infos["final_info"].get(key, 0), values)
    return values


def _lower_bounds(venv: VectorEnv[Any, Any, Any]) -> Array | None:
    """Least cost from each start; None for a goal task, where it depends on the goal too."""
    env: Any = venv.unwrapped
    task = getattr(env, "task", None)
    hook = None if getattr(task, "n_goal", 0) else getattr(task, "lower_bound", None)
    return None if hook is None else np.asarray(hook(env.get_state()["y"]), dtype=np.float64)
