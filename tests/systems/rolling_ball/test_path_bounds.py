"""Proofs that no path is shorter, against elasticae that were computed by other means."""

import itertools
import math
import sys

import numpy as np
import pytest
from scipy.special import ellipj, ellipkinc

from rigid_envs.engine.compiler import cache_directory
from rigid_envs.mechanics import rotations
from rigid_envs.scores.best import PLANS_FOLDER
from rigid_envs.scores.finding import stored_plans
from rigid_envs.scores.optima import SHARE, proven, stored_optima
from rigid_envs.scores.starts import N_STARTS, evaluation_seeds, registered_rows
from rigid_envs.systems.rolling_ball import (
    controllers,
    covering,
    elastica,
    nearby,
    path_bounds,
    strips,
)
from rigid_envs.systems.rolling_ball.least_path import least_path
from rigid_envs.systems.rolling_ball.path_bounds import numbers_of, room_for
from tests.kernels.fingerprint import foreign_symbols

IDS = [f"RigidEnvs/{n}-v0" for n in ("BallPark", "BallParkGoal", "BallParkRandom", "BallReorient")]
NO_GUESS = np.empty((0, 5))
EDGE = 0.1, 0.15  # largest distance [radii] and angle [rad] of the set
MIDDLE = 3.0
FAMILIES = [False, True]


def pose(swings, rho, sigma, eps, length):
    """Where an elastica from the corner of the set leads, by Jacobi's functions and `elastica`."""
    m = (1.0 - eps) ** 2 if swings else 1.0 - eps
    sn, cn, dn, am = ellipj(sigma - rho * MIDDLE, m)
    heading = 2.0 * math.asin(math.sqrt(m) * sn) if swings else 2.0 * am
    rate = 2.0 * rho * (math.sqrt(m) * cn if swings else dn)
    force = rho**2 * (1.0 if swings else m) * np.array([math.cos(heading), -math.sin(heading)])
    ends = np.empty((2, 8))
    row = np.array([0.0, rate * length, *force * length**2, length])
    elastica.trace(row, math.ceil(400 * (1.0 + rho) * length), ends)
    return carried(force, rate, ends[1])


def carried(force, rate, end):
    """The end of a path from the origin, carried to the corner where it leaves the set."""
    moment = np.array([force[1], 1.0 - force[0], -rate])
    corner = rotations.exp(EDGE[1] * moment / np.linalg.norm(moment))
    place = EDGE[0] * force / np.linalg.norm(force) + end[6:]
    return np.concatenate([rotations.multiply(end[2:6], corner), place])


def poses_of(targets, limits, middle=MIDDLE, edge=EDGE):
    radii = np.full(len(targets), edge[0])
    bends = np.full(len(targets), 0.01)
    return covering.Poses(numbers_of(targets), radii, limits, bends, edge[1], middle)


def may_be_met(swings, low, high, targets, limit):
    """Which poses the elasticae of a box may meet, as far as the proof sees."""
    left = np.zeros(len(targets), dtype=bool)
    poses = poses_of(targets, np.full(len(targets), limit))
    low, high = np.array(low), np.array(high)
    covering.leftover(swings, low, high, poses, np.arange(len(targets)), 10**6, room_for(), left)
    return left


def samples(swings, n, seed=0):
    """Random elasticae (rho, sigma, eps), and lengths, of all kinds of both families."""
    rng = np.random.default_rng([seed, swings])
    for _ in range(n):
        eps = 10.0 ** rng.uniform(-4.0, -0.05)
        quarter = nearby.quarter_period(swings, eps)
        yield (rng.uniform(0.3, 4.0), rng.uniform(-1.0, 1.0) * quarter, eps), rng.uniform(2.0, 6.0)


@pytest.mark.parametrize("swings", FAMILIES)
def test_motions_are_jacobis_functions(swings):
    """Long times, by many short ones."""
    table, nodes = np.zeros((2, nearby.N_LANDEN)), np.zeros((101, 7))
    cells = np.zeros((200, 3))
    for (_, t, eps), length in samples(swings, 50):
        nearby.neighbours(swings, eps, 0.0, t, 0.03 * length, 100, table, nodes, cells)
        k = 1.0 - eps if swings else math.sqrt(1.0 - eps)
        sn, cn, dn, am = ellipj(t + 0.03 * length * np.arange(101), k * k)
        angle, rate = (2.0 * np.arcsin(k * sn), 2.0 * k * cn) if swings else (2.0 * am, 2.0 * dn)
        np.testing.assert_allclose(nodes[:, nearby.THETA], angle, atol=1e-8)
        np.testing.assert_allclose(nodes[:, nearby.RATE], rate, atol=1e-8)


