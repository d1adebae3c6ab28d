"""Efficiencies, aggregates and intervals, against values by hand, scipy and what is known."""

import numpy as np
import pytest
from scipy import stats

from rigid_envs.envs.lookup import task_of
from rigid_envs.scores.best import best_known
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.policies import PolicyFactory, reference_controllers
from rigid_envs.scores.starts import cost_of, efficiencies
from rigid_envs.scores.statistics import (
    interquartile_mean,
    performance_profile,
    probability_of_improvement,
    stratified_band,
    stratified_bootstrap,
    wilson_interval,
)
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.testing.environments import in_full

RUNS = [[0.1, 0.2, 0.9], [0.4, 0.5, 0.6, 0.7, 0.8]]


def test_the_interquartile_mean_leaves_out_a_quarter_on_either_side():
    assert interquartile_mean([[0.3]]) == 0.3
    rng = np.random.default_rng(0)
    for n in range(1, 30):
        x = rng.random(n)
        assert interquartile_mean([x]) == pytest.approx(stats.trim_mean(x, 0.25))


def test_every_id_has_the_same_weight_in_the_interquartile_mean():
    as_many = np.concatenate([np.repeat(RUNS[0], 5), np.repeat(RUNS[1], 3)])
    assert interquartile_mean(RUNS) == pytest.approx(stats.trim_mean(as_many, 0.25))
    few, many = [*RUNS, [0.3], [0.65]], [*RUNS, [0.3] * 7, [0.65] * 2]
    assert interquartile_mean(many) == pytest.approx(interquartile_mean(few))


def test_a_performance_profile_is_the_share_of_runs_above_averaged_over_ids():
    found = performance_profile(RUNS, [0.0, 0.45, 0.6, 1.0])
    np.testing.assert_allclose(found, [1.0, (1 / 3 + 4 / 5) / 2, (1 / 3 + 2 / 5) / 2, 0.0])


def test_the_probability_of_improvement_is_that_of_mann_and_whitney():
    assert probability_of_improvement([[1.0, 2.0]], [[1.0, 0.0]]) == (0.5 + 1 + 1 + 1) / 4
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 7)).round(1), rng.normal(size=(2, 9)).round(1)
    shares = [stats.mannwhitneyu(x, y).statistic / 63 for x, y in zip(a, b, strict=True)]
    assert probability_of_improvement(a, b) == pytest.approx(np.mean(shares))


def test_the_bootstrap_draws_seeds_within_each_id():
    means = []

    def mean(runs):
        assert [len(each) for each in runs] == [3, 5]
        assert set(runs[0]) <= set(RUNS[0]) and set(runs[1]) <= set(RUNS[1])
        means.append(float(np.mean([each.mean() for each in runs])))
        return means[-1]

    low, high = stratified_bootstrap(mean, RUNS, n_resamples=400)
    assert (low, high) == tuple(np.quantile(means, [0.025, 0.975])) and low < high
    assert stratified_bootstrap(mean, RUNS, n_resamples=400) == (low, high)


def test_the_band_of_a_curve_is_the_interval_at_each_point():
    at = [0.3, 0.5, 0.75]
    band = np.array(stratified_band(lambda runs: performance_profile(runs, at), RUNS))
    for k, point in enumerate(at):
        one = stratified_bootstrap(lambda runs, t=point: performance_profile(runs, [t])[0], RUNS)
        np.testing.assert_array_equal(band[:, k], one)
    curves = np.random.default_rng(3).normal(size=(6, 2))
    low, high = stratified_band(lambda runs: runs[0].mean(axis=0), [curves])
    assert (low < curves.mean(axis=0)).all() and (curves.mean(axis=0) < high).all()


def test_the_interval_of_one_normal_stratum_is_that_of_its_standard_error():
    x = np.random.default_rng(2).normal(size=400)
    low, high = stratified_bootstrap(lambda runs: float(runs[0].mean()), [x])
    width = 1.959964 * x.std() / 20.0
    # quantiles of 2000 draws are uncertain by 5 % or so of the width
    np.testing.assert_allclose([low, high], [x.mean() - width, x.mean() + width], atol=0.15 * width)


