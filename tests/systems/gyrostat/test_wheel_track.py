"""A satellite that keeps its camera on a point of the ground: geometry of the pass, controllers."""

from functools import cache

import numpy as np
import pytest

import rigid_envs
from rigid_envs.mechanics import rotations
from rigid_envs.scores.policies import reference_controllers
from rigid_envs.systems.gyrostat.pointing import (
    FlyOver,
    LookAhead,
    PointingFeedback,
    SightFollower,
    off_axis,
)
from rigid_envs.systems.gyrostat.system import Gyrostat
from rigid_envs.systems.gyrostat.tasks.wheel_track import (
    ATTRACTION,
    EARTH,
    WheelTrack,
    seen_from_orbit,
)
from tests.systems.runs import at_random, bound, rows, run, still

TRACK = "gyrostat.tasks:WheelTrack"
TASK = WheelTrack()
FRAME = ("pass_w", "pass_x", "pass_y", "pass_z")
PLACE = ("sine", "cosine", "target_sine", "target_cosine")


def controller(name):
    return bound(reference_controllers("RigidEnvs/WheelTrack-v0")[name])


@cache
def played(name):
    return run("WheelTrack", controller(name), n=300)


# The pass.


def kernel_sight(phi, beta, task=TASK):
    """Direction, rate and acceleration in the axes of the pass, by the functions of the task."""
    place, target = ((np.sin(angle), np.cos(angle)) for angle in (phi, beta))
    return seen_from_orbit(place, target, task.constants())


def slant(phi, beta, task=TASK):
    """Distance of the target [m], and its derivative by phi, from the spherical triangle."""
    r = EARTH + task.altitude
    distance = np.sqrt(EARTH**2 + r**2 - 2.0 * EARTH * r * np.cos(phi) * np.cos(beta))
    return distance, EARTH * r * np.sin(phi) * np.cos(beta) / distance


PASS = [(phi, beta) for phi in np.linspace(-0.4, 0.4, 9) for beta in (-0.1, 0.0, 0.03)]


@pytest.mark.parametrize(("phi", "beta"), PASS)
def test_the_target_is_seen_off_nadir_by_the_law_of_sines(phi, beta):
    direction = np.array(kernel_sight(phi, beta).direction)
    nadir = -np.array([0.0, np.sin(phi), np.cos(phi)])
    central = np.arccos(np.cos(phi) * np.cos(beta))  # the spherical law of Pythagoras
    expected = EARTH / slant(phi, beta)[0] * np.sin(central)
    # the target is 13 times nearer than the centre: its place is rounded by so much more
    np.testing.assert_allclose(np.linalg.norm(np.cross(direction, nadir)), expected, atol=1e-14)
    assert direction @ nadir > 0.0
    assert abs(np.linalg.norm(direction) - 1.0) < 1e-15


@pytest.mark.parametrize(("phi", "beta"), PASS)
def test_the_line_of_sight_turns_by_what_of_the_speed_is_across_it(phi, beta):
    r = EARTH + TASK.altitude
    speed = np.sqrt(ATTRACTION / r)
    distance, slope = slant(phi, beta)
    closing = slope * speed / r
    expected = np.sqrt(speed**2 - closing**2) / distance
    sight = kernel_sight(phi, beta)
    np.testing.assert_allclose(np.linalg.norm(sight.rate), expected, rtol=1e-12)
    assert abs(np.dot(sight.rate, sight.direction)) < 1e-15 * np.linalg.norm(sight.rate) * 10.0


@pytest.mark.parametrize(("phi", "beta"), PASS)
def test_rate_and_acceleration_are_derivatives_in_time(phi, beta):
    h = 1e-3  # s
    step = h * TASK.orbit_rate
    before, now, after = (kernel_sight(phi + k * step, beta) for k in (-1, 0, 1))
    turning = (np.array(after.direction) - np.array(before.direction)) / (2.0 * h)
    # truncation h^2 rate^3 / 6 and less than 1e-11, rounding 1e-15 / h
    np.testing.assert_allclose(np.cross(now.rate, now.direction), turning, atol=3e-12)
    change = (np.array(after.rate) - np.array(before.rate)) / (2.0 * h)
    np.testing.assert_allclose(now.acceleration, change, atol=1e-13)


