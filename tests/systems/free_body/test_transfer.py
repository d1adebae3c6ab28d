"""Least impulses between polhodes, and the controller that gives them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import rigid_envs
from rigid_envs.control.linear import simulate_closed_loop
from rigid_envs.envs.lookup import task_of
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.scores.best import best_known, limit_of
from rigid_envs.scores.proof import bounds_of
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.free_body.transfer import (
    PolhodeTransfer,
    TimedTransfer,
    polhode_point,
    rays,
)
from rigid_envs.tasks.registry import ENVIRONMENTS
from tests.refusals import refuses
from tests.systems.claims import spinning

BODY, RATE = FreeBody(1.1, 1.7, 2.3), 1.3
SPINS = ("IntermediateAxis", "IntermediateAxisRandom", "SpinCapture", "AxisFlip")


def crossing(omega):
    """Momentum where the motion next crosses the plane of e1 and e3, by Euler's equations."""
    I1, I2, I3 = BODY.moments

    def rates(_, w):
        return [
            (I2 - I3) / I1 * w[1] * w[2],
            (I3 - I1) / I2 * w[2] * w[0],
            (I1 - I2) / I3 * w[0] * w[1],
        ]

    def middle(_, w):
        return w[1]

    found = solve_ivp(rates, (0.0, 100.0), omega, events=middle, rtol=1e-11, atol=1e-12)
    return BODY.moments * found.y_events[0][0]


def test_the_point_of_a_polhode_is_where_it_crosses_the_plane_of_e1_and_e3():
    omega = spinning(np.random.default_rng(0), (8,))[:, 4:7]
    there = np.abs([crossing(w)[[0, 2]] for w in omega])
    np.testing.assert_allclose(polhode_point(BODY.moments, BODY.moments * omega), there, rtol=1e-8)


def test_an_impulse_moves_the_point_by_no_more_and_in_that_plane_by_as_much():
    rng = np.random.default_rng(0)
    moments = np.cumsum(rng.uniform(0.1, 2.0, (10_000, 3)), axis=1)
    L, J = rng.normal(size=(2, 10_000, 3)) * np.exp(rng.uniform(-3.0, 3.0, (2, 10_000, 1)))
    moved = np.linalg.norm(polhode_point(moments, L + J) - polhode_point(moments, L), axis=1)
    assert (moved <= np.linalg.norm(J, axis=1) * (1.0 + 1e-12)).all()
    L[:, 1], J[:, 1] = 0.0, 0.0
    J = np.abs(J) * np.sign(L)  # so that no component changes its sign
    moved = np.linalg.norm(polhode_point(moments, L + J) - polhode_point(moments, L), axis=1)
    np.testing.assert_allclose(moved, np.linalg.norm(J, axis=1), rtol=1e-12)


def test_spins_about_e2_and_separatrices_lie_on_the_ray():
    d = np.random.default_rng(0).uniform(-0.3, 0.3, 20)
    ratio = np.sqrt(BODY.I3 * (BODY.I3 - BODY.I2) / (BODY.I1 * (BODY.I2 - BODY.I1)))
    omega = np.stack([d / 2.0, np.full(20, RATE), -d / (2.0 * ratio)], axis=1)  # s = 0
    along, across = rays(BODY.moments) @ polhode_point(BODY.moments, BODY.moments * omega).T
    np.testing.assert_allclose(across, 0.0, atol=1e-14)
    np.testing.assert_allclose(along, np.linalg.norm(BODY.moments * omega, axis=1), rtol=1e-14)


def test_no_impulse_adds_to_the_distance_but_what_keeps_clear_of_the_ray():
    controller = PolhodeTransfer(BODY, RATE, 1.0, 1e-5, 0.05)
    y = spinning(np.random.default_rng(0), (5000,), 2.0)
    action = controller(y)
    after = y.copy()
    after[:, 4:7] += controller.torque * controller.dt * action / BODY.moments
    before, now = controller.distance(y), controller.distance(after)
    far = controller.steers(y) & (before > 1.1 * controller.clearance * BODY.I2 * RATE)
    impulse = controller.torque * controller.dt * np.linalg.norm(action, axis=1)
    assert (impulse[far] > 0.0).sum() > 500
    # the distance is not linear, and it is not the goal of motions that leave e2
    assert (now <= before - 0.9 * controller.efficiency * impulse + 1e-9)[far].all()


