"""Every start is played once and counted once; training, selection and test share none."""

import csv
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import tests.agents.drift  # noqa: F401, registers the environment
from agents.environments import make
from agents.evaluation.reports import evaluate, play, table, write_report
from rigid_envs.scores.policies import RandomPolicy
from rigid_envs.scores.records import evaluation_of
from rigid_envs.scores.starts import row_seeds
from rigid_envs.scores.statistics import wilson_interval
from tests.agents.drift import Drift


class Homing:
    """Straight to the origin."""

    def predict(self, observation: Any, *, deterministic: bool = True) -> tuple[Any, None]:
        return np.clip(-3 * observation, -1, 1).astype(np.float32), None


def test_each_row_is_one_episode_as_if_it_were_alone() -> None:
    n = 40
    seeds = row_seeds(0, n, "test")
    together = play(Homing(), Drift(n, noise=0.9), seeds)
    assert 0 < together.successes.sum() < n
    columns = (together.returns, together.lengths, together.successes, together.costs)
    for k, seed in enumerate(seeds):
        assert alone(seed) == tuple(column[k] for column in columns)


def alone(seed: int) -> tuple[float, int, bool, float]:
    venv = Drift(1, noise=0.9)
    obs, _ = venv.reset(seed=[seed])
    total, cost, length, done = 0.0, 0.0, 0, False
    while not done:
        obs, reward, terminated, truncated, info = venv.step(Homing().predict(obs)[0])
        done = terminated[0] or truncated[0]
        total += reward[0]
        cost += (info["final_info"] if done else info)["cost"][0]
        length += 1
    return total, length, bool(terminated[0]), cost


def test_an_evaluation_repeats_to_the_bit_and_another_seed_differs() -> None:
    one, two = (evaluate(Homing(), "Drift-v0", 50, seed=1) for _ in range(2))
    other = evaluate(Homing(), "Drift-v0", 50, seed=2)
    np.testing.assert_array_equal(one.values["return"], two.values["return"])
    assert not np.isin(one.values["return"], other.values["return"]).any()
    chance = [evaluate(None, "Drift-v0", 50, seed=1).values["return"] for _ in range(2)]
    np.testing.assert_array_equal(*chance)


def test_the_random_policy_fills_the_space_evenly() -> None:
    box = RandomPolicy(Drift(1).single_action_space, np.random.default_rng(0))
    actions, _ = box.predict(np.zeros((10_000, 2)))
    assert actions.dtype == np.float32 and actions.shape == (10_000, 2)
    # Mean and variance of a uniform variable on [-1, 1], within 5 standard errors.
    np.testing.assert_allclose(actions.mean(axis=0), 0, atol=5 / math.sqrt(3 * 10_000))
    np.testing.assert_allclose(actions.var(axis=0), 1 / 3, atol=5 * math.sqrt(4 / 45 / 10_000))


