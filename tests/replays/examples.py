"""Replays for tests of files and of the page."""

from typing import Any

import gymnasium as gym
import numpy as np

from rigid_envs.watch.replays.recording import RecordReplay
from rigid_envs.watch.replays.replay import Replay


def idle(
    env_id: str,
    n_steps: int = 20,
    state: dict[str, Any] | None = None,
    seed: int = 0,
    label: str = "",
    **config: Any,
) -> Replay:
    """An episode in which nothing is done, from a start that is drawn or given."""
    env = RecordReplay(gym.make(env_id, **config), label=label)
    env.reset(seed=seed, options=None if state is None else {"state": state})
    for _ in range(n_steps):
        env.step(np.zeros(env.action_space.shape, dtype=np.float32))
    return env.replay()


def free_body(n_steps: int = 60) -> Replay:
    """A body that nothing acts on, near the unstable axis."""
    return idle("RigidEnvs/IntermediateAxis-v0", n_steps, seed=1, label="free")


def recorded(env_id: str, n_steps: int = 6, n_episodes: int = 1, **config: Any) -> Replay:
    """Some random steps of some episodes."""
    env = RecordReplay(gym.make(env_id, **config), label="random")
    env.action_space.seed(3)
    for k in range(n_episodes):
        env.reset(seed=k)
        for _ in range(n_steps):
            _, _, terminated, truncated, _ = env.step(env.action_space.sample())
            if terminated or truncated:
                break
    replay = env.replay()
    env.close()
    return replay


def rolling_ball(label: str, seed: int, n_steps: int = 40) -> Replay:
    """A ball that is rolled at random."""
    env = RecordReplay(gym.make("RigidEnvs/BallPark-v0"), label=label)
    env.reset(seed=5)
    env.action_space.seed(seed)
    action = env.action_space.sample()
    for k in range(n_steps):
        if k % 10 == 0:
            action = env.action_space.sample()
        env.step(action)
    return env.replay()