@pytest.mark.long
@pytest.mark.parametrize("swings", FAMILIES)
@pytest.mark.parametrize("n", [10, 200])
def test_no_elastica_of_a_box_is_overlooked(swings, n):
    """Boxes of all sizes around elasticae: where these lead is never excluded.

    Halved to the end, a box is a point: so this is also a test of the middle of a box.
    """
    rng = np.random.default_rng(1)
    for (rho, sigma, eps), length in samples(swings, n):
        size = 10.0 ** rng.uniform(-3.0, -1.0)
        low = rho - size * rng.random(), sigma - size * rng.random(), eps * (1.0 - size)
        high = rho + size * rng.random(), sigma + size * rng.random(), min(1.0, eps * (1.0 + size))
        target = pose(swings, rho, sigma, eps, length)
        assert may_be_met(swings, low, high, target[None], length + 1e-6)[0], (rho, sigma, eps)


@pytest.mark.skipif(sys.platform != "linux", reason="reads ELF objects")
def test_the_search_calls_no_mathematics_library():
    may_be_met(True, (1.0, 0.0, 0.5), (1.0, 0.0, 0.5), np.eye(1, 6), 1.0)
    folder = cache_directory()
    if folder is None:
        pytest.skip("compiled code is not kept on this machine")
    name = "rigid_envs.systems.rolling_ball.covering.leftover"
    assert any(path.name.startswith(name) for path in folder.rglob("*.nbc"))
    assert foreign_symbols(folder, (name,)) <= {"fma"}


@pytest.mark.parametrize("swings", FAMILIES)
def test_mirror_images_and_turned_poses_are_met_too(swings):
    for (rho, sigma, eps), length in samples(swings, 5, seed=1):
        low, high = (rho, sigma, eps), (rho + 1e-3, sigma + 1e-3, eps * 1.001)
        w, x, y, z, place_x, place_y = pose(swings, rho, sigma, eps, length)
        mirrored = np.array([w, -x, y, -z, place_x, -place_y])
        turn = rotations.exp([0.0, 0.0, 1.0])
        c, s = math.cos(1.0), math.sin(1.0)
        q = rotations.multiply(turn, rotations.multiply([w, x, y, z], rotations.conjugate(turn)))
        turned = np.array([*-q, c * place_x - s * place_y, s * place_x + c * place_y])
        assert may_be_met(swings, low, high, np.stack([mirrored, turned]), length).all()


@pytest.mark.parametrize("swings", FAMILIES)
def test_poses_beside_an_elastica_are_excluded(swings):
    """By a fifth of the tolerances, in a direction drawn at random: nearly all."""
    rng = np.random.default_rng(2)
    left = []
    for (rho, sigma, eps), length in samples(swings, 20, seed=2):
        low, high = (rho, sigma, eps), (rho + 1e-4, sigma + 1e-4, eps * 1.0001)
        target = pose(swings, rho, sigma, eps, length)
        beside = rng.normal(size=5)
        beside *= 0.03 / np.linalg.norm(beside)
        target[:4] = rotations.multiply(rotations.exp(beside[:3]), target[:4])
        target[4:] += beside[3:]
        left.append(may_be_met(swings, low, high, target[None], length)[0])
    assert np.mean(left) < 0.3


@pytest.mark.parametrize("swings", FAMILIES)
def test_no_elastica_of_a_strip_is_overlooked(swings):
    rng = np.random.default_rng(3)
    out = np.zeros(1, dtype=bool)
    for (rho, sigma, eps), length in samples(swings, 100):
        rho *= 2.0
        target = pose(swings, rho, sigma, eps, length)[None]
        share = rng.uniform(0.0, 0.5, 2)
        tile = eps * (1.0 - share[0]), min(1.0, eps * (1.0 + share[1]))
        strips.are_out_of_reach(
            *(swings, rho * rng.uniform(0.7, 1.0), tile, target, np.array([EDGE[0]]), EDGE[1]),
            *(np.array([length]), out),
        )
        assert not out[0], (rho, sigma, eps)


def test_most_poses_are_out_of_reach_of_narrow_strips():
    rng = np.random.default_rng(4)
    q = rng.normal(size=(100, 4))
    targets = np.concatenate(
        [q / np.linalg.norm(q, axis=-1, keepdims=True), rng.uniform(-3.0, 3.0, (100, 2))], axis=-1
    )
    out, limits = np.zeros(100, dtype=bool), np.full(100, 6.0)
    for swings, eps in itertools.product(FAMILIES, [(0.0, 0.01), (0.2, 0.4)]):
        strips.are_out_of_reach(
            swings, 6.0, eps, targets, np.full(100, EDGE[0]), EDGE[1], limits, out
        )
        assert out.mean() > 0.9


