"""What a ball keeps that nothing pushes, over a million steps, and how it loses no energy."""

import numpy as np
import pytest

from rigid_envs.mechanics.laws import EPS
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from tests.verification.measures import is_level, orders, sample_steps, slope

TABLE = DynamicBall(m=1.2, radius=0.5, beta=0.4, turntable_rate=1.7)
CIRCLING = TABLE.state(position=(0.1, 0.2), velocity=(0.3, 0.2), spin=1.0)
MILLION = 10**6


def run(ball, y, dt, n_steps=MILLION):
    """States at 1500 moments on the way."""
    return ball.simulate(y, sample_steps(n_steps, 1500) * dt, max_step=dt)


def test_a_million_steps_on_a_level_turntable_keep_speed_spin_and_circle():
    trajectory = run(TABLE, CIRCLING, 0.02)
    found, speed = trajectory.invariants, np.linalg.norm(trajectory["velocity"], axis=-1)
    # Turns of the velocity are rotations to rounding: a random walk of 1e7 of them.
    np.testing.assert_allclose(speed, speed[0], rtol=1e-11)
    np.testing.assert_allclose(found["energy"], found["energy"][0], rtol=1e-11)
    np.testing.assert_array_equal(found["spin"], 1.0)
    assert np.max(np.abs(np.linalg.norm(trajectory["q"], axis=-1) - 1.0)) <= 1e-14
    # The centre of the circle is r + n x v / (k Omega). It trembles by the fourth power of the
    # step, but goes nowhere.
    rate = 2.0 / 7.0 * 1.7
    v = trajectory["velocity"]
    centre = trajectory["position"] + np.stack([-v[:, 1], v[:, 0]], axis=-1) / rate
    moved = centre - centre[0]
    assert np.max(np.abs(moved)) <= 1e-10
    for k in range(2):
        assert is_level(trajectory.t, moved[:, k])


def test_after_a_million_steps_the_contact_does_not_slip():
    y, h = TABLE.simulate(CIRCLING, [0.0, 2e4], max_step=0.02).y[-1], 1e-3
    near = TABLE.simulate(y, 5.0 + h * np.arange(-2, 3), max_step=h)
    centre, R = near["centre"], near["R"]
    foot = centre[2] - [0.0, 0.0, 0.5]
    surface = np.cross([0.0, 0.0, 1.7], foot)
    contact = slope(centre, h) - slope(R, h) @ R[2].T @ [0.0, 0.0, 0.5]
    # h^4 / 30 times the fifth power of 5 rad/s, and roundings over h.
    np.testing.assert_allclose(contact, surface, rtol=0, atol=1e-10)


def test_on_a_plate_at_rest_a_ball_rolls_straight_for_ever():
    ball = DynamicBall(radius=0.5)
    y = ball.state(position=(0.1, 0.2), velocity=(0.3, -0.2), spin=0.7)
    trajectory = run(ball, y, 0.02)
    # Nothing is added to velocity or spin, not even a rounding.
    np.testing.assert_array_equal(trajectory["velocity"], np.tile(y[6:8], (len(trajectory), 1)))
    np.testing.assert_array_equal(trajectory["spin"], 0.7)
    way = y[4:6] + np.outer(trajectory.t, y[6:8])
    # Ten million additions, each rounded by half a unit and to the same side at worst.
    np.testing.assert_allclose(trajectory["position"], way, rtol=0, atol=5.0 * EPS * MILLION * 6e3)


def test_up_and_down_a_slope_a_ball_keeps_its_energy_to_rounding():
    ball, n_steps, dt = DynamicBall(radius=0.5), 10**5, 1e-4
    y = ball.state(velocity=(0.4, 3.0), spin=0.7, tilt=(0.1, 0.05))
    trajectory = run(ball, y, dt, n_steps)
    energy = trajectory.invariants["energy"]
    assert np.min(trajectory["velocity"][:, 1]) < -2.0  # it came back
    # The parabola is exact: what is left are the roundings of ten kicks a step.
    np.testing.assert_allclose(energy, energy[0], rtol=5.0 * EPS * n_steps)


def test_on_a_tilted_turntable_the_energy_error_falls_with_the_fourth_power_of_the_step():
    ball = DynamicBall(m=1.2, radius=3.0, beta=0.4, turntable_rate=5.0)
    y = ball.state(velocity=(0.3, 0.2), tilt=(0.1, -0.2))
    largest = []
    for dt in (0.02, 0.01, 0.005):
        t = np.linspace(0.0, 6.0, round(6.0 / dt) + 1)
        energy = ball.simulate(y, t, max_step=dt).invariants["energy"]
        largest.append(np.max(np.abs(energy - energy[0])))
    np.testing.assert_allclose(orders(largest), 4.0, rtol=0, atol=0.2)


@pytest.mark.parametrize("rate", [0.0, 2.0])
def test_the_work_of_the_plate_is_what_the_energy_gains(rate):
    # Over a whole motion of the plate: the energy at the end is that at the start plus the
    # integral of the power, force of the contact times velocity of the surface.
    ball = DynamicBall(m=1.2, radius=0.4, beta=0.4, turntable_rate=rate)
    y = ball.state(velocity=(0.3, 0.2), spin=2.0, tilt=(0.1, -0.2), tilt_rate=(0.3, 0.2))
    u, n = np.array([0.4, -0.2, -0.3, 0.2]), 1000
    t = np.linspace(0.0, 2.0, n + 1)
    motion = ball.simulate(y, t, u)
    P, rates = motion["plate"], motion["tilt_rate"]
    normal = P[:, :, 2]
    w = rates[:, :1] * [1.0, 0.0, 0.0] + rates[:, 1:] * P[:, :, 1] + rate * normal
    surface = np.cross(w, motion["centre"] - 0.4 * normal)
    contact = np.einsum("nij,nj->ni", P, ball.contact_force(motion.y, u))
    push = np.einsum("nij,j->ni", P[:, :, :2], u[:2])
    power = np.sum(contact * surface + push * motion["velocity_world"], axis=-1)
    # Simpson's rule: h^4 / 90 times fourth derivatives of the power, 2e-13 times some hundred.
    weights = np.ones(n + 1)
    weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
    gained = motion["energy"][-1] - motion["energy"][0]
    assert gained == pytest.approx(weights @ power * 2.0 / n / 3.0, abs=1e-9)
