"""Tasks of a free body: solved by reference controllers, and within their bounds."""

import importlib
import math

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from rigid_envs.base.checks import ConfigError
from rigid_envs.systems.free_body.controllers import MomentumRegulator, saddle
from rigid_envs.systems.free_body.references import (
    energy_casimir,
    forced_flip,
    momentum_brake,
    momentum_regulator,
    quaternion_pd,
    separatrix_steering,
    single_torque,
    spin_regulator,
    timed_flip,
)
from rigid_envs.systems.free_body.tasks.axis_flip import AxisFlip
from rigid_envs.systems.free_body.tasks.detumble import Detumble
from rigid_envs.systems.free_body.tasks.intermediate_axis import IntermediateAxisRandom
from rigid_envs.systems.free_body.tasks.intermediate_axis_single import IntermediateAxisSingle
from rigid_envs.systems.free_body.tasks.spin_capture import SpinCapture
from rigid_envs.tasks.registry import ENVIRONMENTS
from tests.systems.runs import bound, run

BOUNDED = ("IntermediateAxisSingle", "SpinCapture", "AxisFlip", "Detumble", "Reorient")


def spin_up(envs):
    """As much energy as possible at every moment: each torque along its angular velocity."""
    omega = envs.y[:, 4:7]
    if type(envs.task) is IntermediateAxisSingle:
        omega = omega[:, 2:]
    if envs.task.n_goal or type(envs.task) in (AxisFlip, SpinCapture, IntermediateAxisSingle):
        return np.where(omega < 0.0, -1.0, 1.0)
    momentum = omega * envs.task.system().moments
    return momentum / np.linalg.norm(momentum, axis=-1, keepdims=True)


@pytest.mark.parametrize("name", BOUNDED)
def test_no_motion_before_the_time_limit_is_faster_than_its_bound(name):
    record = ENVIRONMENTS[f"RigidEnvs/{name}-v0"]
    module, kind = record.task.split(":")
    task_type = getattr(importlib.import_module(module), kind)
    fast = np.linalg.norm(run(name, spin_up).y[..., 4:7], axis=-1).max()
    task = task_type()
    assert 0.3 < fast / task.largest_rate(record.max_episode_steps * task.dt) <= 1.0


@pytest.mark.parametrize("task", [IntermediateAxisSingle, SpinCapture, AxisFlip])
def test_moments_out_of_order_are_refused_by_name(task):
    with pytest.raises(ConfigError, match=r"^config\.I1: I1 = 2\.5; expected less than I2 = 2\.0"):
        task(I1=2.5)
    with pytest.raises(ConfigError, match=r"^config\.I3: I3 = .*; expected more than I2 = "):
        task(I2=(1.5, 2.5), I3=(2.4, 2.45))


GROWTH = 1.0 / math.sqrt(3.0)  # of the default body at Omega = 1, [1/s]
LEAST = 2.0 * 2.0 * 1.0  # 2 L = 2 I2 Omega [N m s]


def bang_bang(seed=0):
    rng = np.random.default_rng(seed)
    return lambda envs: rng.choice([-1.0, 1.0], envs.action_space.shape)


@pytest.mark.parametrize("controller", [spin_regulator, energy_casimir])
@pytest.mark.parametrize("name", ["IntermediateAxis", "IntermediateAxisRandom"])
def test_linear_and_energy_casimir_feedback_hold_the_intermediate_axis(name, controller):
    found = run(name, bound(controller))
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
    timed, forced = (run("AxisFlip", bound(controller)) for controller in (timed_flip, forced_flip))
    assert timed.success.all()
    assert forced.success.all()
    assert timed.cost.mean() < 0.05 * forced.cost.mean()
    assert timed.reward.mean() > forced.reward.mean() + 20.0


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


SETTINGS = [
    {},
    {"weight_momentum": 0.2, "weight_impulse": 3.0},
    {"impulse": 2.0, "n_substeps": 30},  # faster bodies are possible then
]


def sizes(found):
    """|L| before the first and after every step, shape (T + 1, N)."""
    return np.linalg.norm(found.y[..., 4:7] * [1.0, 2.0, 3.0], axis=-1)


def weights(task):
    """Of |L + j|^2 and |j|^2 in the cost of a step."""
    momentum = task.weight_momentum / task.start_momentum**2
    return momentum, task.weight_impulse / task.impulse**2


def regulator(task):
    return MomentumRegulator(task.system(), task.impulse, *weights(task))


def value(task):
    """P of the cost to go P |L|^2, by SciPy: x' = x + u at the cost a (x + u)^2 + b u^2."""
    (a, b), one = weights(task), np.eye(1)
    return solve_discrete_are(one, one, a * one, (a + b) * one, s=a * one)[0, 0]


@pytest.mark.parametrize("settings", SETTINGS)
def test_the_optimal_controller_costs_exactly_what_the_riccati_equation_says(settings):
    task, limit = Detumble(**settings), 50
    found = run("Detumble", bound(momentum_regulator), **settings)
    size = sizes(found)
    # Rounding the actions to float32 changes a least cost in the second order only, by
    # (6e-8)^2. There remain the roundings of float64: in every step those of a free drift, of 30
    # turns, which may each change |L|^2 by a few eps.
    np.testing.assert_allclose(
        -found.reward, value(task) * (size[0] ** 2 - size[limit] ** 2), rtol=limit * 30 * 2.2e-16
    )


@pytest.mark.parametrize("share", [0.05, 1.0 / 6.0, 0.4, 1.0, 3.0])
def test_with_equal_weights_the_optimal_controller_stays_within_the_ball_for_all_starts(share):
    task = Detumble(impulse=3.0 * share, n_substeps=100)
    assert regulator(task).reach > task.start_momentum


def test_the_optimal_controller_and_the_brake_succeed_from_every_start():
    for controller in (momentum_regulator, momentum_brake):
        found = run("Detumble", bound(controller))
        assert found.success.all()
        # both push against L only: |L| is what they cost
        np.testing.assert_allclose(found.cost, sizes(found)[0], rtol=1e-3)


def test_quaternion_feedback_reaches_every_goal():
    found = run("Reorient", bound(quaternion_pd))
    assert found.success.all()
    assert found.reward.mean() > -75.0  # steps until the goal is reached; 66 of 1000 starts
