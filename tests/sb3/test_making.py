"""Rows of a registered id, made as Stable-Baselines3 makes them."""

import random
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch
from stable_baselines3.common.env_util import make_vec_env as their_make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

from rigid_envs import load
from rigid_envs.base.checks import ConfigError
from rigid_envs.sb3.adapter import GymnasiumVecEnv, make_vec_env
from rigid_envs.scores.trained import CompiledPolicy
from tests.fixtures import Patch
from tests.page_code import run_page
from tests.programs import printed


@pytest.mark.parametrize("env_id", ["RigidEnvs/BallPark-v0", "RigidEnvs/SleepingTopRandom-v0"])
def test_a_seed_gives_the_episodes_that_their_function_gives(env_id: str) -> None:
    ours, theirs = make_vec_env(env_id, 3, seed=5), their_make_vec_env(env_id, 3, seed=5)
    np.testing.assert_array_equal(ours.reset(), theirs.reset())
    rng = np.random.default_rng(0)
    for _ in range(20):
        actions = rng.uniform(-1, 1, (3, *ours.action_space.shape)).astype(np.float32)
        for mine, other in zip(ours.step(actions)[:3], theirs.step(actions)[:3], strict=True):
            np.testing.assert_array_equal(mine, other)
    assert make_vec_env(env_id, seed=3).action_space.sample() == pytest.approx(
        make_vec_env(env_id, seed=3).action_space.sample()
    )


@pytest.mark.parametrize("seed", [None, 0])
def test_the_random_numbers_of_the_process_are_left_alone(seed: int | None) -> None:
    def drawn_next() -> tuple[Any, ...]:
        legacy = str(np.random.get_state())  # noqa: NPY002
        return random.getstate(), legacy, torch.get_rng_state().tolist()

    before = drawn_next()
    venv = make_vec_env("BallPark", 2, seed=seed)
    venv.reset()
    venv.step(np.stack([venv.action_space.sample()] * 2))
    assert drawn_next() == before


def test_short_ids_and_settings_are_taken() -> None:
    venv = make_vec_env("BallPark", n_envs=4, frame="reduced", radius=(0.8, 1.2))
    assert isinstance(venv, GymnasiumVecEnv) and venv.num_envs == 4
    (task,) = set(venv.get_attr("task"))
    assert task.frame == "reduced" and task.radius == (0.8, 1.2)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("BallPrak",), "did you mean 'RigidEnvs/BallPark-v0'"),
        (("BallPark", 0), "num_envs = 0; expected an integer from 1"),
    ],
)
def test_what_cannot_be_is_refused(words: Any, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        make_vec_env(*words)
    with pytest.raises(ConfigError, match=r"config\.radios: unknown key; did you mean 'radius'"):
        make_vec_env("BallPark", radios=1.0)


@pytest.mark.parametrize("name", ["Detumble", "BallGrid", "BallParkGoal", "BallPark"])
def test_their_evaluation_plays_published_policies(name: str) -> None:
    policy = load(name)
    env_id = f"RigidEnvs/{name}-v0"
    settings = dict(policy.env_kwargs)
    returns = [
        evaluate_policy(policy, env, n_eval_episodes=4, return_episode_rewards=True)[0]
        for env in (
            make_vec_env(name, 2, seed=0, **settings),
            their_make_vec_env(env_id, 2, seed=0, env_kwargs=settings),
        )
    ]
    assert returns[0] == pytest.approx(returns[1], abs=1e-5)  # Monitor rounds to six digits
    alone = gym.make(env_id, **settings)
    mean, _ = evaluate_policy(policy, alone, n_eval_episodes=1, warn=False)
    assert np.isfinite(mean)


def test_without_stable_baselines3_the_import_names_the_extra_and_the_rest_works() -> None:
    code = """
import sys
sys.modules["stable_baselines3"] = None
import rigid_envs
assert not {"torch", "matplotlib"} & set(sys.modules)
print(rigid_envs.load("Detumble").name)
try:
    import rigid_envs.sb3
except ImportError as error:
    print(error)
"""
    first, second = printed("-c", code).splitlines()
    assert first.startswith("ppo")
    assert 'pip install "rigid-envs[train]"' in second


def test_the_page_runs(tmp_path: Path, monkeypatch: Patch) -> None:
    monkeypatch.chdir(tmp_path)
    names = run_page("sb3.md", _200_000="1", _2_000="1_100")
    assert isinstance(names["policy"], CompiledPolicy)
    assert names["venv"].action_space.contains(names["action"][0])
    assert names["mean"] > 0.0
    assert "mine" in (tmp_path / "leaderboard.md").read_text()
