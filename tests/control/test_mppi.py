"""Sampling control: weights, boxes, a linear-quadratic problem whose optimum is known, choices."""

import itertools

import numpy as np
import pytest

from rigid_envs.control.predictive import CrossEntropyChoices, PathIntegral, weights

A = np.array([[1.0, 0.1], [0.0, 1.0]])  # a double integrator of period 0.1 s
B = np.array([[0.005], [0.1]])
Q, R = np.diag([1.0, 0.1]), np.array([[0.1]])
T = 20


def cost(x, plans):
    """Quadratic cost of plans (T, ..., 1) from x (2,)."""
    x, total = np.broadcast_to(x, (*plans.shape[1:-1], 2)), 0.0
    for u in plans:
        x = x @ A.T + u @ B.T
        total = total + np.einsum("...i,ij,...j", x, Q, x) + np.einsum("...i,ij,...j", u, R, u)
    return total


def optimum(x):
    """Least cost over the horizon, by the Riccati recursion."""
    P = np.zeros((2, 2))
    for _ in range(T):
        P = Q + P
        P = A.T @ P @ A - A.T @ P @ B @ np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)
    return x @ P @ x


@pytest.mark.parametrize("correlation", [0.0, 0.5])
def test_plans_come_near_the_optimum_of_a_linear_quadratic_problem(correlation):
    rng = np.random.default_rng(0)
    planner = PathIntegral(
        n_samples=500, horizon=T, spread=0.1, temperature=0.3, correlation=correlation
    )
    x = np.array([0.3, 0.2])
    plan = planner.start((), 1)
    for _ in range(60):
        samples = planner.sample(plan, planner.draw(rng, 1))
        plan = planner.improve(samples, cost(x, samples))
    assert optimum(x) <= cost(x, plan)  # nothing is better
    # measured: 1 to 3 % above, the noise of a mean of some dozens of plans that count
    assert cost(x, plan) < 1.05 * optimum(x) < 0.5 * cost(x, planner.start((), 1))


def test_a_batch_of_plans_is_its_rows():
    planner, rng = PathIntegral(8, 5), np.random.default_rng(0)
    plan, draws = rng.uniform(-1.0, 1.0, (5, 3, 2)), planner.draw(rng, 2)
    samples, costs = planner.sample(plan, draws), rng.normal(size=(3, 8))
    together = planner.improve(samples, costs)
    for k in range(3):
        alone = planner.sample(plan[:, k], draws)
        np.testing.assert_array_equal(alone, samples[:, k])
        np.testing.assert_array_equal(planner.improve(alone, costs[k]), together[:, k])


def test_plans_stay_in_the_box_and_the_first_that_is_tried_is_the_plan():
    planner, rng = PathIntegral(64, 10, spread=3.0), np.random.default_rng(0)
    plan = rng.uniform(-1.0, 1.0, (10, 4, 2))
    samples = planner.sample(plan, planner.draw(rng, 2))
    np.testing.assert_array_equal(samples[:, :, 0], plan)
    assert np.abs(samples).max() == 1.0
    # a mean of numbers in the box, but for the roundings of its sum
    assert np.abs(planner.improve(samples, rng.normal(size=(4, 64)))).max() <= 1.0 + 1e-14


def test_noise_has_the_deviation_and_the_correlation_that_are_asked_for():
    planner = PathIntegral(20_000, 4, spread=0.1, correlation=0.6, finest=1.0)
    e = planner.draw(np.random.default_rng(0), 1)[:, 1:, 0].T
    # 5 standard errors of 20 000 draws: 5 / sqrt(n) of a correlation, 5 / sqrt(2 n) of a deviation
    np.testing.assert_allclose(e.std(axis=0), 0.1, rtol=0.025)
    for now, later in itertools.pairwise(e.T):
        np.testing.assert_allclose(np.corrcoef(now, later)[0, 1], 0.6, atol=0.036)


def test_weights_do_not_depend_on_unit_or_origin_of_costs():
    costs = np.random.default_rng(0).normal(size=(5, 40))
    w = weights(costs, 0.2)
    np.testing.assert_allclose(w.sum(axis=-1), 1.0, rtol=1e-14)
    # a shift by 100 loses two digits of the costs, which the temperature multiplies by 25 or so
    np.testing.assert_allclose(weights(7.0 * costs + 100.0, 0.2), w, rtol=1e-11)
    assert (np.argmax(w, axis=-1) == np.argmin(costs, axis=-1)).all()
    assert (weights(costs, 1e-6).max(axis=-1) > 0.999).all()
    np.testing.assert_array_equal(weights(np.full(8, 3.0), 0.1), 1.0 / 8.0)


def test_how_badly_the_worst_fail_does_not_matter():
    costs = np.sort(np.random.default_rng(0).normal(size=(5, 100)))
    fallen = costs + np.where(np.arange(100) < 50, 0.0, 1e6)  # half of the rollouts
    w, w_fallen = weights(costs, 0.2)[:, :50], weights(fallen, 0.2)[:, :50]
    np.testing.assert_allclose(w_fallen / w_fallen[:, :1], w / w[:, :1], rtol=1e-14)


def test_choices_are_drawn_as_the_plan_says():
    planner = CrossEntropyChoices(40_000, 2, 3)
    plan = np.array([[0.2, 0.5, 0.3], [0.0, 0.0, 1.0]])
    drawn = planner.sample(plan, planner.draw(np.random.default_rng(0)))[..., 0]
    share = np.stack([np.bincount(row, minlength=3) for row in drawn]) / 40_000
    np.testing.assert_allclose(share, plan, atol=5 * 0.5 / 200)  # 5 standard errors at most


def test_choices_find_a_hidden_sequence():
    rng = np.random.default_rng(0)
    hidden = rng.integers(0, 4, 12)
    planner = CrossEntropyChoices(200, 12, 4)
    plan = planner.start(())
    for _ in range(20):
        samples = planner.sample(plan, planner.draw(rng))
        plan = planner.improve(samples, (samples[..., 0].T != hidden).sum(axis=-1))
    np.testing.assert_array_equal(plan.argmax(axis=-1), hidden)
    np.testing.assert_allclose(plan.sum(axis=-1), 1.0, rtol=1e-14)


def test_a_plan_moves_on_by_one_step():
    planner = PathIntegral(4, 3)
    np.testing.assert_array_equal(planner.shift(np.arange(6.0).reshape(3, 2))[:, 0], [2, 4, 4])
    choices = CrossEntropyChoices(4, 2, 2)
    np.testing.assert_array_equal(choices.shift(np.eye(2)), [[0.0, 1.0], [0.5, 0.5]])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PathIntegral(1, 5), "n_samples = 1; expected an integer of at least 2"),
        (lambda: PathIntegral(8, 0), "horizon = 0; expected an integer of at least 1"),
        (lambda: PathIntegral(8, 5, spread=0.0), "spread = 0.0; expected a positive"),
        (
            lambda: PathIntegral(8, 5, correlation=1.0),
            r"correlation = 1.0; .* in \[0, 1\)",
        ),
        (lambda: CrossEntropyChoices(8, 5, 1), "n_choices = 1"),
        (lambda: CrossEntropyChoices(8, 5, 3, temperature=0.0), "temperature = 0.0"),
    ],
)
def test_numbers_outside_their_range_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
