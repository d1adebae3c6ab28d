"""Pumping a roller: what a changing inertia ratio can gain, that nothing gains more."""

import numpy as np
import pytest

from rigid_envs.systems.roller.closed_forms import valley
from rigid_envs.systems.roller.controllers import LeastTime, Pump
from rigid_envs.systems.roller.references import ROLL_PUMP_TIME, pump
from rigid_envs.systems.roller.system import Roller
from rigid_envs.systems.roller.tasks.roll_pump import RollPump
from tests.refusals import refuses
from tests.systems.runs import bound, rows, run

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


def test_the_ratio_is_the_one_for_the_middle_of_the_period():
    y = np.random.default_rng(0).uniform([-1.0, -0.01], [1.0, 0.01], (50, 2))
    s, v = VALLEY.advance(y, [0.0, 0.9], 0.5 * DT).T
    np.testing.assert_array_equal(PUMP(y, 0.9)[:, 0], np.where(s * v < 0.0, 1.0, -1.0))


@pytest.mark.long
def test_the_number_of_passes_is_the_least_with_which_the_controller_comes_over_the_rim():
    for start in (-0.3, 2.0):
        for rim in (0.8, 1.4):
            n = int(PUMP.least_passes([start, 0.0], rim))
            top = (1.0 - np.cos(rim)) / 0.3
            heights = turning_points(bang_bang, start, n + 1, DT)
            assert heights[n] > top * (1.0 - 1e-3 * n)
            assert heights[n - 1] < top
    assert PUMP.least_passes([2.0, 0.0], 0.5) == 0  # it starts beyond the rim, at an angle of 0.6


def test_the_height_is_constant_while_the_ratio_stays_and_that_of_the_turning_point():
    motion = VALLEY.simulate([-2.0, 0.0], np.linspace(0.0, 3.0, 50), (0.0, 0.5))
    heights = PUMP.height(motion.y, 0.5)
    np.testing.assert_allclose(heights, (1.0 - np.cos(0.6)) / 0.3, rtol=1e-9)


def test_the_bottom_is_where_the_path_is_level():
    tilted = Pump(Roller(beta=0.4, curvature=0.3, slope=0.2), 0.9, DT)
    shift = np.array([0.2 / 0.3, 0.0])
    y = np.random.default_rng(0).uniform(-1.0, 1.0, (50, 2))
    np.testing.assert_array_equal(tilted(y + shift, 0.0), PUMP(y, 0.0))
    np.testing.assert_allclose(tilted.height(y + shift, 0.0), PUMP.height(y, 0.0))


def test_what_cannot_be_pumped_is_refused():
    refuses(r"roller\.curvature = 0\.0", Pump, Roller(), 0.6, DT)
    refuses("expected rest, and not at the bottom", PUMP.least_passes, [0.0, 0.0], 1.0)
    refuses("expected rest, and not at the bottom", PUMP.least_passes, [0.4, 0.1], 1.0)
    refuses(r"beta_change = -0\.1", PUMP, [0.4, 0.1], -0.1)
    tilted = Pump(Roller(curvature=0.3, slope=0.2), 0.9, DT)
    refuses(r"pump\.roller\.slope = 0\.2; expected 0", LeastTime, tilted, 1.2)


GAIN = 10.0 / 7.0  # (1 + 1) / (1 + 2/5)
KAPPA, G = 0.2, 9.81


def change(envs):
    """What is added to the ratio of each row."""
    return envs.auxiliary("beta_change")


def height(envs):
    """Energy of each row above the bottom, as the height that it would rise to [m]."""
    s, v = envs.y.T
    return (1.0 - np.cos(KAPPA * s)) / KAPPA + 0.5 * (1.4 + change(envs)) * v**2 / G


def greedy(envs):
    """The ratio with which the energy is largest at once: P^2 / (2 (1 + beta)) of the momentum."""
    momentum = (1.4 + change(envs)) * envs.y[:, 1]
    energies = [0.5 * momentum**2 / (1.4 + 0.6 * k) for k in (1, 0)]
    return np.where(energies[0] > energies[1], 1.0, -1.0)[:, None]


def passes(found):
    """How often the bottom was passed."""
    return np.sum(np.diff(np.sign(found.y[..., 0]), axis=0) != 0, axis=0)


def late(dt):
    """Part of a gain that is lost at most where the two switches come up to dt late or early.

    Beside the bottom and the turning points, energy of the other kind is (w dt)^2 of the whole,
    with w^2 = g kappa / 1.4; of this the part 3/7 is lost, less than half.
    """
    return 2 * 0.5 * G * KAPPA / 1.4 * dt**2


def test_the_bang_bang_controller_climbs_out_in_hardly_more_passes_than_it_must():
    found = run("RollPump", bound(pump))
    least = Pump(RollPump().system(), 0.6, 0.1).least_passes(found.y[0], 1.2)
    assert found.success.all()
    assert (passes(found) >= least).all()
    assert np.mean(passes(found) == least) > 0.95  # steps of 0.1 s cost a pass here and there
    assert set(least) == {7, 8, 9, 10, 11}
    shortest = RollPump().lower_bound(found.y[0])
    assert (found.cost >= shortest).all()
    assert np.mean(found.cost) < 1.2 * np.mean(shortest)


LEAST = LeastTime(Pump(RollPump().system(), 0.6, 0.1), 1.2)


