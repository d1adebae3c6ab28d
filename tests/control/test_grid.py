"""QuarterRolls: Bellman's equation, parity, and ways that lead to their goals."""

import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball.controllers import (
    SIDES,
    QuarterRolls,
    attitudes,
    attitudes_after,
)
from rigid_envs.systems.rolling_ball.system import RollingBall

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