def test_it_turns_fastest_overhead_at_the_speed_over_the_altitude():
    r = EARTH + TASK.altitude
    assert TASK.overhead_rate == pytest.approx(np.sqrt(ATTRACTION / r) / 5e5, rel=1e-14)
    np.testing.assert_allclose(kernel_sight(0.0, 0.0).rate, [-TASK.overhead_rate, 0.0, 0.0])
    rates = [np.linalg.norm(kernel_sight(phi, beta).rate) for phi, beta in PASS]
    assert max(rates) <= TASK.overhead_rate * (1.0 + 1e-14)
    assert 0.0152 < TASK.overhead_rate < 0.0153  # 7.6 km/s over 500 km


def test_the_controllers_see_the_same_line_of_sight():
    phi, beta = np.array(PASS).T
    found = FlyOver(TASK.orbit_rate, 1.0 / TASK.ground).sight(phi, beta)
    for k, place in enumerate(PASS):
        for part, expected in zip(found, kernel_sight(*place), strict=True):
            np.testing.assert_allclose(part[k], expected, rtol=1e-12, atol=1e-18)


def test_an_episode_is_flown_along_the_circle_whatever_the_satellite_does():
    envs = rows(TRACK, 20, dt=0.5)
    first = envs.auxiliary(*FRAME, *PLACE)
    act = at_random()
    for _ in range(600):
        envs.step(np.float32(act(envs)))
    last = envs.auxiliary(*FRAME, *PLACE)
    flown = np.arctan2(last[:, 4], last[:, 5]) - np.arctan2(first[:, 4], first[:, 5])
    # 600 roundings of angles below 1
    np.testing.assert_allclose(flown, 300.0 * TASK.orbit_rate, rtol=0, atol=600 * 2.0**-53)
    kept = [0, 1, 2, 3, 6, 7]
    np.testing.assert_array_equal(last[:, kept], first[:, kept])


def test_episodes_start_at_rest_near_the_target_on_its_way_to_it():
    envs = rows(TRACK, 2000)
    seen = envs.step(np.zeros((2000, 3), np.float32))[0].astype(np.float64)
    lead = seen[:, 12] / TASK.overhead_rate
    assert (lead > 98.9).all() and (lead < 199.1).all()
    assert np.abs(seen[:, 13]).max() <= 0.8 and np.mean(seen[:, 13] > 0.0) == pytest.approx(
        0.5, abs=0.04
    )
    off = np.arccos(seen[:, 2])
    assert 0.29 < off.max() < 0.305
    # uniform in a disk: two thirds of the radius in the mean
    assert np.mean(off) == pytest.approx(0.2, abs=0.005)
    roll = np.arctan2(seen[:, 4], seen[:, 3])
    assert np.abs(np.mean(np.exp(1j * roll))) < 0.06
    assert np.max(np.linalg.norm(0.03 * seen[:, 9:12], axis=-1)) < 0.01501


# What the wheels must hold.


def test_overhead_one_wheel_does_not_hold_the_momentum_and_two_do():
    A, w = TASK.system().carrier_moments, TASK.overhead_rate
    assert (A[:2] * w > TASK.capacity).all()
    # the largest of A1 w cos(roll) and A2 w sin(roll) is least where they are equal
    shared = A[0] * A[1] / np.hypot(A[0], A[1]) * w
    assert shared < 0.8 * TASK.capacity


def test_nothing_turns_faster_than_the_bound():
    satellite, most, fastest = TASK.system(), TASK.largest_rate(np.inf), 0.0
    envs, rng = rows(TRACK, 500), np.random.default_rng(0)
    for k in range(120):
        if k % 40 == 0:  # full torques, until wheels are full
            signs = rng.choice([-1.0, 1.0], (500, 3))
        envs.step(np.float32(signs))
        omega, L = satellite.omega_body(envs.y), satellite.L_body(envs.y)
        sphere = L / satellite.carrier_moments[1]
        rates = [np.linalg.norm(each, axis=-1).max() for each in (omega, sphere, omega - sphere)]
        fastest = max(fastest, *rates)
    assert 0.3 * most < fastest <= most


# Controllers.


