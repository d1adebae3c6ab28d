"""Turning a tippe top over by little torque about its axis."""

import numpy as np
import pytest

from rigid_envs.systems.spheroid import references
from rigid_envs.systems.spheroid.controllers import TippeTopSpin
from rigid_envs.systems.spheroid.system import Spheroid
from tests.refusals import refuses
from tests.systems.runs import at_random, bound, run, still

TOP = Spheroid()


def jellett(y):
    return TOP.invariants(y)["jellett"]


def test_the_references_turn_every_top_over_and_two_spins_cost_less_than_one():
    two, one = (run("TippeTop", bound(f), 200) for f in (references.two_spins, references.spin_up))
    assert two.success.all() and one.success.all()
    assert two.cost.mean() < 0.98 * one.cost.mean()


@pytest.mark.parametrize("policy", [still, at_random()])
def test_without_a_plan_no_top_turns_over(policy):
    assert not run("TippeTop", policy, 100).success.any()


def test_jelletts_integral_changes_by_the_torque_alone():
    """J' = (r cos(theta) - a) tau, by Simpson's rule over periods that are divided in two."""
    rng, n, dt = np.random.default_rng(0), 50, 0.02
    y = TOP.state(tilt=rng.uniform(0.0, np.pi, n), spin=rng.uniform(-6.0, 6.0, n))
    u = np.zeros((n, 5))
    u[:, 2] = rng.uniform(-0.5, 0.5, n)
    rows = [y]
    for _ in range(2):
        rows.append(TOP.advance(rows[-1], u, 0.5 * dt, 8))
    arms = np.cos(TOP.tilt(np.stack(rows))) - TOP.offset
    gained = u[:, 2] * dt * (arms[0] + 4.0 * arms[1] + arms[2]) / 6.0
    # Simpson: dt^5 / 2880 times the fourth derivative, (6 rad/s)^4
    np.testing.assert_allclose(jellett(rows[2]) - jellett(y), gained, rtol=0, atol=1e-8)


def test_a_top_that_reaches_the_threshold_stays_on_its_head_and_below_it_falls():
    """The rates of the page: spins by a twentieth above and below, with a small lean."""
    for rate, start, rises in (
        (TOP.rising_spin, 0.02, True),
        (TOP.standing_spin, np.pi - 0.02, False),
    ):
        y = TOP.state(tilt=[start, start], spin=[0.95 * rate, 1.05 * rate])
        end = np.sin(TOP.simulate(y, [0.0, 60.0])["tilt"][-1])
        slow, fast = end > 0.02
        assert (slow, fast) == ((False, True) if rises else (True, False))


def test_the_controller_acts_only_where_its_torque_does_something():
    law = TippeTopSpin(TOP, 0.5, 0.2, rise=2.0, stand=3.0, least_arm=0.5)
    tilts = np.array([0.2, np.arccos(0.8) + 0.01, 1.4, np.arccos(-0.2) + 0.01, 3.0])
    # J of 0.5: below both thresholds
    y = TOP.state(tilt=tilts, spin=0.5 / (TOP.I3 * (np.cos(tilts) - TOP.offset)))
    np.testing.assert_array_equal(np.sign(law(y)[:, 0]), [1.0, 0.0, 0.0, -1.0, -1.0])
    mirrored = TOP.state(tilt=tilts, spin=-0.5 / (TOP.I3 * (np.cos(tilts) - TOP.offset)))
    np.testing.assert_array_equal(law(mirrored), -law(y))
    np.testing.assert_array_equal(law.inputs(law(y))[:, 2], 0.5 * law(y)[:, 0])


def test_the_last_torque_is_as_long_as_it_has_to_be():
    law = TippeTopSpin(TOP, 0.5, 0.2, rise=2.0, stand=3.0)
    y = TOP.state(tilt=0.1, spin=1.99 / (TOP.I3 * (np.cos(0.1) - TOP.offset)))
    end = TOP.advance(y, law.inputs(law(y)), 0.2, 20)
    assert 0.0 < law(y)[0] < 1.0
    assert abs(jellett(end) - 2.0) < 1e-3  # the lean hardly changes in a period


def test_bodies_that_are_no_tippe_top_are_refused():
    egg = Spheroid(half_height=1.2)
    refuses("top = .*expected a sphere", TippeTopSpin, egg, 0.5, 0.2, rise=1.0, stand=2.0)
