"""A policy file gives the actions of the SB3 model that it came from.

In torch bit by bit; compiled, without torch, to the rounding of float32.
"""

import functools
import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from stable_baselines3 import DQN
from stable_baselines3.common.vec_env import VecNormalize

import tests.agents.drift  # noqa: F401, registers the environment
from agents.config.entries import config_from
from agents.environments import make
from agents.policies import Policy, load_policy, save_policy
from agents.training.algorithms import build_model
from agents.training.recording import export_policy
from rigid_envs import load
from rigid_envs.base.files import DamagedFileError, load_tensors
from rigid_envs.mechanics import rotations
from rigid_envs.sb3.adapter import GymnasiumVecEnv
from rigid_envs.scores.trained import write_policy

PPO = {"n_steps": 16, "batch_size": 32, "n_epochs": 2}
MEMORY = {"batch_size": 32, "learning_starts": 420, "train_freq": 8, "gradient_steps": 1}
GOAL = "RigidEnvs/BallParkGoal-v0"
GRID = "RigidEnvs/BallGrid-v0"


def cart_pole() -> GymnasiumVecEnv:
    rows = [lambda: gym.make("CartPole-v1")] * 4
    return GymnasiumVecEnv(SyncVectorEnv(rows, autoreset_mode=AutoresetMode.SAME_STEP))


def trained(kind: str, env_id: str = "Drift-v0", **entries: Any) -> Any:
    env: Any = cart_pole() if kind == "discrete" else GymnasiumVecEnv(make(env_id, {}, 4))
    if kind == "normalized":
        env = VecNormalize(env, clip_obs=2.0)
    own = PPO if entries.get("algo", "ppo") == "ppo" else MEMORY
    config = config_from({"env_id": env_id, "n_envs": 4, **own, **entries})
    model = build_model(config, env)
    model.learn(512)
    return model, export_policy(model, config)


CASES: list[tuple[str, dict[str, Any]]] = [
    ("box", {}),
    ("box", {"net_arch": [], "log_std_init": -1.0}),
    ("box", {"net_arch": [32, 16, 8], "activation": "relu"}),
    ("box", {"activation": "elu"}),
    ("box", {"activation": "silu"}),
    ("normalized", {"normalize_observation": True}),
    ("discrete", {}),
    ("box", {"env_id": GOAL}),
    ("normalized", {"env_id": GOAL}),
    ("box", {"algo": "sac"}),
    ("box", {"algo": "sac", "net_arch": []}),
    ("box", {"algo": "tqc"}),
    ("normalized", {"algo": "sac", "env_id": GOAL}),
    ("normalized", {"algo": "sac", "env_id": GOAL, "goal_turn": True}),
    ("box", {"env_id": GOAL, "goal_turn": True}),
    ("grid", {"env_id": GRID}),
    ("grid", {"algo": "dqn", "env_id": GRID, "net_arch": [16], "activation": "relu"}),
]


def observations(space: gym.Space[Any], n: int, rng: np.random.Generator) -> Any:
    if isinstance(space, gym.spaces.Dict):
        return {name: observations(part, n, rng) for name, part in space.items()}
    return rng.normal(scale=2, size=(n, *(space.shape or ()))).astype(np.float32)


def first(obs: Any) -> Any:
    return {name: part[0] for name, part in obs.items()} if isinstance(obs, dict) else obs[0]


def acted(model: Any, seen: Any, deterministic: bool) -> Any:
    """DQN's own exploration is no part of its policy."""
    actor = model.policy if isinstance(model, DQN) else model
    return actor.predict(seen, deterministic=deterministic)[0]


@pytest.mark.parametrize(("kind", "entries"), CASES, ids=str)
def test_a_loaded_policy_acts_as_the_model_bit_by_bit(
    tmp_path: Path, kind: str, entries: dict[str, Any]
) -> None:
    model, policy = trained(kind, **entries)
    loaded = load_policy(save_policy(policy, tmp_path / "policy"))
    normalize = model.get_vec_normalize_env()
    rng = np.random.default_rng(0)
    for batch in (1, 2, 7, 500):
        obs = observations(model.observation_space, batch, rng)
        seen = obs if normalize is None else normalize.normalize_obs(obs)
        for deterministic in (True, False):
            torch.manual_seed(batch)
            expected = acted(model, seen, deterministic)
            torch.manual_seed(batch)
            actions, _ = loaded.predict(obs, deterministic=deterministic)
            np.testing.assert_array_equal(actions, expected)
            assert actions.dtype == expected.dtype
        generator = torch.Generator().manual_seed(batch)
        drawn, _ = loaded.predict(obs, deterministic=False, generator=generator)
        np.testing.assert_array_equal(drawn, expected)
        compiled, _ = load(tmp_path / "policy").predict(obs)
        np.testing.assert_allclose(compiled, loaded.predict(obs)[0], rtol=1e-5, atol=1e-5)
    single, _ = loaded.predict(first(obs))
    expected = acted(model, first(seen), True)
    np.testing.assert_array_equal(single, expected)
    assert np.shape(single) == np.shape(expected)


