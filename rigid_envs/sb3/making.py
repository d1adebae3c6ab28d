"""Vector environments of registered ids, ready for Stable-Baselines3."""

from __future__ import annotations

from typing import Any

from rigid_envs.envs.lookup import checked_id
from rigid_envs.sb3.adapter import GymnasiumVecEnv
from rigid_envs.scores.evaluation import make_rows


def make_vec_env(
    env_id: str, n_envs: int = 1, seed: int | None = None, **env_kwargs: Any
) -> GymnasiumVecEnv:
    """An environment of n rows, compiled into one loop, as Stable-Baselines3 takes it.

    It stands for `stable_baselines3.common.env_util.make_vec_env`: same episodes from the same
    seed, episode statistics included.

    Args:
        env_id: A registered id, also in short: "BallPark".
        n_envs: Number of rows.
        seed: Row i is given seed + i in the first reset; None draws the seeds.
        **env_kwargs: Hyperparameters of the task, and ``num_threads``.

    Raises:
        ConfigError: An unknown id or hyperparameter, or a bad value; names it.
    """
    venv = GymnasiumVecEnv(make_rows(checked_id(env_id), n_envs, env_kwargs))
    venv.action_space.seed(seed)
    if seed is not None:
        venv.seed(seed)
    return venv
