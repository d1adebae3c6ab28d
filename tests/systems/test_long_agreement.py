"""A hundred periods of free body and heavy top against their closed forms.

What can be asked for: the integrators are symmetric and (between roundings) Poisson, so that they
follow, exactly but for exponentially little, a system that differs from the one meant by a part tau
of fourth order in the step. For an oscillator, which the weight alone makes of a hanging top, tau
is 9.3e-4 (rate h)^4, from the trace of the composed step: 5.5e-11 at 64 steps per radian of the
fastest rate; twice that is allowed. Such a motion departs as the closed form does when its numbers
are changed by the part tau: rates are wrong by a constant, phases by an angle that grows with t
(and not with t^2, as where the energy drifts). So a tolerance is tau times the conditioning, which
the closed form gives: the sum of what each relative change of one number does.
Roundings, EPS in each of n steps, add EPS sqrt(n) times the conditioning: of n = 1e6, 2e-13.
"""

import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from rigid_envs.mechanics.laws import EPS, matrices
from rigid_envs.systems.free_body import closed_forms as free_body
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.heavy_top import closed_forms as heavy_top
from rigid_envs.systems.heavy_top.system import HeavyTop
from tests.systems.measures import leaning

PERIODS = 100
TAU = 1.1e-10


# Irregular moments on the way, and the end.
MOMENTS_OF_TIME = np.sort(np.append(np.mod(0.6180339887 * np.arange(1, 20), 1.0), 1.0))
RACKET = FreeBody(1.0, 2.0, 3.0)


def conditioning(solve, constants, omega0, rate):
    """What changes of all numbers do to the closed form, per relative size of the change.

    Constants change by a part of themselves, angular velocities by one of the fastest rate. 1e-9:
    little enough to be linear in up to 1e5 radians, and 1e4 roundings at the least.
    """
    base, share = solve(constants, omega0), 1e-9
    effect = np.zeros_like(base)
    for unit in np.eye(3):
        for changed in (
            solve(constants * (1.0 + share * unit), omega0),
            solve(constants, omega0 + share * rate * unit),
        ):
            effect += np.abs(changed - base) / share
    # One change can leave one component alone at one time: the largest counts.
    return np.append(np.full(3, effect[:, :3].max()), np.full(9, effect[:, 3:].max()))


def agrees(system, y, t, solve, constants):
    """Check a simulation, from t = 0, against `solve` for rates and attitude at the times t."""
    constants, omega0 = np.array(constants), y[4:7]
    trajectory = system.simulate(y, np.append(0.0, t))
    R = matrices(trajectory["q"][1:]).reshape(-1, 9)
    found = np.concatenate([trajectory["omega_body"][1:], R], axis=-1)
    rate = system.rate_bound(y, np.zeros(len(system.input_entries)), 0.0)
    tolerance = TAU * conditioning(solve, constants, omega0, rate) + 64.0 * EPS * (1.0 + rate)
    assert np.all(np.abs(found - solve(constants, omega0)) <= tolerance)


def free(t, q0):
    """Closed form of the free body as a function of its moments and its start."""

    def solve(moments, omega0):
        R = matrices(free_body.attitude(t, moments, omega0, q0)).reshape(-1, 9)
        return np.concatenate([free_body.omega(t, moments, omega0), R], axis=-1)

    return solve


def heavy(t, q0):
    """Closed form of the symmetric top as a function of I, I3, mgl and its start."""

    def solve(constants, omega0):
        body = dict(zip(("i_perp", "i3", "mgl"), constants, strict=True))
        R = matrices(heavy_top.attitude(t, omega0, q0, **body)).reshape(-1, 9)
        return np.concatenate([heavy_top.omega(t, omega0, q0, **body), R], axis=-1)

    return solve


MASS = st.floats(0.15, 1.0)
RATE = st.floats(-2.0, 2.0).map(lambda x: round(x, 6))
QUATERNION = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1)