def some_points(n):
    """Points in the valley, as `LeastTime` has them, and inputs."""
    x = np.random.default_rng(1).uniform(-1.0, 1.0, (n, 2)) * [1.2 / KAPPA, 12.0]
    return x, np.linspace(0.0, 1.0, 9)


def test_the_points_of_the_least_time_move_as_the_roller_does():
    x, inputs = some_points(20)
    s, momentum = x[:, 0], x[:, 1] - 0.05 * G * np.sin(KAPPA * x[:, 0])
    after = LEAST.moved(x, inputs, 0.1)
    for k, u in enumerate(1.0 / 2.0 + (1.0 / 1.4 - 1.0 / 2.0) * inputs):
        for row in range(20):
            end = valley(0.1, s[row], u * momentum[row], curvature=KAPPA, beta=1 / u - 1, g=G)
            p = end[1] / u + 0.05 * G * np.sin(KAPPA * end[0])
            # 1.1e-6 found, of one step of the integrator at the largest speed
            np.testing.assert_allclose(after[k, row], [end[0], p], atol=2e-6)
    np.testing.assert_allclose(LEAST.moved(after[3], inputs[3:4], -0.1)[0], x, atol=1e-12)


def test_the_margin_covers_what_a_ratio_changes_of_the_momentum_and_the_errors_of_chords():
    x, inputs = some_points(5000)
    after = LEAST.moved(x, inputs, 0.1)
    high = np.min([LEAST.margin(each)[:, 1] for each in after], axis=0)
    spread = np.ptp(after[..., 1], axis=0) / high
    assert 0.5 < spread.max() < 1.0
    chords = np.random.default_rng(2).normal(size=x.shape)
    chords *= LEAST.size / (np.abs(chords) @ [1.0, 0.1 / 1.4])[:, None]
    first, last = (LEAST.moved(x + t * chords, inputs[[0, -1]], 0.1) for t in (0.0, 1.0))
    middle = LEAST.moved(x + 0.5 * chords, inputs[[0, -1]], 0.1)
    off = np.abs(0.5 * (first + last) - middle).max(axis=0)
    assert (off < LEAST.margin(x)).all()


@pytest.mark.long
def test_plans_of_least_time_climb_out_in_hardly_more_periods_than_any_can():
    n = 40
    envs = rows("roller.tasks:RollPump", n)
    s = envs.y[:, 0].copy()
    bound, time = LEAST.periods(s, 400), np.zeros(n)
    for k, actions in enumerate(LEAST.actions(s, 400)):
        over = envs.step(actions)[2]
        time[over & (time == 0)] = k + 1
    assert (time >= bound).all() and (time > 0).all()
    assert np.mean(time <= bound + 1) > 0.85 and np.mean(time) < 1.01 * np.mean(bound)


def test_without_a_plan_the_roller_stays_in_the_valley():
    assert not run("RollPump", greedy).success.any()


def test_no_two_switches_gain_more_in_a_pass_and_some_gain_as_much():
    """All patterns of three ratios in a pass of 80 steps, at all pairs of times."""
    n, levels = 80, np.array([-1.0, 0.0, 1.0])
    first, second, a, b, c = (
        grid.ravel() for grid in np.meshgrid(*[np.arange(0, n, 2)] * 2, *[levels] * 3)
    )
    keep = first <= second
    first, second, a, b, c = (x[keep] for x in (first, second, a, b, c))
    envs = rows("roller.tasks:RollPump", len(a), dt=0.05, rim=3.0)
    envs.reset(options={"state": {"arc_length": -1.5, "velocity": 0.0}})
    start, reached = height(envs)[0], np.full(len(a), np.nan)
    for k in range(n):
        envs.step(np.where(k < first, a, np.where(k < second, b, c))[:, None].astype(np.float32))
        back = np.isnan(reached) & (envs.y[:, 1] < 0.0)
        reached[back] = height(envs)[back]
    gain = np.nanmax(reached) / start
    assert np.isnan(reached).sum() < 10  # hardly any is still on its way
    assert gain <= GAIN * (1.0 + 1e-6)  # truncation error of steps of 0.05 s
    assert gain > GAIN * (1.0 - late(0.1))


def test_masses_moved_at_once_keep_the_momentum_about_the_contact():
    envs = rows("roller.tasks:RollPump", 3, dt=1e-4)
    envs.reset(options={"state": {"arc_length": 0.0, "velocity": 2.0}})
    before = 1.4 * 2.0
    for action in (1.0, -0.2, 0.4):
        envs.step(np.full((3, 1), action, dtype=np.float32))
        ratio = 1.4 + 0.3 * (1.0 + np.float32(action))
        # the bottom is left by 2e-4 m a step, where gravity changes it by g kappa s dt
        np.testing.assert_allclose(ratio * envs.y[:, 1], before, atol=3 * 3 * 2e-4 * 1.96e-4)


def test_a_single_row_whose_gravity_is_drawn_has_the_bound_of_its_own():
    """Not that of the middle of the range."""
    config = {"g": (5.0, 15.0)}
    for seed in range(4):
        envs = rows("roller.tasks.roll_pump:RollPump", 1, **config)
        envs.reset(seed=seed)
        expected = envs.task.lower_bound(envs.y)
        np.testing.assert_array_equal(ROLL_PUMP_TIME.values(envs), expected)
