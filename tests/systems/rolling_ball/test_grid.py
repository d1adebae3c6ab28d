"""Straight rolls, and the ball on its grid: where they lead, in how few steps, and BallGrid."""

import numpy as np
import pytest

from rigid_envs.envs.shells import RigidEnv, RigidVectorEnv
from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball import controllers
from rigid_envs.systems.rolling_ball.references import quarter_rolls
from rigid_envs.systems.rolling_ball.system import RollingBall
from tests.reference import cases, every
from tests.refusals import refuses
from tests.systems.runs import bound, run

# Straight rolls and plans of them: where they lead, by the closed form, and in how many steps.


def polygons(n_rows, n_sides):
    return np.random.default_rng(0).uniform(-2.0, 2.0, (n_rows, n_sides, 2))


def test_rolls_turn_the_ball_as_the_closed_form_says():
    rolls = polygons(20, 7)
    turns, _ = controllers.rolled(rolls)
    closed = np.array([rolling_ball.roll_polygon(row, 1.0) for row in rolls])
    assert np.max(rotations.distance(turns, closed)) < 1e-14


def test_derivatives_are_those_of_the_turn():
    rolls, step = polygons(5, 6), 1e-5
    turn, change = controllers.rolled(rolls)
    for k, axis in np.ndindex(6, 2):
        moved = np.zeros_like(rolls)
        moved[:, k, axis] = step
        there, back = controllers.rolled(rolls + moved)[0], controllers.rolled(rolls - moved)[0]
        difference = rotations.log(rotations.multiply(there, rotations.conjugate(back)))
        # truncation step^2, rounding 1e-16 / step
        np.testing.assert_allclose(difference / (2.0 * step), change[:, k, :, axis], atol=1e-9)
    assert change.shape == (5, 6, 3, 2)
    assert turn.shape == (5, 4)


def test_the_difference_of_poses_is_what_leads_from_one_to_the_other():
    rng = np.random.default_rng(0)
    start, goal = (
        np.concatenate([rotations.random_quaternion(rng, (9,)), rng.normal(size=(9, 2))], axis=1)
        for _ in range(2)
    )
    radius = np.linspace(0.5, 2.0, 9)
    turn, way = controllers.difference(start, goal, radius)
    np.testing.assert_allclose(start[:, 4:] + radius[:, None] * way, goal[:, 4:], atol=1e-15)
    assert np.max(rotations.distance(rotations.multiply(turn, start[:, :4]), goal[:, :4])) < 1e-15


def three_sides(n, size=2.0):
    return size * np.random.default_rng(0).uniform(-1.0, 1.0, (n, 3, 2))


@pytest.mark.parametrize("reach", [0.05, 0.3, 10.0])
def test_a_ball_that_is_told_to_rolls_as_the_polygon_turns_it(reach):
    rolls = three_sides(20)
    plan = controllers.roll_along(rolls, reach)
    y = np.broadcast_to(BALL.state(), (20, 6))
    for action in plan.actions:
        velocity = np.concatenate([reach * action, np.zeros((20, 1))], axis=1)
        y = BALL.advance(y, velocity, 1.0, 12)
    np.testing.assert_allclose(y[:, 4:], np.sum(rolls, axis=1), rtol=0, atol=1e-12)
    turns = np.array([rolling_ball.roll_polygon(way, 0.7) for way in rolls])
    assert np.max(rotations.distance(y[:, :4], turns)) < 1e-12


def test_each_roll_takes_the_fewest_steps_that_are_not_too_large():
    rolls, reach = three_sides(50), np.linspace(0.1, 0.5, 50)
    plan = controllers.roll_along(rolls, reach)
    lengths = np.linalg.norm(rolls, axis=-1)
    np.testing.assert_array_equal(
        plan.steps, np.sum(np.ceil(lengths / reach[:, None]), axis=1).astype(int)
    )
    assert np.max(np.linalg.norm(plan.actions, axis=-1)) <= 1.0 + 1e-9
    moves = plan.actions.any(axis=-1)
    np.testing.assert_array_equal(np.sum(moves, axis=0), plan.steps)
    np.testing.assert_allclose(plan.length, np.sum(lengths, axis=1))
    assert not plan.actions[-1].any()


def test_a_roll_of_no_length_takes_no_step():
    plan = controllers.roll_along(np.zeros((4, 3, 2)), 0.3)
    assert plan.actions.shape == (1, 4, 2)
    assert not plan.steps.any()


# The attitude is solved for to 1e-12 rad; the rest is rounding, 2.2e-16 times ways of up to 500.
EXACT = 2e-12
N = 60


