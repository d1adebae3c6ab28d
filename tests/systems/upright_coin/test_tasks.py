"""Parking a coin: plans that lead from any pose to any other, and the task in which they do."""

import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.systems.upright_coin.closed_forms import roll_coin
from rigid_envs.systems.upright_coin.controllers import TwoRolls
from rigid_envs.systems.upright_coin.references import two_rolls
from rigid_envs.systems.upright_coin.system import UprightCoin
from rigid_envs.systems.upright_coin.tasks.coin_park import CoinPark
from tests.systems.runs import bound, run

COIN = UprightCoin(radius=0.4)
SIZES = (0.3, 0.5)  # roll and steer in a step
PLANNER = TwoRolls(COIN, *SIZES)
HOME = COIN.state(q=COIN.attitude(0.0, 0.0))


# A plan misses by its rounding, 1e-9 radii at the most; so does the sum of its steps
EXACT = 1e-9


def poses(seed, n, way):
    rng = np.random.default_rng(seed)
    q = COIN.attitude(*rng.uniform(-np.pi, np.pi, (2, n)))
    return COIN.state(q=q, contact=way * rng.uniform(-1.0, 1.0, (n, 2)))


def driven(y, actions):
    """Poses (place, attitude) of one coin after all actions, each an exact arc."""
    place, q = y[4:6], y[:4]
    heading, phase = COIN.heading(y), COIN.phase(y)
    for roll, steer in actions * SIZES:
        rates = {"psi_rate": roll, "phi_rate": steer, "phi": heading, "psi": phase}
        arc = roll_coin(1.0, radius=COIN.radius, place=place, **rates)
        place, q, heading, phase = arc.place, arc.attitude, heading + steer, phase + roll
    return place, q


@pytest.mark.parametrize("way", [0.0, 1e-6, 1.0, 30.0])
def test_two_rolls_lead_from_any_pose_to_any_other(way):
    start, goal = poses(0, 20, way), poses(1, 20, way)
    plan = PLANNER(start, goal)
    for k in range(20):
        place, q = driven(start[k], plan.actions[:, k])
        np.testing.assert_allclose(place, goal[k, 4:6], rtol=0, atol=10 * EXACT)
        assert rotations.distance(q, goal[k, :4]) < 10 * EXACT


def test_the_goal_is_home_if_none_is_given():
    y = poses(2, 5, 1.0)
    np.testing.assert_array_equal(PLANNER(y).actions, PLANNER(y, HOME).actions)


def test_legs_are_taken_in_steps_of_the_largest_size_or_less():
    plan = PLANNER(poses(3, 50, 2.0))
    assert np.max(np.abs(plan.actions)) <= 1.0
    assert not (plan.actions[..., 0] * plan.actions[..., 1]).any()
    moves = (plan.actions != 0.0).any(axis=-1)
    np.testing.assert_array_equal(np.sum(moves, axis=0), plan.steps)
    # the fewest steps of which each leg can be made up
    sizes = np.array([SIZES[1], SIZES[0], SIZES[1], SIZES[0], SIZES[1]])
    assert (np.sum(np.abs(plan.legs) / sizes, axis=1) <= plan.steps).all()
    assert (np.sum(np.abs(plan.legs) / sizes, axis=1) > plan.steps - 5).all()
    assert PLANNER(COIN.state(q=COIN.attitude(0.0, -1.5), contact=[0.6, 0.0])).steps == 5  # whole


def test_no_plan_is_shorter_than_distance_and_phase_ask_for():
    y = poses(4, 100, 2.0)
    bound = np.maximum(np.hypot(y[:, 4], y[:, 5]), COIN.radius * np.abs(COIN.phase(y)))
    length = PLANNER(y).length
    assert (length > bound - EXACT).all()
    assert np.mean(length / bound) < 1.5


def test_no_first_heading_and_no_number_of_turns_nearby_takes_fewer_steps_or_as_many_on_less_way():
    """All plans of two rolls whose sum is next to the distance, its opposite or 0, on either side.

    With rolls a and b from the offset D in directions u_1 and u_2: a u_1 + b u_2 = D, a + b = S, so
    |D - a u_1| = |S - a|, which is linear in a.
    """
    # two more of which only a sum beyond the distance is good, and the phase is almost half a turn
    extreme = COIN.state(q=COIN.attitude(0.0, [3.05, -3.05]), contact=[[3.686, 0.0], [-3.686, 0.0]])
    y = np.concatenate([poses(44, 30, 8.0), extreme])
    plan = PLANNER(y)
    for k in range(32):
        D, phase, heading = y[k, 4:6] / COIN.radius, COIN.phase(y[k]), COIN.heading(y[k])
        sums = 2.0 * np.pi * np.arange(-15, 16) - phase
        distance = np.hypot(*D)
        nearby = {-phase}
        for target in (distance, -distance):
            nearby |= {sums[sums >= target].min(), sums[sums <= target].max()}
        for S in nearby:
            first = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
            u = np.stack([np.cos(first), np.sin(first)])
            a = 0.5 * (S**2 - distance**2) / (S - D @ u)
            rest = D[:, None] - a * u
            b = S - a
            second = np.arctan2(np.sign(b) * rest[1], np.sign(b) * rest[0])
            turns = [first - heading, second - first, -second]
            turns = [np.abs((turn + np.pi) % (2.0 * np.pi) - np.pi) for turn in turns]
            # a part of a step that is rounding counts as none, as in the plan
            steps = sum(np.ceil(turn / SIZES[1] - 1e-9) for turn in turns)
            steps += sum(np.ceil(np.abs(roll) / SIZES[0] - 1e-9) for roll in (a, b))
            assert plan.steps[k] <= steps.min()
            way = COIN.radius * (np.abs(a) + np.abs(b))[steps == plan.steps[k]]
            assert (plan.length[k] <= way + EXACT).all()


