"""Balls that roll as they are told: parked, and led after a ball that rolls ahead."""

from functools import cache

import numpy as np
import pytest
from scipy.special import ellipe, ellipj, ellipk

from rigid_envs.envs.shells import RigidEnv, RigidGoalVectorEnv, RigidVectorEnv
from rigid_envs.mechanics import rotations
from rigid_envs.scores.policies import reference_controllers
from rigid_envs.systems.rolling_ball import closed_forms as rolling_ball
from rigid_envs.systems.rolling_ball import controllers, references
from rigid_envs.systems.rolling_ball.references import straight_rolls
from rigid_envs.systems.rolling_ball.system import RollingBall
from rigid_envs.systems.rolling_ball.tasks.ball_steer import _EIGHT
from tests.refusals import refuses
from tests.systems.runs import bound, rows, run

# Following a ball that rolls ahead: costs along closed loops, elasticae, and BallSteer.


BALL = RollingBall(0.7)
RATE = 4.0
SPEED = 0.5 * RATE * 0.7


def starts(n, offset, angle, seed=0):
    """Balls near the origin, and a reference there, upright."""
    rng = np.random.default_rng(seed)
    q = rotations.exp(angle * rng.uniform(-1.0, 1.0, (n, 3)))
    return BALL.state(q=q, position=offset * rng.uniform(-1.0, 1.0, (n, 2)))


def circle(n_steps, dt, n, curvature=1.0):
    """Velocities of a reference on a polygon round a circle, shape (n_steps, n, 2)."""
    heading = SPEED * dt * curvature * np.arange(n_steps)[:, None] + np.arange(n)
    return SPEED * np.stack([np.cos(heading), np.sin(heading)], axis=-1)


def rolled(y, velocity, dt):
    return BALL.advance(y, np.concatenate([velocity, 0.0 * velocity[..., :1]], axis=-1), dt)


def simulate_closed_loop(act, y, velocities, dt):
    """States of ball and reference, and actions, over all periods."""
    reference, found = np.broadcast_to(BALL.state(), y.shape), []
    for k, velocity in enumerate(velocities):
        action = act(k, y, reference, velocity)
        found.append((y, reference, action))
        y, reference = rolled(y, RATE * 0.7 * action, dt), rolled(reference, velocity, dt)
    return [np.stack(part) for part in zip(*found, strict=True)]


@pytest.fixture(scope="module")
def damped():
    follower, dt = controllers.DampedFollower(BALL, RATE), 0.01
    return follower, simulate_closed_loop(
        lambda k, *now: follower(*now), starts(50, 0.7, 0.8), circle(2000, dt, 50), dt
    )


def test_the_lyapunov_function_of_damping_does_not_grow(damped):
    follower, (y, reference, _) = damped
    V = follower.lyapunov(y, reference)
    # Held for dt, a correction w goes on after the slope has changed: by |w|^2 dt / 2 and the like.
    assert np.max(np.diff(V, axis=0)) < 1e-4 * np.max(V)
    assert np.max(V[-1]) < 1e-3 * np.max(V[0])


def test_it_falls_as_fast_as_its_equation_says(damped):
    follower, (y, reference, action) = damped
    V = follower.lyapunov(y, reference)
    relative = RATE * action - circle(2000, 0.01, 50) / 0.7
    free = np.linalg.norm(action, axis=-1) < 1.0 - 1e-6  # s = 1
    fall = np.sum(relative**2, axis=-1) / 0.6
    found = -np.diff(V, axis=0) / 0.01
    # of first order in dt, relative to the largest fall of V
    np.testing.assert_allclose(
        found[free[:-1]], fall[:-1][free[:-1]], rtol=0, atol=0.03 * np.max(fall)
    )


@pytest.mark.long
@pytest.mark.parametrize("curvature", [0.0, 1.0])
def test_along_a_straight_line_one_error_stays_and_bends_take_it_away(curvature):
    follower, dt, start = controllers.DampedFollower(BALL, RATE), 0.02, starts(20, 0.05, 0.05)
    way = circle(1500, dt, 20, curvature)
    y, reference, _ = simulate_closed_loop(lambda k, *now: follower(*now), start, way, dt)
    error = controllers.pose_error(BALL, y, reference)
    size = np.linalg.norm(error, axis=-1)
    across = np.stack([error[..., 3], -error[..., 2]], axis=-1) - error[..., :2]
    stays = np.sum(across * way / SPEED, axis=-1)
    if curvature == 0.0:  # to first order in the error
        assert (np.abs(stays[-1] - stays[0]) < size[0] ** 2).all()
        assert (np.abs(stays[0]) > 5.0 * size[0] ** 2).sum() > 5
    else:
        assert (size[-1] < 1e-3 * size[0]).all()


@pytest.fixture(scope="module")
def ahead():
    follower, velocities = controllers.FarSightedFollower(BALL, RATE, 0.1), circle(200, 0.1, 30)
    return follower, velocities, follower.regulator(velocities)


