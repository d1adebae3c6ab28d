"""The coin held upright against reference cases, Newton's law with multipliers, a million steps."""

import math

import numpy as np

from rigid_envs.systems.upright_coin.system import UprightCoin
from tests.systems.measures import is_level, sample_steps

MILLION = 10**6


def test_a_million_steps_keep_the_circle_of_a_coin_left_alone():
    coin = UprightCoin()
    y = coin.state(contact=(0.5, 0.0), steer_rate=0.9, roll_rate=2.0)
    t = sample_steps(MILLION, 500) * 0.05
    motion = coin.simulate(y, t, max_step=0.05)
    np.testing.assert_array_equal(motion.y[:, 6:], np.tile(y[6:], (len(t), 1)))
    assert np.max(np.abs(np.linalg.norm(motion["q"], axis=-1) - 1.0)) <= 1e-14
    # It is as upright as on the first day, and its circle is where it was: 1e7 roundings.
    assert np.max(np.abs(motion["gamma"][:, 2])) <= 1e-11
    along, radius = motion["direction"], 2.0 / 0.9
    middle = motion["contact"] + radius * np.stack([-along[:, 1], along[:, 0]], axis=-1)
    np.testing.assert_allclose(middle, np.tile(middle[0], (len(t), 1)), rtol=0, atol=1e-10)


def test_a_million_steps_on_a_slope_keep_the_energy_and_the_height():
    coin = UprightCoin(slope=0.3)
    y = coin.state(q=coin.attitude(math.pi, 0.0), steer_rate=1.2)
    t = sample_steps(MILLION, 1500) * 0.04
    motion = coin.simulate(y, t, max_step=0.04)
    energy = motion.invariants["energy"] - motion.invariants["energy"][0]
    assert np.max(np.abs(energy)) <= 2e-7  # found: 7e-8
    assert is_level(t, energy, share=0.25)
    np.testing.assert_array_equal(motion["steer_rate"], 1.2)
    # Down by at most g sin(slope) / omega^2 / (1 + beta), for ever.
    lowest = 9.81 * math.sin(0.3) / 1.44 / 1.5
    assert np.max(motion["contact"][:, 0]) <= lowest * (1.0 + 1e-6)
    assert np.min(motion["contact"][:, 0]) >= -1e-5
