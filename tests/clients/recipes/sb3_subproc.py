"""Stable-Baselines3: the same in two processes."""

import json

from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import SubprocVecEnv

import rigid_envs  # noqa: F401, registers the ids

if __name__ == "__main__":
    env_id = "rigid_envs:RigidEnvs/IntermediateAxis-v0"  # each process imports the package by it
    venv = make_vec_env(env_id, n_envs=2, seed=0, vec_env_cls=SubprocVecEnv)
    model = PPO("MlpPolicy", venv, 1e-3, n_steps=1024, gamma=0.98, seed=0, device="cpu")
    before, _ = evaluate_policy(model, venv, n_eval_episodes=20)
    model.learn(20_000)
    after, _ = evaluate_policy(model, venv, n_eval_episodes=20)
    venv.close()
    assert after > before
    steps = model.num_timesteps
    print(json.dumps({"steps": steps, "return before": before, "return after": after}))
