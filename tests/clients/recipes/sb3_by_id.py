"""Stable-Baselines3: an id by its name, `evaluate_policy` before and after."""

import json

from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy

import rigid_envs  # noqa: F401, registers the ids

model = PPO("MlpPolicy", "RigidEnvs/IntermediateAxis-v0", 1e-3, gamma=0.98, seed=0, device="cpu")
before, _ = evaluate_policy(model, model.get_env(), n_eval_episodes=20)
model.learn(20_000)
after, _ = evaluate_policy(model, model.get_env(), n_eval_episodes=20)
assert after > before
print(json.dumps({"steps": model.num_timesteps, "return before": before, "return after": after}))
