"""To rest by magnetic coils: at the pace of the field, and not faster."""

import functools
from dataclasses import replace

import numpy as np
import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.mechanics import rotations
from rigid_envs.scores.policies import feedback, system_of
from rigid_envs.systems.satellite import closed_forms as theory
from rigid_envs.systems.satellite import references
from rigid_envs.systems.satellite.controllers import FieldBrake
from rigid_envs.systems.satellite.system import Satellite
from rigid_envs.systems.satellite.tasks import MagneticDetumble
from rigid_envs.testing.environments import fresh, vector
from tests.systems.runs import at_random, bound, rows, run

SATELLITE = Satellite(0.04, 0.05, 0.06)
DIPOLE = 0.1
BRAKE = FieldBrake(SATELLITE, DIPOLE)
FREE = replace(BRAKE, dipole=1e6)  # so strong that it is never at its limit


class Scaled(FieldBrake):
    """The same law with another gain."""

    factor = 1.0

    @property
    def gain(self):
        return self.factor * super().gain


def with_gain(factor):
    """The reference at so many times its gain."""
    law = type("Scaled", (Scaled,), {"factor": factor})
    return bound(lambda task: feedback(law(system_of(task), task.dipole)))


def along_first(share):
    """The largest dipole along the first axis of the reduced frame, or a share of it."""
    return lambda envs: np.tile([share, 0.0, 0.0], (envs.num_envs, 1))


@functools.cache
def braked():
    """Episodes of the reference."""
    return run("MagneticDetumble", bound(references.b_dot), 100)


def tumbling(n, seed=0):
    """States in the middle of episodes: of all attitudes, directions, places and rates."""
    rng = np.random.default_rng(seed)
    omega = 0.05 * rng.normal(size=(n, 3))
    q, place = rotations.random_quaternion(rng, (n,)), rng.uniform(0.0, 6.0, n)
    return SATELLITE.state(q=q, omega_body=omega, latitude=place)


def momentum_along_field(n, seed=1):
    """The same, with L along the field or against it."""
    y = tumbling(n, seed)
    L = 100.0 * SATELLITE.field_body(y) * np.resize([1.0, -1.0], n)[:, None]
    y[:, 4:7] = L / SATELLITE.moments
    return y


def unit(v):
    """Directions of vectors."""
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def across(v, n):
    """Parts of vectors across directions n."""
    return v - np.sum(v * n, axis=-1, keepdims=True) * n


# The task.


def test_the_reference_brings_every_satellite_to_rest():
    assert braked().success.all()
    assert braked().cost.mean() < 2100.0


@pytest.mark.parametrize("factor", [0.2, 5.0])
def test_a_gain_five_times_smaller_or_larger_is_worse(factor):
    found = run("MagneticDetumble", with_gain(factor), 100)
    assert found.success.mean() <= 0.8
    assert found.cost.mean() > 1.3 * braked().cost.mean()


def test_the_largest_dipole_fails_from_many_starts():
    found = run("MagneticDetumble", along_first(1.0), 200, frame="reduced")
    assert 0.4 < found.success.mean() < 0.75


def test_no_success_is_faster_than_the_bound():
    envs = fresh(vector("RigidEnvs/MagneticDetumble-v0", 100), 0)
    least = references.DETUMBLE_TIME.values(envs)
    assert (least < braked().cost).all() and np.mean(least / braked().cost) > 0.3
    fast = run("MagneticDetumble", along_first(1.0), 100, frame="reduced")
    assert (least <= fast.cost).all()


def test_the_bound_knows_that_gravity_may_brake_too():
    """Of slow satellites with weak coils, on an orbit so fast that gravity turns them harder."""
    config = {"n": 0.02, "dipole": 0.01, "start_rate": (0.0105, 0.03), "n_substeps": 60}
    envs = rows("satellite.tasks:MagneticDetumble", 200, **config)
    least, policy = references.DETUMBLE_TIME.values(envs), references.b_dot(envs.task)
    too_much = np.linalg.norm(SATELLITE.L_body(envs.y), axis=1) - SATELLITE.I3 * 0.01
    strongest = SATELLITE.b * np.sqrt(1.0 + 3.0 * np.sin(SATELLITE.inclination) ** 2)
    by_coils, alive, early = too_much / (0.01 * strongest), np.ones(200, dtype=bool), 0
    for step in range(1, 101):
        _, _, terminated, _, _ = envs.step(policy(envs).astype(np.float32))
        ended, time = alive & terminated, step * envs.task.dt
        assert (least[ended] <= time).all()
        early += (by_coils[ended] > time).sum()
        alive &= ~ended
    assert early > 10


