"""BallGrid: starts that can go home, and the shortest ways there."""

import numpy as np
import pytest

from rigid_envs.envs.single import RigidEnv
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.systems.rolling_ball.controllers import (
    SIDES,
    QuarterRolls,
    attitudes,
    attitudes_after,
)
from rigid_envs.systems.rolling_ball.references import quarter_rolls
from rigid_envs.systems.rolling_ball.system import RollingBall
from tests.tasks.runs import bound

TASK = "rigid_envs.tasks:BallGrid"
LAW = QuarterRolls(RollingBall(), 4)


def cells_and_attitudes(y, radius):
    """Cells, shape (..., 2), and numbers of the attitudes, shape (...), of states (..., 6)."""
    cells = np.rint(y[..., 4:6] / (0.5 * np.pi * radius)).astype(int)
    return cells, np.argmax(np.abs(y[..., :4] @ attitudes().T), axis=-1)


def play(policy, n, seed=0):
    """Steps to the end, success and starts of one episode of n rows."""
    envs = RigidVectorEnv(TASK, n, max_episode_steps=30)
    envs.reset(seed=seed)
    start = envs.y
    steps, success, alive = np.zeros(n, int), np.zeros(n, bool), np.ones(n, bool)
    while alive.any():
        _, _, terminated, truncated, infos = envs.step(policy(envs))
        steps += alive
        success |= alive & infos["is_success"]
        alive &= ~(terminated | truncated)
    return steps, success, start


def test_the_moves_are_those_of_the_policy():
    envs = RigidVectorEnv(TASK, 96)
    y = np.zeros((24, 4, 6))
    y[..., :4] = attitudes()[:, None]
    envs.reset(options={"state": y.reshape(96, 6)})
    envs.step(np.tile(np.arange(4), 24))
    cells, number = cells_and_attitudes(envs.y, 1.0)
    np.testing.assert_array_equal(cells, np.tile(SIDES, (24, 1)))
    np.testing.assert_array_equal(number, attitudes_after().ravel())
    # on the grid to rounding: nothing but the 24 attitudes comes of the moves
    closest = np.max(np.abs(envs.y[:, :4] @ attitudes().T), axis=1)
    np.testing.assert_allclose(closest, 1.0, rtol=0, atol=1e-15)


def everywhere():
    """Fewest moves home from all cells and attitudes of the starts, -1 where there is no way."""
    i, j, number = np.meshgrid(*[np.arange(-4, 5)] * 2, np.arange(24), indexing="ij")
    return LAW.moves(LAW.state(np.stack([i, j], axis=-1), number))


def test_starts_are_those_that_can_go_home_each_as_often():
    n = 50000
    envs = RigidVectorEnv(TASK, n)
    envs.reset(seed=0)
    cells, number = cells_and_attitudes(envs.y, 1.0)
    np.testing.assert_allclose(cells * 0.5 * np.pi, envs.y[:, 4:6], rtol=1e-15)
    np.testing.assert_allclose(
        np.max(np.abs(envs.y[:, :4] @ attitudes().T), axis=1), 1.0, rtol=0, atol=1e-15
    )
    counts = np.zeros((9, 9, 24), int)
    np.add.at(counts, (cells[:, 0] + 4, cells[:, 1] + 4, number), 1)
    reachable = everywhere() >= 0
    np.testing.assert_array_equal(counts > 0, reachable)
    # chi-squared of 971 degrees of freedom: five standard deviations from its mean
    expected = n / np.sum(reachable)
    chi_squared = np.sum((counts[reachable] - expected) ** 2) / expected
    assert abs(chi_squared - 971) < 5.0 * np.sqrt(2.0 * 971)


def test_the_breadth_first_search_brings_every_ball_home_on_the_shortest_way():
    steps, success, start = play(bound(quarter_rolls), 5000)
    least = LAW.moves(start)
    assert success.all()
    np.testing.assert_array_equal(steps, np.where(least == 0, 2, least))  # at home: out and back


def test_the_longest_of_the_shortest_ways_is_nine_moves():
    moves = everywhere()
    assert np.max(moves) == 9
    np.testing.assert_allclose(np.mean(moves[moves >= 0]), 5.846, atol=1e-3)


def test_a_way_without_a_plan_seldom_leads_home():
    rng = np.random.default_rng(0)
    _, success, _ = play(lambda envs: rng.integers(0, 4, envs.num_envs), 5000)
    assert np.mean(success) < 0.025
    for side in range(4):
        _, success, _ = play(lambda envs, side=side: np.full(envs.num_envs, side), 1000)
        assert np.mean(success) < 0.01


def test_going_straight_to_the_cell_seldom_brings_the_right_side_up():
    def straight(envs):
        cells, _ = cells_and_attitudes(envs.y, 1.0)
        along_y = np.where(cells[:, 1] > 0, 3, 1)
        return np.where(cells[:, 0] > 0, 2, np.where(cells[:, 0] < 0, 0, along_y))

    # and to and fro over it, once there: one attitude in twelve is right
    _, success, _ = play(straight, 5000)
    assert np.mean(success) < 0.2


def test_rounding_does_not_move_the_ball_off_the_grid():
    env = RigidEnv(TASK, radius=0.7)
    rng = np.random.default_rng(0)
    env.reset(seed=0, options={"state": {"position": [7.0 * np.pi, 0.0]}})  # 20 cells from home
    for k in range(2000):
        cells, _ = cells_and_attitudes(env.y, 0.7)
        away = np.max(np.abs(attitudes() @ env.y[:4]))
        assert abs(away - 1.0) < 1e-15 * (k + 10)
        np.testing.assert_allclose(env.y[4:], cells * 0.35 * np.pi, rtol=0, atol=1e-13 * (k + 1))
        if env.step(int(rng.integers(0, 4)))[2]:
            break


@pytest.mark.parametrize("radius", [0.2, 5.0])
def test_home_is_recognised_for_balls_of_every_size(radius):
    env = RigidEnv(TASK, radius=radius)
    home = env.task.system().state()
    for side in range(4):
        env.reset(options={"state": home})
        assert not env.step(side)[2]
        *_, terminated, _, info = env.step((side + 2) % 4)
        assert terminated
        assert info["is_success"]