def poses(seed, way, angle):
    """States whose positions and rotation vectors have entries of these sizes."""
    rng = np.random.default_rng(seed)
    position = way * rng.uniform(-1.0, 1.0, (N, 2))
    return np.concatenate([rotations.exp(angle * rng.uniform(-1.0, 1.0, (N, 3))), position], axis=1)


def uniform(seed, way, n=N):
    rng = np.random.default_rng(seed)
    position = rng.uniform(-way, way, (n, 2))
    return np.concatenate([rotations.random_quaternion(rng, (n,)), position], axis=1)


def missed(start, goal, rolls, radius=1.0):
    """Distance [m] and angle [rad] between the goal and where the rolls lead to."""
    turns = np.array([rolling_ball.roll_polygon(way, radius) for way in rolls])
    end = start[:, 4:] + np.sum(rolls, axis=1)
    angle = rotations.distance(rotations.multiply(turns, start[:, :4]), goal[:, :4])
    return np.linalg.norm(end - goal[:, 4:], axis=1), angle


def length(rolls):
    return np.sum(np.linalg.norm(rolls, axis=-1), axis=-1)


def least(start, goal):
    """No way is shorter: it turns the ball by its own length in radii at most."""
    distance = np.linalg.norm(goal[:, 4:] - start[:, 4:], axis=1)
    return np.maximum(distance, rotations.distance(start[:, :4], goal[:, :4]))


HOME = np.broadcast_to([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], (N, 6))
FROM_TO = {
    "anywhere in a square": (uniform(0, 2.0), uniform(1, 2.0)),
    "back where it was": (uniform(2, 0.0), uniform(3, 0.0)),
    "far away": (uniform(4, 100.0), uniform(5, 100.0)),
    "the attitude it has": (poses(6, 2.0, 0.0), poses(7, 2.0, 0.0)),
    "nearly where it is": (poses(8, 1e-3, 1e-3), HOME),
    "twisted a little": (poses(9, 0.0, np.array([0.0, 0.0, 0.1])), HOME),
    "upside down": (poses(10, 2.0, 0.0), np.tile([0.0, 0.6, 0.8, 0.0, 0.3, 0.7], (N, 1))),
    "half a turn about the vertical": (poses(11, 2.0, 0.0), np.tile([0, 0, 0, 1.0, 0, 0], (N, 1))),
    "nowhere": (HOME, HOME),
}


@pytest.mark.long
@pytest.mark.parametrize("kind", FROM_TO)
def test_three_rolls_lead_from_any_pose_to_any_other(kind):
    start, goal = FROM_TO[kind]
    rolls = controllers.three_rolls(start, goal)
    distance, angle = missed(start, goal, rolls)
    assert rolls.shape == (N, 3, 2)
    assert np.max(distance) < EXACT
    assert np.max(angle) < EXACT
    assert (length(rolls) >= least(start, goal) - EXACT).all()


def test_where_one_straight_roll_is_enough_it_is_the_plan():
    way = np.random.default_rng(0).uniform(-2.0, 2.0, (N, 2))
    goal = np.concatenate([[rolling_ball.roll_straight(w, 1.0) for w in way], way], axis=1)
    np.testing.assert_allclose(
        length(controllers.three_rolls(HOME, goal)), np.linalg.norm(way, axis=1), rtol=EXACT
    )


def test_a_ball_is_carried_along_unturned_by_rolls_of_two_whole_turns_together():
    start, goal = FROM_TO["the attitude it has"]
    np.testing.assert_allclose(length(controllers.three_rolls(start, goal)), 4.0 * np.pi, rtol=1e-6)


def test_plans_are_those_of_seed_0_unless_another_is_given():  # published costs are theirs
    start, goal = (each[:3] for each in FROM_TO["anywhere in a square"])
    plans = [controllers.three_rolls(start, goal, seed=seed) for seed in (0, 1)]
    np.testing.assert_array_equal(controllers.three_rolls(start, goal), plans[0])
    assert (plans[0] != plans[1]).any()


def test_plans_scale_with_the_radius():
    start, goal = FROM_TO["anywhere in a square"]
    size = np.array([1.0, 1.0, 1.0, 1.0, 0.3, 0.3])
    rolls = controllers.three_rolls(size * start, size * goal, radius=0.3)
    assert np.max(missed(size * start, size * goal, rolls, 0.3)) < EXACT
    # the same family, and near its shortest the length depends on the place to second order only
    np.testing.assert_allclose(
        length(rolls), 0.3 * length(controllers.three_rolls(start, goal)), rtol=1e-9
    )


@every(cases("ball_reach"))
def test_plans_are_no_longer_than_those_of_the_reference(case):
    given = case["in"]
    goal = np.concatenate([given["target_q"], given["target_xy"]])
    rolls = controllers.three_rolls([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], goal, radius=given["a"])
    assert length(rolls) < case["out"]["path_length"] + EXACT