def test_a_dipole_gives_no_torque_along_the_field():
    rng, y = np.random.default_rng(2), tumbling(200)
    u = DIPOLE * unit(rng.normal(size=(200, 3)))
    B = SATELLITE.field_body(y)
    torque = SATELLITE.moments * (SATELLITE.rhs(y, u) - SATELLITE.rhs(y))[:, 4:7]
    # roundings are those of the gyroscopic torque, which is some hundred times larger
    size = np.linalg.norm(B, axis=1) * DIPOLE
    assert np.max(np.abs(np.sum(torque * unit(B), axis=1)) / size) < 1e-12
    np.testing.assert_allclose(torque, np.cross(u, B), rtol=0, atol=1e-12 * size.max())


def test_the_momentum_along_a_field_that_does_not_turn_stays():
    found = run("MagneticDetumble", bound(references.b_dot), 50, inclination=0.0)
    first, last = (SATELLITE.L_world(y) for y in found.y[[0, -1]])
    # over an equator the field is along the axis; gravity pulls by 4e-8 N m, to and fro
    np.testing.assert_allclose(last[:, 2], first[:, 2], rtol=0, atol=2e-5)
    rest = SATELLITE.moments.max() * 0.01
    assert np.median(np.abs(first[:, 2])) > 2.0 * rest
    assert not found.success[np.abs(first[:, 2]) > 1.1 * rest].any()
    slow = ~found.success
    assert (np.linalg.norm(last[slow, :2], axis=1) < 0.1 * rest).all()


def test_nothing_turns_faster_than_the_largest_rate():
    task, fastest = vector("RigidEnvs/MagneticDetumble-v0", 1).task, 0.0
    for policy in (along_first(-1.0), at_random()):
        y = run("MagneticDetumble", policy, 100, frame="reduced").y
        omega, L = SATELLITE.omega_body(y), SATELLITE.L_body(y)
        for rates in (omega, L / SATELLITE.I2):
            fastest = max(fastest, np.linalg.norm(rates, axis=-1).max())
    most = task.largest_rate(4000.0)
    assert 0.3 * most < fastest <= most


def test_rates_of_drawn_satellites_stay_below_the_largest():
    drawn = {"I1": (0.03, 0.05), "I3": (0.05, 0.07), "b": (2e-5, 4e-5), "inclination": (0.0, 3.0)}
    envs = rows("satellite.tasks:MagneticDetumble", 50, frame="reduced", n_substeps=12, **drawn)
    for step in range(1, 200):
        envs.step(np.tile(np.float32([-1.0, 0.0, 0.0]), (50, 1)))
        rates = [system.rate(y) for system, y in zip(envs.systems, envs.y, strict=True)]
        assert np.max(rates) <= envs.task.largest_rate(step * envs.task.dt)


def test_a_start_within_the_tolerance_is_refused():
    message = r"start_rate: start_rate = \(0\.01, 0\.1\); expected more than rate_tolerance = 0\.01"
    with pytest.raises(ConfigError, match=message):
        MagneticDetumble(start_rate=(0.01, 0.1))


# The reduced frame.


def in_frame(y, frame="reduced", **config):
    """An environment with a row in each state."""
    envs = rows("satellite.tasks:MagneticDetumble", len(y), frame=frame, **config)
    envs.set_state({**envs.get_state(), "y": y})
    return envs


def test_the_first_action_alone_brakes_and_does_so_at_once():
    """L falls at a1 m |B| sin(L, B), whatever the other actions."""
    rng, y, dt = np.random.default_rng(3), tumbling(300), 0.01
    actions = np.concatenate([np.eye(3), -np.eye(3), unit(rng.normal(size=(294, 3)))])
    ends = []
    for a in (actions, np.zeros_like(actions)):
        envs = in_frame(y, dt=dt, n_substeps=1, rate_tolerance=1e-6, start_rate=1.0)
        envs.step(a.astype(np.float32))
        ends.append(SATELLITE.L_body(envs.y))
    L, B = SATELLITE.L_body(y), SATELLITE.field_body(y)
    fall = -np.sum((ends[0] - ends[1]) * unit(L), axis=1) / (dt * DIPOLE)
    # within the period L turns in the body by less than 0.002 rad
    size = np.linalg.norm(B, axis=1)
    expected = actions[:, 0] * np.linalg.norm(across(B, unit(L)), axis=1)
    np.testing.assert_allclose(fall / size, expected / size, rtol=0, atol=2e-3)


@pytest.mark.parametrize("frame", ["world", "reduced"])
def test_momentum_along_the_field_and_rest_do_no_harm(frame):
    y = momentum_along_field(100)
    y[:10, 4:7] = 0.0
    envs = in_frame(y, frame)
    for _ in range(3):
        seen, rewards, _, _, infos = envs.step(np.resize(np.eye(3), (100, 3)).astype(np.float32))
        assert np.isfinite(seen).all() and np.isfinite(rewards).all()
        assert not infos["physics_error"].any()


