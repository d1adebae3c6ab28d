"""A native vector environment for tests: cheap, random in start and step, exactly resumable.

A point in the plane drifts at random; the action pushes it; success is to come near the origin.
Its randomness is SplitMix64 of (seed of the row, number of draws), so its state is two integers.
"""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

ID = "Drift-v0"


class Drift(VectorEnv[Any, Any, Any]):
    def __init__(
        self,
        num_envs=1,
        max_episode_steps=20,
        autoreset_mode="SameStep",
        noise=0.05,
        bad_reward_at=-1,
    ):
        if not 0 <= noise <= 1:
            raise ValueError(f"config.noise: expected a number in [0, 1], got {noise}")
        self.metadata = {"autoreset_mode": AutoresetMode(autoreset_mode), "render_modes": []}
        self.num_envs, self.limit, self.noise = num_envs, max_episode_steps, noise
        self.bad_reward_at = bad_reward_at
        self.single_observation_space = gym.spaces.Box(-10, 10, (2,), np.float32)
        self.single_action_space = gym.spaces.Box(-1, 1, (2,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.state = {
            "seed": np.zeros(num_envs, dtype=np.uint64),
            "draws": np.zeros(num_envs, dtype=np.uint64),
            "elapsed": np.zeros(num_envs, dtype=np.int64),
            "x": np.zeros((num_envs, 2)),
            "ticks": np.zeros((), dtype=np.int64),
        }

    def reset(self, *, seed=None, options=None):
        if seed is not None:
            seeds = seed if isinstance(seed, list) else [seed + i for i in range(self.num_envs)]
            self.state["seed"][:] = seeds
            self.state["draws"][:] = 0
        self._start(np.ones(self.num_envs, dtype=bool))
        return self._observe(), self._info(np.zeros(self.num_envs, dtype=bool))

    def step(self, actions):
        if actions.shape != (self.num_envs, 2):
            raise ValueError(f"actions of shape {actions.shape}")
        x = self.state["x"]
        push = 0.3 * np.clip(actions, -1, 1).astype(np.float64)
        x += push + self.noise * np.column_stack([self._uniform(), self._uniform()])
        np.clip(x, -9, 9, out=x)
        self.state["elapsed"] += 1
        self.state["ticks"] += 1
        distance = np.sqrt((x * x).sum(axis=1))
        terminated = distance < 0.5
        truncated = self.state["elapsed"] >= self.limit
        reward = -0.1 * distance + terminated
        if self.state["ticks"] == self.bad_reward_at:
            reward[self.num_envs // 2] = np.nan
        done = terminated | truncated
        info = self._info(terminated)
        info["cost"] = np.sqrt((push * push).sum(axis=1))
        if done.any():
            final = {key: value.copy() for key, value in info.items()}
            final_obs = self._observe()
            self._start(done)
            info = {
                key: np.where(done, 0, value).astype(value.dtype) for key, value in info.items()
            }
            info |= {"final_info": final, "_final_info": done, "final_obs": final_obs}
            info["_final_obs"] = done
        return self._observe(), reward, terminated, truncated, info

    def get_state(self):
        return {key: value.copy() for key, value in self.state.items()}

    def set_state(self, state):
        for key, value in state.items():
            self.state[key][...] = value

    def _info(self, success):
        return {"is_success": success.copy(), "cost": np.zeros(self.num_envs)}

    def _observe(self):
        return self.state["x"].astype(np.float32)

    def _start(self, rows):
        start = 2.0 * np.column_stack([self._uniform(rows), self._uniform(rows)])
        self.state["x"][rows] = start[rows]
        self.state["elapsed"][rows] = 0

    def _uniform(self, rows=True):
        with np.errstate(over="ignore"):
            z = self.state["seed"] + self.state["draws"] * np.uint64(0x9E3779B97F4A7C15)
            z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            z ^= z >> np.uint64(31)
        self.state["draws"] += np.asarray(rows, dtype=np.uint64)
        return (z >> np.uint64(11)).astype(np.float64) * 2.0**-52 - 1.0


if ID not in gym.registry:
    gym.register(
        ID,
        vector_entry_point="tests.agents.drift:Drift",
        max_episode_steps=20,
        entry_point="tests.agents.drift:Drift",
    )
