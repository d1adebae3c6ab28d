"""Steering a spin by what the free motion keeps."""

import itertools

import numpy as np
import pytest

from rigid_envs.control.linear import simulate_closed_loop
from rigid_envs.systems.free_body.closed_forms import growth_rate
from rigid_envs.systems.free_body.controllers import SeparatrixSteering, saddle
from rigid_envs.systems.free_body.system import FreeBody
from tests.control.claims import assert_within_limits_row_by_row, spinning

BODY, RATE, TORQUE, DT = FreeBody(1.1, 1.7, 2.3), 1.3, 0.1, 0.1
AXES = [axes for axes in itertools.product((True, False), repeat=3) if axes[0] or axes[2]]


def steering(axes=(True, True, True), body=BODY, rate=RATE, dt=DT):
    return SeparatrixSteering(body, rate, TORQUE, dt, axes)


def starts(rng, n, low=0.5, high=1.5):
    """Spins about any direction, of rates between two ones."""
    y = spinning(rng, (n,))
    size = np.linalg.norm(y[:, 4:7], axis=-1, keepdims=True)
    y[:, 4:7] *= rng.uniform(low, high, (n, 1)) / size
    return y


def test_saddle_coordinates_turn_eulers_equations_into_theirs():
    rng = np.random.default_rng(0)
    for moments in ((1.0, 2.0, 3.0), (1.1, 1.8, 2.5), (0.3, 0.4, 0.5)):
        r, growth, share = body = saddle(moments)
        assert growth == pytest.approx(growth_rate(moments, 1.0), rel=1e-14)
        y = FreeBody.state(omega_body=rng.normal(size=(50, 3)))
        rates = FreeBody(*moments).rhs(y)[:, 4:7]
        (d, s), w2 = body.coordinates(y[:, 4:7]), y[:, 5]
        d_rate, s_rate = body.coordinates(rates)
        for found, expected in (
            (d_rate, growth * w2 * d),
            (s_rate, -growth * w2 * s),
            (rates[:, 1], share * growth * (s**2 - d**2)),
        ):
            # a few roundings of terms of the size r omega^2
            np.testing.assert_allclose(found, expected, atol=1e-14 * (1.0 + r) * np.max(y**2))


def test_what_is_steered_is_energy_and_momentum():
    """W is 0 where 2 T I2 = L^2 and L = I2 Omega."""
    law, y = steering(), spinning(np.random.default_rng(0), (50,))
    I1, I2, I3 = BODY.moments
    square = np.sum(BODY.L_body(y) ** 2, axis=-1)
    apart = 2.0 * BODY.kinetic_energy(y) * I2 - square
    p = apart / (I1 * (I2 - I1))
    # of all quadratic forms of energy and momentum the one without omega1^2 - r^2 omega3^2
    E = (square + 0.5 * apart * (I3 / (I3 - I2) - I1 / (I2 - I1))) / I2**2
    slope = (E - y[:, 5] ** 2) / (y[:, 4] ** 2 + law.saddle.ratio**2 * y[:, 6] ** 2)
    np.testing.assert_allclose(slope, slope[0], rtol=1e-9)
    expected = 0.5 * ((p / RATE**2) ** 2 + (E / RATE**2 - 1.0) ** 2)
    np.testing.assert_allclose(law.lyapunov(y), expected, rtol=1e-11)


@pytest.mark.parametrize("axes", AXES)
def test_actions_stay_within_their_limits_and_off_the_axes_without_actuator(axes):
    law, y = steering(axes), starts(np.random.default_rng(0), 50)
    y[:10, 4:7] = [0.01, RATE, -0.02] + 0.02 * y[:10, 4:7]
    assert law.steers(y).any() and not law.steers(y).all()
    assert_within_limits_row_by_row(law, y)
    assert (law(y)[:, ~np.array(axes)] == 0.0).all()


@pytest.mark.parametrize("axes", AXES)
def test_no_torque_that_steers_adds_to_the_lyapunov_function(axes):
    law, y = steering(axes), starts(np.random.default_rng(0), 1000, 0.1, 3.0)
    y = y[law.steers(y)]
    rate, h = BODY.rhs(y, law.inputs(law(y))) - BODY.rhs(y), 1e-6
    after, before = (law.lyapunov(y + s * h * rate * ([0.0] * 4 + [1.0] * 3)) for s in (1.0, -1.0))
    slope = (after - before) / (2.0 * h)
    assert (slope <= 1e-9 * law.lyapunov(y).max()).all()
    if sum(axes) > 1:
        assert (slope < 0.0).mean() > 0.99


def test_between_samples_the_lyapunov_function_is_kept_and_over_them_it_falls():
    law, y = steering(dt=0.05), starts(np.random.default_rng(0), 100)
    value = law.lyapunov(simulate_closed_loop(lambda y: BODY.advance(y, None, 0.05, 2), y, 100))
    np.testing.assert_allclose(value, np.broadcast_to(value[0], value.shape), rtol=1e-6, atol=1e-9)
    states = simulate_closed_loop(lambda y: BODY.advance(y, law.inputs(law(y)), 0.05, 2), y, 800)
    value, steers = law.lyapunov(states), law.steers(states)
    rise = np.where(steers[:-1] & steers[1:], np.diff(value, axis=0), 0.0)
    assert rise.max() < 1e-3  # a held torque may outlast the sign of the gradient
    assert (value[-1] < 1e-2).mean() > 0.97


@pytest.mark.parametrize(
    ("axes", "share"),
    [
        ((True, True, True), 1.0),
        ((True, False, True), 1.0),
        ((False, True, True), 0.93),
        ((True, True, False), 0.9),
    ],
)
def test_weak_torque_captures_every_spin_and_most_of_them_in_a_minute(axes, share):
    """Of 1000 starts 1000, 1000, 972 and 946 in a minute."""
    law, y = steering(axes, FreeBody(), 1.0), starts(np.random.default_rng(1), 200)
    states = simulate_closed_loop(lambda y: law.body.advance(y, law.inputs(law(y)), DT, 3), y, 1500)
    there = np.linalg.norm(law.error(states), axis=-1) < 0.05
    assert there[550:600].all(axis=0).mean() >= share
    assert there[-50:].all()


def test_what_is_caught_is_held():
    """Where the catch begins, the unstable direction is within the reach of the torque."""
    law, rng = steering(), np.random.default_rng(0)
    omega = RATE * np.array([0.0, 1.0, 0.0]) + rng.uniform(-0.4, 0.4, (4000, 3))
    y = BODY.state(omega_body=omega)
    y = y[~law.steers(y)]
    assert len(y) > 100
    states = simulate_closed_loop(lambda y: BODY.advance(y, law.inputs(law(y)), DT, 3), y, 300)
    assert (np.linalg.norm(law.error(states[-1]), axis=-1) < 0.05 * RATE).all()


def test_an_actuator_about_e2_alone_is_refused():
    with pytest.raises(ValueError, match=r"axes = \(False, True, False\); expected an actuator"):
        steering((False, True, False))
    with pytest.raises(ValueError, match=r"^gain = 0\.0; expected a positive finite number"):
        SeparatrixSteering(BODY, RATE, TORQUE, DT, gain=0.0)
    with pytest.raises(ValueError, match=r"^torque = -0\.1; expected a positive finite number"):
        SeparatrixSteering(BODY, RATE, -0.1, DT)
