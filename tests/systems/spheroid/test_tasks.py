"""Turning a tippe top over by little torque about its axis."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rigid_envs.mechanics.equations import gamma
from rigid_envs.systems.spheroid import references
from rigid_envs.systems.spheroid.controllers import TippeTopSpin
from rigid_envs.systems.spheroid.system import Spheroid
from rigid_envs.systems.spheroid.tasks.tippe_top import TippeTop
from tests.refusals import refuses
from tests.systems.runs import at_random, bound, run, still

TOP = Spheroid()


def jellett(y):
    return TOP.invariants(y)["jellett"]


def test_the_references_turn_every_top_over_and_two_spins_cost_less_than_one():
    two, one = (run("TippeTop", bound(f), 200) for f in (references.two_spins, references.spin_up))
    assert two.success.all() and one.success.all()
    assert two.cost.mean() < 0.98 * one.cost.mean()
    for runs in (two, one):  # more than a top needs to stand, but not by more than an eighth
        spare = np.abs(jellett(runs.y[-1])) / TOP.standing_jellett - 1.0
        assert 0.05 < spare.min() and spare.max() < 0.125


@pytest.mark.parametrize("factory", [references.two_spins, references.spin_up])
def test_the_references_use_no_lever_below_half_the_radius(factory):
    task = TippeTop(radius=2.0, offset=0.6, I1=1.52, I3=1.6)
    y = task.system().state(tilt=np.arccos((np.array([1.1, 0.9, -0.9, -1.1]) + 0.6) / 2.0))
    acts = factory(task)(SimpleNamespace(y=y))[:, 0] != 0.0
    np.testing.assert_array_equal(acts, [True, False, False, True])


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


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_last_torque_is_as_long_as_it_has_to_be(sense):
    law = TippeTopSpin(TOP, 0.5, 0.2, rise=2.0, stand=3.0)
    y = TOP.state(tilt=0.1, spin=sense * 1.99 / (TOP.I3 * (np.cos(0.1) - TOP.offset)))
    end = TOP.advance(y, law.inputs(law(y)), 0.2, 20)
    assert 0.0 < sense * law(y)[0] < 1.0
    assert abs(jellett(end) - sense * 2.0) < 1e-3  # the lean hardly changes in a period


def test_a_torque_whose_lever_is_0_or_the_least_one_is_not_used():
    y = TOP.state(tilt=0.8)
    height = float(TOP.radius * gamma(y)[2])
    for offset, least in ((height, 0.0), (TOP.offset, height - TOP.offset)):
        top = replace(TOP, offset=offset)
        assert TippeTopSpin(top, 0.5, 0.2, rise=2.0, stand=3.0, least_arm=least)(y) == 0.0


def test_a_top_that_does_not_turn_is_spun_in_the_positive_sense():
    law = TippeTopSpin(TOP, 0.5, 0.2, rise=2.0, stand=3.0)
    np.testing.assert_array_equal(law(TOP.state(tilt=[0.1, 0.5])), 1.0)


def test_bodies_that_are_no_tippe_top_are_refused():
    egg = Spheroid(half_height=1.2)
    refuses("top = .*expected a sphere", TippeTopSpin, egg, 0.5, 0.2, rise=1.0, stand=2.0)
