"""The ball on its grid: Bellman's equation, parity, ways that lead home, and BallGrid."""

import numpy as np
import pytest

from rigid_envs.envs.single import RigidEnv
from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball.controllers import (
    SIDES,
    QuarterRolls,
    attitudes,
    attitudes_after,
)
from rigid_envs.systems.rolling_ball.references import quarter_rolls
from rigid_envs.systems.rolling_ball.system import RollingBall
from tests.systems.runs import bound

BALL = RollingBall(0.7)
REACH = 6


@pytest.fixture(scope="module")
def policy():
    return QuarterRolls(BALL, REACH)


def everywhere(policy, reach):
    """All states at most so many cells from home, shape (2 reach + 1, 2 reach + 1, 24, 6)."""
    i, j, number = np.meshgrid(*[np.arange(-reach, reach + 1)] * 2, np.arange(24), indexing="ij")
    return policy.state(np.stack([i, j], axis=-1), number)


def after(y, side):
    """The state after a move, by the closed form of a straight roll."""
    way = 0.5 * np.pi * BALL.radius * SIDES[side]
    q = rotations.multiply(rolling_ball.roll_straight(way, BALL.radius), y[..., :4])
    return np.concatenate([q, y[..., 4:6] + way], axis=-1)


def test_the_attitudes_are_the_rotations_of_a_cube():
    matrices = rotations.matrix_from_quaternion(attitudes())
    assert matrices.shape == (24, 3, 3)
    np.testing.assert_allclose(np.rint(matrices), matrices, rtol=0, atol=1e-15)
    assert len(np.unique(np.rint(matrices).reshape(24, 9), axis=0)) == 24
    np.testing.assert_array_equal(attitudes()[0], [1.0, 0.0, 0.0, 0.0])


def test_a_move_is_a_quarter_roll():
    for side in range(4):
        q = after(np.concatenate([attitudes(), np.zeros((24, 2))], axis=1), side)[:, :4]
        expected = attitudes()[attitudes_after()[:, side]]
        np.testing.assert_allclose(np.abs(np.sum(q * expected, axis=1)), 1.0, rtol=0, atol=1e-15)


def test_a_move_is_undone_by_the_opposite_one():
    for side in range(4):
        there_and_back = attitudes_after()[attitudes_after()[:, side], (side + 2) % 4]
        np.testing.assert_array_equal(there_and_back, np.arange(24))


def test_fewest_moves_solve_the_equation_of_bellman(policy):
    y = everywhere(policy, REACH - 1)
    moves = policy.moves(y)
    next_best = np.min([policy.moves(after(y, side)) for side in range(4)], axis=0)
    home = moves == 0
    assert np.sum(home) == 1
    reachable = ~home & (moves > 0)
    np.testing.assert_array_equal(moves[reachable], 1 + next_best[reachable])
    np.testing.assert_array_equal(next_best[moves < 0], -1)


def test_exactly_twelve_of_the_24_attitudes_lead_home_from_each_cell(policy):
    reachable = policy.moves(everywhere(policy, REACH)) >= 0
    assert (np.sum(reachable, axis=-1) == 12).all()
    i, j = np.indices(reachable.shape[:2])
    even = reachable[REACH, REACH]
    np.testing.assert_array_equal(reachable, np.where(((i + j) % 2 == 0)[..., None], even, ~even))


def test_no_way_takes_more_than_six_moves_above_the_straight_one(policy):
    """What the square that is searched beyond the reach relies on."""
    wide = QuarterRolls(BALL, 20)
    moves = wide.moves(everywhere(wide, 20))
    i, j = np.indices(moves.shape[:2]) - 20
    detour = moves - (np.abs(i) + np.abs(j))[..., None]
    assert np.max(detour) == 6
    near = slice(20 - REACH, 21 + REACH)
    np.testing.assert_array_equal(policy.moves(everywhere(policy, REACH)), moves[near, near])


@pytest.mark.parametrize("reach", [0, 1, 2])
def test_numbers_of_moves_do_not_depend_on_the_reach(policy, reach):
    poses = everywhere(policy, reach)
    np.testing.assert_array_equal(QuarterRolls(BALL, reach).moves(poses), policy.moves(poses))


def test_every_goal_is_reached_in_the_fewest_moves(policy):
    rng, n = np.random.default_rng(0), 300
    y = policy.state(rng.integers(-1, 2, (n, 2)), rng.integers(0, 24, n))
    goal = policy.state(rng.integers(-3, 4, (n, 2)), rng.integers(0, 24, n))
    possible = policy.moves(y, goal) > 0
    y, goal = y[possible], goal[possible]
    moves = policy.moves(y, goal)
    while (moves > 0).any():
        ahead = np.stack([after(*row) for row in zip(y, policy(y, goal), strict=True)])
        y = np.where((moves > 0)[:, None], ahead, y)
        moves = np.where(moves > 0, moves - 1, 0)
        np.testing.assert_array_equal(policy.moves(y, goal), moves)


def test_at_home_it_goes_out_and_back(policy):
    home = BALL.state()
    out = after(home, int(policy(home)))
    assert policy.moves(out) == 1
    np.testing.assert_array_equal(SIDES[policy(out)], -SIDES[policy(home)])


def test_each_row_of_a_batch_is_treated_as_alone(policy):
    y = everywhere(policy, 1)
    y = y[policy.moves(y) >= 0]
    np.testing.assert_array_equal(policy(y), [policy(row) for row in y])
    assert policy(y[0]).shape == ()


def test_what_has_no_way_is_refused(policy):
    tipped = BALL.state(q=attitudes()[1])
    with pytest.raises(ValueError, match="expected a pose from which quarter rolls lead"):
        policy(tipped)
    assert policy.moves(tipped) == -1
    with pytest.raises(ValueError, match=r"^offset_from_grid = .*; expected"):
        policy(BALL.state(position=[0.5, 0.0]))
    with pytest.raises(ValueError, match=r"^offset_from_grid = .*; expected"):
        policy(BALL.state(q=rotations.exp([1e-3, 0.0, 0.0])))
    with pytest.raises(ValueError, match=r"^cells_to_goal = 7; expected at most"):
        policy(BALL.state(position=[0.35 * np.pi * 7, 0.0]))
    with pytest.raises(ValueError, match="reach = -1"):
        QuarterRolls(BALL, -1)


TASK = "rigid_envs.systems.rolling_ball.tasks:BallGrid"
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


def from_all_starts():
    """Fewest moves home from all cells and attitudes of the starts, -1 where there is no way."""
    i, j, number = np.meshgrid(*[np.arange(-4, 5)] * 2, np.arange(24), indexing="ij")
    return LAW.moves(LAW.state(np.stack([i, j], axis=-1), number))


def test_the_breadth_first_search_brings_every_ball_home_on_the_shortest_way():
    steps, success, start = play(bound(quarter_rolls), 5000)
    least = LAW.moves(start)
    assert success.all()
    np.testing.assert_array_equal(steps, np.where(least == 0, 2, least))  # at home: out and back


def test_the_longest_of_the_shortest_ways_is_nine_moves():
    moves = from_all_starts()
    assert np.max(moves) == 9
    np.testing.assert_allclose(np.mean(moves[moves >= 0]), 5.846, atol=1e-3)


def test_a_way_without_a_plan_seldom_leads_home():
    rng = np.random.default_rng(0)
    _, success, _ = play(lambda envs: rng.integers(0, 4, envs.num_envs), 5000)
    assert np.mean(success) < 0.025
    for side in range(4):
        _, success, _ = play(lambda envs, side=side: np.full(envs.num_envs, side), 1000)
        assert np.mean(success) < 0.01


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
