"""Wheels, spheres and hoops on inclines and in valleys, against references and multipliers."""

import numpy as np
import pytest

from rigid_envs.systems.roller.system import Roller
from tests.systems.measures import is_level, sample_steps

VALLEY = Roller(m=1.1, radius=0.3, beta=0.45, g=9.5, slope=0.4, curvature=0.5)
MILLION = 10**6


@pytest.mark.parametrize(
    # Down from the top of a sphere, at rest there: a block leaves it at cos = 2/3, a rolling
    # sphere at 10/17, and 2 / (3 + beta) in general.
    ("beta", "cosine"),
    [(0.0, 2.0 / 3.0), (0.4, 10.0 / 17.0), (1.0, 1.0 / 2.0)],
)
def test_a_body_leaves_the_hill_where_the_textbook_says(beta, cosine):
    hill = Roller(beta=beta, curvature=-0.5)
    motion = hill.simulate(hill.state(velocity=1e-4), np.linspace(0.0, 10.0, 2001))
    off = np.isinf(motion["needed_friction"])
    first = int(np.argmax(off))
    before, after = np.cos(motion["descent"][first - 1 : first + 1])
    assert before > cosine > after
    assert before - after < 0.02
    assert hill.slips(motion.y[first])


@pytest.mark.parametrize(("dt", "bound"), [(0.1, 2e-5)])
def test_a_million_steps_in_a_valley_keep_the_energy(dt, bound):
    y = VALLEY.state(arc_length=0.2, velocity=1.5)
    motion = VALLEY.simulate(y, sample_steps(MILLION) * dt, max_step=dt)
    energy = motion.invariants["energy"] / motion.invariants["energy"][0] - 1.0
    assert np.max(np.abs(energy)) <= bound  # found: 1.0e-5 and 6.5e-7, the fourth power
    assert is_level(motion.t, energy)
