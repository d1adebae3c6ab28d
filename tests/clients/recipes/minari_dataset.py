"""Minari: collect episodes, write a data set, read it, and make its environment again."""

import json
import os
import tempfile

import gymnasium as gym

import rigid_envs

os.environ["MINARI_DATASETS_PATH"] = tempfile.mkdtemp()
import minari

policy = rigid_envs.load("IntermediateAxis")
env = minari.DataCollector(gym.make("RigidEnvs/IntermediateAxis-v0", **policy.env_kwargs))
for seed in range(5):
    observation, _ = env.reset(seed=seed)
    over = False
    while not over:
        action, _ = policy.predict(observation)
        observation, _, terminated, truncated, _ = env.step(action)
        over = terminated or truncated
env.create_dataset("rigid-envs/intermediate-axis-v0", algorithm_name="published policy")

data = minari.load_dataset("rigid-envs/intermediate-axis-v0")
again = data.recover_environment()
errors = []
for episode, seed in zip(data.iterate_episodes(), range(5), strict=True):
    again.reset(seed=seed)
    rewards = [again.step(action)[1] for action in episode.actions]
    errors.append(max(abs(rewards - episode.rewards)))
assert max(errors) == 0.0
figures = {"episodes": data.total_episodes, "steps": data.total_steps}
print(json.dumps({**figures, "largest difference, played again": float(max(errors))}))