def test_the_riccati_value_is_the_cost_of_small_errors(ahead):
    follower, velocities, regulator = ahead
    size = 1e-4
    y, reference, action = simulate_closed_loop(
        lambda k, *now: follower(*now, regulator.gain[k]), starts(30, size, size), velocities, 0.1
    )
    error, w = controllers.pose_error(BALL, y, reference), RATE * action - velocities / 0.7
    cost = np.sum(error**2, axis=-1) + 0.03 * np.sum(w**2, axis=-1)
    to_go = np.cumsum(cost[::-1], axis=0)[::-1]
    value = np.einsum("...i,...ij,...j", error, regulator.riccati, error)
    # the linearised error is off by its square, in parts of itself; at the end rounding is left
    big = value > 1e-4 * value[0]
    np.testing.assert_allclose(to_go[big], value[big], rtol=100 * size)
    assert (np.diff(value, axis=0)[big[:-1]] < 0.0).all()


def test_the_regulator_brings_in_errors_of_a_radius_and_a_radian(ahead):
    follower, velocities, regulator = ahead
    y, reference, _ = simulate_closed_loop(
        lambda k, *now: follower(*now, regulator.gain[k]), starts(30, 0.7, 0.57), velocities, 0.1
    )
    size = np.linalg.norm(controllers.pose_error(BALL, y, reference), axis=-1)
    assert (size[150] < 1e-3 * size[0]).all()


def test_the_linearised_step_is_that_of_the_balls():
    follower = controllers.FarSightedFollower(BALL, RATE, 0.1)
    velocity = np.array([1.0, 0.6])
    (F,), (G,) = follower._steps(velocity[None])
    h = 1e-6
    for k in range(7):
        change = h * np.eye(7)[k]
        y = BALL.state(q=rotations.exp(change[2:5]), position=0.7 * change[:2])
        after = rolled(y, velocity + 0.7 * change[5:], 0.1)
        error = controllers.pose_error(BALL, after, rolled(BALL.state(), velocity, 0.1)) / h
        # differences: truncation h, rounding 1e-16 / h
        np.testing.assert_allclose(error, np.hstack([F, G])[:, k], rtol=0, atol=1e-5)


def test_the_pose_error_is_that_of_rolling_there():
    way = np.array([0.2, -0.3])
    y = BALL.state(q=rolling_ball.roll_straight(way, 0.7), position=way)
    expected = np.concatenate([way, [0.3, 0.2, 0.0]]) / 0.7
    np.testing.assert_allclose(controllers.pose_error(BALL, y, BALL.state()), expected, rtol=1e-14)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_no_velocity_is_larger_than_the_largest_and_the_correction_keeps_its_direction(share):
    follower = controllers.DampedFollower(BALL, RATE)
    y = starts(200, 10.0, 1.0)
    velocity = share * RATE * 0.7 * np.array([0.6, 0.8])
    action = follower(y, BALL.state(), velocity)
    assert np.max(np.linalg.norm(action, axis=-1)) <= 1.0 + 1e-12
    p, theta = np.split(controllers.pose_error(BALL, y, BALL.state()), [2], axis=-1)
    wanted = -p - 1.2 * np.stack([theta[:, 1], -theta[:, 0]], axis=-1)
    added = action - share * np.array([0.6, 0.8])
    inner = np.sum(wanted * added, axis=-1)
    assert (inner >= -1e-12).all()
    np.testing.assert_allclose(
        inner, np.linalg.norm(wanted, axis=-1) * np.linalg.norm(added, axis=-1), atol=1e-9
    )
    # all of it, or as much as leads to the edge of the disk
    inside = np.linalg.norm(action, axis=-1) < 1.0 - 1e-9
    whole = follower.gain / RATE * wanted[inside]
    np.testing.assert_allclose(added[inside], whole, rtol=0, atol=1e-12)
    assert 0 < np.sum(inside) < 150


def test_a_ball_ahead_that_is_faster_than_the_follower_can_be_is_refused(damped, ahead):
    y, faster = BALL.state(), (1.0 + 1e-5) * RATE * 0.7 * np.array([0.6, 0.8])
    message = r"^velocity = .*; expected at most radius \* rate = 2.8 \[m/s\]"
    refuses(message, damped[0], y, y, faster)
    refuses(message, ahead[0], y, y, faster, ahead[2].gain[0, 0])


def test_each_row_of_a_batch_has_the_gains_that_it_has_alone(ahead):
    follower, velocities, regulator = ahead
    for k in range(0, 30, 7):
        alone = follower.regulator(velocities[:, k]).gain
        np.testing.assert_allclose(alone, regulator.gain[:, k], rtol=1e-10, atol=1e-13)


N = 200
PATHS = ("eight", "elastica", "both")
STEER = "rolling_ball.tasks:BallSteer"


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
    assert np.mean(run("BallSteer", bound(references.damped), 1000, path=path).success) > 0.99


