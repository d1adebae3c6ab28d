"""Jacobians of the equations of motion: against differences and against closed forms."""

import numpy as np
import pytest

from rigid_envs.systems.dynamic_ball.system import DynamicBall
from rigid_envs.systems.free_body import closed_forms as free_body
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.heavy_top import closed_forms as heavy_top
from rigid_envs.systems.heavy_top.system import HeavyTop
from rigid_envs.systems.rolling_ball.system import RollingBall
from tests.systems.examples import ROLLER, SYSTEMS, inputs, name_of, states

EPS = np.finfo(np.float64).eps
each_system = pytest.mark.parametrize("system", SYSTEMS, ids=name_of)
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def left(a):
    """Matrix of q -> a q (Hamilton product)."""
    w, x, y, z = a
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])


def right(a):
    """Matrix of q -> q a."""
    w, x, y, z = a
    return np.array([[w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w]])


@each_system
def test_jacobians_agree_with_finite_differences(system):
    rng = np.random.default_rng(1)
    y, u = states(system, rng, 5), inputs(system, rng, 5)
    A, B = system.linearize(y, u)
    # h^2 times third derivatives (3e-13 times some hundred) and eps / h times the terms of rhs
    # (4e-10 times some ten)
    h = 5e-7
    for k in range(y.shape[-1]):
        step = h * np.eye(y.shape[-1])[k]
        slope = (system.rhs(y + step, u) - system.rhs(y - step, u)) / (2.0 * h)
        np.testing.assert_allclose(A[..., k], slope, rtol=0, atol=1e-8)
    # rhs is linear in u: any step, to rounding. But not in the ratio of a roller.
    h, atol = (5e-7, 1e-8) if system is ROLLER else (1.0, 1e-13)
    for k in range(u.shape[-1]):
        step = h * np.eye(u.shape[-1])[k]
        slope = (system.rhs(y, u + step) - system.rhs(y, u - step)) / (2.0 * h)
        np.testing.assert_allclose(B[..., k], slope, rtol=0, atol=atol)


def test_jacobian_of_the_free_body_is_that_of_eulers_equations():
    body = FreeBody(1.1, 1.7, 2.3)
    y = states(body, np.random.default_rng(2))
    A, B = body.linearize(y)
    (w1, w2, w3), q = y[4:], y[:4]
    expected = np.zeros((7, 7))
    expected[:4, :4] = 0.5 * right((0.0, w1, w2, w3))
    expected[:4, 4:] = 0.5 * left(q)[:, 1:]
    expected[4:, 4:] = [
        [0.0, (1.7 - 2.3) * w3 / 1.1, (1.7 - 2.3) * w2 / 1.1],
        [(2.3 - 1.1) * w3 / 1.7, 0.0, (2.3 - 1.1) * w1 / 1.7],
        [(1.1 - 1.7) * w2 / 2.3, (1.1 - 1.7) * w1 / 2.3, 0.0],
    ]
    np.testing.assert_allclose(A, expected, rtol=0, atol=8 * EPS)
    np.testing.assert_allclose(
        B, np.vstack([np.zeros((4, 3)), np.diag([1 / 1.1, 1 / 1.7, 1 / 2.3])])
    )


@pytest.mark.parametrize("spin", [0.3, 1.0, 4.0])
def test_spin_about_the_intermediate_axis_grows_at_the_rate_of_the_theory(spin):
    body = FreeBody(1.0, 2.0, 3.0)
    A, _ = body.linearize(body.state(omega_body=(0.0, spin, 0.0)))
    growth = max(np.linalg.eigvals(A[4:, 4:]).real)
    assert growth == pytest.approx(free_body.growth_rate((1.0, 2.0, 3.0), spin), rel=8 * EPS)


