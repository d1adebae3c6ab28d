"""Whole episodes of many rows under a policy: what came of them."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.testing.environments import fresh, vector


@dataclass(frozen=True)
class Runs:
    """One episode of each of N rows.

    Attributes:
        success: whether the last step was a success, (N,).
        cost: sum of ``info["cost"]``, (N,).
        reward: sum of rewards, (N,).
        steps: number of steps, (N,).
        y: states from the first to the last, (T + 1, N, n_state); after the end of a row, its last.
    """

    success: npt.NDArray[np.bool_]
    cost: Array
    reward: Array
    steps: npt.NDArray[np.int64]
    y: Array


def run(env_id, policy, n=100, seed=0, **config):
    """One episode of n rows, seeded seed .. seed + n - 1, under actions ``policy(envs)``."""
    envs = fresh(vector(f"RigidEnvs/{env_id}-v0", n, **config), seed)
    success, alive = np.zeros(n, dtype=bool), np.ones(n, dtype=bool)
    cost, reward, steps = np.zeros(n), np.zeros(n), np.zeros(n, dtype=np.int64)
    y = [envs.y]
    while alive.any():
        actions = np.asarray(policy(envs), dtype=envs.action_space.dtype)
        _, rewards, terminated, truncated, infos = envs.step(actions)
        assert not infos["physics_error"].any()
        cost += np.where(alive, infos["cost"], 0.0)
        reward += np.where(alive, rewards, 0.0)
        steps += alive
        y.append(np.where(alive[:, None], envs.y, y[-1]))
        ended = alive & (terminated | truncated)
        success[ended] = infos["is_success"][ended]
        alive &= ~ended
    return Runs(success, cost, reward, steps, np.stack(y))


def bound(factory):
    """A reference controller for the task of the environment that it meets first."""
    policies = []

    def policy(envs):
        if not policies:
            policies.append(factory(envs.task))
        return policies[0](envs)

    return policy


def rows(task, n, /, **config):
    """N rows of a task of ``system.tasks:Task``, in their first episode, without a time limit."""
    return fresh(RigidVectorEnv(f"rigid_envs.systems.{task}", n, **config))


def still(envs):
    """No action."""
    return np.zeros(envs.action_space.shape)


def at_random(seed=0):
    """Actions uniform in the box, anew in every step."""
    rng = np.random.default_rng(seed)
    return lambda envs: rng.uniform(-1.0, 1.0, envs.action_space.shape)