def test_plans_of_a_batch_are_those_of_its_rows():
    start = uniform(12, 2.0, 6).reshape(2, 3, 6)
    radius = np.array([0.5, 1.0, 2.0])
    rolls = controllers.three_rolls(start, HOME[0], radius=radius)
    assert rolls.shape == (2, 3, 3, 2)
    for row in np.ndindex(2, 3):
        alone = controllers.three_rolls(start[row], HOME[0], radius=radius[row[1]])
        # products of matrices may be summed in another order, and each plan is near its shortest
        np.testing.assert_allclose(length(alone), length(rolls[row]), rtol=1e-9)
    assert controllers.three_rolls(start[0, 0], HOME[0], radius=radius).shape == (3, 3, 2)


@pytest.mark.long
def test_ten_thousand_of_ten_thousand_poses_are_reached():
    start = uniform(13, 2.0, 10_000)
    distance, angle = missed(
        start, np.broadcast_to(HOME[0], start.shape), controllers.three_rolls(start, HOME[0])
    )
    assert np.max(distance) < 1e-9
    assert np.max(angle) < 1e-9


def test_what_is_no_pose_or_no_ball_is_refused():
    with pytest.raises(ValueError, match=r"radius = 0\.0; expected positive"):
        controllers.three_rolls(HOME[0], HOME[0], radius=0.0)
    with pytest.raises(ValueError, match=r"^q = .*; expected length 1"):
        controllers.three_rolls([2.0, 0.0, 0.0, 0.0, 0.0, 0.0], HOME[0])
    refuses(r"shape \(5,\)", controllers.three_rolls, HOME[0], np.zeros(5))


# The ball on its grid: Bellman's equation, parity, ways that lead home, and BallGrid.


BALL = RollingBall(0.7)
REACH = 6


@pytest.fixture(scope="module")
def policy():
    return controllers.QuarterRolls(BALL, REACH)


def everywhere(policy, reach):
    """All states at most so many cells from home, shape (2 reach + 1, 2 reach + 1, 24, 6)."""
    i, j, number = np.meshgrid(*[np.arange(-reach, reach + 1)] * 2, np.arange(24), indexing="ij")
    return policy.state(np.stack([i, j], axis=-1), number)


def after(y, side):
    """The state after a move, by the closed form of a straight roll."""
    way = 0.5 * np.pi * BALL.radius * controllers.SIDES[side]
    q = rotations.multiply(rolling_ball.roll_straight(way, BALL.radius), y[..., :4])
    return np.concatenate([q, y[..., 4:6] + way], axis=-1)


def test_the_attitudes_are_the_rotations_of_a_cube():
    matrices = rotations.matrix_from_quaternion(controllers.attitudes())
    assert matrices.shape == (24, 3, 3)
    np.testing.assert_allclose(np.rint(matrices), matrices, rtol=0, atol=1e-15)
    assert len(np.unique(np.rint(matrices).reshape(24, 9), axis=0)) == 24
    np.testing.assert_array_equal(controllers.attitudes()[0], [1.0, 0.0, 0.0, 0.0])


def test_a_move_is_a_quarter_roll():
    for side in range(4):
        q = after(np.concatenate([controllers.attitudes(), np.zeros((24, 2))], axis=1), side)[:, :4]
        expected = controllers.attitudes()[controllers.attitudes_after()[:, side]]
        np.testing.assert_allclose(np.abs(np.sum(q * expected, axis=1)), 1.0, rtol=0, atol=1e-15)


