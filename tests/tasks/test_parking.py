"""When a ball counts as parked."""

import numpy as np
import pytest

from rigid_envs.envs.single import RigidEnv


def parked(env, x, angle=0.0):
    """Whether a ball is parked that stands still at (x, 0), turned about the vertical."""
    q = [np.cos(0.5 * angle), 0.0, 0.0, np.sin(0.5 * angle)]
    env.reset(options={"state": {"q": q, "position": [x, 0.0]}})
    _, _, terminated, _, info = env.step(np.zeros(2, dtype=np.float32))
    assert terminated == info["is_success"]
    return terminated


@pytest.mark.parametrize("radius", [1e-3, 0.3, 1.0, 7.0])
def test_ball_is_parked_within_the_tolerances_and_not_outside(radius):
    config = {"radius": radius, "position_tolerance": 2.0, "angle_tolerance": 0.4}
    env = RigidEnv("rigid_envs.tasks:BallPark", **config)
    for x, angle in ((1.999, 0.0), (0.0, 0.399), (-1.999, -0.399)):
        assert parked(env, x, angle)
    for x, angle in ((2.001, 0.0), (0.0, 0.401), (-1e3, 0.0), (0.0, -3.0)):
        assert not parked(env, x, angle)
