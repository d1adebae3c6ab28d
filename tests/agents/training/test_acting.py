"""A model acts in evaluations as it does where it is trained, and so does its file, to rounding."""

import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import tests.agents.drift  # noqa: F401, registers the environment
from agents.config.entries import Config, config_from
from agents.environments import make
from agents.training.algorithms import build_model
from agents.training.recording import acting, save_policy, stronger
from agents.training.rows import TrainingRows
from agents.training.trainer import wrapped
from rigid_envs import load
from rigid_envs.base.files import load_tensors
from rigid_envs.mechanics import rotations
from rigid_envs.sb3.adapter import NonFiniteError

GOAL, GRID = "RigidEnvs/BallParkGoal-v0", "RigidEnvs/BallGrid-v0"
PPO = {"n_steps": 16, "batch_size": 32, "n_epochs": 2}
MEMORY = {"batch_size": 32, "learning_starts": 420, "train_freq": 8, "gradient_steps": 1}
SCALED = {"normalize_observation": True}


def config_of(**entries: Any) -> Config:
    own = PPO if entries.get("algo", "ppo") == "ppo" else MEMORY
    return config_from({"env_id": "Drift-v0", "n_envs": 4, **own, **entries})


def model_of(config: Config) -> Any:
    rows = TrainingRows(make(config.env_id, config.env_kwargs, config.n_envs))
    return build_model(config, wrapped(rows, config))


def observations(space: gym.Space[Any], n: int, rng: np.random.Generator) -> Any:
    if isinstance(space, gym.spaces.Dict):
        return {name: observations(part, n, rng) for name, part in space.items()}
    return rng.normal(scale=2, size=(n, *(space.shape or ()))).astype(np.float32)


@pytest.mark.parametrize(
    "entries",
    [
        {},
        {"net_arch": [32, 16, 8], "activation": "elu", **SCALED},
        {"env_id": GOAL, "goal_turn": True},
        {"env_id": GOAL, "env_kwargs": {"frame": "reduced"}, **SCALED},
        {"algo": "sac", "env_id": GOAL, "goal_turn": True, **SCALED},
        {"algo": "tqc", "net_arch": []},
        {"env_id": GRID},
        {"algo": "dqn", "env_id": GRID, "net_arch": [16], "activation": "relu"},
    ],
    ids=str,
)
def test_a_model_and_its_file_act_alike(tmp_path: Path, entries: dict[str, Any]) -> None:
    config = config_of(**entries)
    model = model_of(config)
    model.learn(512)
    save_policy(model, config, tmp_path / "policy")
    policy = load(tmp_path / "policy")
    for batch in (1, 500):
        venv = make(config.env_id, config.env_kwargs, batch)
        act = acting(model, venv)
        obs = observations(venv.single_observation_space, batch, np.random.default_rng(batch))
        np.testing.assert_allclose(act(obs), policy.predict(obs)[0], rtol=1e-5, atol=1e-5)
        assert act(obs).dtype == policy.predict(obs)[0].dtype
    if config.frame == "reduced":  # goals are in the frame of the world: they are not read
        assert policy.document["network"]["inputs"] == [["observation", 9]]
        alone = {"observation": obs["observation"]}
        np.testing.assert_array_equal(policy.predict(obs)[0], policy.predict(alone)[0])
        np.testing.assert_array_equal(act(obs), act(alone))
    beside = json.loads((tmp_path / "policy" / "policy.json").read_text())
    assert beside == load_tensors(tmp_path / "policy" / "policy.safetensors", 10**6)[1]
    assert (beside["env_id"], beside["seed"]) == (config.env_id, config.seed)


def test_an_observation_that_is_not_finite_ends_an_evaluation() -> None:
    model = model_of(config_of())
    act = acting(model, make("Drift-v0", {}, 1))
    with pytest.raises(NonFiniteError, match="observation of the evaluation"):
        act(np.array([[0.0, np.nan]], dtype=np.float32))


@pytest.mark.parametrize("name", ["Reorient", "BallParkGoal"])
def test_a_network_with_goals_is_told_the_turn_in_body_and_world_axes(name: str) -> None:
    model = model_of(config_of(env_id=f"RigidEnvs/{name}-v0", n_envs=50, goal_turn=True))
    obs: Any = model.env.reset()
    told = model.policy.extract_features(model.policy.obs_to_tensor(obs)[0]).numpy()
    envs: Any = model.env.venv.unwrapped
    here, there = envs.y[:, :4], envs.auxiliary(*envs.task.aux_names)[:, :4]
    back = rotations.conjugate(here)
    for turn, at in ((rotations.multiply(back, there), -18), (rotations.multiply(there, back), -9)):
        expected = rotations.matrix_from_quaternion(turn).reshape(50, 9)
        np.testing.assert_allclose(told[:, at:][:, :9], expected, atol=1e-6)  # of float32
    np.testing.assert_array_equal(told[:, :-18], np.hstack([obs[part] for part in sorted(obs)]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"observation": None}, "dictionary of achieved_goal, desired_goal, observation"),
        ({"achieved_goal": np.zeros((2, 3))}, r"\['achieved_goal'\]: shape \(2, 3\), expected 11"),
        ({"achieved_goal": np.full((2, 11), np.nan)}, "every entry finite"),
        ({"achieved_goal": np.zeros((3, 11))}, "dimensions"),
    ],
)
def test_a_dictionary_that_does_not_fit_its_file_is_refused(
    tmp_path: Path, change: dict[str, Any], message: str
) -> None:
    config = config_of(env_id=GOAL)
    save_policy(model_of(config), config, tmp_path / "policy")
    policy = load(tmp_path / "policy")
    sizes = dict(policy.document["network"]["inputs"])
    obs = {name: np.zeros((2, size)) for name, size in sizes.items()} | change
    with pytest.raises(ValueError, match=message):
        policy.predict({k: part for k, part in obs.items() if part is not None})
    with pytest.raises(ValueError, match="expected a dictionary"):
        policy.predict(np.zeros((2, sum(sizes.values()))))


@pytest.mark.parametrize("gain", [0.5, 1.0, 3.0])
def test_modes_and_spread_are_those_without_it_times_the_gain(tmp_path: Path, gain: float) -> None:
    """What is trained does not change."""
    seen = np.random.default_rng(0).normal(size=(500, 2)).astype(np.float32)
    config = config_of()
    model = model_of(config)
    model.learn(256)
    rows = make("Drift-v0", {}, 500)
    plain, before = acting(model, rows)(seen), str(model.policy.state_dict())
    spread = model.policy.log_std.exp().tolist()
    with stronger(model, gain):
        strong = acting(model, rows)(seen)
        save_policy(model, config, tmp_path / "policy")
    assert str(model.policy.state_dict()) == before
    np.testing.assert_array_equal(acting(model, rows)(seen), plain)
    inside = np.abs(plain) < 1.0
    np.testing.assert_allclose(strong[inside], np.clip(gain * plain, -1.0, 1.0)[inside], 1e-5, 1e-7)
    np.testing.assert_allclose(load(tmp_path / "policy").predict(seen)[0], strong, 1e-5, 1e-5)
    saved, _ = load_tensors(tmp_path / "policy" / "policy.safetensors", 10**6)
    np.testing.assert_allclose(np.exp(saved["log_std"]), gain * np.array(spread), rtol=1e-6)
