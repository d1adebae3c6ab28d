"""TorchRL: `GymEnv` of every id, and its PPO on native rows."""

import json

import gymnasium as gym
import torch
from tensordict.nn import TensorDictModule
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import GymEnv, GymWrapper, check_env_specs
from torchrl.modules import NormalParamExtractor, ProbabilisticActor, TanhNormal, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

import rigid_envs

for env_id in rigid_envs.ENVIRONMENTS:
    check_env_specs(GymEnv(env_id))

torch.manual_seed(0)
native = {"vectorization_mode": "vector_entry_point", "autoreset_mode": "Disabled"}
env = GymWrapper(gym.make_vec("RigidEnvs/IntermediateAxis-v0", num_envs=32, **native))
check_env_specs(env)
env.set_seed(0)


def network(n, *more):
    """Two hidden layers."""
    hidden = (nn.Linear(3, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh())
    return nn.Sequential(*hidden, nn.Linear(64, n), *more)


moments = TensorDictModule(network(6, NormalParamExtractor()), ["observation"], ["loc", "scale"])
settings = {"distribution_class": TanhNormal, "return_log_prob": True}
actor = ProbabilisticActor(moments, ["loc", "scale"], spec=env.action_spec, **settings)
critic = ValueOperator(network(1), in_keys=["observation"])
advantage = GAE(gamma=0.98, lmbda=0.95, value_network=critic, average_gae=True)
loss = ClipPPOLoss(actor, critic, entropy_coeff=0.0)
optimizer = torch.optim.Adam(loss.parameters(), 1e-3)
returns = []
for batch in Collector(env, actor, frames_per_batch=9_600, total_frames=8 * 9_600):
    returns.append(batch["next", "reward"].sum(1).mean().item())
    for _ in range(10):
        advantage(batch)
        for part in batch.reshape(-1)[torch.randperm(9_600)].split(960):
            losses = loss(part)
            optimizer.zero_grad()
            sum(losses[f"loss_{kind}"] for kind in ("objective", "critic")).backward()
            nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
            optimizer.step()
before, after = returns[0], returns[-1]
assert after > before
print(json.dumps({"steps": 8 * 9_600, "return before": before, "return after": after}))
