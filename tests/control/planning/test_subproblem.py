"""The convex problem of a linearisation, and the proximal map of its cost: what is optimal."""

import numpy as np
import pytest
from scipy.optimize import minimize

from rigid_envs.control.planning.descent import Subproblem, square_root
from rigid_envs.control.planning.model import Limits

LIMITS = Limits(True, np.array([True, True]))


def problem(rng, n=6, r=3, t=5):
    a = LIMITS.clip(rng.normal(0.0, 0.7, (n, t, 2)))
    G, c = rng.normal(0.0, 1.0, (n, r, t, 2)), rng.normal(0.0, 2.0, (n, r))
    ones = np.ones(n)
    return Subproblem(LIMITS, a, G, c, np.ones((n, r)), 0.3 * ones, 2.0 * ones, 5.0 * ones)


KINDS = {
    "disk": LIMITS,
    "box": Limits(False, np.array([True, True, True])),
    "box of which one side counts": Limits(False, np.array([True, False])),
}


def uneven(limits, n=40, r=4, t=6):
    """Problems that have nothing in common but their sizes."""
    rng, m = np.random.default_rng(3), len(limits.counted)
    a = limits.clip(rng.normal(0.0, 0.7, (n, t, m)))
    G, c = rng.normal(0.0, 1.0, (n, r, t, m)), rng.normal(0.0, 3.0, (n, r))
    sizes = ((0.3, 1.5, (n, r)), (0.1, 1.0, n), (0.5, 5.0, n), (0.5, 8.0, n))
    return Subproblem(limits, a, G, c, *(rng.uniform(*size) for size in sizes))


@pytest.mark.parametrize("limits", KINDS.values(), ids=KINDS)
def test_plans_and_prices_meet_the_conditions_of_karush_kuhn_and_tucker(limits):
    """The problem is convex: whatever meets them is its solution."""
    p = uneven(limits)
    plans, prices = p.solve(np.zeros_like(p.c))
    e = p.c + np.einsum("nrtj,ntj->nr", p.G, plans - p.a)
    mu, slack = p.mu[:, None], np.abs(e) - p.b
    free, spent = np.abs(prices) < 1e-9 * mu, np.abs(prices) > (1.0 - 1e-9) * mu
    assert min(free.sum(), spent.sum(), (~free & ~spent).sum()) > 5  # each kind is there
    assert (np.abs(prices) <= mu).all()
    assert (slack[free] < 1e-4).all() and (slack[spent] > -1e-4).all()
    assert (np.abs(slack[~free & ~spent]) < 1e-4).all()
    assert (prices * e >= 0.0).all()
    # no way from a plan within the limits goes down, given the prices
    down = p.rho[:, None, None] * (plans - p.a) + np.einsum("nr,nrtj->ntj", prices, p.G)
    rng = np.random.default_rng(4)
    for _ in range(200):
        ahead = plans + 1e-3 * (limits.clip(rng.normal(0.0, 1.5, plans.shape)) - plans)
        paid = p.w[:, None] * (limits.length(ahead) - limits.length(plans))
        assert (paid + (down * (ahead - plans)).sum(axis=2) > -1e-6).all()


def test_no_problem_is_left_before_its_duality_gap_is_a_millionth_of_its_value():
    p = uneven(LIMITS, n=400)
    plans, prices = p.solve(np.zeros_like(p.c))
    e = p.c + np.einsum("nrtj,ntj->nr", p.G, plans - p.a)
    bounds = (1.0 - 1e-5) * p.b  # a plan ends so far within them
    spent = p.w * LIMITS.length(plans).sum(axis=1)
    spent += 0.5 * p.rho * ((plans - p.a) ** 2).sum(axis=(1, 2))
    primal = spent + (p.mu[:, None] * np.maximum(np.abs(e) - bounds, 0.0)).sum(axis=1)
    dual = spent + (prices * e - bounds * np.abs(prices)).sum(axis=1)
    assert (np.abs(primal - dual) <= 1.01e-6 * np.abs(dual)).all()


def test_the_solution_does_not_depend_on_the_prices_it_begins_with():
    p = uneven(LIMITS)
    first = p.solve(np.zeros_like(p.c))
    for prices in (np.full_like(p.c, 1e3), -first[1]):
        for one, other in zip(p.solve(prices), first, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-4)


def test_a_violation_is_what_all_errors_have_above_their_bounds():
    p = uneven(LIMITS)
    e = p.c + np.einsum("nrtj,ntj->nr", p.G, -p.a)
    above = sum(max(abs(e[0, k]) - p.b[0, k], 0.0) for k in range(p.c.shape[1]))
    assert p.violation(np.zeros_like(p.a))[0] == pytest.approx(above)
    assert (p._replace(b=np.full_like(p.b, 1e6)).violation(p.a) == 0.0).all()


def test_what_can_be_met_is_met_within_the_tolerance():
    rng = np.random.default_rng(1)
    p = problem(rng)
    p = p._replace(c=np.clip(p.c, -1.2, 1.2), mu=1e3 * np.ones(6))
    plans, _ = p.solve(np.zeros_like(p.c))
    assert p.violation(plans).max() < 1e-5


def test_the_factor_of_a_matrix_that_may_be_singular():
    x = np.random.default_rng(2).normal(size=(50, 3, 2))
    S = x @ x.swapaxes(1, 2)
    F = square_root(S)
    np.testing.assert_allclose(F @ F.swapaxes(1, 2), S, atol=1e-6)


@pytest.mark.parametrize("limits", KINDS.values(), ids=KINDS)
def test_no_other_action_within_the_limits_is_better(limits):
    rng, m = np.random.default_rng(0), len(limits.counted)
    for z, threshold in zip(rng.normal(0.0, 1.2, (40, m)), rng.uniform(0.0, 1.0, 40), strict=True):
        v = limits.shrink(z[None], np.array([threshold]))[0][0]

        def value(v, z=z, threshold=threshold):
            return threshold * limits.length(v) + 0.5 * np.sum((v - z) ** 2)

        inside = {"type": "ineq", "fun": lambda v: 1.0 - v @ v} if limits.disk else ()
        start = limits.clip(z) * 0.9
        other = minimize(value, start, bounds=[(-1.0, 1.0)] * m, constraints=inside, tol=1e-12).x
        assert value(v) <= value(limits.clip(other)) + 1e-9
        np.testing.assert_allclose(limits.clip(v), v, atol=1e-12)


@pytest.mark.parametrize("limits", KINDS.values(), ids=KINDS)
def test_its_derivative_is_that_of_difference_quotients(limits):
    rng, m, h = np.random.default_rng(1), len(limits.counted), 1e-6
    z, threshold = rng.normal(0.0, 1.2, (200, m)), rng.uniform(0.0, 1.0, 200)
    slope = limits.shrink(z, threshold)[1]
    for k, unit in enumerate(np.eye(m)):
        ahead, behind = (limits.shrink(z + s * h * unit, threshold)[0] for s in (1.0, -1.0))
        off = np.abs((ahead - behind) / (2.0 * h) - slope[:, :, k]).max(axis=1)
        assert np.mean(off < 1e-4) > 0.98  # but at kinks
