"""Spin about the intermediate axis: holding, aligning, capturing and flipping it."""

import math
from functools import partial

import numpy as np
import pytest

from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.systems.free_body.controllers import saddle
from rigid_envs.systems.free_body.references import (
    energy_casimir,
    forced_flip,
    separatrix_steering,
    single_torque,
    spin_regulator,
    timed_flip,
)
from rigid_envs.systems.free_body.tasks.intermediate_axis import IntermediateAxisRandom
from tests.tasks.runs import bound, run

GROWTH = 1.0 / math.sqrt(3.0)  # of the default body at Omega = 1, [1/s]
LEAST = 2.0 * 2.0 * 1.0  # 2 L = 2 I2 Omega [N m s]


def bang_bang(seed=0):
    rng = np.random.default_rng(seed)
    return lambda envs: rng.choice([-1.0, 1.0], envs.action_space.shape)


@pytest.mark.parametrize("law", [spin_regulator, energy_casimir])
@pytest.mark.parametrize("name", ["IntermediateAxis", "IntermediateAxisRandom"])
def test_linear_and_energy_casimir_feedback_hold_the_intermediate_axis(name, law):
    found = run(name, bound(law))
    assert found.success.all()
    assert found.cost.mean() < 0.6  # N m s


def test_every_start_of_every_drawn_body_can_be_held_by_the_torque_there_is():
    """Its growth on the unstable direction is less than what full torque takes away."""
    rng, task = np.random.default_rng(0), IntermediateAxisRandom()
    for I1, I2, I3 in rng.uniform(*np.transpose([task.I1, task.I2, task.I3]), (2000, 3)):
        body = saddle(np.array([I1, I2, I3]))
        second = task.start_spread * np.linspace(-1.0, 1.0, 41)
        unstable = np.sqrt(task.start_spread**2 - second**2) * np.hypot(1.0, body.ratio)
        growth = body.growth * (task.spin_rate + second) * unstable
        assert growth.max() < task.torque * (1.0 / I1 + body.ratio / I3)


def test_one_torque_aligns_the_spin_with_the_intermediate_axis():
    assert run("IntermediateAxisSingle", bound(single_torque)).success.all()


def test_one_torque_stabilises_just_above_its_threshold_and_not_just_below():
    """With eps = 1 +- 0.05 of I2 - I1 and k = 1 the slow root of ``mu^2 + mu / 3 +- 0.05 / 3``
    is -0.061 or +0.044 [1/s]: over 115 s, factors of 1e-3 or 150 on a perturbation of 0.05."""
    success = {}
    for strength in (0.95, 1.05):
        success[strength] = run(
            "IntermediateAxisSingle",
            bound(partial(single_torque, strength=strength, damping=1.0 / 3.0)),
            start_spread=0.05,
            max_episode_steps=1200,
            n_substeps=7,  # for what full torque could do in that time
        ).success
    assert success[1.05].all()
    assert success[0.95].mean() < 0.01


# what no torque about that axis alone can change; the moments are 1, 2, 3
FORMS = {
    "e1": (0.0, 2.0, 6.0),  # 0, I2 (I2 - I1), I3 (I3 - I1)
    "e2": (1.0, 0.0, -3.0),  # I1 (I2 - I1), 0, I3 (I2 - I3): 2 T I2 - L^2
    "e3": (2.0, 2.0, 0.0),  # I1 (I3 - I1), I2 (I3 - I2), 0
}


@pytest.mark.parametrize("axis", FORMS)
def test_one_torque_alone_keeps_a_quadratic_form_whatever_it_does(axis):
    drifts = []
    for n_substeps in (3, 6, 24):
        found = run("SpinCapture", bang_bang(), actuators=axis, n_substeps=n_substeps)
        form = found.y[..., 4:7] ** 2 @ FORMS[axis]
        drifts.append(np.max(np.abs(form - form[0])))
    # what is left is the error of a method of fourth order
    assert drifts[0] < 1e-7
    assert 14.0 < drifts[0] / drifts[1] < 18.0
    assert drifts[2] < 1e-10


