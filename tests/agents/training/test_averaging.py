"""The average of the weights of a policy: its closed form, and that it is what is evaluated."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tests.agents.drift  # noqa: F401, registers the environment
from agents.config.by_algorithm import config_from
from agents.policies.policy_file import load_policy
from agents.training import trainer as module
from agents.training.averaging import PolicyAverage
from agents.training.trainer import train
from tests.agents.sessions import SMALL


def weights(n: int) -> np.ndarray[Any, Any]:
    return np.random.default_rng(0).normal(size=(n, 3, 2)).astype(np.float32)


def averaged(values: Any, n_updates: int) -> np.ndarray[Any, Any]:
    average = PolicyAverage(n_updates)
    for value in values:
        average.update({"w": value})
    return np.asarray(average.arrays()["w"])


@pytest.mark.parametrize("n_updates", [1, 2, 5, 40])
def test_it_is_the_mean_at_first_and_forgets_by_the_same_share_then(n_updates: int) -> None:
    x, keep = weights(30).astype(np.float64), 1.0 - 1.0 / n_updates
    first = min(n_updates, 30)
    later = np.array([keep ** (29 - k) / n_updates for k in range(first, 30)])
    expected = keep ** (30 - first) * x[:first].mean(axis=0)
    expected = expected + np.tensordot(later, x[first:], 1)
    np.testing.assert_allclose(averaged(weights(30), n_updates), expected, atol=1e-6)


def test_what_does_not_change_keeps_its_bits_and_one_update_is_the_last() -> None:
    low = np.array([-0.1, -1.0], dtype=np.float32)
    np.testing.assert_array_equal(averaged([low] * 50, 7), low)
    np.testing.assert_array_equal(averaged(weights(9), 1), weights(9)[-1])


def test_the_policy_that_is_saved_has_the_mean_weights(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen, export = [], module.export_policy

    def note(model: Any, config: Any) -> Any:
        policy = export(model, config)
        seen.append((model.num_timesteps, policy.arrays["layers.0.weight"].copy()))
        return policy

    monkeypatch.setattr(module, "export_policy", note)
    values = SMALL | {"policy_average": 1000, "total_timesteps": 512 * 6, "checkpoint_every": 100}
    train(config_from(values | {"log_dir": str(tmp_path), "run_name": "a"}), quiet=True)
    found = load_policy(tmp_path / "ppo" / "a" / "last_model").arrays["layers.0.weight"]
    each = {age: weight for age, weight in seen if age}
    assert len(each) == 6
    np.testing.assert_allclose(found, np.mean(list(each.values()), axis=0), atol=1e-6)
