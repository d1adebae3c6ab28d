"""Stable-Baselines3: hindsight experience replay on a goal environment."""

import json

from stable_baselines3 import SAC, HerReplayBuffer
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

import rigid_envs  # noqa: F401, registers the ids

venv = make_vec_env("RigidEnvs/BallParkGoal-v0", n_envs=8, seed=0)
model = SAC(
    "MultiInputPolicy",
    venv,
    replay_buffer_class=HerReplayBuffer,
    replay_buffer_kwargs={"n_sampled_goal": 4, "goal_selection_strategy": "future"},
    learning_starts=1_600,
    policy_kwargs={"net_arch": [64, 64]},
    seed=0,
    device="cpu",
)
model.learn(8_000)
rewards = model.replay_buffer.sample(2_000).rewards  # of goals drawn, and seen in hindsight
mean, _ = evaluate_policy(model, venv, n_eval_episodes=8)
paid = float((rewards > -1.0).float().mean())
assert paid > 0.0
print(json.dumps({"steps": model.num_timesteps, "paid in hindsight": paid, "return after": mean}))
