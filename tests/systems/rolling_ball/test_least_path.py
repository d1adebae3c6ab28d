"""Shortest paths from a pose into a set of poses, against closed forms and other methods."""

from functools import partial

import numpy as np
import pytest
from scipy.optimize import minimize

from rigid_envs.envs.lookup import task_of
from rigid_envs.mechanics import rotations
from rigid_envs.scores.best import PLANS_FOLDER, best_known
from rigid_envs.scores.finding import stored_plans
from rigid_envs.scores.optima import searched, stored_optima
from rigid_envs.scores.proof import bounds_of
from rigid_envs.scores.starts import TEST_SEED
from rigid_envs.systems.rolling_ball import controllers, references
from rigid_envs.systems.rolling_ball.least_path import least_path, least_paths, rolls_along
from rigid_envs.systems.rolling_ball.shortest_path import shortest_path
from rigid_envs.systems.rolling_ball.wavefront import Wavefront

IDS = [f"RigidEnvs/{n}-v0" for n in ("BallPark", "BallParkGoal", "BallParkRandom", "BallReorient")]
HOME = np.eye(1, 6)[0]
NO_GUESS = np.empty((0, 5))
EDGE = 0.1, 0.15
N_RAYS = 4000


@pytest.fixture(scope="module")
def front():
    return Wavefront(*EDGE, N_RAYS)


