"""Replays for tests of files and of the page."""

import gymnasium as gym
import numpy as np

from rigid_envs.watch.replays.recording import RecordReplay


def idle(env_id, n_steps=20, state=None, seed=0, label="", **config):
    """An episode in which nothing is done, from a start that is drawn or given."""
    env = RecordReplay(gym.make(env_id, **config), label=label)
    env.reset(seed=seed, options=None if state is None else {"state": state})
    for _ in range(n_steps):
        env.step(np.zeros(env.action_space.shape, dtype=np.float32))
    return env.replay()


def free_body(n_steps=60):
    """A body that nothing acts on, near the unstable axis."""
    return idle("RigidEnvs/IntermediateAxis-v0", n_steps, seed=1, label="free")


def recorded(env_id, n_steps=6, n_episodes=1, **config):
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


def rolling_ball(label, seed, n_steps=40):
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
