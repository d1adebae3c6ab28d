"""When a ball counts as parked."""

import numpy as np
import pytest

from rigid_envs.core import Core
from rigid_envs.tasks import BallPark


def parked(task, x, angle=0.0):
    """Whether a ball is parked that stands still at (x, 0), turned about the vertical."""
    core = Core(task, 1)
    q = [np.cos(0.5 * angle), 0.0, 0.0, np.sin(0.5 * angle)]
    core.reset(np.array([0]), state={"q": q, "position": [x, 0.0]})
    core.actions[...] = 0.0
    return bool(core.step())


@pytest.mark.parametrize("radius", [1e-3, 0.3, 1.0, 7.0])
def test_ball_is_parked_within_the_tolerances_and_not_outside(radius):
    task = BallPark(radius=radius, position_tolerance=2.0, angle_tolerance=0.4)
    for x, angle in ((1.999, 0.0), (0.0, 0.399), (-1.999, -0.399)):
        assert parked(task, x, angle)
    for x, angle in ((2.001, 0.0), (0.0, 0.401), (-1e3, 0.0), (0.0, -3.0)):
        assert not parked(task, x, angle)