@pytest.mark.parametrize("path", PATHS)
def test_whoever_knows_the_path_ahead_keeps_up_from_every_start_and_closer(path):
    found = run("BallSteer", bound(references.far_sighted), N, path=path)
    assert found.success.all()
    assert np.mean(found.reward) > 1.1 * np.mean(
        run("BallSteer", bound(references.damped), N, path=path).reward
    )


@pytest.mark.parametrize("path", PATHS)
def test_the_headings_that_are_looked_ahead_at_are_those_that_come(path):
    envs = rows(STEER, 20, path=path, radius=0.7)
    start, way = aux(envs), envs.task.reference_speed * envs.task.roll_per_step * 0.7
    ahead = controllers.elastica_headings(start[:, 6:8], start[:, 8], start[:, 9:11], way, 100)
    for heading in ahead:
        # roundings of 100 turns, and of sines that are not NumPy's
        np.testing.assert_allclose(aux(envs)[:, 6:8], heading, rtol=0, atol=1e-12)
        envs.step(np.zeros((20, 2), dtype=np.float32))


@pytest.mark.parametrize("path", PATHS)
def test_without_correction_no_ball_keeps_up(path):
    assert not run("BallSteer", copy, N, path=path).success.any()


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("n_substeps", [1, 3])
def test_whoever_copies_the_reference_from_no_offset_stays_at_none(path, n_substeps):
    config = {"path": path, "start_offset": 0.0, "start_angle": 0.0, "n_substeps": n_substeps}
    envs = rows(STEER, N, **config)
    for _ in range(300):
        _, rewards, *_, infos = envs.step(np.float32(copy(envs)))
        assert infos["is_success"].all()
    away = envs.y - aux(envs)[:, :6]
    # the same operations on the same numbers; in parts of a step the sums are rounded differently:
    # 900 roundings of positions up to 30 and of attitudes
    assert np.max(np.abs(away)) <= (0.0 if n_substeps == 1 else 900 * 2.0**-53 * 30)
    # the reward tells the error to rounding: 1 + 5 error is rounded at 1
    assert np.max(error(rewards)) < (4e-16 if n_substeps == 1 else 1e-11)


def way_along(n, step, **config):
    """Way [radii], heading and curvature [1/radius] of references, in steps of this roll [rad]."""
    envs = rows(STEER, 50, reference_speed=0.5, roll_per_step=2.0 * step, radius=0.7, **config)
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


def test_the_eight_closes():
    assert abs(ellipk(_EIGHT**2) - 2.0 * ellipe(_EIGHT**2)) < 1e-14
    gaps = []
    for n in (100, 200):
        step = 4.0 * ellipk(_EIGHT**2) / 0.6 / n
        _, found = way_along(n, step, path="eight")
        gaps.append(np.max(np.abs(found[-1, :, 4:6] - found[0, :, 4:6])) / 0.7)
    assert gaps[1] < 0.02  # of a path that is 15.5 radii long
    assert 3.8 < gaps[0] / gaps[1] < 4.2


# Parking a ball that rolls as it is told: BallPark, BallParkRandom, BallReorient, BallParkGoal.


KINDS = ("BallPark", "BallParkRandom", "BallReorient", "BallParkGoal")


@cache
def planned(env_id):
    """Episodes along three straight rolls."""
    return run(env_id, bound(reference_controllers(f"RigidEnvs/{env_id}-v0")["three_rolls"]), n=40)


@pytest.mark.long
@pytest.mark.push
@pytest.mark.parametrize("env_id", KINDS)
def test_three_straight_rolls_park_every_ball(env_id):
    found, n = planned(env_id), 20
    assert found.success.all()
    if env_id != "BallParkGoal":
        assert (found.steps < 50).all()
    kind = RigidGoalVectorEnv if env_id == "BallParkGoal" else RigidVectorEnv
    envs = kind(f"rigid_envs.systems.rolling_ball.tasks:{env_id}", n)
    envs.reset(seed=0)
    length = np.sum(np.linalg.norm(straight_rolls(envs.task, envs, np.arange(n)), axis=-1), axis=-1)
    # the steps along a plan make up the plan: rounded to float32, each by 6e-8
    assert (found.cost[:n] <= length * (1.0 + 1e-6)).all()


def test_a_ball_of_another_radius_is_parked_along_its_shortest_path():
    policy = bound(reference_controllers("RigidEnvs/BallPark-v0")["shortest_path"])
    assert run("BallPark", policy, n=1, radius=0.8).success.all()


@pytest.mark.parametrize("env_id", ["BallPark", "BallReorient"])
def test_no_way_is_shorter_than_the_bound_less_the_tolerance(env_id):
    found = planned(env_id)
    task = RigidEnv(f"rigid_envs.systems.rolling_ball.tasks:{env_id}").task
    least = task.lower_bound(found.y[0]) - max(task.position_tolerance, task.angle_tolerance)
    assert (found.cost >= least).all()
