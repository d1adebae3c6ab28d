"""Flips beside the separatrix: simulated sign changes against the closed form 2 K / p.

What can be asked for: the interval grows with the logarithm of the perturbation eps (relative to
the spin), T = (2 / p) ln(c / eps), so a relative error x of eps moves it by 2 x / p, and the
relative error of T is 2 x / (p T), a twentieth of x at eps = 1e-8: d ln T / d ln eps is small. But
d ln eps / d eps = 1 / eps is not. Beside the axis the small components keep their own digits, and
eps is as good as the state. During the flip all components are of the size of the spin, and eps is
only left in the difference 2 T J2 - L^2, which is eps^2 of its terms: the roundings of one flip,
some EPS each, change eps by the part EPS / eps^2, which is all of it from 1e-8 on. No simulation in
double precision does better. So every interval is compared with the closed form for the state in
its own middle, beside the axis; and the perturbation given at the start decides the interval about
the start, which is found by going both ways from there.
"""

from dataclasses import dataclass

import numpy as np
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from rigid_envs.systems.free_body import closed_forms as free_body
from rigid_envs.systems.free_body.system import FreeBody

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
