"""Studies: each runs end to end, its page is that of its records, its theory that of sums."""

import math

import numpy as np
import pytest
from PIL import Image

from rigid_envs.envs.lookup import task_of
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.policies import reference_controllers, system_of
from rigid_envs.systems.free_body.references import _momentum_regulator
from tests.benchmarks.studies import critics, exploration, holding
from tests.benchmarks.studies.__main__ import main
from tests.benchmarks.studies.jobs import DOCS, NAMES, digest_of, markdown, records

MEND = "python -m tests.benchmarks.studies NAME --page"


@pytest.mark.parametrize("name", NAMES)
def test_the_page_and_the_figure_are_those_of_the_records(name):
    found = records(name, DOCS)
    assert (DOCS / f"{name}.md").read_text() == markdown(name, found), MEND
    assert (DOCS / f"{name}.png").is_file() == bool(found)
    if found:
        with Image.open(DOCS / f"{name}.png") as image:
            assert image.info["Description"] == digest_of(found), MEND


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_a_study_runs_from_its_jobs_to_its_page_and_again_at_no_cost(name, tmp_path, capfd):
    main([name, "--quick", "--out", str(tmp_path)])
    page = (tmp_path / f"{name}.md").read_text()
    assert "{results}" not in page and "\n| " in page.partition("## Results")[2]
    assert (tmp_path / f"{name}.png").stat().st_size > 1000
    first = {file: file.stat().st_mtime_ns for file in (tmp_path / name).glob("*.json")}
    main([name, "--quick", "--out", str(tmp_path)])
    assert {file: file.stat().st_mtime_ns for file in first} == first
    assert f"{len(first)} of {len(first)} have their record" in capfd.readouterr().err


@pytest.mark.parametrize("name", NAMES)
def test_jobs_have_names_of_their_own(name):
    module = {"exploration": exploration, "holding": holding, "critics": critics}[name]
    for quick in (False, True):
        names = [job["name"] for job in module.jobs(quick)]
        assert len(set(names)) == len(names) > 0


def test_a_first_look_is_not_written_among_the_results(capfd):
    with pytest.raises(SystemExit):
        main(["holding", "--quick"])
    assert "--quick needs --out" in capfd.readouterr().err


def test_mean_norms_of_normal_numbers_are_those_of_draws():
    z = np.random.default_rng(0).normal(size=(400_000, 3))
    for a in (1.2, 1.5):
        drawn = np.linalg.norm(z * [a, 1.0, 1.0], axis=1).mean()
        assert exploration.spread_norm(a) == pytest.approx(drawn, rel=3e-3)
    for m in (1e-6, 0.5, 3.0):
        drawn = np.linalg.norm(z + np.array([m, 0.0, 0.0]), axis=1).mean()
        assert exploration.shifted_norm(m) == pytest.approx(drawn, rel=3e-3)


def test_optimal_control_under_large_noise_mirrors_the_pole():
    task = task_of(exploration.ID, exploration._settings("fast"))
    lam, b = exploration.growth_of("fast")
    best = exploration.Smoothed(lam, b, task, 0.2, 1.04, 200)
    d = np.linspace(0.1, 0.4, 40)
    ratio = np.mean(np.interp(d, best.d, best.place) / d)
    pole = 1.0 / (exploration.GAMMA * math.exp(lam * task.dt))
    assert ratio == pytest.approx(pole, abs=0.006)  # places are a percent apart


def test_what_targets_hide_is_what_sums_of_errors_say():
    gamma, trace, n, error = 0.99, 0.95, 64, 2.0
    delta = (gamma - 1.0) * error
    advantages = np.zeros(n + 1)
    for k in reversed(range(n)):  # as Stable-Baselines3 has it, with rewards and true values of 0
        advantages[k] = delta + gamma * trace * advantages[k + 1]
    share = critics.hidden_share(gamma, trace, n)
    assert -advantages[:n].mean() / error == pytest.approx(share)


def test_the_optimum_of_detumble_is_that_of_its_regulator_without_discount():
    task = task_of("RigidEnvs/Detumble-v0")
    y = system_of(task).state(omega_body=[[0.3, -0.2, 0.1], [0.0, 0.0, 0.4]])
    value = critics._of_detumble(1.0)(y)
    np.testing.assert_allclose(value, -_momentum_regulator(task).value(y), rtol=1e-12)


def test_discounted_moves_home_obey_the_equation_of_bellman():
    task, gamma = task_of("RigidEnvs/BallGrid-v0"), 0.9
    rolls = critics.QuarterRolls(system_of(task), 5)
    y = rolls.state([[1, 0], [0, 2]], [1, 0])
    n = rolls.moves(y)
    paid = [sum(-0.05 * gamma**k for k in range(m)) + gamma ** (m - 1) for m in n]
    np.testing.assert_allclose(critics._of_ball_grid(gamma)(y), paid)


def test_an_episode_of_long_periods_lasts_as_long_and_costs_the_same_price_per_second():
    one, long = (holding.entries_for("RigidEnvs/SleepingTop-v0", k) for k in (1, 4))
    assert "dt" not in one["train_kwargs"]
    held, plain = long["train_kwargs"], task_of("RigidEnvs/SleepingTop-v0")
    assert held["dt"] * held["max_episode_steps"] == pytest.approx(300 * plain.dt)
    assert long["cost_price"] == [price / 4 for price in one["cost_price"]]
    assert long["gamma"] == pytest.approx(one["gamma"] ** 4)


@pytest.mark.long
def test_values_of_the_plane_are_about_those_of_bang_bang_and_hardly_lower():
    rows, gamma = make_rows("RigidEnvs/RollPump-v0", 200), critics.GAMMA["RollPump"]
    rows.reset(seed=1)
    values = critics.Plane(gamma, 201)(np.array(rows.y))
    law = reference_controllers("RigidEnvs/RollPump-v0")["bang_bang"](rows.task)
    returns, weight, going = np.zeros(200), 1.0, np.ones(200, bool)
    for _ in range(399):
        _, rewards, ended, *_ = rows.step(np.asarray(law(rows), np.float32))
        returns += weight * going * rewards
        going &= ~ended
        weight *= gamma
    assert 0.0 < np.mean(values - returns) < 0.03  # a pass more or less, in few of them
    assert np.min(values - returns) > -0.03
