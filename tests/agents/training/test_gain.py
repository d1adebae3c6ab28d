"""A policy with a gain acts so many times as strongly."""

from pathlib import Path

import numpy as np
import pytest
import torch

import tests.agents.drift  # noqa: F401, registers the environment
from agents.config.entries import config_from
from agents.policies import Policy, load_policy
from agents.training.recording import with_gain
from agents.training.trainer import train
from rigid_envs.base.checks import ConfigError
from tests.agents.sessions import SMALL

FEW = SMALL | {"total_timesteps": 512 * 2}


def trained(folder: Path, name: str, **entries: object) -> Policy:
    config = config_from({**FEW, "log_dir": str(folder), "run_name": name, **entries})
    return load_policy(train(config, quiet=True).folder / "last_model")


def test_actions_within_bounds_are_those_without_it_times_the_gain(tmp_path: Path) -> None:
    plain = trained(tmp_path, "plain")
    seen = np.random.default_rng(0).normal(size=(500, 2)).astype(np.float32)
    actions, _ = plain.predict(seen)
    for gain in (0.5, 3.0):
        strong = Policy(plain.document, with_gain(plain.arrays, gain))
        expected = np.clip(gain * actions, -1.0, 1.0)
        inside = np.abs(actions) < 1.0
        np.testing.assert_allclose(strong.predict(seen)[0][inside], expected[inside], 1e-5, 1e-7)
        draws = [
            policy.predict(seen, deterministic=False, generator=torch.manual_seed(1))[0]
            for policy in (plain, strong)
        ]
        inside = (np.abs(draws[0]) < 1.0) & (np.abs(draws[1]) < 1.0)
        np.testing.assert_allclose(draws[1][inside], gain * draws[0][inside], rtol=1e-4, atol=1e-5)


def test_what_is_saved_has_it_and_what_is_trained_has_not(tmp_path: Path) -> None:
    plain = trained(tmp_path, "plain")
    strong = trained(tmp_path, "strong", policy_gain=2.0)
    for name, array in with_gain(plain.arrays, 2.0).items():
        np.testing.assert_array_equal(strong.arrays[name], array, err_msg=name)


@pytest.mark.parametrize(
    "entries",
    [{"env_id": "RigidEnvs/BallGrid-v0"}, {"algo": "sac"}, {"algo": "dqn"}],
)
def test_other_policies_have_none(tmp_path: Path, entries: dict[str, object]) -> None:
    values = {"log_dir": str(tmp_path), "env_id": "RigidEnvs/BallPark-v0"} | entries
    if entries.get("algo") == "dqn":
        values["env_id"] = "RigidEnvs/BallGrid-v0"
    with pytest.raises(ConfigError, match=r"config\.policy_gain: policy_gain = 2\.0; expected 1"):
        train(config_from({**values, "policy_gain": 2.0}), quiet=True)
