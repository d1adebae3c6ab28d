"""Flips in time and by force: the free motion that is followed, and how the error decreases."""

import numpy as np
import pytest

from rigid_envs.control.linear import simulate_closed_loop
from rigid_envs.systems.free_body.controllers import ForcedFlip, TimedFlip
from rigid_envs.systems.free_body.system import FreeBody
from tests.control.claims import assert_within_limits_row_by_row, rate_along, spinning

BODY, RATE = FreeBody(1.1, 1.7, 2.3), 1.3
FREE = 1e9  # N m, no limit
OMEGA = slice(4, 7)


def rate_of(law, y, action):
    return BODY.rhs(y, law.inputs(action))


@pytest.mark.parametrize("law", [ForcedFlip(BODY, RATE, 0.5), TimedFlip(BODY, RATE, 0.5)])
def test_actions_stay_within_their_limits_and_rows_are_independent(law):
    rng = np.random.default_rng(0)
    y = spinning(rng, (3, 5))
    left = () if isinstance(law, ForcedFlip) else (rng.uniform(-2.0, 9.0, (3, 5)),)
    assert_within_limits_row_by_row(law, y, *left)


def test_the_motion_to_join_is_a_free_one():
    """Each f(time_left) obeys Euler's equations and has the momentum and energy of the spin."""
    law, y = TimedFlip(BODY, RATE, 0.5), spinning(np.random.default_rng(0), (10,))
    left, h = np.linspace(0.1, 15.0, 200)[:, None], 1e-5
    f = law.reference(y, left)
    slope = (law.reference(y, left - h) - law.reference(y, left + h)) / (2.0 * h)
    euler = BODY.rhs(BODY.state(omega_body=f))[..., OMEGA]
    np.testing.assert_allclose(slope, euler, atol=1e-9)  # h^2 and eps / h
    L = BODY.moments * f
    np.testing.assert_allclose(np.sum(L**2, axis=-1), (BODY.I2 * RATE) ** 2, rtol=1e-13)
    np.testing.assert_allclose(np.sum(L * f, axis=-1), BODY.I2 * RATE**2, rtol=1e-13)


def test_at_the_commanded_time_the_motion_is_a_margin_away_from_the_flipped_spin():
    law, y = TimedFlip(BODY, RATE, 0.5, margin=0.02), spinning(np.random.default_rng(0), (10,))
    off = law.reference(y, 1e-9) + [0.0, RATE, 0.0] * np.ones((10, 1))
    # but for the second order of the margin, in omega2
    np.testing.assert_allclose(np.linalg.norm(off, axis=-1), 0.02 * RATE, rtol=0.02)


def test_the_error_of_brute_force_decreases_everywhere_as_stated():
    law, y = ForcedFlip(BODY, RATE, FREE), spinning(np.random.default_rng(0), (500,), 3.0)
    found = rate_along(law.lyapunov, y, rate_of(law, y, law(y)), OMEGA)
    value = law.lyapunov(y)
    I1, _, I3 = BODY.moments
    stated = RATE * (I3 - I1) * y[:, 4] * y[:, 6] - 2.0 * law.gain * RATE * value
    np.testing.assert_allclose(found, stated, atol=1e-12 * np.abs(found).max())
    assert (found <= -(2.0 * law.gain - (I3 - I1) / np.sqrt(I1 * I3)) * RATE * value).all()


def test_the_error_of_the_timed_flip_decreases_everywhere_as_stated():
    law, rng = TimedFlip(BODY, RATE, FREE), np.random.default_rng(0)
    y, left = spinning(rng, (500,), 3.0), rng.uniform(0.1, 12.0, 500)
    f, h = law.reference(y, left), 1e-6
    body_rate = rate_of(law, y, law(y, left))[:, OMEGA]
    error_rate = body_rate - BODY.rhs(BODY.state(omega_body=f))[:, OMEGA]
    error = y[:, OMEGA] - f
    found = np.sum(BODY.moments * error * error_rate, axis=-1)
    value = law.lyapunov(y, left)
    I1, I2, I3 = BODY.moments
    slowest = 2.0 * law.gain - np.sqrt(I2 / I1) * (I3 - I1) / np.sqrt(I1 * I3)
    assert (found <= -slowest * RATE * value).all()
    after = y.copy()
    after[:, OMEGA] += h * body_rate
    difference = (law.lyapunov(after, left - h) - value) / h
    same_side = np.abs(y[:, 4] - y[:, 6]) > 1e-2  # where the sign of d does not change in h
    np.testing.assert_allclose(difference[same_side], found[same_side], rtol=1e-3, atol=1e-3)


def test_without_limits_both_flips_come_from_everywhere():
    y = spinning(np.random.default_rng(0), (100,), 1.5)
    forced = ForcedFlip(BODY, RATE, FREE)
    states = simulate_closed_loop(
        lambda y: BODY.advance(y, forced.inputs(forced(y)), 0.02, 2), y, 400
    )
    assert (np.diff(forced.lyapunov(states), axis=0)[:100] < 0.0).all()
    np.testing.assert_allclose(states[-1, :, OMEGA], [[0.0, -RATE, 0.0]] * 100, atol=1e-9)
    timed, dt = TimedFlip(BODY, RATE, FREE), 0.02
    for k in range(500, -100, -1):
        y = BODY.advance(y, timed.inputs(timed(y, k * dt)), dt, 2)
        if k <= 1:
            off = np.linalg.norm(y[:, OMEGA] + [[0.0, RATE, 0.0]], axis=-1)
            assert off.max() < 0.05 * RATE


def test_gains_that_do_not_make_the_error_decrease_are_refused():
    with pytest.raises(ValueError, match=r"^gain = 0\.3; expected more than 0\.377"):
        ForcedFlip(BODY, RATE, 0.5, gain=0.3)
    with pytest.raises(ValueError, match=r"^gain = 0\.4; expected more than 0\.4689"):
        TimedFlip(BODY, RATE, 0.5, gain=0.4)
    with pytest.raises(ValueError, match=r"^margin = 0; expected a positive finite number"):
        TimedFlip(BODY, RATE, 0.5, margin=0)
