"""Long motions against closed forms: a hundred periods, and flips beside the separatrix."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from rigid_envs.mechanics.laws import EPS, matrices
from rigid_envs.systems.free_body import closed_forms as free_body
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.heavy_top import closed_forms as heavy_top
from rigid_envs.systems.heavy_top.system import HeavyTop
from tests.systems.measures import leaning

# A hundred periods of free body and heavy top against their closed forms.
#
# What can be asked for: the integrators are symmetric and (between roundings) Poisson, so that they
# follow, exactly but for exponentially little, a system that differs from the one meant by a part
# tau of fourth order in the step. For an oscillator, which the weight alone makes of a hanging top,
# tau is 9.3e-4 (rate h)^4, from the trace of the composed step: 5.5e-11 at 64 steps per radian of
# the fastest rate; twice that is allowed. Such a motion departs as the closed form does when its
# numbers are changed by the part tau: rates are wrong by a constant, phases by an angle that grows
# with t (and not with t^2, as where the energy drifts). So a tolerance is tau times the
# conditioning, which the closed form gives: the sum of what each relative change of one number
# does. Roundings, EPS in each of n steps, add EPS sqrt(n) times the conditioning: of n = 1e6,
# 2e-13.


PERIODS = 100
TAU = 1.1e-10


# Irregular moments on the way, and the end.
MOMENTS_OF_TIME = np.sort(np.append(np.mod(0.6180339887 * np.arange(1, 20), 1.0), 1.0))


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


# Flips beside the separatrix: simulated sign changes against the closed form 2 K / p.
#
# What can be asked for: the interval grows with the logarithm of the perturbation eps (relative to
# the spin), T = (2 / p) ln(c / eps), so a relative error x of eps moves it by 2 x / p, and the
# relative error of T is 2 x / (p T), a twentieth of x at eps = 1e-8: d ln T / d ln eps is small.
# But d ln eps / d eps = 1 / eps is not. Beside the axis the small components keep their own digits,
# and eps is as good as the state. During the flip all components are of the size of the spin, and
# eps is only left in the difference 2 T J2 - L^2, which is eps^2 of its terms: the roundings of one
# flip, some EPS each, change eps by the part EPS / eps^2, which is all of it from 1e-8 on. No
# simulation in double precision does better. So every interval is compared with the closed form for
# the state in its own middle, beside the axis; and the perturbation given at the start decides the
# interval about the start, which is found by going both ways from there.


PER_RADIAN = 32.0  # steps per radian of the fastest rate in the motion


def truncation(body, omega0):
    """Relative truncation error of an interval, that of the growth rate p.

    At 64 steps per radian of the fastest rate the integrator, which is of fourth order, errs by up
    to 1e-10 per radian; and there are rate / p of these in one of the growth.
    """
    rate = body.rate_bound(body.state(omega_body=omega0), np.zeros(3), 0.0)
    growth = abs(free_body.polhode(body.moments, omega0).rate)
    return 1e-10 * (64.0 / PER_RADIAN) ** 4 * rate / growth


@dataclass
class Flips:
    """Sign changes of the component about the intermediate axis, and what was in between."""

    times: np.ndarray
    middles: list[np.ndarray]  # omega half way from each to the next

    @property
    def intervals(self):
        return np.diff(self.times)


def flips(body, omega0, *, per_radian=PER_RADIAN, after=1):
    """The last sign change before t = 0 and those after it, by root finding in the simulation."""
    y, middle = body.state(omega_body=omega0), int(np.argsort(body.moments)[1])
    step = 1.0 / (per_radian * body.rate_bound(y, np.zeros(3), 0.0))
    interval = free_body.polhode(body.moments, omega0).flip_interval

    def crossings(direction, count):
        t = direction * np.arange(0.0, (count + 0.6) * interval, 4.0 * step)
        trajectory = body.simulate(y, t, max_step=step)
        turning = trajectory["omega_body"][:, middle]

        def crossing(k):
            def component(s):
                if s == 0.0:
                    return turning[k]
                ahead = body.simulate(trajectory.y[k], [0.0, s], max_step=step)
                return ahead["omega_body"][-1, middle]

            return t[k] + brentq(component, 0.0, t[k + 1] - t[k], xtol=1e-14)

        changes = np.flatnonzero(turning[:-1] * turning[1:] < 0.0)[:count]
        return [crossing(k) for k in changes], t, trajectory["omega_body"]

    before, _, _ = crossings(-1.0, 1)
    later, t, omega = crossings(1.0, after)
    times = np.array(before + later)
    halves = 0.5 * (times[1:-1] + times[2:])
    return Flips(times, [np.array(omega0), *omega[np.searchsorted(t, halves)]])


def perturbed(moments, spin, eps, angle):
    """Spin about the intermediate axis, and eps of it across, at an angle."""
    low, middle, high = np.argsort(moments)
    omega = np.zeros(3)
    omega[[low, middle, high]] = spin * np.array([eps * np.cos(angle), 1.0, eps * np.sin(angle)])
    return omega


@settings(max_examples=60)
@given(
    masses=st.tuples(*[st.floats(0.1, 1.0)] * 3),
    spin=st.floats(0.3, 3.0),
    decades=st.floats(2.0, 8.0),
    angle=st.floats(-3.2, 3.2),
)
@example(masses=(0.1, 0.55, 1.0), spin=-1.0, decades=8.0, angle=0.8)
def test_every_flip_takes_the_interval_of_the_state_in_its_middle(masses, spin, decades, angle):
    a, b, c = masses
    body = FreeBody(b + c, c + a, a + b)
    omega0 = perturbed(body.moments, spin, 10.0**-decades, angle)
    assume(free_body.growth_rate(body.moments, spin) > 0.1 * abs(spin))
    # Exactly on the separatrix nothing flips, and beside it the start is not in the middle.
    assume(free_body.polhode(body.moments, omega0).m1 > 0.1 * 10.0 ** (-2.0 * decades))
    found = flips(body, omega0, after=3)
    expected = [free_body.polhode(body.moments, w).flip_interval for w in found.middles]
    tolerance = truncation(body, omega0)
    assert tolerance <= 1e-6
    np.testing.assert_allclose(found.intervals, expected, rtol=tolerance)
