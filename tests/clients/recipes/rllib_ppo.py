"""RLlib: PPO on rows in each of Gymnasium's modes, native ones included."""

import json

import gymnasium as gym
from ray.rllib.algorithms.ppo import PPOConfig

import rigid_envs  # noqa: F401, registers the ids


def returns(mode):
    """Mean return of the episodes in each iteration."""
    algorithm = (
        PPOConfig()
        .environment("RigidEnvs/IntermediateAxis-v0")
        .env_runners(num_env_runners=0, num_envs_per_env_runner=8, gym_env_vectorize_mode=mode)
        .training(train_batch_size_per_learner=4096, minibatch_size=512, num_epochs=8, lr=1e-3)
        .debugging(seed=0)
        .build_algo()
    )
    found = [algorithm.train()["env_runners"]["episode_return_mean"] for _ in range(4)]
    algorithm.stop()
    return found


native = returns(gym.VectorizeMode.VECTOR_ENTRY_POINT)
assert returns(gym.VectorizeMode.SYNC) == native  # to the bit
assert returns(gym.VectorizeMode.ASYNC) == native
assert native[-1] > native[0]
figures = {"return before": native[0], "return after": native[-1]}
print(json.dumps({"modes": 3, "steps of each": 4 * 4096, **figures}))