def test_beside_momentum_along_the_field_the_first_two_actions_are_dipoles_across_it():
    y, actions = momentum_along_field(90), np.resize(np.eye(3), (90, 3)).astype(np.float32)
    L, B = SATELLITE.L_body(y), SATELLITE.field_body(y)
    np.testing.assert_allclose(np.abs(np.sum(unit(L) * unit(B), axis=1)), 1.0, rtol=1e-15)
    pushed, left, dt = in_frame(y), in_frame(y), 4.0
    pushed.step(actions)
    left.step(np.zeros_like(actions))
    change = SATELLITE.moments * (pushed.y - left.y)[:, 4:7]
    share = np.linalg.norm(change, axis=1) / (DIPOLE * np.linalg.norm(B, axis=1) * dt)
    # the body turns by up to 0.2 rad in the period, about another axis than the field
    np.testing.assert_allclose(share.reshape(-1, 3)[:, :2], 1.0, rtol=0, atol=0.05)
    assert (share.reshape(-1, 3)[:, 2] < 0.15).all()


# The controller.


def test_the_controller_brakes_what_is_across_the_field_at_its_gain():
    y = tumbling(100)
    B, L = SATELLITE.field_body(y), SATELLITE.L_body(y)
    m = FREE.dipole * FREE(y)
    expected = -FREE.gain * across(L, unit(B))
    np.testing.assert_allclose(np.cross(m, B), expected, rtol=0, atol=1e-15 * np.abs(L).max())
    np.testing.assert_allclose(np.sum(m * B, axis=1), 0.0, atol=1e-15 * np.abs(m).max())


def test_in_a_fixed_field_the_momentum_across_it_decays_as_in_closed_form():
    """Of a sphere that stays where it is, at k of the orbit: exp(-k t), and nothing along B."""
    ball = Satellite(0.05, 0.05, 0.05, n=0.0)
    law = FieldBrake(replace(ball, n=SATELLITE.n), 1e6)
    y = tumbling(20)
    y[:, 4:7] *= 0.02
    B, start = ball.field_body(y), ball.omega_world(y)
    field, h, steps = rotations.rotate(y[:, :4], B), 0.5, 1000
    for _ in range(steps):
        y = ball.advance(y, law.dipole * law(y), h, 1)
    found = ball.omega_world(y)
    for row in range(20):
        gain = law.gain * ball.I1 / (B[row] @ B[row])
        expected = theory.detumble(h * steps, start[row], field[row], gain=gain, moment=ball.I1)
        # a dipole that is held for a time h brakes by 1 - k h in place of exp(-k h), and turns
        np.testing.assert_allclose(found[row], expected, rtol=0, atol=3e-3 * abs(start[row]).max())


def test_the_gain_is_twice_that_of_the_orbit_and_more_where_the_field_turns():
    for inclination in (0.0, 1.0, -1.0, np.pi):
        law = FieldBrake(replace(SATELLITE, inclination=inclination), DIPOLE)
        turning = 1.0 + abs(np.sin(inclination))
        assert law.gain == pytest.approx(2.0 * SATELLITE.n * turning, rel=1e-15)


def test_the_dipole_is_as_the_momentum_over_the_field():
    y = tumbling(50)
    slower, stronger = y.copy(), FieldBrake(replace(SATELLITE, b=2.0 * SATELLITE.b), 1e6)
    slower[:, 4:7] *= 0.2
    # entries near 0 are differences of larger products
    size = np.abs(FREE(y)).max()
    np.testing.assert_allclose(FREE(slower), 0.2 * FREE(y), rtol=0, atol=1e-15 * size)
    np.testing.assert_allclose(stronger(y), 0.5 * FREE(y), rtol=0, atol=1e-15 * size)
    limited, size = BRAKE(slower), np.linalg.norm(FREE(slower), axis=1) * FREE.dipole / DIPOLE
    large = size > 1.0
    assert 5 < large.sum() < 45
    np.testing.assert_allclose(np.linalg.norm(limited, axis=1), np.minimum(size, 1.0), rtol=1e-13)
    np.testing.assert_allclose(unit(limited), unit(FREE(slower)), rtol=0, atol=1e-14)


def test_symmetries_of_satellite_and_orbit_take_the_controller_with_them():
    y = tumbling(50)
    later = y.copy()
    later[:, 7] += np.pi
    np.testing.assert_allclose(BRAKE(later), BRAKE(y), rtol=0, atol=1e-14)
    for axis, signs in enumerate(2.0 * np.eye(3) - 1.0):
        turned = y.copy()
        turned[:, :4] = rotations.multiply(y[:, :4], np.eye(4)[axis + 1])
        turned[:, 4:7] *= signs
        np.testing.assert_allclose(BRAKE(turned), signs * BRAKE(y), rtol=0, atol=1e-14)


def test_the_controller_leaves_alone_what_is_along_the_field_or_at_rest():
    y = momentum_along_field(50)
    assert np.abs(BRAKE(y)).max() < 1e-13
    y[:, 4:7] = 0.0
    np.testing.assert_array_equal(BRAKE(y), 0.0)
    without = FieldBrake(replace(SATELLITE, b=0.0), DIPOLE)
    np.testing.assert_array_equal(without(tumbling(50)), 0.0)