def random_targets(n, seed=0):
    rng = np.random.default_rng(seed)
    q = rng.normal(size=(n, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    return np.concatenate([q, rng.uniform(-2.0, 2.0, (n, 2))], axis=1)


def along(x):
    """Pose after a straight roll from home."""
    return np.array([np.cos(0.5 * x), 0.0, np.sin(0.5 * x), 0.0, x, 0.0])


def ends_at(x, target, n=500):
    """Distance and angle to the middle of the set at the end of many chords of a path."""
    rolls = rolls_along(x, n)
    turn, _ = controllers.rolled(rolls)
    offset = target[4:] + rolls.sum(axis=0)
    angle = rotations.angle(rotations.multiply(turn, target[:4]))
    return np.hypot(*offset), min(angle, 2.0 * np.pi - angle)


@pytest.mark.parametrize("way", [0.5, 2.0, 2.0 * np.pi])
@pytest.mark.parametrize("edge", [EDGE, (0.3, 0.3), (0.3, 0.35)])
def test_a_straight_roll_ends_at_the_edge_of_the_disk(way, edge):
    assert least_path(along(way), edge, NO_GUESS)[4] == pytest.approx(way - edge[0], rel=1e-12)


@pytest.mark.parametrize("way", [0.5, 2.0])
def test_where_the_angle_alone_matters_the_roll_ends_at_its_edge(way):
    assert least_path(along(way), (0.3, 0.1), NO_GUESS)[4] == pytest.approx(way - 0.1, rel=1e-12)


def test_within_the_set_nothing_is_rolled():
    assert least_path(along(0.09), EDGE, NO_GUESS)[4] == 0.0


@pytest.mark.parametrize(("slope", "length"), [(0.3, 1.0), (-1.2, 2.5), (2.0, 0.7), (-0.4, 6.0)])
def test_an_arc_is_found_where_it_leads(slope, length):
    """From the edge of the angle, about the axis of the arc, and from anywhere within the disk."""
    s = np.linspace(0.0, length, 501)
    a = 0.7 + slope * 0.5 * (s[1:] + s[:-1])
    turn, _ = controllers.rolled(length / 500 * np.stack([np.cos(a), np.sin(a)], axis=-1))
    axis = np.array([-np.sin(0.7), np.cos(0.7), -slope]) / np.hypot(1.0, slope)
    q = rotations.multiply(turn, rotations.exp(EDGE[1] * axis))
    end = length / 500 * np.array([np.cos(a).sum(), np.sin(a).sum()]) + [0.03, -0.05]
    target = np.array([*q, *end])
    found = least_path(target, EDGE, NO_GUESS)
    # polygons of 500 sides are as exact as (length slope / 500)^2
    assert found[4] <= length + 5e-5
    distance, angle = ends_at(found, target)
    assert distance <= EDGE[0] + 5e-5 and angle <= EDGE[1] + 5e-5
    if length < 3.0:
        np.testing.assert_allclose(found, [0.7, slope * length, 0.0, 0.0, length], atol=2e-4)


def test_paths_end_at_the_edge(front):
    for target in random_targets(3, seed=5):
        np.testing.assert_allclose(
            ends_at(least_path(target, EDGE, front.passing(target)), target), EDGE, atol=5e-5
        )


def test_without_tolerance_it_is_the_shortest_path(front):
    for target in random_targets(3):
        found = least_path(target, (1e-7, 1e-7), front.passing(target))[4]
        assert found == pytest.approx(shortest_path(HOME, target).length, abs=1e-6)


def test_to_first_order_a_tolerance_saves_its_product_with_the_costate(front):
    """The costate at the goal is the gradient of the length."""
    place, angle = 2e-4, 3e-4
    for target in random_targets(3, seed=1):
        path = shortest_path(target, HOME)
        force = path.pull
        end = path.headings(1)[-1]
        turning = path._trace(1)[-1, 1] / path.length
        moment = [force[1] - np.sin(end), np.cos(end) - force[0], -turning]
        saved = path.length - least_path(target, (place, angle), front.passing(target))[4]
        expected = place * np.linalg.norm(force) + angle * np.linalg.norm(moment)
        assert saved == pytest.approx(expected, rel=5e-3)


def test_larger_sets_are_nearer(front):
    for target in random_targets(3, seed=2):
        edges = [(k * 0.05, k * 0.07) for k in (0.5, 1.0, 2.0, 4.0)]
        lengths = [least_path(target, edge, front.passing(target))[4] for edge in edges]
        assert (np.diff(lengths) < 0.0).all()


def test_lengths_are_in_radii():
    starts = random_targets(3, seed=3)
    goals, radii = np.tile(HOME, (3, 1)), np.ones(3)
    one = least_paths(starts, goals, radii, *EDGE, n_rays=N_RAYS)
    starts[:, 4:] *= 2.0
    two = least_paths(starts, goals, 2.0 * radii, 2.0 * EDGE[0], EDGE[1], n_rays=N_RAYS)
    np.testing.assert_allclose(two, one, rtol=1e-9)


def test_a_known_path_leads_to_the_shortest_one_near_it(front):
    """Without guesses, from the polygon of a longer path: that to the middle of the set."""
    for target in random_targets(3, seed=4):
        polygon = shortest_path(target, HOME).rolls(40)
        found = least_path(target, EDGE, NO_GUESS, polygon)[4]
        assert found == pytest.approx(least_path(target, EDGE, front.passing(target))[4], rel=1e-9)


def polygon_length(target, place, angle, guess):
    """Least length of polygons of equal sides, by sequential quadratic programming."""
    n = len(guess)

    def rolls(v):
        return v[-1] / n * np.stack([np.cos(v[:-1]), np.sin(v[:-1])], axis=-1)

    def room(v):
        turn, _ = controllers.rolled(rolls(v))
        left = rotations.log(rotations.multiply(turn, target[:4]))
        offset = target[4:] + rolls(v).sum(axis=0)
        return np.array([place**2 - offset @ offset, angle**2 - left @ left])

    first = np.append(np.unwrap(np.arctan2(guess[:, 1], guess[:, 0])), np.hypot(*guess.T).sum())
    found = minimize(
        lambda v: v[-1],
        first,
        jac=lambda v: np.eye(1, n + 1, n)[0],
        method="SLSQP",
        constraints={"type": "ineq", "fun": room},
        options={"maxiter": 300, "ftol": 1e-10},
    )
    assert (room(found.x) > -1e-8).all()
    return found.x[-1]


@pytest.mark.long
def test_polygons_that_are_optimised_come_near_from_above(front):
    for target in random_targets(2, seed=4):
        guess = shortest_path(target, HOME).rolls(40)
        found = polygon_length(target, *EDGE, guess)
        assert 1.0 <= found / least_path(target, EDGE, front.passing(target))[4] < 1.006


@pytest.mark.parametrize("env_id", IDS)
def test_nobody_is_known_to_beat_a_numerical_optimum(env_id):
    optima, costs = stored_optima(env_id).costs, best_known(env_id).costs
    assert (costs >= optima * (1.0 - 1e-6)).all()


@pytest.mark.parametrize("env_id", IDS)
def test_a_numerical_optimum_is_not_below_what_theory_proves(env_id):
    optima = stored_optima(env_id).costs
    bounds = bounds_of(env_id, len(optima), TEST_SEED, {})
    assert (optima >= bounds * (1.0 - 1e-9)).all()


def again(env_id, n, n_rays, monkeypatch):
    """Optima searched for anew, over those that are stored."""
    monkeypatch.setattr(references, "least_paths", partial(least_paths, n_rays=n_rays))
    found, actions = searched(env_id, stored_plans(env_id, n, PLANS_FOLDER))
    sizes = np.linalg.norm(actions, axis=-1)
    assert (sizes <= 1.0 + 1e-9).all()  # chords are not longer than the path
    assert (sizes.sum(axis=0) * task_of(env_id).roll_per_step > 0.0).all()
    return found / stored_optima(env_id).costs[:n]


@pytest.mark.parametrize("env_id", IDS[1:3])
def test_few_rays_find_most_of_the_numerical_optima_and_nothing_less(env_id, monkeypatch):
    found = again(env_id, 10, 1000, monkeypatch)
    assert (found >= 1.0 - 1e-9).all() and (found <= 1.0 + 1e-9).sum() >= 8


@pytest.mark.long
@pytest.mark.parametrize("env_id", IDS)
def test_numerical_optima_are_those_of_the_search(env_id, monkeypatch):
    np.testing.assert_allclose(again(env_id, 20, 200_000, monkeypatch), 1.0, rtol=1e-9)