@pytest.mark.parametrize("axis", [0, 2])
def test_spin_about_a_stable_axis_oscillates_at_the_rate_of_the_theory(axis):
    body = FreeBody(1.0, 2.0, 3.0)
    A, _ = body.linearize(body.state(omega_body=1.5 * np.eye(3)[axis]))
    rates = free_body.oscillation_rates((1.0, 2.0, 3.0), 1.5)
    found = np.linalg.eigvals(A[4:, 4:])
    assert max(found.imag) == pytest.approx(rates[axis // 2], rel=8 * EPS)
    np.testing.assert_allclose(found.real, 0.0, atol=8 * EPS)


def test_jacobian_of_the_upright_top_is_the_textbook_one():
    top, spin = HeavyTop(1.3, 1.1, 0.6, m=0.8, g=9.5, ell=0.13), 2.5
    A, B = top.linearize(top.state(q=UPRIGHT, omega_body=(0.0, 0.0, spin)))
    weight, lever = 0.8 * 9.5 * 0.13, 0.8 * 0.13
    omega = np.zeros((3, 11))
    omega[:, :4] = weight * np.array([[0, 2 / 1.3, 0, 0], [0, 0, 2 / 1.1, 0], [0, 0, 0, 0]])
    omega[0, 5] = (1.1 - 0.6) * spin / 1.3
    omega[1, 4] = (0.6 - 1.3) * spin / 1.1
    np.testing.assert_allclose(A[4:7], omega, rtol=0, atol=8 * EPS)
    torques = np.diag([1 / 1.3, 1 / 1.1, 1 / 0.6])
    # An acceleration of the pivot to +X is a force -m aX at ell e3: a torque -ell m aX about +Y.
    forces = lever * np.array([[0.0, 1 / 1.3], [-1 / 1.1, 0.0], [0.0, 0.0]])
    np.testing.assert_allclose(B[4:7], np.hstack([torques, torques, forces]), rtol=0, atol=8 * EPS)
    np.testing.assert_array_equal(A[7:], np.hstack([np.zeros((4, 9)), np.eye(4)[:, :2]]))
    np.testing.assert_array_equal(B[7:], np.eye(8)[[0, 0, 6, 7]] * [[0], [0], [1], [1]])


@pytest.mark.parametrize("spin", [0.0, 1.0, 3.9, 6.0])
def test_the_upright_top_has_the_exponents_of_the_sleeping_top(spin):
    top = HeavyTop()
    A, _ = top.linearize(top.state(omega_body=(0.0, 0.0, spin)))
    # In a world frame that turns with the spin, p = conj(q_spin) q stands still at 1: there its
    # x and y, and the two transverse rates, form a linear system with constant coefficients.
    A[:4, :4] -= 0.5 * left((0.0, 0.0, 0.0, spin))
    kept = [1, 2, 4, 5]
    found = np.linalg.eigvals(A[np.ix_(kept, kept)])
    exponents = heavy_top.sleeping_exponents(spin, i_perp=1.0, i3=0.5, mgl=1.0)
    seen = np.array(exponents) - 1j * spin  # by that frame
    for expected in (*seen, *seen.conj()):
        # Just below the threshold two exponents nearly meet: the square root of a rounding.
        assert np.min(np.abs(found - expected)) < 1e-7


def test_jacobian_of_the_rolling_ball_is_that_of_the_no_slip_condition():
    ball = RollingBall(0.7)
    y, u = states(ball, np.random.default_rng(3)), np.array([0.4, -0.9, 0.3])
    A, B = ball.linearize(y, u)
    omega = np.array([-u[1] / 0.7, u[0] / 0.7, u[2]])
    np.testing.assert_allclose(A[:4, :4], 0.5 * left((0.0, *omega)), rtol=0, atol=4 * EPS)
    assert not A[4:].any()
    assert not A[:, 4:].any()
    by_input = np.array([[0.0, -1 / 0.7, 0.0], [1 / 0.7, 0.0, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(B[:4], 0.5 * right(y[:4])[:, 1:] @ by_input, rtol=0, atol=4 * EPS)
    np.testing.assert_array_equal(B[4:], np.eye(3)[:2])


def test_jacobian_of_the_ball_on_a_level_plate_is_that_of_the_textbook():
    ball = DynamicBall(m=1.2, radius=0.8, beta=0.55, g=9.6, turntable_rate=0.7)
    A, B = ball.linearize(ball.state())
    # About O the centre moves by V + r rate_y along x: m (1 + beta) (VX' + r a_y) = m g alpha_y +
    # FX, and likewise along y with the other sign; a turntable adds k Omega n x V.
    turn, fall, push = 0.55 / 1.55 * 0.7, 9.6 / 1.55, 1.0 / (1.2 * 1.55)
    names = ball.state_entries[4:]
    expected = np.zeros((9, 9))
    for rate, name, value in (
        *(("X", "VX", 1.0), ("Y", "VY", 1.0)),
        *(("alpha_x", "rate_x", 1.0), ("alpha_y", "rate_y", 1.0)),
        *(("VX", "VY", -turn), ("VY", "VX", turn)),
        *(("VX", "alpha_y", fall), ("VY", "alpha_x", -fall)),
    ):
        expected[names.index(rate), names.index(name)] = value
    np.testing.assert_allclose(A[4:, 4:], expected, rtol=0, atol=16 * EPS)
    np.testing.assert_allclose(
        B[6:8], [[push, 0, 0, -0.8], [0, push, 0.8, 0]], rtol=0, atol=8 * EPS
    )


def test_jacobian_of_the_roller_in_a_valley_is_that_of_a_pendulum():
    y = np.array([0.7, -0.3])
    A, B = ROLLER.linearize(y)
    swing = 0.3 * 9.5 * np.cos(0.4 - 0.3 * 0.7) / 1.45
    push, heavier = 1.0 / (1.1 * 1.45), -9.5 * np.sin(0.4 - 0.3 * 0.7) / 1.45**2
    np.testing.assert_allclose(A, [[0.0, 1.0], [-swing, 0.0]], rtol=0, atol=4 * EPS)
    np.testing.assert_allclose(B, [[0.0, 0.0], [push, heavier]], rtol=0, atol=4 * EPS)


@each_system
def test_the_jacobian_predicts_how_a_perturbation_travels(system):
    rng = np.random.default_rng(4)
    y, u, h = states(system, rng), inputs(system, rng), 1e-4
    A, B = system.linearize(y, u)
    du, dy = 1e-6 * rng.normal(size=B.shape[1]), 1e-6 * rng.normal(size=len(y))
    dy[system.components.get("q", slice(0))] = 0.0  # the quaternion stays a unit one
    moved = system.advance(y + dy, u + du, h) - system.advance(y, u, h)
    # exp(A h) to second order in h; what is left is h^2 |A|^2 |dy|, and roundings.
    rate = 1.0 + np.linalg.norm(A, 2) + np.linalg.norm(B, 2)
    atol = 1e-6 * rate**2 * h**2 + 8 * EPS
    np.testing.assert_allclose(moved, dy + h * (A @ dy + B @ du), rtol=0, atol=atol)
