"""Measures of simulated motions: order of convergence, drift, error estimate by step doubling."""

from dataclasses import dataclass

import numpy as np
import pytest

from rigid_envs.mechanics.integration import Trajectory
from rigid_envs.mechanics.laws import EPS


def orders(errors):
    """Powers of the step with which errors fall, for steps that are halved each time."""
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


@dataclass(frozen=True)
class Refined:
    """A motion in constant steps, and in steps twice as long.

    Attributes:
        trajectory: the motion in the shorter steps.
        coarse: the motion in the longer ones.
        steps: how many of the shorter ones there are.
        rate: largest rate on the way [rad/s].
        turned: rate times the whole time [rad].
    """

    trajectory: Trajectory
    coarse: Trajectory
    steps: float
    rate: float
    turned: float

    def tolerance(self, name, size, cond=1.0):
        """How far a named quantity may be from the truth.

        With order four the difference of the two is 15 times the error of the better one: a fifth
        of it is allowed. Each of the ten kicks of a step rounds a velocity by half a unit, to the
        same side at worst: `size` is what velocities that are wrong by a part of themselves make of
        the quantity. Roundings of the start count `cond` times.
        """
        missed = np.max(np.abs(self.trajectory[name] - self.coarse[name])) / 5.0
        return float(missed) + EPS * (64.0 * cond + 5.0 * self.steps * size)


def refined(system, y0, t, u=None, per_radian=16.0):
    """The motion in so many steps per radian of the fastest rate on its way, and in twice as many.

    The rates are those of the motion in default steps.
    """
    default = system.simulate(y0, t, u).y
    rest = system.checked_input(None)
    rate = max(system.rate_bound(row, rest, 0.0) for row in default)
    step, span = 1.0 / (per_radian * rate), float(abs(t[-1] - t[0]))
    coarse, fine = (system.simulate(y0, t, u, max_step=step / k) for k in (1, 2))
    return Refined(fine, coarse, 2.0 * span / step, rate, rate * span)


def is_level(t, values, share=0.1):
    """Whether values oscillate but go nowhere.

    The straight line that fits them best changes by less than a share of their size in all the
    time. An oscillation seen at 20 000 moments leaves a hundredth; 1e-12 is for roundings.
    """
    slope = np.polyfit(t / (t[-1] - t[0]), values, 1)[0]
    return abs(slope) <= share * np.max(np.abs(values)) + 1e-12


def sample_steps(n_steps, size):
    """Numbers of steps at which to look, 0 and `n_steps` among them.

    Irregular: regular ones can beat with a periodic motion, and a beat looks like a drift.
    """
    inside = np.random.default_rng(0).choice(n_steps - 1, size, replace=False) + 1
    return np.concatenate([[0], np.sort(inside), [n_steps]])


def million_steps(system, y0, dt, moments=20000):
    """A million steps, seen at so many moments."""
    return system.simulate(y0, sample_steps(10**6, moments) * dt, max_step=dt)


def assert_energy_stays(trajectory, bound, size=None, share=0.1):
    """The energy changes by no more than a bound, and goes nowhere; attitudes stay unit.

    Args:
        trajectory: of one start.
        bound: of the change.
        size: in parts of which the change is measured; by default the energy at the start.
        share: see `is_level`.
    """
    energy = trajectory.invariants["energy"]
    change = (energy - energy[0]) / (size or energy[0])
    assert np.max(np.abs(change)) <= bound
    assert is_level(trajectory.t, change, share)
    if "q" in trajectory:
        assert np.max(np.abs(np.linalg.norm(trajectory["q"], axis=-1) - 1.0)) <= 1e-14


def leaning(theta):
    """Attitude with Euler angles (0, theta, 0): turned about world x."""
    return (np.cos(0.5 * theta), np.sin(0.5 * theta), 0.0, 0.0)


def seeds(n, of):
    """Seeds below `of`: the first n by default, the others with `-m long`."""
    return [*range(n), *(pytest.param(k, marks=pytest.mark.long) for k in range(n, of))]


def random_attitude(rng):
    """A unit quaternion, uniform on the rotation group."""
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def random_moments(rng):
    """Principal moments of a body: second moments of mass along the axes, added in pairs."""
    a, b, c = rng.uniform(0.05, 1.0, 3)
    return np.array([b + c, c + a, a + b])