@pytest.mark.parametrize("log_std", [-30.0, -20.0, -9.0, -2.0, 0.5, 1.9, 2.0, 5.0])
def test_draws_of_a_squashed_gaussian_are_as_wide_as_those_of_the_model(log_std: float) -> None:
    env = GymnasiumVecEnv(make("Drift-v0", {}, 4))
    config = config_from({"env_id": "Drift-v0", "algo": "sac", "n_envs": 4, **MEMORY})
    model = build_model(config, env)
    with torch.no_grad():
        model.actor.log_std.weight.zero_()
        model.actor.log_std.bias.fill_(log_std)
    policy = export_policy(model, config)
    obs = np.zeros((4000, 2), dtype=np.float32)
    torch.manual_seed(0)
    expected = model.predict(obs)[0]
    torch.manual_seed(0)
    np.testing.assert_array_equal(policy.predict(obs, deterministic=False)[0], expected)
    spread = math.exp(min(max(log_std, -20.0), 2.0))  # the bounds that SB3 has
    middle = policy.predict(obs)[0]
    drawn = np.arctanh(np.clip(expected, -1 + 1e-7, 1 - 1e-7)) - np.arctanh(middle)
    if -9.0 <= log_std <= 0.5:  # beyond, float32 has no place for it
        # the standard deviation of 4000 draws, within 5 standard errors
        np.testing.assert_allclose(drawn.std(axis=0), spread, rtol=5 / math.sqrt(2 * 4000))


@pytest.mark.parametrize("name", ["Reorient", "BallParkGoal"])
def test_a_network_with_goals_is_told_the_turn_in_body_and_world_axes(name: str) -> None:
    env = GymnasiumVecEnv(make(f"RigidEnvs/{name}-v0", {}, 50))
    config = config_from({"env_id": f"RigidEnvs/{name}-v0", "n_envs": 50, "goal_turn": True, **PPO})
    obs: Any = env.reset()
    policy = build_model(config, env).policy
    told = policy.extract_features(policy.obs_to_tensor(obs)[0]).numpy()
    envs: Any = env.venv.unwrapped
    here, there = envs.y[:, :4], envs.auxiliary(*envs.task.aux_names)[:, :4]
    back = rotations.conjugate(here)
    for turn, at in ((rotations.multiply(back, there), -18), (rotations.multiply(there, back), -9)):
        expected = rotations.matrix_from_quaternion(turn).reshape(50, 9)
        np.testing.assert_allclose(told[:, at:][:, :9], expected, atol=1e-6)  # of float32
    np.testing.assert_array_equal(told[:, :-18], np.hstack([obs[part] for part in sorted(obs)]))


def test_the_json_beside_it_is_what_is_inside(tmp_path: Path) -> None:
    path = save_policy(example(), tmp_path / "policy")
    beside = json.loads((tmp_path / "policy" / "policy.json").read_text())
    assert beside == load_tensors(path, 10**6)[1]
    assert beside["network"]["activation"] == "tanh"
    assert beside["env_id"] == "Drift-v0"


def test_a_policy_needs_torch_and_not_sb3(tmp_path: Path) -> None:
    path = save_policy(example(), tmp_path / "policy")
    code = f"""
import sys
for name in ("stable_baselines3", "pickle5"):
    sys.modules[name] = None
import numpy as np
from agents.policies import load_policy
print(load_policy({str(path)!r}).predict(np.zeros((1, 2), np.float32))[0].tolist())
"""
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert answer.returncode == 0, answer.stderr
    assert json.loads(answer.stdout) == example().predict(np.zeros((1, 2), np.float32))[0].tolist()


@pytest.mark.parametrize(
    "obs", [np.zeros(3), np.zeros((2, 3)), np.zeros((1, 1, 2)), np.array([0.0, np.nan]), 0.0]
)
def test_an_observation_that_does_not_fit_is_refused(obs: Any) -> None:
    with pytest.raises(ValueError, match=r"expected \(2,\) or \(N, 2\), every entry finite"):
        example().predict(obs)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"observation": None}, "dictionary of achieved_goal, desired_goal, observation"),
        ({"achieved_goal": np.zeros((2, 3))}, r"\['achieved_goal'\]: shape \(2, 3\), expected 11"),
        ({"achieved_goal": np.full((2, 11), np.nan)}, "every entry finite"),
        ({"achieved_goal": np.zeros((3, 11))}, "dimensions"),
    ],
)
def test_a_dictionary_that_does_not_fit_is_refused(change: dict[str, Any], message: str) -> None:
    sizes = dict(example(env_id=GOAL).document["network"]["inputs"])
    obs = {name: np.zeros((2, size)) for name, size in sizes.items()} | change
    with pytest.raises(ValueError, match=message):
        example(env_id=GOAL).predict({k: part for k, part in obs.items() if part is not None})
    with pytest.raises(ValueError, match="expected a dictionary"):
        example(env_id=GOAL).predict(np.zeros((2, sum(sizes.values()))))


@functools.cache
def example(**entries: Any) -> Policy:
    return trained("box", **entries)[1]  # type: ignore[no-any-return]


def test_a_file_that_is_no_policy_is_refused_by_name(tmp_path: Path) -> None:
    policy = example()
    document = {key: value for key, value in policy.document.items() if key != "network"}
    write_policy(tmp_path / "policy.safetensors", document, policy.arrays)
    with pytest.raises(DamagedFileError, match=r"policy\.safetensors: not a policy: KeyError"):
        load_policy(tmp_path)


def test_a_missing_policy_is_said_to_be_missing(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"policy\.safetensors"):
        load_policy(tmp_path)
