"""PlateRegulator: the Riccati value is the cost, and from how far balls are held."""

import numpy as np
import pytest

from rigid_envs.control.linear import region_of_attraction, simulate_closed_loop
from rigid_envs.systems.dynamic_ball.controllers import PlateRegulator
from rigid_envs.systems.dynamic_ball.system import DynamicBall

DT, RATE = 0.1, 0.4
TABLES = (0.0, 1.0, -2.0)
POINT = np.array([0.4, -0.3])


def law_on(table):
    return PlateRegulator(DynamicBall(turntable_rate=table), RATE, DT)


def played(law, y, n, n_substeps=40):
    """States of the closed loop, the limit of the rates included."""

    def step(y):
        return law.ball.advance(y, law.inputs(y, law(y, POINT)), DT, n_substeps)

    return simulate_closed_loop(step, y, n)


@pytest.mark.parametrize("table", TABLES)
def test_the_closed_loop_is_stable(table):
    law = law_on(table)
    F, G = law.step
    assert np.max(np.abs(np.linalg.eigvals(F - G @ law.regulator.gain))) < 0.95


@pytest.mark.parametrize("table", TABLES)
def test_the_linear_step_is_that_of_the_system(table):
    law = law_on(table)
    F, G = law.step
    h = 1e-5
    for k in range(10):
        x = h * np.eye(10)[k]
        y = law.ball.state(position=POINT + x[:2], velocity=x[2:4], tilt=x[4:6], tilt_rate=x[6:8])
        # on a turntable the middle of the table is at rest, not the point
        y[4:6] -= POINT
        after = law.ball.advance(y, law.inputs(y, x[8:] / RATE), DT, 20)
        found = law.error(after, [0.0, 0.0]) / h
        # the next order is h^2 of an odd motion; rounding is 1e-16 / h
        np.testing.assert_allclose(found, np.hstack([F, G])[:, k], rtol=0, atol=1e-8)


def test_the_riccati_value_is_the_cost_of_small_errors():
    law, rng = law_on(0.0), np.random.default_rng(0)
    y = law.ball.state(position=POINT + 1e-3 * rng.uniform(-1, 1, (20, 2)))
    states = played(law, y, 150, 10)
    error, action = law.error(states, POINT), law(states, POINT)
    cost = np.sum(error**2 * ([1.0] * 2 + [1e-3] * 6), axis=-1)
    cost += law.input_weight * RATE**2 * np.sum(action**2, axis=-1)
    value = law.value(states, POINT)
    # offsets of 1e-3 m in a motion whose next order is their square
    np.testing.assert_allclose(np.sum(cost[:-1], axis=0) + value[-1], value[0], rtol=1e-4)
    big = value[:-1] > 1e-6 * value[0]
    assert (np.diff(value, axis=0)[big] < 0.0).all()


def held(states):
    """Whether the last two seconds were within 0.05 m."""
    away = np.linalg.norm(states[-20:, ..., 4:6] - POINT, axis=-1)
    return (away < 0.05).all(axis=0)


DIRECTIONS = np.stack([np.cos(np.arange(5.0)), np.sin(np.arange(5.0))], axis=-1)


@pytest.mark.parametrize("table", TABLES)
def test_balls_are_led_in_from_ten_metres_away(table):
    law = law_on(table)

    def succeeds(offset):
        return held(played(law, law.ball.state(position=POINT + offset), 400))

    assert (region_of_attraction(succeeds, DIRECTIONS, [0.1, 1.0, 3.0, 10.0]) == 10.0).all()


@pytest.mark.parametrize("table", TABLES)
def test_balls_are_stopped_that_pass_at_four_metres_a_second(table):
    law = law_on(table)

    def succeeds(velocity):
        return held(played(law, law.ball.state(position=POINT, velocity=velocity), 300))

    assert (region_of_attraction(succeeds, DIRECTIONS, [0.1, 1.0, 4.0]) == 4.0).all()


def test_rates_are_those_commanded_at_the_end_of_the_period():
    law = law_on(0.0)
    y = law.ball.state(tilt_rate=[0.1, -0.2])
    after = law.ball.advance(y, law.inputs(y, [0.5, 1.0]), DT, 2)
    np.testing.assert_allclose(law.ball.tilt_rate(after), [0.2, 0.4], rtol=1e-14)


def test_no_rate_is_larger_than_the_largest_and_each_row_is_as_alone():
    law, rng = law_on(1.0), np.random.default_rng(1)
    y = law.ball.state(position=rng.uniform(-5, 5, (4, 3, 2)), tilt=rng.uniform(-1, 1, (4, 3, 2)))
    points = rng.uniform(-1, 1, (4, 3, 2))
    actions = law(y, points)
    assert np.max(np.abs(actions)) <= 1.0
    for row in np.ndindex(4, 3):
        np.testing.assert_allclose(law(y[row], points[row]), actions[row], rtol=1e-13)


def test_beyond_the_farthest_only_the_direction_of_the_offset_counts():
    law = law_on(0.0)
    near, far = (law(law.ball.state(position=d * np.array([0.6, 0.8])), [0, 0]) for d in (1, 50))
    np.testing.assert_allclose(near, far, rtol=1e-14)


def test_bad_numbers_are_refused():
    with pytest.raises(ValueError, match="input_weight = 0"):
        PlateRegulator(DynamicBall(), RATE, DT, input_weight=0.0)
    with pytest.raises(ValueError, match="tilt_rate = -1"):
        PlateRegulator(DynamicBall(), -1.0, DT)
    with pytest.raises(ValueError, match="point has shape"):
        law_on(0.0)(DynamicBall().state(), [0.0, 0.0, 0.0])