def test_straight_rolls_are_not_overlooked():
    out = np.zeros(1, dtype=bool)
    for way, bend in itertools.product([0.5, 3.0, 6.0], [0.0, 0.1]):
        q = rotations.multiply(rotations.exp([0.0, 0.1, bend]), rotations.exp([0.0, way, 0.0]))
        target = np.array([[*q, way + 0.09, bend]])
        arguments = target, np.array([EDGE[0]]), EDGE[1], np.array([6.1]), out
        strips.are_beside_straight_rolls(1.2 * bend + 1e-6, *arguments)
        assert not out[0]


def numbers(x, middle):
    """(swings, rho, sigma, eps) of a row of `elastica`, and whether its mirror image has them."""
    length = x[4]
    ends = np.empty((2, 8))
    part = middle / length
    row = np.array([0.0, x[1] * part, *x[2:4] * part**2, middle])
    elastica.trace(row, 4000, ends)
    force = np.hypot(*x[2:4]) / length**2
    heading = ends[1, 0] - math.atan2(x[3], x[2])
    rate = ends[1, 1] / middle
    mirrored = rate < 0.0
    if mirrored:
        heading, rate = -heading, -rate
    heading -= 2.0 * math.pi * round(heading / (2.0 * math.pi))
    energy = 0.5 * rate**2 - force * math.cos(heading)
    if energy < force:
        rho, k = math.sqrt(force), math.sqrt(0.5 * (1.0 + energy / force))
        angle = math.asin(max(-1.0, min(1.0, math.sin(0.5 * heading) / k)))
        return True, (rho, float(ellipkinc(angle, k**2)), 1.0 - k)
    rho = math.sqrt(0.5 * (energy + force))
    return False, (rho, float(ellipkinc(0.5 * heading, force / rho**2)), 1.0 - force / rho**2)


@pytest.mark.parametrize("env_id", IDS)
def test_elasticae_that_were_found_to_lead_to_starts_are_not_excluded(env_id):
    """The corner, signs and gauges of the proof are those of what the search found."""
    n = 20
    envs = registered_rows(env_id, n, {})
    envs.reset(seed=evaluation_seeds(n))
    goals = envs.auxiliary(*envs.task.aux_names) if envs.task.n_goal else np.eye(1, 6)
    radii = np.array([ball.radius for ball in envs.systems])
    targets = np.concatenate(controllers.difference(goals, envs.y[:, :6], radii), axis=-1)
    plans = envs.task.roll_per_step * stored_plans(env_id, n, PLANS_FOLDER)
    found = 0
    for k, target in enumerate(targets):
        edge = envs.task.position_tolerance / radii[k], envs.task.angle_tolerance
        x = least_path(target, edge, NO_GUESS, plans[:, k])
        if not (math.isfinite(x[4]) and np.hypot(*x[2:4]) > 1e-6):
            continue  # a straight roll, or an arc
        middle = 0.5 * x[4]
        swings, point = numbers(x, middle)
        low = np.array(point) * [1.0, 1.0, 1.0 - 1e-3] - [1e-3, 1e-3, 0.0]
        high = np.array(point) * [1.0, 1.0, 1.0 + 1e-3] + [1e-3, 1e-3, 0.0]
        left = np.zeros(1, dtype=bool)
        for length, expected in ((1.0001 * x[4], True), (0.97 * x[4], False)):
            left[:] = False
            poses = poses_of(target[None], np.array([length]), middle, edge)
            covering.leftover(swings, low, high, poses, np.arange(1), 10**6, room_for(), left)
            assert left[0] == expected
        found += 1
    assert found >= 15


def prove(env_id, share, starts):
    """Whether shares of the optima of some starts are proven."""
    shares = np.zeros(N_STARTS)  # of the others, a length of 0 is proven at once
    shares[starts] = share
    return proven(env_id, shares)[starts] > 0.0


@pytest.mark.long
@pytest.mark.push
def test_a_bound_is_proven_and_more_than_the_optimum_is_not():
    assert prove(IDS[0], SHARE, [113]).all()
    assert not prove(IDS[0], 1.002, [113]).any()


def test_a_search_of_too_many_boxes_proves_nothing(monkeypatch):
    monkeypatch.setattr(path_bounds, "_MOST", 100)
    assert not prove(IDS[0], SHARE, [113]).any()


@pytest.mark.long
@pytest.mark.parametrize("env_id", IDS)
def test_bounds_are_proven_again(env_id):
    starts = np.arange(8)
    expected = stored_optima(env_id).proven[starts] > 0.0
    np.testing.assert_array_equal(prove(env_id, SHARE, starts), expected)
