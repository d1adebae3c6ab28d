"""sb3-contrib: RecurrentPPO, whose policy has a memory."""

import json

from sb3_contrib import RecurrentPPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

import rigid_envs  # noqa: F401, registers the ids

venv = make_vec_env(
    "RigidEnvs/IntermediateAxis-v0", n_envs=32, seed=0, env_kwargs={"frame": "reduced"}
)
settings = {"n_epochs": 4, "batch_size": 1024, "policy_kwargs": {"lstm_hidden_size": 32}}
model = RecurrentPPO("MlpLstmPolicy", venv, 1e-3, seed=0, device="cpu", **settings)
before, _ = evaluate_policy(model, venv, n_eval_episodes=32)
model.learn(40_000)
after, _ = evaluate_policy(model, venv, n_eval_episodes=32)
assert after > before
print(json.dumps({"steps": model.num_timesteps, "return before": before, "return after": after}))
