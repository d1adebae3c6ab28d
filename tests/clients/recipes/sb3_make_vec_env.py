"""Stable-Baselines3: `make_vec_env` with settings of the task, measured on the 500 test starts."""

import json

from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env

import rigid_envs

env_id, frame = "RigidEnvs/IntermediateAxis-v0", {"frame": "reduced"}
venv = make_vec_env(env_id, n_envs=16, seed=0, env_kwargs=frame)
model = PPO("MlpPolicy", venv, 1e-3, n_steps=256, batch_size=512, seed=0, device="cpu")
before = rigid_envs.evaluate(env_id, model, config=frame)
model.learn(100_000)
after = rigid_envs.evaluate(env_id, model, config=frame)
returns = {
    "return before": before.values["return"].mean(),
    "return after": after.values["return"].mean(),
}
assert after.success.mean > 0.9
print(json.dumps({"steps": model.num_timesteps, **returns, "success after": after.success.mean}))
