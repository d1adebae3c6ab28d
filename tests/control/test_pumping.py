"""Pump: what a pass gains under the law, and that nothing gains more."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rigid_envs.systems.roller.controllers import Pump
from rigid_envs.systems.roller.system import Roller

VALLEY = Roller(beta=0.4, curvature=0.3, g=9.81)
DT = 0.01
PUMP = Pump(VALLEY, beta_change=0.9, dt=DT)


def turning_points(policy, start, n, dt):
    """Heights [m] of n turning points, the start first; masses are moved at the policy's word."""
    y, change, heights = np.array([start, 0.0]), 0.0, [PUMP.height([start, 0.0], 0.0)]
    while len(heights) < n:
        new = 0.5 * PUMP.beta_change * (1.0 + policy(y, change))
        v = y[1] * (1.4 + change) / (1.4 + new)  # the momentum is kept
        y, change, before = VALLEY.advance([y[0], v], [0.0, new], dt), new, v
        if y[1] * before < 0.0:
            heights.append(float(PUMP.height(y, change)))
    return np.array(heights)


def bang_bang(y, change):
    return float(PUMP(y, change)[0])


def test_every_pass_gains_what_the_ratios_allow():
    heights = turning_points(bang_bang, -0.5, 6, DT)
    assert PUMP.gain == pytest.approx(2.3 / 1.4, rel=1e-15)
    # Where a switch is late by up to dt, energy of the other kind is (w dt)^2 of the whole; less
    # than half of it is lost, at each of two switches.
    late = 9.81 * 0.3 / 1.4 * DT**2
    np.testing.assert_allclose(heights[1:] / heights[:-1], PUMP.gain, rtol=late)


@pytest.mark.parametrize("seed", range(5))
def test_no_ratios_gain_more(seed):
    rng = np.random.default_rng(seed)
    heights = turning_points(lambda y, change: rng.uniform(-1.0, 1.0), -0.5, 6, 0.05)
    assert np.max(heights[1:] / heights[:-1]) < PUMP.gain


def test_the_number_of_passes_is_the_least_with_which_the_law_comes_over_the_rim():
    for start in (-0.3, 0.5, -1.1, 2.0):
        for rim in (0.8, 1.4):
            n = int(PUMP.least_passes([start, 0.0], rim))
            top = (1.0 - np.cos(rim)) / 0.3
            heights = turning_points(bang_bang, start, n + 1, DT)
            assert heights[n] > top * (1.0 - 1e-3 * n)
            assert n == 0 or heights[n - 1] < top


def test_the_height_is_constant_while_the_ratio_stays_and_that_of_the_turning_point():
    def swing(_, y):
        return [y[1], -9.81 * np.sin(0.3 * y[0]) / 1.9]

    found = solve_ivp(swing, (0.0, 3.0), [-2.0, 0.0], rtol=1e-11, atol=1e-12)
    heights = PUMP.height(found.y.T, 0.5)
    np.testing.assert_allclose(heights, (1.0 - np.cos(0.6)) / 0.3, rtol=1e-9)


def test_the_bottom_is_where_the_path_is_level():
    tilted = Pump(Roller(beta=0.4, curvature=0.3, slope=0.2), 0.9, DT)
    shift = np.array([0.2 / 0.3, 0.0])
    y = np.random.default_rng(0).uniform(-1.0, 1.0, (50, 2))
    np.testing.assert_array_equal(tilted(y + shift, 0.0), PUMP(y, 0.0))
    np.testing.assert_allclose(tilted.height(y + shift, 0.0), PUMP.height(y, 0.0))


def test_actions_are_the_ends_of_the_box_for_each_row_as_alone():
    rng = np.random.default_rng(1)
    y, change = rng.uniform(-1.0, 1.0, (2, 20, 2)), rng.uniform(0.0, 0.9, (2, 20))
    actions = PUMP(y, change)
    assert actions.shape == (2, 20, 1)
    assert set(np.unique(actions)) == {-1.0, 1.0}
    for row in np.ndindex(2, 20):
        assert PUMP(y[row], change[row]) == actions[row]


def test_what_cannot_be_pumped_is_refused():
    with pytest.raises(ValueError, match=r"roller\.curvature = 0\.0"):
        Pump(Roller(), 0.6, DT)
    with pytest.raises(ValueError, match="beta_change = -1"):
        Pump(VALLEY, -1.0, DT)
    with pytest.raises(ValueError, match="expected rest, and not at the bottom"):
        PUMP.least_passes([0.0, 0.0], 1.0)
    with pytest.raises(ValueError, match="expected rest, and not at the bottom"):
        PUMP.least_passes([0.4, 0.1], 1.0)
    with pytest.raises(ValueError, match=r"beta_change = -0\.1"):
        PUMP([0.4, 0.1], -0.1)
