"""BallSteer: a reference that can be followed exactly, along elasticae."""

import numpy as np
import pytest
from scipy.special import ellipe, ellipj, ellipk

from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball.controllers import elastica_headings
from rigid_envs.systems.rolling_ball.references import damped, far_sighted
from rigid_envs.systems.rolling_ball.tasks.ball_steer import _EIGHT, _MODULI
from tests.tasks.runs import at_random, bound, run, still

N = 200
PATHS = ("eight", "elastica", "both")


def rows(n, **config):
    envs = RigidVectorEnv("rigid_envs.tasks:BallSteer", n, **config)  # without a time limit
    return envs, envs.reset(seed=0)[0]


def aux(envs):
    return envs.get_state()["aux"]


def error(rewards):
    """Pose error of each row, from its reward 1 / (1 + 5 error)."""
    return (1.0 / rewards - 1.0) / 5.0


def copy(envs):
    """The action of the reference alone."""
    return envs.task.reference_speed * aux(envs)[:, 6:8]


@pytest.mark.parametrize("path", PATHS)
def test_going_down_the_slope_of_the_error_keeps_up_with_the_reference(path):
    # a few in a thousand begin so far off that their mean error is beyond the bound
    assert np.mean(run("BallSteer", bound(damped), 1000, path=path).success) > 0.99


@pytest.mark.parametrize("path", PATHS)
def test_whoever_knows_the_path_ahead_keeps_up_from_every_start_and_closer(path):
    found = run("BallSteer", bound(far_sighted), N, path=path)
    assert found.success.all()
    assert np.mean(found.reward) > 1.1 * np.mean(
        run("BallSteer", bound(damped), N, path=path).reward
    )


@pytest.mark.parametrize("path", PATHS)
def test_the_headings_that_are_looked_ahead_at_are_those_that_come(path):
    envs, _ = rows(20, path=path, radius=0.7)
    start, way = aux(envs), envs.task.reference_speed * envs.task.roll_per_step * 0.7
    ahead = elastica_headings(start[:, 6:8], start[:, 8], start[:, 9:11], way, 100)
    for heading in ahead:
        # roundings of 100 turns, and of sines that are not NumPy's
        np.testing.assert_allclose(aux(envs)[:, 6:8], heading, rtol=0, atol=1e-12)
        envs.step(np.zeros((20, 2), dtype=np.float32))


@pytest.mark.parametrize("policy", [still, at_random(), copy])
@pytest.mark.parametrize("path", PATHS)
def test_without_correction_no_ball_keeps_up(path, policy):
    assert not run("BallSteer", policy, N, path=path).success.any()


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("n_substeps", [1, 3])
def test_whoever_copies_the_reference_from_no_offset_stays_at_none(path, n_substeps):
    config = {"path": path, "start_offset": 0.0, "start_angle": 0.0, "n_substeps": n_substeps}
    envs, seen = rows(N, **config)
    for _ in range(300):
        seen, rewards, *_, infos = envs.step(seen[:, 5:7])
        assert infos["is_success"].all()
    away = envs.y - aux(envs)[:, :6]
    # the same operations on the same numbers; in parts of a step the sums are rounded differently:
    # 900 roundings of positions up to 30 and of attitudes
    assert np.max(np.abs(away)) <= (0.0 if n_substeps == 1 else 900 * 2.0**-53 * 30)
    # the reward tells the error to rounding: 1 + 5 error is rounded at 1
    assert np.max(error(rewards)) < (4e-16 if n_substeps == 1 else 1e-11)


def test_the_reference_rolls_without_slipping():
    envs, _ = rows(1, radius=0.7)
    places, turn = [aux(envs)[0, 4:6]], aux(envs)[0, :4]
    for _ in range(100):
        envs.step(np.zeros((1, 2), dtype=np.float32))
        places.append(aux(envs)[0, 4:6])
    rolled = rolling_ball.roll_polygon(np.diff(places, axis=0), 0.7)
    expected = rotations.multiply(rolled, turn)
    # 100 rolls, each rounded in the differences of places up to 10 radii
    assert rotations.distance(aux(envs)[0, :4], expected) < 100 * 10 * 2.3e-16
    speed = np.linalg.norm(np.diff(places, axis=0), axis=1) / envs.task.dt
    # directions are rounded to float32, by 3e-8 of the largest speed in each component
    np.testing.assert_allclose(speed, 0.5 * np.pi / 8 / 0.1 * 0.7, rtol=1e-7)


