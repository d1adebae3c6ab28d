"""skrl: PPO with its defaults on the native vector environment."""

import json

import gymnasium as gym
import torch
from skrl.envs.wrappers.torch import wrap_env
from skrl.utils.runner.torch import Runner

import rigid_envs

env_id = "RigidEnvs/IntermediateAxis-v0"
net = [{"name": "net", "input": "OBSERVATIONS", "layers": [64, 64], "activations": "elu"}]
settings = {
    "seed": 0,
    "models": {
        "policy": {"class": "GaussianMixin", "network": net, "output": "ACTIONS"},
        "value": {"class": "DeterministicMixin", "network": net, "output": "ONE"},
    },
    "memory": {"class": "RandomMemory", "memory_size": -1},
    "agent": {"class": "PPO", "rollouts": 16},
    "trainer": {"class": "SequentialTrainer", "timesteps": 3200},
}
runner = Runner(wrap_env(gym.make_vec(env_id, num_envs=64)), settings)


def act(observations):
    """Mean actions of all rows."""
    inputs = {"observations": torch.as_tensor(observations), "states": None}
    with torch.no_grad():
        return runner.agent.policy.act(inputs, role="policy")[1]["mean_actions"].numpy()


before = rigid_envs.evaluate(env_id, act).values["return"].mean()
runner.run()
after = rigid_envs.evaluate(env_id, act).values["return"].mean()
assert after > 2.0 * before
print(json.dumps({"steps": 3200 * 64, "return before": before, "return after": after}))
