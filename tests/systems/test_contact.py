"""Normal force and friction against Newton's law on simulated motion, and closed values."""

import dataclasses
import math

import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.systems.dynamic_ball import dynamics as dynamic_ball
from rigid_envs.systems.dynamic_ball.dynamics import LEVEL
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from rigid_envs.systems.roller.system import Roller
from rigid_envs.systems.rolling_ball.system import RollingBall
from rigid_envs.systems.rolling_disk import closed_forms as rolling_disk
from rigid_envs.systems.rolling_disk.system import RollingDisk
from rigid_envs.systems.upright_coin.system import UprightCoin
from tests.systems.examples import COIN, DISK, PLATE, ROLLER, inputs, name_of, states

ROLLING = (DISK, PLATE, COIN, ROLLER)
H = 2e-4  # [s]; second differences: h^2 / 12 of the fourth derivative, and 4 eps / h^2 = 2e-8


def heights(system, y):
    """Places of the centre and the weight, in axes of which the last is the normal at y."""
    if isinstance(system, RollingDisk):
        return system.centre(y), np.array([0.0, 0.0, -system.m * system.g])
    if isinstance(system, UprightCoin):
        place = np.append(system.contact(y), system.radius)
        tilt = np.array([math.sin(system.slope), 0.0, -math.cos(system.slope)])
        return place, system.m * system.g * tilt
    return system.centre(y), np.array([0.0, 0.0, -system.m * system.g])


def second_difference(system, y, u, place):
    ends = [system.simulate(y, [0.0, s * H], u).y[-1] for s in (-1.0, 1.0)]
    return (place(ends[0]) - 2.0 * place(y) + place(ends[1])) / H**2


@pytest.mark.parametrize("system", [DISK, PLATE, COIN], ids=name_of)
@pytest.mark.parametrize("seed", range(6))
def test_the_forces_are_what_newtons_law_lacks_along_a_simulated_motion(system, seed):
    rng = np.random.default_rng([71, seed])
    y, u = states(system, rng), inputs(system, rng)
    weight = heights(system, y)[1]
    pushed = system.m * second_difference(system, y, u, lambda x: heights(system, x)[0]) - weight
    if system is PLATE:
        pushed = system.plate(y).T @ pushed - np.append(u[:2], 0.0)
    size = 1.0 + np.linalg.norm(pushed)
    assert system.normal_force(y, u) == pytest.approx(pushed[2], abs=1e-5 * size)
    friction = np.hypot(pushed[0], pushed[1])
    if pushed[2] > 0.1:
        needed = system.needed_friction(y, u)
        assert needed == pytest.approx(friction / pushed[2], rel=1e-4 * size / pushed[2])
        assert system.slips(y, u, mu=0.99 * needed)
        assert not system.slips(y, u, mu=1.01 * needed)


def acceleration(system, y, u):
    """Derivative of the velocity of the centre along the motion: differences of sixth order."""
    h, rates = 2e-3, system.rhs(y, u)
    velocity = system.velocity_world if system is PLATE else system.velocity
    rows = y + h * np.arange(-3, 4)[:, None] * rates
    rows[:, :4] /= np.linalg.norm(rows[:, :4], axis=-1, keepdims=True)  # q' is perpendicular to q
    v = velocity(rows)
    weights = (-1.0 / 60, 3.0 / 20, -3.0 / 4, 0.0, 3.0 / 4, -3.0 / 20, 1.0 / 60)
    found = np.array(weights) @ v / h
    return np.append(found, 0.0) if system is COIN else found


