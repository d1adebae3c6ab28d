"""Every start is played once and counted once; training, selection and test share none."""

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

import tests.agents.drift  # noqa: F401, registers the environment
from agents.evaluation.reports import evaluate, table, write_report
from rigid_envs.scores.policies import RandomPolicy
from rigid_envs.scores.records import evaluation_of
from rigid_envs.scores.starts import play, row_seeds
from tests.agents.drift import Drift


class Homing:
    """Straight to the origin."""

    def predict(self, observation: Any, *, deterministic: bool = True) -> tuple[Any, None]:
        return np.clip(-3 * observation, -1, 1).astype(np.float32), None


def homing(observation: Any) -> Any:
    return Homing().predict(observation)[0]


def test_each_row_is_one_episode_as_if_it_were_alone() -> None:
    n = 40
    seeds = row_seeds(0, n, "test")
    together = play(homing, Drift(n, noise=0.9), seeds)
    assert 0 < together.successes.sum() < n
    columns = (together.returns, together.lengths, together.successes, together.costs)
    for k, seed in enumerate(seeds):
        assert alone(seed) == tuple(column[k] for column in columns)


def alone(seed: int) -> tuple[float, int, bool, float]:
    venv = Drift(1, noise=0.9)
    obs, _ = venv.reset(seed=[seed])
    total, cost, length, done = 0.0, 0.0, 0, False
    while not done:
        obs, reward, terminated, truncated, info = venv.step(homing(obs))
        done = terminated[0] or truncated[0]
        total += reward[0]
        cost += (info["final_info"] if done else info)["cost"][0]
        length += 1
    return total, length, bool(terminated[0]), cost


def test_the_random_policy_fills_the_space_evenly() -> None:
    box = RandomPolicy(Drift(1).single_action_space, np.random.default_rng(0))
    actions, _ = box.predict(np.zeros((10_000, 2)))
    assert actions.dtype == np.float32 and actions.shape == (10_000, 2)
    # Mean and variance of a uniform variable on [-1, 1], within 5 standard errors.
    np.testing.assert_allclose(actions.mean(axis=0), 0, atol=5 / math.sqrt(3 * 10_000))
    np.testing.assert_allclose(actions.var(axis=0), 1 / 3, atol=5 * math.sqrt(4 / 45 / 10_000))


def test_seeds_of_100_runs_and_all_purposes_are_distinct() -> None:
    runs = [*range(100), 2**32, 2**32 + 1, 2**40 + 7, np.int64(5000)]
    seeds = [s for run in runs for s in row_seeds(run, 64, "train")]
    for purpose in ("validation", "test", "random policy", "learner"):
        seeds += [s for run in runs for s in row_seeds(run, 64, purpose)]
    assert len(set(seeds)) == len(seeds) == 5 * 64 * len(runs)
    assert all(type(s) is int and 0 <= s < 2**63 for s in seeds)


def test_an_evaluation_repeats_another_seed_differs_and_no_global_stream_is_touched() -> None:
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    for policy in (Homing(), None):
        one, two = (evaluate(policy, "Drift-v0", 50, seed=1).values["return"] for _ in range(2))
        np.testing.assert_array_equal(one, two)
        other = evaluate(policy, "Drift-v0", 50, seed=2).values["return"]
        assert not np.isin(one, other).any()
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002


def test_figures_are_in_the_table_and_can_be_recomputed_from_the_episodes(tmp_path: Path) -> None:
    found = evaluate(Homing(), "Drift-v0", 30, 0)
    figures = found.row() | {"random_policy": evaluate(None, "Drift-v0", 30, 0).summary()}
    lines = table(figures).splitlines()
    assert "30 unseen starts" in lines[0] and len({len(line) for line in lines[2:-2]}) == 1
    assert lines[4].startswith("homing") and f"{figures['policy']['cost_mean']:.3f}" in lines[4]
    assert lines[5].startswith("random policy")
    write_report(tmp_path, figures, found)
    row = json.loads((tmp_path / "results.json").read_text())
    assert evaluation_of(row).summary() == found.summary() == row["policy"]
    with (tmp_path / "episodes.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [int(each["seed"]) for each in rows] == row_seeds(0, 30, "test")
    assert sum(int(each["is_success"]) for each in rows) == row["policy"]["successes"]
    assert np.mean([float(each["return"]) for each in rows]) == row["policy"]["return_mean"]
