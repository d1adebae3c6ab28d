"""Torques in both frames and a pivot that moves, by equivalences that hold exactly."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigid_envs.mechanics.laws import EPS
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.heavy_top.system import HeavyTop
from tests.verification.measures import leaning, random_attitude

TOP = HeavyTop(1.3, 1.1, 0.6, m=0.8, g=9.5, ell=0.13)
T = np.linspace(0.0, 5.0, 26)


def start(top, seed):
    rng = np.random.default_rng([12, seed])
    return top.state(
        q=random_attitude(rng), omega_body=rng.normal(size=3), pivot_velocity=rng.normal(size=2)
    )


def pivot_input(ax, ay):
    return np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, ax, ay])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("a", [(3.0, 0.0), (0.0, -2.0), (4.0, 5.0)])
def test_a_constant_acceleration_of_the_pivot_is_a_tilted_and_stronger_gravity(a, seed):
    y = start(TOP, seed)
    pushed = TOP.simulate(y, T, pivot_input(*a), max_step=0.01)
    # In the pivot's frame gravity is (-aX, -aY, -g): turn the world so that it points down again.
    weight = np.array([*a, TOP.g])
    size = float(np.linalg.norm(weight))
    upright, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [weight / size])
    heavier = HeavyTop(TOP.I1, TOP.I2, TOP.I3, TOP.m, size, TOP.ell)
    q = (upright * Rotation.from_quat(y[:4], scalar_first=True)).as_quat(scalar_first=True)
    tilted = heavier.simulate(heavier.state(q=q, omega_body=y[4:7]), T, max_step=0.01)
    # The same steps but for roundings, which grow by up to exp(6) in 5 s of a chaotic motion.
    np.testing.assert_allclose(pushed["omega_body"], tilted["omega_body"], rtol=0, atol=1e-11)
    np.testing.assert_allclose(upright.as_matrix() @ pushed["R"], tilted["R"], rtol=0, atol=1e-11)


def test_an_acceleration_of_the_pivot_is_the_textbook_inertial_force():
    # Upright and accelerated to +X, the body is left behind: it falls towards -X.
    rate = TOP.rhs(TOP.state(), pivot_input(2.0, 0.0))
    np.testing.assert_allclose(rate[4:7], (0.0, -TOP.m * TOP.ell * 2.0 / TOP.I2, 0.0), rtol=EPS)
    later = TOP.simulate(TOP.state(), [0.0, 0.1], pivot_input(2.0, 0.0))
    assert later["R"][-1, 0, 2] < 0.0


def test_a_top_leaning_into_the_acceleration_is_in_balance():
    angle = math.atan2(2.0, TOP.g)  # forwards by a / g, like a runner
    y = TOP.state(q=(math.cos(0.5 * angle), 0.0, math.sin(0.5 * angle), 0.0))
    rate = TOP.rhs(y, pivot_input(2.0, 0.0))
    np.testing.assert_allclose(rate[4:7], 0.0, rtol=0, atol=4 * EPS)


def test_the_pivot_moves_exactly_as_its_acceleration_says():
    rng = np.random.default_rng(13)
    y, a = start(TOP, 0), rng.uniform(-3.0, 3.0, (25, 2))
    inputs = np.hstack([rng.uniform(-1.0, 1.0, (25, 6)), a])
    trajectory = TOP.simulate(y, T, inputs)
    # Constant acceleration in each interval: v += a h, x += v h + a h^2 / 2.
    v = y[9:11] + np.vstack([np.zeros(2), np.cumsum(0.2 * a, axis=0)])
    x = y[7:9] + np.vstack([np.zeros(2), np.cumsum(0.2 * v[:-1] + 0.02 * a, axis=0)])
    # To the roundings of some thousand steps.
    np.testing.assert_allclose(trajectory["pivot_velocity"], v, rtol=0, atol=1e-12)
    np.testing.assert_allclose(trajectory["pivot"], x, rtol=0, atol=1e-12)


def test_the_pivot_does_not_feel_the_body():
    y, other = start(TOP, 1), start(TOP, 2)
    other[7:] = y[7:]
    u = pivot_input(1.0, -2.0)
    one, two = (TOP.simulate(state, T, u, max_step=0.02) for state in (y, other))
    np.testing.assert_array_equal(one.y[:, 7:], two.y[:, 7:])


def test_a_steady_pivot_velocity_changes_nothing():
    y = start(TOP, 3)
    still = y.copy()
    still[7:] = 0.0
    moving, resting = (TOP.simulate(state, T, max_step=0.02) for state in (y, still))
    np.testing.assert_array_equal(moving.y[:, :7], resting.y[:, :7])


@pytest.mark.parametrize("seed", range(4))
def test_without_weight_a_body_torque_drives_the_free_body(seed):
    weightless = HeavyTop(1.3, 1.1, 0.6, g=0.0, ell=0.0)
    body, y, tau = FreeBody(1.3, 1.1, 0.6), start(weightless, seed), np.array([0.3, -0.2, 0.1])
    u = np.concatenate([tau, np.zeros(5)])
    top = weightless.simulate(y, T, u, max_step=0.01)
    free = body.simulate(y[:7], T, tau, max_step=0.01)
    # The same kicks and turns, the quaternion normalised at other places: roundings.
    np.testing.assert_allclose(top["omega_body"], free["omega_body"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(top["q"], free["q"], rtol=0, atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_a_world_torque_is_the_body_torque_of_the_same_vector(seed):
    y = start(TOP, seed)
    R, tau = Rotation.from_quat(y[:4], scalar_first=True), np.array([0.4, -0.3, 0.7])
    in_world = np.concatenate([np.zeros(3), tau, np.zeros(2)])
    in_body = np.concatenate([R.inv().apply(tau), np.zeros(5)])
    np.testing.assert_allclose(TOP.rhs(y, in_world), TOP.rhs(y, in_body), rtol=0, atol=16 * EPS)


def test_a_world_torque_about_the_vertical_adds_to_the_vertical_momentum_only():
    u = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0])
    trajectory = TOP.simulate(start(TOP, 5), T, u, max_step=0.02)
    gained = trajectory["L_world"][:, 2] - trajectory["L_world"][0, 2]
    # Neither gravity nor the splitting adds any: exact, to some thousand roundings.
    np.testing.assert_allclose(gained, 0.25 * T, rtol=0, atol=1e-12)


def test_a_body_torque_about_the_axis_of_a_symmetric_top_adds_to_its_spin_only():
    top = HeavyTop()
    u = np.array([0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    trajectory = top.simulate(start(top, 6), T, u, max_step=0.02)
    spin = trajectory["omega_body"][:, 2]
    np.testing.assert_allclose(spin, spin[0] + 0.1 / 0.5 * T, rtol=0, atol=1e-12)


def test_a_torque_against_gravity_holds_the_top_where_it_leans():
    top, theta = HeavyTop(), 0.8
    # Weight pulls e3 down about the line of nodes, +x: hold it with -m g ell sin theta.
    u = np.array([0.0, 0.0, 0.0, -math.sin(theta), 0.0, 0.0, 0.0, 0.0])
    trajectory = top.simulate(top.state(q=leaning(theta)), np.linspace(0.0, 2.0, 11), u)
    np.testing.assert_allclose(trajectory["tilt"], theta, rtol=0, atol=1e-13)