def test_who_looks_ahead_succeeds_from_nearly_all_starts():
    assert np.mean(played("look_ahead").success) > 0.97


def test_looking_ahead_and_knowing_the_rate_of_the_line_of_sight_pay():
    shares = [np.mean(played(name).success) for name in ("pd", "feedforward", "look_ahead")]
    returns = [np.mean(played(name).reward) for name in ("pd", "feedforward", "look_ahead")]
    assert shares[0] + 0.3 < shares[1] < shares[2] - 0.1
    assert returns[0] + 50.0 < returns[1] < returns[2] - 10.0


@pytest.mark.parametrize("policy", [still, at_random()])
def test_neither_rest_nor_random_torques_keep_the_camera_on_the_target(policy):
    assert not run("WheelTrack", policy, n=300).success.any()


def test_who_does_not_look_ahead_fails_where_wheels_are_full():
    found, other = played("feedforward"), played("look_ahead")
    full = np.zeros((2, 300))
    for k, each in enumerate((found, other)):
        stored = TASK.system().spin_momenta(each.y)
        full[k] = np.mean(np.abs(stored).max(axis=-1) > (1.0 - 1e-6) * TASK.capacity, axis=0)
    assert (full[0][~found.success] > 0.05).all()
    assert np.mean(full[1]) < 0.25 * np.mean(full[0])


def test_a_target_that_is_met_is_kept_to_the_accuracy_of_held_torques():
    largest = []
    for dt in (1.0, 0.5):
        envs = rows(TRACK, 50, dt=dt, torque=1.0, capacity=1.0, bias=0.0, start_angle=0.0)
        sight = FlyOver(TASK.orbit_rate, 1.0 / TASK.ground).sight(
            *(np.arctan2(*envs.auxiliary(*pair).T) for pair in (PLACE[:2], PLACE[2:]))
        )
        turn = rotations.multiply(rotations.conjugate(envs.y[:, :4]), envs.auxiliary(*FRAME))
        y = envs.y
        y[:, 4:7] = rotations.rotate(turn, sight.rate)
        y[:, 7:10] -= y[:, 4:7]
        envs.set_state(envs.get_state() | {"y": y})
        act = controller("feedforward")
        worst = 0.0
        for _ in range(round(300 / dt)):
            _, reward, *_ = envs.step(np.float32(act(envs)))
            worst = max(worst, (1.0 / reward.min() - 1.0) / 20.0)
        largest.append(worst)
    # the line of sight accelerates differently at the end of a period
    assert largest[0] < 1e-3
    assert largest[1] < 0.6 * largest[0]


def test_without_knowledge_of_the_rate_the_camera_lags_by_twice_the_rate_over_the_gain():
    satellite, rate, dt = Gyrostat(2.0, 2.5, 3.0, 0.01, 0.01, 0.01), 0.002, 0.05
    law = PointingFeedback(satellite, torque=1.0, capacity=1.0, dt=dt)
    y = satellite.state()
    for k in range(1600):
        turn = rotations.exp(np.array([rate * dt * k, 0.0, 0.0]))
        direction = rotations.rotate(turn, np.array([0.0, 0.0, 1.0]))
        seen = rotations.rotate(rotations.conjugate(y[:4]), direction)
        y = satellite.advance(y, law.inputs(law(y, seen)), dt)
    # the period in which a torque is held is late by half of it
    np.testing.assert_allclose(
        off_axis(seen), [2.0 * rate / law.gain, 0.0, 0.0], rtol=0.02, atol=1e-12
    )


def test_a_small_error_falls_as_critical_damping_says():
    satellite = Gyrostat(2.0, 2.5, 3.0, 0.01, 0.01, 0.01)
    dt, k = 0.01, 0.2
    law = SightFollower(satellite, torque=1.0, capacity=1.0, dt=dt)
    y = satellite.state(q=rotations.exp(np.array([0.001, -0.002, 0.0])))
    zero, found = np.zeros(3), []
    for _ in range(2000):
        seen = rotations.rotate(rotations.conjugate(y[:4]), np.array([0.0, 0.0, 1.0]))
        found.append(off_axis(seen))
        y = satellite.advance(y, law.inputs(law(y, seen, zero, zero)), dt)
    t = dt * np.arange(2000)[:, None]
    expected = found[0] * (1.0 + k * t) * np.exp(-k * t)
    # held torques are late by half a period; squares of the angle
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5)