@pytest.mark.parametrize(
    ("pose", "legs"),
    [
        ((0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0)),
        ((0.0, 0.0, 1.0, 0.0), (-1.0, 0.0, 0.0, 0.0, 0.0)),
        ((0.8, 0.0, 0.0, -2.0), (0.0, 2.0, 0.0, 0.0, 0.0)),
        ((-0.8, 0.0, 0.0, 2.0), (0.0, -2.0, 0.0, 0.0, 0.0)),
    ],
    ids=["there already", "a turn", "forward", "backward"],
)
def test_where_a_turn_or_a_roll_is_enough_it_is_the_plan(pose, legs):
    x, y, heading, phase = pose
    start = COIN.state(q=COIN.attitude(heading, phase), contact=[x, y])
    found = PLANNER(start).legs
    np.testing.assert_allclose(found[[1, 3]].sum(), legs[1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(np.abs(found).sum(), np.abs(legs).sum(), rtol=0, atol=1e-9)


def test_where_turns_take_a_step_the_coin_rolls_forth_and_back_along_a_straight_line():
    start = COIN.state(q=COIN.attitude(0.0, 0.0), contact=[0.64, 0.48])
    assert TwoRolls(COIN, 0.3, 7.0, directions=1)(start).length == pytest.approx(0.8, rel=1e-12)


def test_plans_do_not_depend_on_where_the_goal_is_or_how_it_is_turned():
    """The same way in another frame: turned by 0.7, shifted, phase shifted."""
    start, goal = poses(5, 30, 2.0), poses(6, 30, 2.0)
    c, s = np.cos(0.7), np.sin(0.7)
    moved = []
    for y in (start, goal):
        q = COIN.attitude(COIN.heading(y) + 0.7, COIN.phase(y) + 0.2)
        place = y[:, 4:6] @ np.array([[c, s], [-s, c]]) + [3.0, -1.0]
        moved.append(COIN.state(q=q, contact=place))
    before, after = PLANNER(start, goal), PLANNER(*moved)
    np.testing.assert_allclose(after.length, before.length, rtol=1e-9)
    np.testing.assert_array_equal(after.steps, before.steps)


def test_each_row_of_a_batch_is_planned_as_alone():
    y = poses(7, 6, 2.0).reshape(2, 3, 8)
    plan = PLANNER(y)
    for row in np.ndindex(2, 3):
        alone = PLANNER(y[row])
        np.testing.assert_array_equal(plan.actions[: len(alone.actions), *row], alone.actions)
        assert plan.length[row] == alone.length
        assert plan.steps[row] == alone.steps


UNIT_COIN = UprightCoin()


def test_two_straight_rolls_park_the_coin_from_every_start():
    found = run("CoinPark", bound(two_rolls))
    assert found.success.all()
    assert found.steps.mean() < 17.0
    # hardly longer than the bound; what is saved at the end is within the tolerance
    shortest = CoinPark().lower_bound(found.y[0])
    assert (found.cost >= shortest - 0.15).all()
    assert found.cost.mean() < 1.15 * shortest.mean()


def directions(scale):
    """Where a fixed loop of steps leads, all of them scaled: heading, phase, side, mismatch."""
    loop = np.random.default_rng(2).uniform(-1.0, 1.0, (12, 2))
    y = UNIT_COIN.state(q=UNIT_COIN.attitude(0.0, 0.0))
    for roll, steer in scale * loop:
        y[6:] = steer, roll
        y = UNIT_COIN.advance(y, None, 0.1)
    x, side = y[4:6]
    phase = UNIT_COIN.phase(y)
    return np.abs([UNIT_COIN.heading(y), phase, side, x + phase])


def test_directions_are_of_the_orders_1_1_2_and_3_by_which_the_cost_weighs_them():
    wide, narrow = directions(0.2), directions(0.1)
    # the next order is smaller by the square of the largest heading, some 0.05 rad
    np.testing.assert_allclose(np.log2(wide / narrow), [1.0, 1.0, 2.0, 3.0], atol=0.01)