@pytest.mark.long
def test_weak_torque_brings_every_spin_to_e2_at_hardly_more_than_the_distance():
    body = FreeBody(1.0, 2.0, 3.0)
    controller = PolhodeTransfer(body, 1.0, 0.02, 0.1, 0.05)
    y = spinning(np.random.default_rng(1), (30,))
    y[:, 4:7] *= np.linspace(0.5, 1.5, 30)[:, None] / np.linalg.norm(y[:, 4:7], axis=1)[:, None]
    spent = np.zeros(30)

    def step(y):
        nonlocal spent
        u = controller.inputs(controller(y))
        spent = spent + controller.dt * np.linalg.norm(u, axis=-1)
        return body.advance(y, u, controller.dt, 4)

    states = simulate_closed_loop(step, y, 4_000)
    assert (np.linalg.norm(controller.error(states[-1]), axis=-1) < 0.06).mean() > 0.95
    assert spent.sum() < 1.15 * controller.distance(y).sum()


def test_one_torque_crosses_the_ray_where_it_does_most():
    task = {"n": 400, "seed": 12345}
    found = rigid_envs.evaluate("IntermediateAxisSingle", "transfer", **task)
    held = rigid_envs.evaluate("IntermediateAxisSingle", "energy_casimir", **task)
    assert found.successes.mean() >= 0.995
    assert found.costs.mean() < 0.35 * held.costs.mean()
    law = PolhodeTransfer(BODY, RATE, 1.0, 1e-4, 1.0, axes=(False, False, True))
    y = spinning(np.random.default_rng(0), (5000,))
    action = law(y)
    assert (action[:, :2] == 0.0).all()
    after = y.copy()
    after[:, 4:7] += law.torque * law.dt * action / BODY.moments
    across = rays(BODY.moments)[1]
    before, now = (
        polhode_point(BODY.moments, BODY.moments * x[:, 4:7]) @ across for x in (y, after)
    )
    impulse = law.torque * law.dt * np.abs(action[:, 2])
    steered = law.steers(y) & (impulse > 0.0)
    assert 500 < steered.sum() < 4500
    most = abs(across[1])  # of the change by an impulse of 1 about e3
    moved = np.abs(now - before)[steered]
    assert (moved <= most * impulse[steered] * (1.0 + 1e-9)).all()
    assert (moved >= 0.95 * most * impulse[steered]).all()


def test_a_flip_comes_in_time_and_is_pushed_only_if_it_would_be_late():
    body, rate, dt = FreeBody(1.0, 1.8, 2.6), 0.8, 0.1
    controller = TimedTransfer(body, rate, 0.5, dt, tolerance=0.04, margin=0.03)
    rng, time = np.random.default_rng(0), 24.0
    d = rng.uniform(-0.1, 0.1, 100) * rate
    d[0] = 0.0
    y = body.state(omega_body=np.stack([d, np.full(100, rate), 0.0 * d], axis=-1))
    action = controller(y, np.full(100, time))
    # by the closed form of a separatrix, sech(growth rate t)
    growth = controller.saddle.growth * rate
    need = np.exp(-growth * time) * 4.0 / controller.saddle.share / (2.0 * controller.margin)
    need *= np.hypot(1.0, 1.0 / controller.saddle.ratio) * rate
    assert (np.abs(action).max(axis=1)[np.abs(d) < 0.9 * need] > 0.0).all()
    assert (np.abs(action).max(axis=1)[np.abs(d) > 1.1 * need] == 0.0).all()
    assert 5 < (np.abs(d) > 1.1 * need).sum() < 95
    left = time
    while left > -5.0:
        if left < 0.5 * dt:
            error = np.linalg.norm(y[:, 4:7] + np.array([0.0, rate, 0.0]), axis=1)
            assert (error < 0.06 * rate).all()
        u = controller.inputs(controller(y, np.full(100, left)))
        y, left = body.advance(y, u, dt, 4), left - dt