def planned():
    satellite = TASK.system()
    law = LookAhead(satellite, TASK.torque, TASK.capacity, TASK.dt)
    rng = np.random.default_rng(0)
    path, n = FlyOver(TASK.orbit_rate, 1.0 / TASK.ground), 40
    L = 0.012 * rotations.random_quaternion(rng, (n,))[:, 1:]
    phi, beta = -TASK.orbit_rate * rng.uniform(100.0, 200.0, n), rng.uniform(-0.06, 0.06, n)
    roll = 2.0 * np.pi / 72 * rng.integers(0, 72, n)
    return law, path, (L, phi, beta), roll, law.plan(path, L, phi, beta, roll, 300)


def costs_of(law, path, where, rolls, moves):
    """Cost of rolls and moves of a plan, computed from the momenta that the wheels hold."""
    L, phi, beta = where
    total = np.zeros(len(phi))
    for k in range(15):
        sight = path.sight(phi + 20.0 * k * path.rate, beta)
        w = np.linalg.norm(sight.rate, axis=-1, keepdims=True)
        # body axes: e3 along the line of sight, e1 such that the rate is at the angle `roll`
        ahead, side = sight.rate / w, np.cross(sight.direction, sight.rate / w)
        c, s = np.cos(rolls[k])[:, None], np.sin(rolls[k])[:, None]
        axes = np.stack([c * ahead - s * side, s * ahead + c * side, sight.direction], axis=1)
        turning = sight.twist - 2.0 * np.pi / 72 / 20.0 * moves[k]
        omega = np.einsum("nij,nj->ni", axes, sight.rate + turning[:, None] * sight.direction)
        l = np.einsum("nij,nj->ni", axes, L) - law.satellite.carrier_moments * omega  # noqa: E741
        total += np.sum(np.maximum(np.abs(l) / law.capacity - 0.95, 0.0), axis=-1)
        total += 1e-3 * moves[k] ** 2
    return total


def test_a_plan_costs_what_its_rolls_make_the_wheels_hold():
    law, path, where, roll, plan = planned()
    moves = np.rint(np.diff(plan.rolls[::20], axis=0, append=plan.rolls[-1:]) / (2 * np.pi / 72))
    moves[-1] = np.rint(plan.rates[-1] * 20.0 / (2 * np.pi / 72))
    again = costs_of(law, path, where, plan.rolls[::20], moves)
    np.testing.assert_allclose(again, plan.cost, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(plan.rolls[0], roll)
    np.testing.assert_allclose(np.diff(plan.rolls, axis=0), plan.rates[:-1] * law.dt, atol=1e-14)


def test_no_plan_at_random_costs_less():
    law, path, where, roll, plan = planned()
    rng = np.random.default_rng(1)
    for k in range(300):
        moves = np.zeros((15, 40)) if k == 0 else rng.integers(-2, 3, (15, 40))
        if k % 2:  # one way for some time
            moves = np.sort(moves, axis=0) * (np.arange(15)[:, None] < rng.integers(1, 16))
        rolls = roll + 2.0 * np.pi / 72 * (np.cumsum(moves, axis=0) - moves)
        assert (costs_of(law, path, where, rolls, moves) >= plan.cost - 1e-9).all()


@pytest.mark.parametrize("name", ["pd", "feedforward", "look_ahead"])
def test_what_controllers_read_in_observations_is_the_pass(name):
    envs = rows(TRACK, 50)
    act, agent = controller(name), rigid_envs.reference("WheelTrack", name)
    seen = envs.step(np.zeros((50, 3), np.float32))[0]
    decoded = agent.decode(seen)
    y, known = envs.y, decoded.auxiliary(*PLACE)
    np.testing.assert_allclose(known, envs.auxiliary(*PLACE), atol=1e-6)  # of float32
    turn = rotations.multiply(rotations.conjugate(y[:, :4]), envs.auxiliary(*FRAME))
    assert np.max(rotations.distance(turn, decoded.auxiliary(*FRAME))) < 1e-5
    np.testing.assert_allclose(agent(seen), act(envs), atol=1e-5)  # of float32, and of gains
