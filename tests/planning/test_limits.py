"""The proximal map of an action's cost, against a general minimiser and difference quotients."""

import numpy as np
import pytest
from scipy.optimize import minimize

from rigid_envs.control.planning.model import Limits

KINDS = {
    "disk": Limits(True, np.array([True, True])),
    "box": Limits(False, np.array([True, True, True])),
    "box of which one side counts": Limits(False, np.array([True, False])),
}


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
