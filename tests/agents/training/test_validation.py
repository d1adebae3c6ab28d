"""Evaluations during training: on starts of their own, when they are due, for the best policy."""

from typing import Any

import numpy as np
import pytest

import tests.agents.drift  # noqa: F401, registers the environment
from agents.config.entries import config_from
from agents.training import validation
from agents.training.trainer import Trainer
from agents.training.validation import VALIDATION_SEED, Validation
from rigid_envs.scores.starts import TEST_SEED, row_seeds
from tests.fixtures import Patch


def constant(obs: Any) -> Any:
    """Always the same action."""
    return np.tile(np.array([0.1, 0.0], dtype=np.float32), (len(obs), 1))


def validated(**entries: Any) -> Validation:
    return Validation(config_from({"env_id": "Drift-v0", "eval_episodes": 20, **entries}))


@pytest.mark.parametrize("seed", [0, 1, TEST_SEED, VALIDATION_SEED])
def test_training_validation_and_test_share_no_start(
    tmp_path: Any, monkeypatch: Patch, seed: int
) -> None:
    from agents.storage.runs import create_run
    from agents.training.rows import TrainingRows
    from agents.training.validation import Progress

    seen: dict[str, Any] = {}

    def play(policy: Any, venv: Any, seeds: list[int]) -> Any:
        seen["validation"] = seeds
        return played(policy, venv, seeds)

    def seeded(self: TrainingRows, seeds: Any) -> Any:
        seen["train"] = seeds
        return seed_rows(self, seeds)

    played, seed_rows = validation.play, TrainingRows.seed
    monkeypatch.setattr(validation, "play", play)
    monkeypatch.setattr(TrainingRows, "seed", seeded)
    values = {"env_id": "Drift-v0", "n_envs": 64, "n_steps": 32, "eval_every": 1, "seed": seed}
    run = create_run(config_from({**values, "log_dir": str(tmp_path), "run_name": "r"}))
    run.begin()
    trainer = Trainer(run, run.config(), Progress(True))
    trainer.iterate()
    trainer.close()
    run.close()
    tested = row_seeds(TEST_SEED, 1000, "test")
    assert len({*tested, *seen["train"], *seen["validation"]}) == 1000 + 64 + 100
    assert seen["train"] == row_seeds(seed, 64, "train")  # each run has its own


def test_the_first_of_equally_good_policies_is_the_best() -> None:
    evaluations = validated()
    _, better = evaluations.run(lambda venv: constant, 1)
    assert better
    best = evaluations.best
    _, better = evaluations.run(lambda venv: constant, 2)
    assert not better and evaluations.best == best
    evaluations.close()


def test_success_counts_before_return_and_return_before_nothing() -> None:
    evaluations = validated(eval_episodes=2, cost_price=[0.0, 2.0])
    for won, results, costs, best in (
        ([0, 1], [5.0, 6.0], [0.0, 1.0], (0.5, 4.5)),
        ([1, 1], [1.0, 2.0], [1.0, 1.0], (1.0, -0.5)),  # more success with less return
        ([1, 1], [1.0, 2.0], [0.5, 0.5], (1.0, 0.5)),  # the same success at less cost
    ):
        columns = {"successes": won, "results": results, "costs": costs, "ep_lengths": [3, 4]}
        arrays = {key: np.array([column]) for key, column in columns.items()}
        evaluations.found = {"timesteps": np.array([1]), **arrays}
        assert evaluations.best == best
    assert (1.0, 0.5) > (1.0, -0.5) > (0.5, 4.5)
    evaluations.close()


def test_it_is_due_where_an_update_passes_a_multiple_and_at_the_end() -> None:
    config = config_from({"env_id": "Drift-v0", "eval_every": 1000, "total_timesteps": 3100,
                          "n_envs": 8, "n_steps": 32, "batch_size": 64})  # fmt: skip
    evaluations = Validation(config)
    pairs = [(0, 999), (0, 1000), (999, 1001), (1000, 1999), (2999, 3001), (3001, 3099)]
    due = [evaluations.is_due(before, now, 3100) for before, now in pairs]
    assert due == [False, True, True, False, True, False]
    assert evaluations.is_due(3001, 3100, 3100) and evaluations.is_due(3001, 3257, 3100)
    # of updates of 256 steps: those that end behind 1000, 2000, 3000, and the last one
    assert evaluations.ages(13, config) == [1024, 2048, 3072, 3328]
    evaluations.close()