@pytest.mark.parametrize("name", [*SPINS, "IntermediateAxisSingle"])
def test_no_known_cost_is_below_the_bound(name):
    env_id = f"RigidEnvs/{name}-v0"
    known = best_known(env_id)
    assert (known.costs >= (1.0 - 1e-6) * bounds_of(env_id, 500, 314159, {})).all()


def held(task, system, torque, n=40_000):
    """States from which a spin is held by torques of any size up to one, and what that takes.

    Motions are drawn backwards, from states within the tolerance: under the same torque they are
    motions with the opposite rates. Those that stay within it are kept.

    Returns:
        States (k, 7), impulses (k,).
    """
    rng = np.random.default_rng(0)
    goal = np.array([0.0, task.spin_rate, 0.0])
    error = rng.normal(size=(n, 3)) * np.exp(rng.uniform(-4.0, 0.0, (n, 3)))
    error *= (task.tolerance * task.spin_rate / np.linalg.norm(error, axis=1))[:, None]
    y = spinning(rng, (n,))
    y[:, 4:7] = -goal - error * rng.uniform(0.0, 1.0, (n, 1)) ** 0.2
    tau = torque * rng.uniform(-1.0, 1.0, (n, 3))
    n_periods, stays = round(getattr(task, "hold", task.dt) / task.dt) - 1, np.ones(n, dtype=bool)
    for _ in range(n_periods):
        y = system.advance(y, tau, task.dt, 1)
        off = np.linalg.norm(y[:, 4:7] + goal, axis=1)
        stays &= off < task.tolerance * task.spin_rate
    y[:, 4:7] *= -1.0
    return y[stays], n_periods * task.dt * np.linalg.norm(tau[stays], axis=1)


@pytest.mark.long
@pytest.mark.parametrize("name", SPINS)
def test_the_bound_is_the_distance_from_the_goals_themselves(name):
    """Of spins that stay at the goal none is nearer, and the nearest is hardly further away."""
    record, n = ENVIRONMENTS[f"RigidEnvs/{name}-v0"], 40
    envs = RigidVectorEnv(record.task, n, record.max_episode_steps)
    envs.reset(seed=3)
    bound, known = limit_of(record.id, "effort").values(envs), {}  # goals by the moments
    for k, system in enumerate(envs.systems):
        body = tuple(system.moments)
        if body not in known:
            known[body], _ = held(envs.task, system, 0.0, 15_000)
        goals = known[body]
        points = polhode_point(system.moments, system.moments * goals[:, 4:7])
        here = polhode_point(system.moments, system.moments * envs.y[k, 4:7])
        nearest = np.linalg.norm(points - here, axis=1).min()
        assert bound[k] <= nearest + 1e-12
        # of goals along a ray of width 0.003 I2 Omega
        assert nearest <= bound[k] + 0.005 * system.I2 * envs.task.spin_rate
    envs.close()


@pytest.mark.parametrize("moments", [(1.0, 2.0, 3.0), (1.1, 1.7, 2.3)])
@pytest.mark.parametrize("torque", [0.005, 0.02])
def test_no_spin_is_held_by_less_than_the_bound(moments, torque):
    """Whatever torque holds it, from the first state of the hold on."""
    record = ENVIRONMENTS["RigidEnvs/IntermediateAxis-v0"]
    settings = dict(zip(("I1", "I2", "I3"), moments, strict=True))
    task = replace(task_of(record.id), **settings)
    y, impulses = held(task, FreeBody(*moments), torque)
    assert len(y) > 300
    envs = RigidVectorEnv(record.task, len(y), record.max_episode_steps, **settings)
    envs.reset(seed=0, options={"state": y})
    bound = limit_of(record.id, "effort").values(envs)
    assert (bound <= impulses).all()
    assert (bound > 0.0).any()
    envs.close()


def test_an_actuator_about_e2_alone_is_refused():
    def made():
        return PolhodeTransfer(BODY, RATE, 1.0, 0.1, 0.05, axes=(False, True, False))

    refuses(r"axes = \(False, True, False\); expected an actuator", made)
