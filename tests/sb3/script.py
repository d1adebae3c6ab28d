"""A vector environment that plays what is written, and steps of an adapter around it."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space


class Script(VectorEnv[Any, Any, Any]):
    """Three rows that play what is written: row 0 ends after 2 steps, row 1 at the limit of 3."""

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP, "render_modes": []}  # noqa: RUF012
    ENDS = (2, 99, 3)

    def __init__(self):
        self.num_envs = 3
        self.single_observation_space = gym.spaces.Box(-100, 100, (1,), np.float32)
        self.single_action_space = gym.spaces.Box(-1, 1, (1,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, 3)
        self.action_space = batch_space(self.single_action_space, 3)

    def reset(self, *, seed=None, options=None):
        self.seen_seed, self.seen_options = seed, options
        self.elapsed = np.zeros(3, dtype=np.int64)
        return self.observe(), {"elapsed": self.elapsed.copy()}

    def step(self, actions):
        self.elapsed += 1
        reward = 10.0 * np.arange(3) + self.elapsed
        terminated = self.elapsed == np.array(self.ENDS)
        truncated = self.elapsed >= 3
        done = terminated | truncated
        info = {"elapsed": self.elapsed.copy()}
        if done.any():
            info |= {
                "final_obs": self.observe(),
                "final_info": {
                    "elapsed": self.elapsed.copy(),
                    "is_success": terminated.copy(),
                    "only_row_0": np.array([7, 0, 0]),
                    "_only_row_0": np.array([True, False, False]),
                    "pose": np.outer(self.elapsed, [1.0, 2.0]),
                },
            }
            self.elapsed[done] = 0
            info["elapsed"] = self.elapsed.copy()
        return self.observe(), reward, terminated, truncated, info

    def observe(self):
        return (10.0 * np.arange(3) + self.elapsed).astype(np.float32)[:, None]


def steps(env, n):
    return [env.step(np.zeros((env.num_envs, *env.action_space.shape))) for _ in range(n)]
