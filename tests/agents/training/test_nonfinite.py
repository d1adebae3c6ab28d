"""A NaN ends the run before it reaches the weights, and says where it came up."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import tests.agents.drift  # noqa: F401, registers the environment
from agents.config.by_algorithm import config_from
from agents.training.gradients import guard_optimizer
from agents.training.trainer import Trainer, train
from rigid_envs.sb3.finite import NonFiniteError, all_finite, bad_row
from rigid_envs.tensorfile import load_tensors
from tests.agents.sessions import SMALL

MEMORY = {"env_id": "Drift-v0", "n_envs": 16, "learning_starts": 32, "log_every": 64}


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf")])
def test_an_optimiser_does_not_step_along_a_bad_gradient(bad: float) -> None:
    weights = torch.nn.Parameter(torch.ones(3))
    optimizer = torch.optim.Adam([weights], lr=0.1)
    guard_optimizer(optimizer)
    weights.sum().backward()
    optimizer.step()
    before = weights.detach().clone()
    weights.grad = torch.tensor([0.0, bad, 1.0])
    with pytest.raises(NonFiniteError, match="gradient"):
        optimizer.step()
    assert torch.equal(weights, before)


def test_a_nan_reward_stops_the_run_and_leaves_good_checkpoints(tmp_path: Path) -> None:
    values = {**SMALL, "env_kwargs": {"bad_reward_at": 300}, "seed": 11}
    config = config_from({**values, "log_dir": str(tmp_path), "run_name": "r"})
    with pytest.raises(NonFiniteError, match=r"reward of row 8 .*step 300 .*action \[.*seed 11"):
        train(config, quiet=True)
    run = tmp_path / "ppo" / "r"
    paths = sorted((run / "checkpoints").glob("*.safetensors"))
    assert [int(path.stem) for path in paths] == [512 * 6, 512 * 9]  # 300 is in update 10
    for path in paths:
        arrays, _ = load_tensors(path, 10**8)
        assert all(np.isfinite(array).all() for array in arrays.values())
    assert (run / "progress.csv").read_text().count("\n") == 1 + 9


@pytest.mark.parametrize(
    ("values", "factor"),
    [
        (SMALL, "ent_coef"),
        (MEMORY | {"algo": "sac"}, "gamma"),
        (MEMORY | {"algo": "tqc"}, "gamma"),
        (MEMORY | {"algo": "dqn", "env_id": "RigidEnvs/BallGrid-v0"}, "gamma"),
    ],
)
def test_a_nan_loss_stops_the_run_before_the_optimiser_steps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, values: dict[str, Any], factor: str
) -> None:
    seen = {}

    def iterate(self: Trainer) -> None:
        setattr(self.model, factor, float("nan"))
        seen["weights"] = [p.detach().clone() for p in self.model.policy.parameters()]
        seen["policy"] = self.model.policy
        original(self)

    original = Trainer.iterate
    monkeypatch.setattr(Trainer, "iterate", iterate)
    config = config_from({**values, "log_dir": str(tmp_path)})
    with pytest.raises(NonFiniteError, match=r"gradient of the loss .*seed 0"):
        train(config, quiet=True)
    for before, after in zip(seen["weights"], seen["policy"].parameters(), strict=True):
        assert torch.equal(before, after)


def test_one_bad_entry_is_found_wherever_it_is() -> None:
    rng = np.random.default_rng(0)
    for value in (np.nan, np.inf, -np.inf):
        for _ in range(50):
            array = rng.normal(size=(7, 5)).astype(np.float32)
            assert all_finite(array) and bad_row(array) is None
            row = int(rng.integers(7))
            array[row, rng.integers(5)] = value
            assert not all_finite(array) and bad_row(array) == row
    assert not all_finite({"a": np.zeros(3), "b": np.array([np.inf, -np.inf])})
