"""sb3-contrib: TQC on eight rows."""

import json

from sb3_contrib import TQC
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

import rigid_envs  # noqa: F401, registers the ids

frame = {"frame": "reduced"}
venv = make_vec_env("RigidEnvs/IntermediateAxis-v0", n_envs=8, seed=0, env_kwargs=frame)
small = {"net_arch": [64, 64]}
model = TQC("MlpPolicy", venv, learning_starts=800, policy_kwargs=small, seed=0, device="cpu")
before, _ = evaluate_policy(model, venv, n_eval_episodes=8)
model.learn(6_000)
after, _ = evaluate_policy(model, venv, n_eval_episodes=8)
assert after > before
print(json.dumps({"steps": model.num_timesteps, "return before": before, "return after": after}))
