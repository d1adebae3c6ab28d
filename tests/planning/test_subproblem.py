"""The convex problem of a linearisation, against a general solver."""

import numpy as np
from scipy.optimize import minimize

from rigid_envs.planning.limits import Limits
from rigid_envs.planning.subproblem import Subproblem, square_root

LIMITS = Limits(True, np.array([True, True]))


def problem(rng, n=6, r=3, t=5):
    a = LIMITS.clip(rng.normal(0.0, 0.7, (n, t, 2)))
    G, c = rng.normal(0.0, 1.0, (n, r, t, 2)), rng.normal(0.0, 2.0, (n, r))
    ones = np.ones(n)
    return Subproblem(LIMITS, a, G, c, np.ones((n, r)), 0.3 * ones, 2.0 * ones, 5.0 * ones)


def value(p, k, v):
    e = p.c[k] + np.einsum("rtj,tj->r", p.G[k], v - p.a[k])
    spent = p.w[k] * LIMITS.length(v).sum() + 0.5 * p.rho[k] * np.sum((v - p.a[k]) ** 2)
    return spent + p.mu[k] * np.maximum(np.abs(e) - p.b[k], 0.0).sum()


def test_no_other_plan_is_better():
    p = problem(np.random.default_rng(0))
    plans, prices = p.solve(np.zeros_like(p.c))
    for k, v in enumerate(plans):
        best = min(
            value(
                p,
                k,
                minimize(
                    lambda x, k=k: value(p, k, LIMITS.clip(x.reshape(-1, 2))),
                    (v + scale * np.random.default_rng(k).normal(size=v.shape)).ravel(),
                    method="Powell",
                    options={"maxiter": 20},
                ).x.reshape(-1, 2).clip(-1.0, 1.0),
            )
            for scale in (0.0, 0.1)
        )  # fmt: skip
        assert value(p, k, v) <= best + 1e-4
    assert (np.abs(prices) <= p.mu[:, None]).all()


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
