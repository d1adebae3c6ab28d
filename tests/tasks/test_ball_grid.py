"""BallGrid: which attitudes can be reached, and the shortest ways home."""

from functools import cache

import numpy as np
import pytest

from rigid_envs.envs import RigidEnv, RigidVectorEnv
from tests.tasks.controllers.ball_grid import (
    SIDES,
    attitudes,
    cells_and_attitudes,
    fewest_moves,
    way_home,
)

TASK = "rigid_envs.tasks:BallGrid"
REACH = 12  # cells looked at on each side of home


@cache
def rolled():
    """Number of the attitude after each of the four moves, from the environment's own steps."""
    envs = RigidVectorEnv(TASK, 96)
    y = np.zeros((24, 4, 6))
    y[..., :4] = attitudes()[:, None]
    envs.reset(options={"state": y.reshape(96, 6)})
    envs.step(np.tile(np.arange(4), 24))
    cells, number = cells_and_attitudes(envs.y, 1.0)
    np.testing.assert_array_equal(cells, np.tile(SIDES, (24, 1)))
    # on the grid to rounding: nothing but the 24 attitudes comes of the moves
    closest = np.max(np.abs(envs.y[:, :4] @ attitudes().T), axis=1)
    np.testing.assert_allclose(closest, 1.0, rtol=0, atol=1e-15)
    return number.reshape(24, 4)


@cache
def moves():
    return fewest_moves(rolled(), REACH)


def play(policy, n, seed=0, **config):
    """Steps to the end, success and starts of one episode of n rows."""
    envs = RigidVectorEnv(TASK, n, max_episode_steps=30, **config)
    envs.reset(seed=seed)
    start = cells_and_attitudes(envs.y, 1.0)
    steps, success, alive = np.zeros(n, int), np.zeros(n, bool), np.ones(n, bool)
    while alive.any():
        _, _, terminated, truncated, infos = envs.step(policy(*cells_and_attitudes(envs.y, 1.0)))
        steps += alive
        success |= alive & infos["is_success"]
        alive &= ~(terminated | truncated)
    return steps, success, start


def test_a_move_is_undone_by_the_opposite_one():
    for side in range(4):
        there_and_back = rolled()[rolled()[:, side], (side + 2) % 4]
        np.testing.assert_array_equal(there_and_back, np.arange(24))


def test_exactly_twelve_of_the_24_attitudes_can_be_reached_in_each_cell():
    reachable = moves() >= 0
    assert (np.sum(reachable, axis=-1) == 12).all()
    # the same twelve in all cells of one colour, the other twelve in those of the other
    i, j = np.indices(reachable.shape[:2])
    even = reachable[REACH, REACH]
    np.testing.assert_array_equal(reachable, np.where(((i + j) % 2 == 0)[..., None], even, ~even))


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
    near = slice(REACH - 4, REACH + 5)
    reachable = moves()[near, near] >= 0
    np.testing.assert_array_equal(counts > 0, reachable)
    # chi-squared of 971 degrees of freedom: five standard deviations from its mean
    expected = n / np.sum(reachable)
    chi_squared = np.sum((counts[reachable] - expected) ** 2) / expected
    assert abs(chi_squared - 971) < 5.0 * np.sqrt(2.0 * 971)


def test_the_breadth_first_search_brings_every_ball_home_on_the_shortest_way():
    steps, success, (cells, number) = play(way_home(rolled(), REACH), 5000)
    least = moves()[cells[:, 0] + REACH, cells[:, 1] + REACH, number]
    assert success.all()
    np.testing.assert_array_equal(steps, np.where(least == 0, 2, least))  # at home: out and back


def test_the_longest_of_the_shortest_ways_is_nine_moves():
    near = moves()[REACH - 4 : REACH + 5, REACH - 4 : REACH + 5]
    assert np.max(near) == 9  # far below 2 (REACH + 1) - 8, where ways round the outside begin
    np.testing.assert_allclose(np.mean(near[near >= 0]), 5.846, atol=1e-3)


def test_a_way_without_a_plan_seldom_leads_home():
    rng = np.random.default_rng(0)
    _, success, _ = play(lambda cells, _: rng.integers(0, 4, len(cells)), 5000)
    assert np.mean(success) < 0.025
    for side in range(4):
        _, success, _ = play(lambda cells, _, side=side: np.full(len(cells), side), 1000)
        assert np.mean(success) < 0.01


def test_going_straight_to_the_cell_seldom_brings_the_right_side_up():
    def straight(cells, _):
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
