"""Episodes played in all rows of an environment, and counted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.vector import VectorEnv

from rigid_envs.registry import ErrorTerm
from rigid_envs.scores.episodes import ActionFunction, Episodes
from rigid_envs.scores.tally import Tally

__all__ = ["play"]

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


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
    first_seeds: Any = seeds  # native environments take one seed for each row
    obs, _ = venv.reset(seed=first_seeds)
    bounds = _lower_bounds(venv)
    tally = Tally(seeds, error, getattr(venv.spec, "max_episode_steps", None))
    while tally.running.any():
        obs, rewards, terminated, truncated, infos = venv.step(act(obs))
        ended = tally.running & (terminated | truncated)
        values = {key: _last(infos, key, ended) for key in tally.keys}
        tally.add(rewards, terminated, truncated, values)
    return tally.episodes(bounds)


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
