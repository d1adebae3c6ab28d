"""Programs of others open every id by its name, unmodified."""

import pytest
from stable_baselines3 import DQN, PPO, SAC
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import DISCRETE, GOALS

IDS = tuple(ENVIRONMENTS)

# Gymnasium says so whenever Stable-Baselines3 asks for pictures of what has none
pytestmark = pytest.mark.filterwarnings("ignore:.*render_mode.*:UserWarning")


@pytest.mark.parametrize("env_id", IDS)
def test_stable_baselines3_makes_rows_of_an_id(env_id: str) -> None:
    venv = make_vec_env(env_id, n_envs=2, seed=0)
    venv.reset()
    for _ in range(3):
        venv.step([venv.action_space.sample() for _ in range(2)])
    venv.close()


@pytest.mark.parametrize("env_id", IDS)
def test_stable_baselines3_trains_on_an_id(env_id: str) -> None:
    policy = "MultiInputPolicy" if env_id in GOALS else "MlpPolicy"
    model = PPO(policy, env_id, n_steps=16, batch_size=16, n_epochs=1, device="cpu")
    model.learn(16)
    evaluate_policy(model, model.get_env(), n_eval_episodes=1)


@pytest.mark.parametrize("env_id", DISCRETE)
def test_dqn_trains_on_an_id(env_id: str) -> None:
    DQN("MlpPolicy", env_id, learning_starts=4, device="cpu").learn(8)


@pytest.mark.parametrize("env_id", ["RigidEnvs/BallPark-v0", "RigidEnvs/SleepingTop-v0"])
def test_sac_trains_on_an_id(env_id: str) -> None:
    SAC("MlpPolicy", env_id, learning_starts=4, device="cpu").learn(8)