@pytest.mark.parametrize("system", [DISK, PLATE, COIN], ids=name_of)
@pytest.mark.parametrize("seed", range(6))
def test_the_force_is_what_newtons_law_lacks_of_the_rates_of_velocity(system, seed):
    rng = np.random.default_rng([74, seed])
    y, u = states(system, rng), inputs(system, rng)
    force = system.m * acceleration(system, y, u) - heights(system, y)[1]
    if system is PLATE:
        force = system.plate(y).T @ force - np.append(u[:2], 0.0)
    # h^6 / 140 of the seventh derivative at rates near 10 rad/s, and rounding of eps |v| / h
    np.testing.assert_allclose(system.contact_force(y, u), force, rtol=0, atol=1e-8)


def test_the_force_of_a_level_plate_is_that_of_any_plate():
    rng = np.random.default_rng(75)
    y, u = states(PLATE, rng, 50), inputs(PLATE, rng, 50)
    y[:, 9:], u[:, 2:] = 0.0, 0.0
    p = PLATE.parameters
    for row, force, expected in zip(y, u, PLATE.contact_force(y, u), strict=True):
        kinds = (dynamic_ball.State(*row), dynamic_ball.Input(*force), dynamic_ball.Parameters(*p))
        found = LEVEL.force(*kinds)
        np.testing.assert_allclose(found, expected, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("system", ROLLING, ids=name_of)
def test_slip_is_judged_by_the_coefficient_of_the_system(system):
    rng = np.random.default_rng(76)
    y, u = states(system, rng, 20), inputs(system, rng, 20)
    held = np.isfinite(system.needed_friction(y, u))
    y, u = y[held][0], u[held][0]
    needed = float(system.needed_friction(y, u))
    assert not dataclasses.replace(system, mu=1.001 * needed).slips(y, u)
    assert dataclasses.replace(system, mu=0.999 * needed).slips(y, u)
    assert not dataclasses.replace(system, mu=0.0).slips(y, u, mu=2.0 * needed)
    with pytest.raises(ValueError, match=r"^mu = -0\.1; expected a finite number of at least 0"):
        dataclasses.replace(system, mu=-0.1)


@pytest.mark.parametrize("seed", range(6))
def test_friction_gives_the_disk_the_angular_momentum_that_it_gains(seed):
    rng = np.random.default_rng([72, seed])
    y, u = states(DISK, rng), np.zeros(3)

    def momentum(x):
        return rotations.rotate(x[:4], DISK.moments * DISK.omega_body(x))

    ends = [DISK.simulate(y, [0.0, s * H], u).y[-1] for s in (-1.0, 1.0)]
    gained = (momentum(ends[1]) - momentum(ends[0])) / (2.0 * H)
    torque = np.cross(-DISK.radius * DISK.radius_up(y), DISK.contact_force(y, u))
    # h^2 / 6 of the third derivative, at rates near 10 rad/s
    np.testing.assert_allclose(torque, gained, rtol=0, atol=1e-4 * (1.0 + np.linalg.norm(gained)))


def test_a_disk_on_a_steady_circle_needs_the_friction_of_the_circle_of_its_centre():
    disk = RollingDisk.uniform(1.3, 0.4)
    theta, around = 1.2, 2.0
    steady = rolling_disk.steady_circle(
        theta, contact_radius=around, m=1.3, radius=0.4, i_perp=disk.I1, i3=disk.I3, g=disk.g
    )
    y = disk.state(
        q=rotations.quaternion_from_euler((0.0, theta, 0.0)),
        omega_body=(0.0, steady.precession * math.sin(theta), steady.omega3),
    )
    assert disk.normal_force(y) == pytest.approx(disk.m * disk.g, rel=1e-12)
    assert disk.needed_friction(y) == pytest.approx(
        abs(steady.centre_radius) * steady.precession**2 / disk.g, rel=1e-12
    )


@pytest.mark.parametrize(("beta", "share"), [(0.4, 2.0 / 7.0), (2.0 / 3.0, 0.4), (0.0, 0.0)])
def test_a_ball_on_a_tilted_plate_needs_beta_over_one_plus_beta_of_the_slope(beta, share):
    ball = DynamicBall(beta=beta)
    for alpha in (0.05, -0.4, 1.2):
        y = ball.state(tilt=(alpha, 0.0))
        assert ball.needed_friction(y) == pytest.approx(share * abs(math.tan(alpha)), abs=1e-14)
        assert ball.normal_force(y) == pytest.approx(9.81 * math.cos(alpha), rel=1e-14)


def test_a_jerked_plate_falls_away_from_under_the_ball():
    ball, u = DynamicBall(m=1.5), (0.0, 0.0, 10.0, 0.0)
    for Y in (-2.0, 0.5):  # z = Y sin(alpha_x): the plate accelerates by 10 Y
        y = ball.state(position=(0.0, Y))
        assert ball.normal_force(y, u) == pytest.approx(1.5 * (9.81 + 10.0 * Y), rel=1e-12)
    falling = ball.state(position=(0.0, -2.0))
    assert ball.needed_friction(falling, u) == np.inf
    assert ball.slips(falling, u, mu=1e9)


def test_an_upright_coin_needs_the_friction_of_its_curve_and_of_its_slope():
    coin = UprightCoin(m=2.0, radius=0.5, I1=0.125, I3=0.25)
    turning = coin.state(q=coin.attitude(0.7, 0.0), steer_rate=1.5, roll_rate=4.0)
    assert coin.needed_friction(turning) == pytest.approx(0.5 * 1.5 * 4.0 / 9.81, rel=1e-14)
    assert coin.normal_force(turning) == pytest.approx(2.0 * 9.81, rel=1e-15)
    slope = UprightCoin(m=2.0, radius=0.5, I1=0.125, I3=0.25, slope=0.3)
    down = slope.state(q=slope.attitude(np.pi, 0.0))  # a disk rolls with a third of the friction
    assert slope.needed_friction(down) == pytest.approx(math.tan(0.3) / 3.0, rel=1e-12)


def test_a_disk_that_is_thrown_over_lifts_off():
    # Upright, tipping at theta': z = radius sin(theta), so N = m (g - radius theta'^2)
    disk = RollingDisk.uniform(2.0, 0.5)
    for rate in (1.0, 4.0, 5.0):
        y = disk.state(
            q=rotations.quaternion_from_euler((0.0, 0.5 * np.pi, 0.0)), omega_body=(rate, 0, 0)
        )
        expected = 2.0 * (9.81 - 0.5 * rate**2)
        assert disk.normal_force(y) == pytest.approx(expected, rel=1e-12)
        assert bool(disk.slips(y, mu=10.0)) == (expected < 0.0)


def test_a_roller_says_the_same_as_before_and_takes_another_coefficient():
    roller = Roller(beta=0.5, slope=0.5, mu=0.1)
    y = roller.state()
    assert roller.needed_friction(y) == pytest.approx(math.tan(0.5) / 3.0, rel=1e-14)
    assert roller.normal_force(y) == pytest.approx(9.81 * math.cos(0.5), rel=1e-15)
    assert roller.slips(y)
    assert not roller.slips(y, mu=0.2)
    hill = Roller(curvature=-1.0)
    assert hill.slips(hill.state(velocity=4.0))  # 16 m/s^2 bend it less than g


@pytest.mark.parametrize("system", ROLLING, ids=name_of)
def test_forces_of_many_states_have_their_shape_and_are_named_quantities(system):
    rng = np.random.default_rng(73)
    y, u = states(system, rng, 3, 2), inputs(system, rng, 3, 2)
    for call in (system.normal_force, system.needed_friction):
        assert call(y, u).shape == (3, 2)
        np.testing.assert_array_equal(system.accessors[call.__name__](y), call(y))
    assert system.slips(y, u, mu=0.5).shape == (3, 2)
    with pytest.raises(ValueError, match=r"^mu = -0\.1; expected a finite number of at least 0"):
        system.slips(y, u, mu=-0.1)
    assert not hasattr(RollingBall, "needed_friction")