def way_along(n, step, **config):
    """Way [radii], heading and curvature [1/radius] of references, in steps of this roll [rad]."""
    envs, _ = rows(50, reference_speed=0.5, roll_per_step=2.0 * step, radius=0.7, **config)
    found = [aux(envs)]
    for _ in range(n):
        envs.step(np.zeros((50, 2), dtype=np.float32))
        found.append(aux(envs))
    return step * np.arange(n + 1), np.stack(found)


def off_the_pendulum(n, step, **config):
    """How far curvatures and headings are from the closed form, largest over all rows."""
    way, found = way_along(n, step, **config)
    w, curvature = 0.6, 0.7 * found[..., 8]
    modulus = curvature[0] / (2.0 * w)
    waves = np.abs(modulus) < 1.0
    k = np.abs(modulus[waves])
    sn, cn, _, _ = ellipj(w * way[:, None], k**2)
    side = np.sign(modulus[waves])
    axis = found[0, waves, 6:8]
    heading = found[:, waves, 6:8]
    across = axis[:, 0] * heading[..., 1] - axis[:, 1] * heading[..., 0]
    # heading - axis = 2 arcsin(k sn): its sine is 2 k sn dn, and dn^2 = 1 - k^2 sn^2
    sine = 2.0 * side * k * sn * np.sqrt(1.0 - k**2 * sn**2)
    return max(
        np.max(np.abs(curvature[:, waves] - 2.0 * side * k * w * cn)), np.max(np.abs(across - sine))
    )


@pytest.mark.parametrize("path", ["eight", "elastica"])
def test_paths_tend_to_the_elasticae_of_the_closed_form_to_second_order(path):
    coarse, fine = off_the_pendulum(150, 0.1, path=path), off_the_pendulum(300, 0.05, path=path)
    assert fine < 0.05
    assert 3.8 < coarse / fine < 4.2


def test_curls_never_turn_back_and_waves_do():
    _, found = way_along(1000, 0.1, path="elastica")
    curvature = found[..., 8]
    curls = np.abs(curvature[0]) > 2.0 * 0.6 / 0.7
    turns_back = (np.sign(curvature) != np.sign(curvature[0])).any(axis=0)
    np.testing.assert_array_equal(turns_back, ~curls)
    assert 0 < np.sum(curls) < 50


def test_the_eight_closes():
    assert abs(ellipk(_EIGHT**2) - 2.0 * ellipe(_EIGHT**2)) < 1e-14
    gaps = []
    for n in (100, 200):
        step = 4.0 * ellipk(_EIGHT**2) / 0.6 / n
        _, found = way_along(n, step, path="eight")
        gaps.append(np.max(np.abs(found[-1, :, 4:6] - found[0, :, 4:6])) / 0.7)
    assert gaps[1] < 0.02  # of a path that is 15.5 radii long
    assert 3.8 < gaps[0] / gaps[1] < 4.2


def test_the_paths_are_those_that_were_chosen():
    moduli = {}
    for path in PATHS:
        envs, _ = rows(2000, path=path)
        moduli[path] = np.abs(aux(envs)[:, 8]) / (2.0 * 0.6)
    np.testing.assert_allclose(moduli["eight"], _EIGHT, rtol=1e-14)
    assert _MODULI[0] <= np.min(moduli["elastica"]) < 0.61
    assert 1.19 < np.max(moduli["elastica"]) <= _MODULI[1]
    share = np.mean(np.abs(moduli["both"] - _EIGHT) < 1e-14)
    assert abs(share - 0.5) < 4.0 * 0.5 / np.sqrt(2000)  # four standard deviations


def test_the_observed_error_is_that_of_the_pose():
    envs, seen = rows(N, radius=0.7)
    for _ in range(20):
        y, reference = envs.y, aux(envs)
        theta = rotations.log(rotations.multiply(y[:, :4], rotations.conjugate(reference[:, :4])))
        expected = np.concatenate([(y[:, 4:6] - reference[:, 4:6]) / 0.7, theta], axis=1)
        np.testing.assert_allclose(seen[:, :5], expected, rtol=1e-6, atol=1e-6)
        seen, rewards, *_ = envs.step(0.3 * seen[:, 5:7])
        now = np.linalg.norm(seen[:, :5].astype(float), axis=1)
        np.testing.assert_allclose(error(rewards), now, rtol=1e-5)


def test_success_is_a_mean_error_since_the_start_within_the_bound():
    envs, _ = rows(N)
    errors = []
    follow = bound(damped)
    for _ in range(100):
        _, rewards, *_, infos = envs.step(follow(envs).astype(np.float32))
        errors.append(error(rewards))
        mean = np.mean(errors, axis=0)
        clear = np.abs(mean - 0.3) > 1e-9
        np.testing.assert_array_equal(infos["is_success"][clear], (mean <= 0.3)[clear])
    assert 0 < np.sum(infos["is_success"]) < N