def test_one_seed_says_nothing_about_others_and_two_policies_are_compared():
    assert stratified_bootstrap(interquartile_mean, [[0.3], [0.5]], n_resamples=9) == (0.4, 0.4)
    low, high = stratified_bootstrap(probability_of_improvement, RUNS, RUNS, n_resamples=200)
    assert low < 0.5 < high


def test_what_is_no_runs_is_refused():
    for runs in ([], [[0.3], []], [[0.3], [[0.5]]]):
        with pytest.raises(ValueError, match=r"runs have shapes \[.*\]; expected"):
            interquartile_mean(runs)
    with pytest.raises(ValueError, match=r"others = 1 ids; expected 2"):
        probability_of_improvement(RUNS, RUNS[:1])


@pytest.mark.parametrize(("won", "n"), [(0, 7), (1, 7), (6, 7), (11, 11), (131, 500), (1, 1)])
def test_the_interval_of_a_rate_is_that_of_wilson(won, n):
    theirs = stats.binomtest(won, n).proportion_ci(0.95, method="wilson")
    low, high = wilson_interval(won, n)
    # the quantile of the normal distribution is written with 15 digits or more
    np.testing.assert_allclose([low, high], theirs, rtol=1e-13, atol=1e-16)
    assert 0.0 <= low <= high <= 1.0  # to the last bit


N = 20
each_id = pytest.mark.parametrize("env_id", list(ENVIRONMENTS))
one_of_each_system = in_full(ENVIRONMENTS)


def test_efficiency_is_the_share_of_the_best_cost_in_the_own_one_of_a_success():
    """The first to succeed has all of it; costs below the floor count as it."""
    for won, costs, best, expected in (
        ([1, 1, 1, 0, 0], [2.0, 4.0, 1.0, 1.0, 0.0], [2.0] * 5, [1.0, 0.5, 1.0, 0.0, 0.0]),
        ([1, 0], [7.0, 0.0], [np.nan] * 2, [1.0, 0.0]),
        ([1, 1, 1], [0.0, 0.005, 0.04], [0.0] * 3, [1.0, 1.0, 0.25]),
    ):
        found = efficiencies(np.array(won, dtype=bool), costs, best, 0.01)
        np.testing.assert_allclose(found, expected, rtol=1e-15)


@each_id
def test_every_id_has_a_cost_with_a_floor_far_below_what_is_known(env_id):
    cost, known = cost_of(env_id, task_of(env_id)), best_known(env_id)
    assert known is not None and known.cost == cost.name
    assert 0.0 < cost.floor <= 0.15 * np.nanmedian(known.costs)
    assert cost.floor == (task_of(env_id).dt if cost.name == "time" else 0.001)


def constant(value):
    def make(envs):
        space = envs.action_space
        fixed = np.full(space.shape, value, dtype=space.dtype)
        if envs.task.n_choices:
            fixed = np.full(space.shape, envs.task.n_choices - 1 if value > 0 else 1)
        return lambda _: fixed.copy()

    return PolicyFactory(make, f"constant {value}")


@one_of_each_system
def test_nothing_that_is_blind_is_efficient_and_no_best_known_is_below_the_bound(env_id):
    for policy in ("zero", "random", constant(1.0), constant(-0.5)):
        found = evaluate(env_id, policy, n=N)
        assert found.efficiencies.mean() <= 0.05, found.policy
    if found.bounds is not None:
        # float32 actions and what the finite horizon leaves change a loss by less than this
        assert (found.best >= found.bounds * (1.0 - 1e-6)).all()


@one_of_each_system
def test_no_reference_controller_is_better_than_the_data_say(env_id):
    known = best_known(env_id)
    name = next(iter(reference_controllers(env_id)))
    found = evaluate(env_id, name, n=4)  # a shortest path takes half a second
    own = np.array([finder == name for finder in known.finders[:4]])
    assert found.successes.all()
    # LAPACK rounds differently on other machines
    assert (found.costs >= known.costs[:4] * (1.0 - 1e-3)).all()
    np.testing.assert_allclose(found.efficiencies[own], 1.0, rtol=1e-3)
    assert known.policies[name]["success_rate"] == 1.0