@settings(max_examples=20)
@given(masses=st.tuples(MASS, MASS, MASS), omega0=st.tuples(RATE, RATE, RATE), q=QUATERNION)
@example(masses=(0.5, 0.5, 0.2), omega0=(0.3, 0.2, 1.0), q=(1.0, 0.0, 0.0, 0.0))
@example(masses=(0.5, 0.5, 0.5), omega0=(0.3, 0.2, 1.0), q=(0.5, 0.5, 0.5, 0.5))
def test_any_free_body_follows_its_closed_form_for_a_hundred_periods(masses, omega0, q):
    a, b, c = masses
    body, q0 = FreeBody(b + c, c + a, a + b), np.array(q) / np.linalg.norm(q)
    path, y = free_body.polhode(body.moments, omega0), body.state(q=q0, omega_body=omega0)
    # Beside the separatrix a flip changes the period itself: that has tests of its own.
    assume(path.m1 > 0.01 and np.linalg.norm(omega0) > 0.1)
    rate = body.rate_bound(y, np.zeros(3), 0.0)
    # A sphere has no period of its own: a hundred turns.
    period = min(path.period, 2.0 * math.pi / rate if body.moments.std() == 0.0 else math.inf)
    assume(period * rate < 1000.0)
    t = PERIODS * period * MOMENTS_OF_TIME
    agrees(body, y, t, free(t, q0), body.moments)


@settings(max_examples=20)
@given(
    i_perp=st.floats(0.5, 2.0),
    aspect=st.floats(0.1, 1.9),
    mgl=st.floats(0.3, 2.0),
    omega=st.tuples(RATE, RATE),
    spin=st.floats(-2.0, 2.0),
    q=QUATERNION,
)
@example(1.0, 0.5, 1.0, (1.0, 0.5), 0.5, (1.0, 0.0, 0.0, 0.0))  # through the upper pole
@example(1.0, 0.5, 1.0, (1.0, 0.5), 0.5, (0.0, 1.0, 0.0, 0.0))  # through the lower one
@example(1.0, 0.5, 1.0, (0.0, 0.0), 2.0, (0.8, 0.6, 0.0, 0.0))  # cusps
def test_any_symmetric_top_follows_its_closed_form_for_a_hundred_periods(
    i_perp, aspect, mgl, omega, spin, q
):
    body = {"i_perp": i_perp, "i3": aspect * i_perp, "mgl": mgl}
    omega0 = (*omega, spin * heavy_top.sleeping_threshold(**body))
    q0 = np.array(q) / np.linalg.norm(q)
    top = HeavyTop(i_perp, i_perp, body["i3"], m=0.125, g=64.0 * mgl, ell=0.125)
    y = top.state(q=q0, omega_body=omega0)
    swing = heavy_top.nutation(omega0, q0, **body)
    assume(swing.m1 > 0.01)  # the way to upright is infinitely long
    t = PERIODS * swing.period * MOMENTS_OF_TIME
    agrees(top, y, t, heavy(t, q0), list(body.values()))


def oscillator(weights, angle):
    """Relative error of the frequency when kicks and drifts are composed, rate times step `angle`.

    A step is a symplectic matrix; the cosine of the phase that it turns by is half of its trace.
    """
    step = np.eye(2)
    for part in weights:
        kick = np.array([[1.0, 0.0], [-0.5 * part * angle, 1.0]])
        step = kick @ np.array([[1.0, part * angle], [0.0, 1.0]]) @ kick @ step
    return math.acos(0.5 * np.trace(step)) / angle - 1.0


def test_a_small_swing_is_late_by_what_the_composition_does_to_an_oscillator():
    top, per_radian, periods = HeavyTop(g=8.0, ell=0.125), 8.0, 500  # swings at 1 rad/s
    y = top.state(q=leaning(math.pi - 1e-5))
    t = 2.0 * math.pi * periods + np.linspace(0.0, 6.0, 25)
    R = top.simulate(y, np.append(0.0, t), max_step=1.0 / per_radian)["R"][1:]
    swing, turning = -R[:, 1, 2] / 1e-5, np.stack([np.cos(t), np.sin(t)], axis=-1)
    cosine, sine = np.linalg.lstsq(turning, swing, rcond=None)[0]
    expected = oscillator(top.weights, 1.0 / per_radian) * 2.0 * math.pi * periods
    # One percent: the phase within the last period, and the square of the amplitude.
    assert math.atan2(-sine, cosine) == pytest.approx(expected, rel=0.01)
    assert abs(oscillator(top.weights, 1.0 / 64.0)) == pytest.approx(TAU / 2.0, rel=0.02)
