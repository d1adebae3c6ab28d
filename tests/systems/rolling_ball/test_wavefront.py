"""Least lengths from a pose into a set of poses, against closed forms and other methods."""

import numpy as np
import pytest
from scipy.optimize import minimize

from rigid_envs.mechanics import rotations
from rigid_envs.scores.best import best_known
from rigid_envs.scores.optima import computed, numerical_optima
from rigid_envs.scores.proof import bounds_of
from rigid_envs.scores.starts import TEST_SEED
from rigid_envs.systems.rolling_ball import controllers
from rigid_envs.systems.rolling_ball.shortest_path import shortest_path
from rigid_envs.systems.rolling_ball.wavefront import Wavefront, least_lengths

IDS = [f"RigidEnvs/{n}-v0" for n in ("BallPark", "BallParkGoal", "BallParkRandom", "BallReorient")]
STORED = [env_id for env_id in IDS if numerical_optima(env_id) is not None]
HOME = np.eye(1, 6)[0]
N_RAYS = 20_000


@pytest.fixture(scope="module")
def front():
    return Wavefront(0.1, 0.15, N_RAYS)


def random_targets(n, seed=0):
    rng = np.random.default_rng(seed)
    q = rng.normal(size=(n, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    return np.concatenate([q, rng.uniform(-2.0, 2.0, (n, 2))], axis=1)


def along(x):
    """Pose after a straight roll from home."""
    return np.array([np.cos(0.5 * x), 0.0, np.sin(0.5 * x), 0.0, x, 0.0])


@pytest.mark.parametrize("way", [0.5, 2.0, 2.0 * np.pi])
@pytest.mark.parametrize(("place", "angle"), [(0.1, 0.15), (0.3, 0.35)])
def test_a_straight_roll_ends_at_the_edge(front, way, place, angle):
    assert front.least_length(along(way), place, angle) == pytest.approx(way - place, rel=1e-12)


@pytest.mark.parametrize("way", [0.5, 2.0])
def test_where_the_angle_alone_matters_the_roll_ends_at_its_edge(front, way):
    """The force of the costate is 0; its smoothing at the edge leaves 1e-6."""
    assert front.least_length(along(way), 0.3, 0.1) == pytest.approx(way - 0.1, abs=1e-5)


def test_within_the_set_nothing_is_rolled(front):
    assert front.least_length(along(0.09), 0.1, 0.15) == 0.0


def test_without_tolerance_it_is_the_shortest_path(front):
    for target in random_targets(5):
        found = front.least_length(target, 1e-7, 1e-7)
        assert found == pytest.approx(shortest_path(HOME, target).length, abs=1e-5)


def test_to_first_order_a_tolerance_saves_its_product_with_the_costate(front):
    """The costate at the goal is the gradient of the length."""
    place, angle = 2e-4, 3e-4
    for target in random_targets(5, seed=1):
        path = shortest_path(target, HOME)
        force = path.pull
        end = path.headings(1)[-1]
        turning = path._trace(1)[-1, 1] / path.length
        moment = [force[1] - np.sin(end), np.cos(end) - force[0], -turning]
        saved = path.length - front.least_length(target, place, angle)
        expected = place * np.linalg.norm(force) + angle * np.linalg.norm(moment)
        assert saved == pytest.approx(expected, rel=5e-3)


def test_larger_sets_are_nearer(front):
    for target in random_targets(5, seed=2):
        lengths = [front.least_length(target, k * 0.05, k * 0.07) for k in (0.5, 1.0, 2.0, 4.0)]
        assert (np.diff(lengths) < 0.0).all()


def test_lengths_scale_with_the_radius():
    starts = random_targets(3, seed=3)
    goals, radii = np.tile(HOME, (3, 1)), np.ones(3)
    one = least_lengths(starts, goals, radii, 0.1, 0.15, N_RAYS)
    starts[:, 4:] *= 2.0
    two = least_lengths(starts, goals, 2.0 * radii, 0.2, 0.15, N_RAYS)
    np.testing.assert_allclose(two, 2.0 * one, rtol=1e-12)


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


def test_polygons_that_are_optimised_come_near_from_above(front):
    for target in random_targets(3, seed=4):
        guess = shortest_path(target, HOME).rolls(60)
        found = polygon_length(target, 0.1, 0.15, guess)
        assert 1.0 <= found / front.least_length(target, 0.1, 0.15) < 1.003


@pytest.mark.parametrize("env_id", STORED)
def test_nobody_is_known_to_beat_a_numerical_optimum(env_id):
    optima, costs = numerical_optima(env_id), best_known(env_id).costs
    assert (costs >= optima * (1.0 - 1e-9)).all()


@pytest.mark.parametrize("env_id", STORED)
def test_a_numerical_optimum_is_not_below_what_theory_proves(env_id):
    bounds = bounds_of(env_id, len(numerical_optima(env_id)), TEST_SEED, {})
    assert (numerical_optima(env_id) >= bounds * (1.0 - 1e-9)).all()


@pytest.mark.long
@pytest.mark.parametrize("env_id", STORED)
def test_numerical_optima_are_those_of_the_search(env_id):
    np.testing.assert_allclose(computed(env_id, 20), numerical_optima(env_id)[:20], rtol=1e-9)
