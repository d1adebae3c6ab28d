"""Published policies: found by name, run without torch, and played in the frame they know."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import rigid_envs
from rigid_envs.errors import ConfigError
from rigid_envs.files import DamagedFileError
from rigid_envs.policies import CompiledPolicy, loading
from rigid_envs.tensorfile import save_tensors

STREAM = np.random.default_rng(5)


def example(**network: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Document and arrays of an untrained policy for a box of two actions."""
    env = gym.make("RigidEnvs/BallPark-v0", frame="reduced")
    n_obs, n_act = env.observation_space.shape[0], env.action_space.shape[0]  # type: ignore[index]
    sizes = (n_obs, 16, n_act)
    arrays: dict[str, Any] = {"log_std": np.zeros(n_act)}
    arrays |= {"action.low": -np.ones(n_act), "action.high": np.ones(n_act)}
    for k in range(2):
        arrays[f"layers.{k}.weight"] = STREAM.normal(size=(sizes[k + 1], sizes[k]))
        arrays[f"layers.{k}.bias"] = STREAM.normal(size=sizes[k + 1])
    document = {
        "format": loading.FORMAT,
        "algo": "ppo",
        "env_id": "RigidEnvs/BallPark-v0",
        "env_kwargs": {"frame": "reduced", "weight_parked": 3.0},
        "network": {"activation": "tanh", "distribution": "gaussian", "normalized": False}
        | network,
    }
    return document, {name: array.astype(np.float32) for name, array in arrays.items()}


def saved(folder: Path, name: str = "policy") -> Path:
    document, arrays = example()
    save_tensors(folder / f"{name}.safetensors", arrays, document)
    return folder / f"{name}.safetensors"


@pytest.fixture
def shelf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in the place of that of the published policies, with one policy."""
    saved(tmp_path, "BallPark-v0")
    monkeypatch.setattr(loading.published, "__defaults__", (tmp_path,))
    monkeypatch.setattr(loading.file_of, "__defaults__", (tmp_path,))
    return tmp_path


@pytest.mark.parametrize("name", ["BallPark", "BallPark-v0", "RigidEnvs/BallPark-v0"])
def test_a_published_policy_has_the_name_of_its_environment(shelf: Path, name: str) -> None:
    policy = rigid_envs.load(name)
    assert policy.env_id == "RigidEnvs/BallPark-v0" and policy.name == "ppo reduced"
    assert policy.env_kwargs == {"frame": "reduced"}  # what pays is no matter of acting


@pytest.mark.parametrize("name", ["Nothing", "RigidEnvs/CoinPark-v0", "../secret", ""])
def test_another_name_is_refused_and_those_that_there_are_are_told(shelf: Path, name: str) -> None:
    with pytest.raises(ConfigError, match=r"expected the path .*: BallPark-v0$"):
        rigid_envs.load(name)


def test_a_policy_is_loaded_from_its_file_or_its_folder(tmp_path: Path) -> None:
    file = saved(tmp_path)
    for place in (file, str(file), tmp_path):
        assert isinstance(rigid_envs.load(place), CompiledPolicy)
    file.write_bytes(file.read_bytes()[:-1])
    with pytest.raises(DamagedFileError, match=r"policy\.safetensors"):
        rigid_envs.load(file)


def test_a_file_of_more_than_256_mebibytes_is_not_read(tmp_path: Path) -> None:
    file = tmp_path / "policy.safetensors"
    with file.open("wb") as sparse:
        sparse.truncate(2**28 + 1)
    with pytest.raises(DamagedFileError, match=f"{2**28 + 1} bytes; expected at most {2**28}"):
        rigid_envs.load(file)


def test_one_observation_is_acted_on_as_among_others() -> None:
    policy = CompiledPolicy(*example())
    obs = STREAM.normal(size=(40, policy.n_obs)).astype(np.float32)
    actions, state = policy.predict(obs, state="kept")
    assert state == "kept" and actions.dtype == np.float32 and np.abs(actions).max() <= 1.0
    for row, action in zip(obs, actions, strict=True):
        np.testing.assert_array_equal(policy.predict(row)[0], action)


@pytest.mark.parametrize("shape", [(1,), (1, 1), (1, 1, 0), (0,)])
def test_an_observation_of_another_shape_or_not_finite_is_refused(shape: tuple[int, ...]) -> None:
    policy = CompiledPolicy(*example())
    for obs in (np.zeros(shape), np.full(policy.n_obs, np.nan)):
        with pytest.raises(ValueError, match="every entry finite"):
            policy.predict(obs)


def test_it_does_not_draw_at_random() -> None:
    policy = CompiledPolicy(*example())
    with pytest.raises(ValueError, match="deterministic = False; expected True"):
        policy.predict(np.zeros(policy.n_obs), deterministic=False)


def test_it_is_played_in_its_own_frame_also_on_another_id() -> None:
    policy = CompiledPolicy(*example())
    for name in ("BallPark", "BallReorient", "BallParkGoal"):
        found = rigid_envs.evaluate(f"RigidEnvs/{name}-v0", policy, n=3)
        assert found.config == {"frame": "reduced"} and found.policy == "ppo reduced"
        assert found.efficiency is not None
    with pytest.raises(ValueError, match="observation of shape"):
        rigid_envs.evaluate("RigidEnvs/BallPark-v0", policy, n=3, config={})


def test_it_needs_neither_torch_nor_safetensors(tmp_path: Path) -> None:
    file = saved(tmp_path)
    code = f"""
import sys
for name in ("torch", "safetensors", "stable_baselines3", "agents"):
    sys.modules[name] = None
import numpy as np, rigid_envs
policy = rigid_envs.load({str(file)!r})
print(policy.predict(np.zeros(policy.n_obs))[0].tolist())
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    policy = rigid_envs.load(file)
    assert json.loads(done.stdout) == policy.predict(np.zeros(policy.n_obs))[0].tolist()


STEERING = "PPO\x1b]0;owned\x07"


@pytest.mark.parametrize(
    "says",
    [
        {"algo": STEERING},
        {"env_id": STEERING},
        {"env_kwargs": {"frame": STEERING}},
        {"versions": {STEERING: "1"}},
        {"git_commit": "a\n| forged | row |"},
    ],
)
def test_text_of_a_policy_that_would_steer_a_terminal_is_refused(
    tmp_path: Path, says: dict[str, Any]
) -> None:
    document, arrays = example()
    save_tensors(tmp_path / "policy.safetensors", arrays, document | says)
    with pytest.raises(DamagedFileError, match="can be printed") as refused:
        rigid_envs.load(tmp_path)
    assert str(refused.value).isprintable()


def test_the_id_of_a_policy_is_one_that_is_registered_already(tmp_path: Path) -> None:
    document, arrays = example()
    document["env_id"] = f"trap:{document['env_id']}"
    save_tensors(tmp_path / "policy.safetensors", arrays, document)
    assert rigid_envs.load(tmp_path).env_id == "RigidEnvs/BallPark-v0"