def test_fewest_moves_solve_the_equation_of_bellman(policy):
    y = everywhere(policy, REACH - 1)
    moves = policy.moves(y)
    next_best = np.min([policy.moves(after(y, side)) for side in range(4)], axis=0)
    home = moves == 0
    assert np.sum(home) == 1
    n = len(policy.table)
    assert policy.table.shape == (n, n, 24) and policy.table[n // 2, n // 2, 0] == 0
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
    wide = controllers.QuarterRolls(BALL, 20)
    moves = wide.moves(everywhere(wide, 20))
    i, j = np.indices(moves.shape[:2]) - 20
    detour = moves - (np.abs(i) + np.abs(j))[..., None]
    assert np.max(detour) == 6
    near = slice(20 - REACH, 21 + REACH)
    np.testing.assert_array_equal(policy.moves(everywhere(policy, REACH)), moves[near, near])


@pytest.mark.parametrize("reach", [0, 1, 2])
def test_numbers_of_moves_do_not_depend_on_the_reach(policy, reach):
    poses = everywhere(policy, reach)
    np.testing.assert_array_equal(
        controllers.QuarterRolls(BALL, reach).moves(poses), policy.moves(poses)
    )


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
    np.testing.assert_array_equal(controllers.SIDES[policy(out)], -controllers.SIDES[policy(home)])


def test_each_row_of_a_batch_is_treated_as_alone(policy):
    y = everywhere(policy, 1)
    y = y[policy.moves(y) >= 0]
    np.testing.assert_array_equal(policy(y), [policy(row) for row in y])
    assert policy(y[0]).shape == ()


def test_what_has_no_way_is_refused(policy):
    tipped = BALL.state(q=controllers.attitudes()[1])
    refuses("expected a pose from which quarter rolls lead", policy, tipped)
    assert policy.moves(tipped) == -1
    refuses(r"^offset_from_grid = .*; expected", policy, BALL.state(position=[0.5, 0.0]))
    with pytest.raises(ValueError, match=r"^offset_from_grid = .*; expected"):
        policy(BALL.state(q=rotations.exp([1e-3, 0.0, 0.0])))
    with pytest.raises(ValueError, match=r"^cells_to_goal = 7; expected at most"):
        policy(BALL.state(position=[0.35 * np.pi * 7, 0.0]))
    refuses("reach = -1", controllers.QuarterRolls, BALL, -1)


TASK = "rigid_envs.systems.rolling_ball.tasks:BallGrid"
LAW = controllers.QuarterRolls(RollingBall(), 4)


def cells_and_attitudes(y, radius):
    """Cells, shape (..., 2), and numbers of the attitudes, shape (...), of states (..., 6)."""
    cells = np.rint(y[..., 4:6] / (0.5 * np.pi * radius)).astype(int)
    return cells, np.argmax(np.abs(y[..., :4] @ controllers.attitudes().T), axis=-1)


def test_the_moves_are_those_of_the_policy():
    envs = RigidVectorEnv(TASK, 96)
    y = np.zeros((24, 4, 6))
    y[..., :4] = controllers.attitudes()[:, None]
    envs.reset(options={"state": y.reshape(96, 6)})
    envs.step(np.tile(np.arange(4), 24))
    cells, number = cells_and_attitudes(envs.y, 1.0)
    np.testing.assert_array_equal(cells, np.tile(controllers.SIDES, (24, 1)))
    np.testing.assert_array_equal(number, controllers.attitudes_after().ravel())
    # on the grid to rounding: nothing but the 24 attitudes comes of the moves
    closest = np.max(np.abs(envs.y[:, :4] @ controllers.attitudes().T), axis=1)
    np.testing.assert_allclose(closest, 1.0, rtol=0, atol=1e-15)


def from_all_starts():
    """Fewest moves home from all cells and attitudes of the starts, -1 where there is no way."""
    i, j, number = np.meshgrid(*[np.arange(-4, 5)] * 2, np.arange(24), indexing="ij")
    return LAW.moves(LAW.state(np.stack([i, j], axis=-1), number))


def test_the_breadth_first_search_brings_every_ball_home_on_the_shortest_way():
    found = run("BallGrid", bound(quarter_rolls), 5000)
    least = LAW.moves(found.y[0])
    assert found.success.all()
    np.testing.assert_array_equal(
        found.steps, np.where(least == 0, 2, least)
    )  # at home: out and back


def test_the_longest_of_the_shortest_ways_is_nine_moves():
    moves = from_all_starts()
    assert np.max(moves) == 9
    np.testing.assert_allclose(np.mean(moves[moves >= 0]), 5.846, atol=1e-3)


def test_a_way_without_a_plan_seldom_leads_home():
    rng = np.random.default_rng(0)
    found = run("BallGrid", lambda envs: rng.integers(0, 4, envs.num_envs), 5000)
    assert np.mean(found.success) < 0.025
    for side in range(4):
        found = run("BallGrid", lambda envs, side=side: np.full(envs.num_envs, side), 1000)
        assert np.mean(found.success) < 0.01


def test_rounding_does_not_move_the_ball_off_the_grid():
    env = RigidEnv(TASK, radius=0.7)
    rng = np.random.default_rng(0)
    env.reset(seed=0, options={"state": {"position": [7.0 * np.pi, 0.0]}})  # 20 cells from home
    for k in range(2000):
        cells, _ = cells_and_attitudes(env.y, 0.7)
        away = np.max(np.abs(controllers.attitudes() @ env.y[:4]))
        assert abs(away - 1.0) < 1e-15 * (k + 10)
        np.testing.assert_allclose(env.y[4:], cells * 0.35 * np.pi, rtol=0, atol=1e-13 * (k + 1))
        if env.step(int(rng.integers(0, 4)))[2]:
            break
