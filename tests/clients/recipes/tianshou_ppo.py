"""Tianshou: an experiment on a registered environment."""

import json

import torch
from tianshou.highlevel.config import OnPolicyTrainingConfig
from tianshou.highlevel.env import EnvFactoryRegistered, VectorEnvType
from tianshou.highlevel.experiment import ExperimentConfig, PPOExperimentBuilder
from tianshou.highlevel.params.algorithm_params import PPOParams

import rigid_envs

env_id = "RigidEnvs/IntermediateAxis-v0"
training = OnPolicyTrainingConfig(
    max_epochs=2,
    epoch_num_steps=24_576,
    batch_size=256,
    num_training_envs=8,
    num_test_envs=8,
    collection_step_num_env_steps=2048,
    update_step_num_repetitions=10,
)
experiment = (
    PPOExperimentBuilder(
        EnvFactoryRegistered(task=env_id, venv_type=VectorEnvType.DUMMY),
        ExperimentConfig(seed=0, device="cpu", watch=False, persistence_enabled=False),
        training,
    )
    .with_ppo_params(PPOParams(gamma=0.98, ent_coef=0.0, deterministic_eval=True))
    .with_actor_factory_default((64, 64), torch.nn.Tanh, continuous_unbounded=True)
    .with_critic_factory_default((64, 64), torch.nn.Tanh)
    .build()
)
result = experiment.run().trainer_result
random = rigid_envs.evaluate(env_id, "random").values["return"].mean()
assert result.best_reward > 2.0 * random
figures = {"return, random": random, "return after": result.best_reward}
print(json.dumps({"steps": result.train_step, **figures}))
