"""Stable-Baselines3: `evaluate_policy` of policies that come with this package."""

import json

from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

import rigid_envs

figures = {}
for name in ("IntermediateAxis", "BallGrid", "SleepingTop"):
    policy = rigid_envs.load(name)
    frame = dict(policy.env_kwargs)
    venv = make_vec_env(f"RigidEnvs/{name}-v0", n_envs=8, seed=0, env_kwargs=frame)
    mean, _ = evaluate_policy(policy, venv, n_eval_episodes=24)
    assert mean > 0.0
    figures[f"return, {name}"] = mean
print(json.dumps(figures))
