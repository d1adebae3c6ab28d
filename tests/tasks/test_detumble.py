"""Detumble: what is best is known exactly, and nothing is better."""

import math

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from rigid_envs.envs.vector import RigidVectorEnv
from rigid_envs.systems.free_body.controllers import MomentumRegulator
from rigid_envs.systems.free_body.references import momentum_brake, momentum_regulator
from rigid_envs.systems.free_body.tasks.detumble import Detumble
from tests.tasks.runs import bound, run, still

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
def test_the_optimal_law_costs_exactly_what_the_riccati_equation_says(settings):
    task, limit = Detumble(**settings), 50
    found = run("Detumble", bound(momentum_regulator), **settings)
    size = sizes(found)
    # Rounding the actions to float32 changes a least cost in the second order only, by
    # (6e-8)^2. There remain the roundings of float64: in every step those of a free drift, of 30
    # turns, which may each change |L|^2 by a few eps.
    np.testing.assert_allclose(
        -found.reward, value(task) * (size[0] ** 2 - size[limit] ** 2), rtol=limit * 30 * 2.2e-16
    )


@pytest.mark.parametrize("settings", SETTINGS)
def test_the_gain_in_closed_form_is_that_of_the_riccati_equation(settings):
    task = Detumble(**settings)
    P, a, b = value(task), *weights(task)
    assert regulator(task).gain == pytest.approx(P / b, rel=1e-12)
    stated = 0.5 * (-a + math.sqrt(a * a + 4.0 * a * b))  # as in the docstring of the task
    assert stated == pytest.approx(P, rel=1e-12)


@pytest.mark.parametrize("factor", [0.8, 0.95, 1.05, 1.2])
def test_other_gains_cost_more(factor):
    law = bound(momentum_regulator)
    best, other = run("Detumble", law), run("Detumble", lambda envs: factor * law(envs))
    assert (other.reward < best.reward).all()


@pytest.mark.parametrize("share", [0.05, 1.0 / 6.0, 0.4, 1.0, 3.0])
def test_with_equal_weights_the_optimal_law_stays_within_the_ball_for_all_starts(share):
    task = Detumble(impulse=3.0 * share, n_substeps=100)
    assert regulator(task).reach > task.start_momentum


def test_the_optimal_law_and_the_brake_succeed_from_every_start():
    for law in (momentum_regulator, momentum_brake):
        found = run("Detumble", bound(law))
        assert found.success.all()
        # both push against L only: |L| is what they cost
        np.testing.assert_allclose(found.cost, sizes(found)[0], rtol=1e-3)


def test_the_least_time_is_the_momentum_over_the_largest_impulse():
    task = Detumble()
    found = run("Detumble", bound(momentum_brake))
    size = sizes(found)
    least = np.ceil(size[0] / task.impulse)
    for k in range(1, 8):
        rest = size[k] < 1e-6  # the actions are rounded to float32
        np.testing.assert_array_equal(rest, k >= least)


def test_no_impulse_takes_more_than_its_size_from_the_momentum():
    rng = np.random.default_rng(0)
    found = run("Detumble", lambda envs: rng.normal(0.0, 2.0, envs.action_space.shape))
    taken = -np.diff(sizes(found), axis=0)
    assert taken.max() <= 0.5 * (1.0 + 1e-6)  # a ball action is rounded to float32
    assert taken.max() > 0.499


def test_free_drift_turns_the_momentum_in_the_body_and_keeps_it_in_space():
    found = run("Detumble", still)
    body, system = found.y[..., 4:7] * [1.0, 2.0, 3.0], Detumble().system()
    space = system.L_world(found.y)
    # 50 steps of 6 substeps of 5 stages of 4 turns, each of a few roundings
    np.testing.assert_allclose(space, np.broadcast_to(space[0], space.shape), atol=6000 * 3e-16)
    assert np.median(np.linalg.norm(body[-1] - body[0], axis=-1)) > 1.0


def test_an_impulse_acts_at_once_and_in_body_axes():
    envs = RigidVectorEnv("rigid_envs.tasks:Detumble", 50, dt=1e-4)
    envs.reset(seed=0)
    system, before = envs.task.system(), envs.y
    actions = np.random.default_rng(0).uniform(-0.5, 0.5, (50, 3)).astype(np.float32)
    *_, infos = envs.step(actions)
    impulse = envs.task.impulse * actions.astype(np.float64)
    np.testing.assert_allclose(infos["cost"], np.linalg.norm(impulse, axis=-1), rtol=1e-6)
    expected = system.L_world(before) + system.L_world(
        np.concatenate([before[:, :4], impulse / system.moments], axis=-1)
    )
    # it acts before the drift, so L in space is what it was and the impulse, whatever dt is
    np.testing.assert_allclose(system.L_world(envs.y), expected, atol=1e-14)
