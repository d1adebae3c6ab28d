"""A policy with a gain acts so many times as strongly; what is trained does not."""

from pathlib import Path

import numpy as np
import pytest

import tests.agents.drift  # noqa: F401, registers the environment
from agents.config.entries import config_from
from agents.environments import make
from agents.training.algorithms import build_model
from agents.training.recording import acting, save_policy, stronger
from agents.training.rows import TrainingRows
from rigid_envs import load
from rigid_envs.base.files import load_tensors

SEEN = np.random.default_rng(0).normal(size=(500, 2)).astype(np.float32)


@pytest.mark.parametrize("gain", [0.5, 1.0, 3.0])
def test_modes_and_spread_are_those_without_it_times_the_gain(tmp_path: Path, gain: float) -> None:
    config = config_from({"env_id": "Drift-v0", "n_envs": 4, "n_steps": 16, "batch_size": 32})
    model = build_model(config, TrainingRows(make("Drift-v0", {}, 4)))
    model.learn(256)
    rows = make("Drift-v0", {}, 500)
    plain, before = acting(model, rows)(SEEN), str(model.policy.state_dict())
    spread = model.policy.log_std.exp().tolist()
    with stronger(model, gain):
        strong = acting(model, rows)(SEEN)
        save_policy(model, config, tmp_path / "policy")
    assert str(model.policy.state_dict()) == before
    np.testing.assert_array_equal(acting(model, rows)(SEEN), plain)
    inside = np.abs(plain) < 1.0
    np.testing.assert_allclose(strong[inside], np.clip(gain * plain, -1.0, 1.0)[inside], 1e-5, 1e-7)
    np.testing.assert_allclose(load(tmp_path / "policy").predict(SEEN)[0], strong, 1e-5, 1e-5)
    saved, _ = load_tensors(tmp_path / "policy" / "policy.safetensors", 10**6)
    np.testing.assert_allclose(np.exp(saved["log_std"]), gain * np.array(spread), rtol=1e-6)