# Source: Newcombe (1998), doi:10.1002/(SICI)1097-0258(19980430)17:8<857::AID-SIM777>3.0.CO;2-E,
# table I, method 3.
@pytest.mark.parametrize(
    ("won", "n", "low", "high"),
    [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_the_wilson_interval_is_the_published_one(
    won: int, n: int, low: float, high: float
) -> None:
    assert wilson_interval(won, n) == pytest.approx((low, high), abs=5e-5)


def test_the_ends_of_the_wilson_interval_are_rates_whose_score_test_just_holds() -> None:
    z = 1.959963984540054  # 97.5 % quantile of the normal distribution
    for n in (1, 2, 10, 500):
        for won in range(0, n + 1, max(1, n // 10)):
            for end in wilson_interval(won, n):
                inside = 0 < end < 1  # at 0 of n and n of n one end is that of [0, 1]
                error = abs(won / n - end) - z * math.sqrt(end * (1 - end) / n)
                assert (abs(error) < 1e-14) if inside else end == won / n


def test_seeds_of_100_runs_and_all_purposes_are_distinct() -> None:
    runs = [*range(100), 2**32, 2**32 + 1, 2**40 + 7, np.int64(5000)]
    seeds = [s for run in runs for s in row_seeds(run, 64, "train")]
    for purpose in ("validation", "test", "random policy", "learner"):
        seeds += [s for run in runs for s in row_seeds(run, 64, purpose)]
    assert len(set(seeds)) == len(seeds) == 5 * 64 * len(runs)
    assert all(type(s) is int and 0 <= s < 2**63 for s in seeds)


def test_first_states_of_100_runs_are_distinct() -> None:
    venv = Drift(64)
    starts = [venv.reset(seed=row_seeds(run, 64, "train"))[0] for run in range(100)]
    assert len(np.unique(np.concatenate(starts), axis=0)) == 6400


def test_more_rows_keep_the_seeds_of_fewer() -> None:
    assert row_seeds(3, 100, "test")[:10] == row_seeds(3, 10, "test")


def test_seeding_touches_no_global_stream() -> None:
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    evaluate(None, "Drift-v0", 5, seed=0)
    row_seeds(0, 5, "train")
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002


def figures() -> dict[str, Any]:
    row = evaluate(Homing(), "Drift-v0", 30, 0).row()
    return row | {"random_policy": evaluate(None, "Drift-v0", 30, 0).summary()}


def test_the_table_is_aligned_and_says_all_figures() -> None:
    row = figures()
    lines = table(row).splitlines()
    assert "30 unseen starts" in lines[0]
    assert len({len(line) for line in lines[2:-2]}) == 1
    assert any("random policy" in line for line in lines)
    assert any(line.startswith("homing") for line in lines)
    assert any(f"{row['policy']['cost_mean']:.3f}" in line for line in lines)


def test_an_environment_of_others_has_success_and_return_and_no_efficiency() -> None:
    found = evaluate(Homing(), "Drift-v0", 30, 0)
    assert found.cost is None and found.efficiency is None and found.gap is None
    assert found.success.low < found.success.mean == found.values["success"].mean()
    assert found.policy == "homing" and "efficiency" not in str(found)


def test_written_results_can_be_recomputed_from_the_episodes(tmp_path: Path) -> None:
    found = evaluate(Homing(), "Drift-v0", 30, 0)
    write_report(tmp_path, figures(), found)
    row = json.loads((tmp_path / "results.json").read_text())
    assert evaluation_of(row).summary() == found.summary() == row["policy"]
    with (tmp_path / "episodes.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [int(each["seed"]) for each in rows] == row_seeds(0, 30, "test")
    assert sum(int(each["is_success"]) for each in rows) == row["policy"]["successes"]
    assert np.mean([float(each["return"]) for each in rows]) == row["policy"]["return_mean"]


NO_SETTINGS = {
    "render_mode": "human",
    "wrappers": ["a:b"],
    "num_envs": 3,
    "autoreset_mode": "Disabled",
    "vectorization_mode": "sync",
    "vector_kwargs": {},
}


@pytest.fixture(autouse=True)
def raw() -> Iterator[None]:
    """An environment of our class that is not registered by `rigid_envs.register`."""
    gym.register(
        "Raw-v0",
        vector_entry_point="rigid_envs.envs:RigidVectorEnv",
        kwargs={"task": "rigid_envs.tasks:Detumble"},
    )
    yield
    del gym.registry["Raw-v0"]


@pytest.mark.parametrize(
    ("env_id", "kwargs", "message"),
    [
        ("Drift-v1", {}, r"^config\.env_id: .* did you mean 'Drift-v0'\?"),
        ("nowhere:Drift-v0", {}, r"^config\.env_id: .* --allow_import nowhere"),
        ("CartPole-v2", {}, r"^config\.env_id: .*did you mean 'CartPole-v1'"),
        ("Drift-v0", {"noise": 7}, r"^config\.env_kwargs\.noise: expected a number in \[0, 1\]"),
        ("Drift-v0", {"nose": 7}, r"^config\.env_kwargs: .*nose"),
        *(
            (env_id, {key: value}, rf"^config\.env_kwargs\.{key}: ")
            for env_id in ("Drift-v0", "RigidEnvs/Detumble-v0")
            for key, value in NO_SETTINGS.items()
        ),
        (
            "RigidEnvs/Detumble-v0",
            {"task": "rigid_envs.tasks:Detumble"},
            r"^config\.env_kwargs\.task",
        ),
        ("Raw-v0", {"task": "rigid_envs.tasks:Reorient"}, r"^config\.env_kwargs\.task"),
    ],
)
def test_an_environment_that_cannot_be_is_refused_by_key(
    env_id: str, kwargs: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        make(env_id, kwargs, 2)