def test_the_invariant_of_the_single_torque_holds_in_its_own_task():
    found = run("IntermediateAxisSingle", bang_bang(), n_substeps=16)
    form = found.y[..., 4:7] ** 2 @ FORMS["e3"]
    np.testing.assert_allclose(form, np.broadcast_to(form[0], form.shape), rtol=1e-10)


def test_a_torque_about_e3_alone_captures_no_spin():
    """It keeps omega1^2 + omega2^2 = c: no nearer to e2 than abs(sqrt(c) - 1)."""
    for policy in (bound(separatrix_steering), bang_bang()):
        found = run("SpinCapture", policy, actuators="e3")
        omega = found.y[..., 4:7]
        nearest = np.abs(np.hypot(omega[0, :, 0], omega[0, :, 1]) - 1.0)
        error = np.linalg.norm(omega - [0.0, 1.0, 0.0], axis=-1)
        assert (error > nearest - 1e-7).all()
        assert not found.success[nearest > 0.05].any()
        assert found.success.mean() < 0.1  # the others started with a c that will do


@pytest.mark.parametrize(
    ("actuators", "least"), [("e1 e2 e3", 0.99), ("e1 e3", 0.99), ("e2 e3", 0.93), ("e1 e2", 0.9)]
)
def test_steering_onto_the_separatrix_captures_the_spin(actuators, least):
    """Of 1000 starts: 1000, 1000, 967 and 949."""
    found = run("SpinCapture", bound(separatrix_steering), actuators=actuators)
    assert found.success.mean() >= least
    if actuators == "e1 e2 e3":
        assert found.cost.mean() < 1.6  # N m s


def test_the_timed_flip_comes_in_time_for_a_twentieth_of_brute_force():
    timed, forced = (run("AxisFlip", bound(law)) for law in (timed_flip, forced_flip))
    assert timed.success.all()
    assert forced.success.all()
    assert timed.cost.mean() < 0.05 * forced.cost.mean()
    assert timed.reward.mean() > forced.reward.mean() + 20.0


def test_brute_force_costs_twice_the_angular_momentum():
    def reverse(envs):
        task = envs.task
        action = np.zeros(envs.action_space.shape)
        action[:, 1] = 2.0 * (-task.spin_rate - envs.y[:, 5]) / (task.torque * task.dt)
        return np.maximum(action, -1.0)

    found = run("AxisFlip", reverse, n=1, start_spread=0.0, flip_time=8.0)
    assert found.success.all()
    # 80 steps; the actions are rounded to float32
    np.testing.assert_allclose(found.cost, LEAST, rtol=80 * np.finfo(np.float32).eps)


def test_the_impulse_of_a_free_flip_falls_exponentially_with_the_time_that_is_given():
    """Like exp(-lambda T): a push of this size grows in T to the size of Omega."""
    times = np.array([16.0, 18.0, 20.0, 22.0])
    flips = [
        run(
            "AxisFlip", bound(timed_flip), n=1, start_spread=0.0, flip_time=t, max_episode_steps=260
        )
        for t in times.tolist()
    ]
    assert all(flip.success.all() for flip in flips)
    costs = np.concatenate([flip.cost for flip in flips])
    # corrections: the square of the push, and the error of the integrator beside the last push
    np.testing.assert_allclose(np.diff(np.log(costs)) / np.diff(times), -GROWTH, rtol=2e-3)
    assert costs[-1] < 1e-3 * LEAST


def test_a_flip_counts_from_the_commanded_time_on_and_only_if_it_lasts():
    envs = RigidVectorEnv("rigid_envs.tasks:AxisFlip", 1, flip_time=1.0)
    flipped = {"omega_body": [0.0, -1.0, 0.0]}
    envs.reset(seed=0, options={"state": flipped})
    still, push = np.zeros((1, 3), np.float32), np.array([[0.0, 0.8, 0.0]], np.float32)
    said = []
    for action in [still] * 12 + [push] * 3 + [-push] * 3 + [still] * 5:
        said.append(bool(envs.step(action)[4]["is_success"][0]))
    # each push changes omega2 by 0.02: the third is too much, and taken back too late
    assert said == [False] * 9 + [True] * 5 + [False] * 9
    np.testing.assert_allclose(envs.y[0, 4:7], flipped["omega_body"], atol=1e-6)
