"""Turning to an attitude, taking momentum out, and the tasks of a free body with their bounds."""

import importlib
import math

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from rigid_envs.base.checks import ConfigError
from rigid_envs.control.linear import simulate_closed_loop, step_jacobian
from rigid_envs.mechanics import rotations
from rigid_envs.systems.free_body.controllers import (
    MomentumBrake,
    MomentumRegulator,
    QuaternionPD,
    least_slew_time,
    saddle,
    slew_acceleration,
)
from rigid_envs.systems.free_body.references import (
    forced_flip,
    momentum_brake,
    momentum_regulator,
    separatrix_steering,
    timed_flip,
)
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.free_body.tasks.axis_flip import AxisFlip
from rigid_envs.systems.free_body.tasks.detumble import Detumble
from rigid_envs.systems.free_body.tasks.intermediate_axis import IntermediateAxisRandom
from rigid_envs.systems.free_body.tasks.intermediate_axis_single import IntermediateAxisSingle
from rigid_envs.systems.free_body.tasks.spin_capture import SpinCapture
from rigid_envs.tasks.registry import ENVIRONMENTS
from tests.refusals import refuses
from tests.systems.claims import spinning
from tests.systems.runs import bound, run

# Turning to an attitude and taking momentum out: cost functions and least times.


BODY, TORQUE = FreeBody(1.1, 1.7, 2.3), 0.5
FREE = 1e9  # N m, no limit
UP = rotations.identity()


def unlimited():
    """The gains of `QuaternionPD(BODY, TORQUE)` without its limits."""
    return QuaternionPD(BODY, FREE, 6.0 * TORQUE / FREE)


def step(controller, goal, dt=0.1):
    return lambda y: BODY.advance(y, controller.inputs(controller(y, goal)), dt, 4)


def test_both_signs_of_a_quaternion_are_turned_alike():
    controller, rng = QuaternionPD(BODY, TORQUE), np.random.default_rng(0)
    y, goal = spinning(rng, (50,)), rotations.random_quaternion(rng, (50,))
    mirrored = y * [-1.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0]
    for again in (controller(mirrored, goal), controller(y, -goal)):
        np.testing.assert_allclose(again, controller(y, goal), atol=1e-14)


def test_the_lyapunov_function_decreases_as_stated():
    controller, rng = unlimited(), np.random.default_rng(0)
    y, goal = spinning(rng, (300,), 2.0), rotations.random_quaternion(rng, (300,))
    rate, h = BODY.rhs(y, controller.inputs(controller(y, goal))), 1e-6
    sides = []
    for sign in (1.0, -1.0):
        moved = y + sign * h * rate
        moved[:, :4] = rotations.normalize(moved[:, :4])
        sides.append(controller.lyapunov(moved, goal))
    found = (sides[0] - sides[1]) / (2.0 * h)
    error = rotations.multiply(rotations.conjugate(goal), y[:, :4])
    away = np.abs(error[:, 0]) > 1e-4  # from half turns, where the short way changes sides
    # h^2 and eps V / h
    np.testing.assert_allclose(found[away], controller.lyapunov_rate(y)[away], rtol=1e-6, atol=1e-8)


def test_the_lyapunov_rate_is_negative_up_to_the_stated_rate():
    controller = unlimited()
    I1, I2, I3 = BODY.moments
    n = (I1 - I2) * (I2 - I3) * (I3 - I1) / (I1 * I2 * I3)
    most = 3.0 * np.sqrt(3.0) * controller.c / abs(n)
    y = spinning(np.random.default_rng(0), (2000,))
    y[:, 4:7] /= np.linalg.norm(y[:, 4:7], axis=-1, keepdims=True)
    y[:, 4:7] *= 0.999 * most
    assert (controller.lyapunov_rate(y) < 0.0).all()
    worst = BODY.state(omega_body=np.array([1.0, 1.0, -np.sign(n)]) * 1.001 * most / np.sqrt(3.0))
    assert controller.lyapunov_rate(worst) > 0.0
    assert most > 30.0  # far more than any turn takes


@pytest.mark.long
def test_within_its_level_the_torque_is_free_of_limits_and_the_level_is_kept():
    controller, rng = QuaternionPD(BODY, TORQUE), np.random.default_rng(0)
    x = rng.normal(size=(2000, 6))
    x *= (
        np.sqrt(rng.uniform(0.0, controller.limit_free, (2000, 1)))
        / np.linalg.norm(x, axis=1)[:, None]
    )
    # V = |angle / 2|^2 + |omega|^2 / (4 k), less what is of fourth order in the angle
    y = BODY.state(
        q=rotations.exp(2.0 * x[:, :3]), omega_body=2.0 * np.sqrt(controller.k) * x[:, 3:]
    )
    assert 0.5 < np.abs(controller(y, UP)).max() < 1.0
    # with omega = 4 sqrt(k) e about the axis of the largest moment the torque is nearly the largest
    along = np.sqrt(controller.limit_free / 5.0) * (BODY.moments == BODY.moments.max())
    worst = BODY.state(q=rotations.exp(2.0 * along), omega_body=4.0 * np.sqrt(controller.k) * along)
    assert 0.97 < np.abs(controller(worst, UP)).max() < 1.0
    value = controller.lyapunov(simulate_closed_loop(step(controller, UP, 0.01), y, 400), UP)
    # where omega passes 0, V rests, and held torque may add (k dt^2) to it
    assert (np.diff(value, axis=0) < 10.0 * controller.k * 0.01**2 * value[:-1]).all()
    assert (value < controller.limit_free).all()
    assert (value[-1] < 1e-2 * value[0]).mean() > 0.9


def test_the_sampled_loop_is_stable_and_nearly_critically_damped():
    controller = unlimited()

    def advance(x, u):
        y = BODY.state(q=rotations.exp(x[:, :3]), omega_body=x[:, 3:])
        end = BODY.advance(y, u, 0.1, 4)
        return np.concatenate([rotations.log(end[:, :4]), end[:, 4:7]], axis=-1)

    F, G = step_jacobian(advance, np.zeros(6), 3)
    K = BODY.moments[:, None] * np.concatenate(
        [controller.k * np.eye(3), controller.c * np.eye(3)], axis=1
    )
    found = np.linalg.eigvals(F - G @ K)
    w = np.sqrt(controller.k) * 0.1
    # held over w = 0.11 of the natural time, a double root exp(-w) splits by about w^1.5
    np.testing.assert_allclose(np.abs(found), np.exp(-w), atol=w**1.5)
    assert np.abs(found).max() < 0.95


def test_limited_turns_arrive_by_the_short_way_and_not_before_the_bound():
    body = FreeBody()
    controller, rng = QuaternionPD(body, TORQUE), np.random.default_rng(0)
    goal = rotations.random_quaternion(rng, (300,))
    y = body.state(q=rotations.random_quaternion(rng, (300,)))
    states = simulate_closed_loop(
        lambda y: body.advance(y, controller.inputs(controller(y, goal)), 0.1, 4), y, 100
    )
    angle = rotations.distance(states[..., :4], goal)
    rate = np.linalg.norm(states[..., 4:7], axis=-1)
    there = (angle < 0.1) & (rate < 0.05)
    assert there[-1].all()
    turned = np.sum(rotations.distance(states[1:, :, :4], states[:-1, :, :4]), axis=0)
    assert (turned < angle[0] + 1.0).all()  # the long way is 2 pi - angle; axes are coupled
    slack = least_slew_time(body, TORQUE, 0.1)  # the tolerance lets the end come earlier
    first = 0.1 * np.argmax(there, axis=0)
    assert (first > least_slew_time(body, TORQUE, angle[0]) - slack).all()


def test_the_least_time_is_taken_by_a_ball_about_its_diagonal():
    """Three equal moments: the torque along (1, 1, 1) is the largest, and the bound exact."""
    ball, angle = FreeBody(2.0, 2.0, 2.0), 2.5
    time = float(least_slew_time(ball, TORQUE, angle))
    states = [ball.state()]
    for sign in (1.0, -1.0):
        states.append(ball.advance(states[-1], [sign * TORQUE] * 3, 0.5 * time, 100))
    np.testing.assert_allclose(states[2][4:7], 0.0, atol=1e-14)
    np.testing.assert_allclose(rotations.angle(states[2][:4]), angle, rtol=1e-12)


def test_the_least_time_is_beaten_by_no_torque():
    rng, n = np.random.default_rng(0), 40
    switch = rng.uniform(-TORQUE, TORQUE, (n, 200, 3)).round() + rng.uniform(-0.5, 0.5, (n, 200, 3))
    y, rate = np.tile(BODY.state(), (200, 1)), []
    for torque in np.clip(switch, -TORQUE, TORQUE):
        y = BODY.advance(y, torque, 0.1, 4)
        rate.append(np.linalg.norm(y[:, 4:7], axis=-1))
    # the rate after a time t from rest is at most 2 angle / t at the bound
    t = 0.1 * np.arange(1, n + 1)[:, None]
    unit = 4.0 / least_slew_time(BODY, TORQUE, 1.0) ** 2
    assert (np.array(rate) <= unit * t).all()


def test_numbers_that_are_not_positive_are_refused():
    refuses(r"^torque = nan; expected a positive", least_slew_time, BODY, float("nan"), 1.0)
    refuses(r"^moments\[1\] = 0\.0; expected positive", slew_acceleration, [1.0, 0.0, 3.0], TORQUE)


IMPULSE = 0.5
WEIGHTS = [(1.0, 1.0), (0.02, 3.0), (5.0, 0.1), (1e-12, 1.0)]


def regulator(a=0.1, b=4.0):
    return MomentumRegulator(BODY, IMPULSE, a, b)


def braked(controller):
    return lambda y: BODY.advance(controller.after(y, controller(y)), None, 0.1, 5)


def sizes(controller, states):
    return np.linalg.norm(controller.momentum(states), axis=-1)


@pytest.mark.parametrize(("a", "b"), WEIGHTS)
def test_gain_and_value_in_closed_form_are_those_of_the_riccati_equation(a, b):
    controller, one = regulator(a, b), np.eye(1)
    if a > 1e-9:  # SciPy knows P there; x+ = x + u at the cost a (x + u)^2 + b u^2
        P = solve_discrete_are(one, one, a * one, (a + b) * one, s=a * one)[0, 0]
        assert controller.riccati == pytest.approx(P, rel=1e-12)
    P, g = controller.riccati, controller.gain
    assert b * (a + P) / (a + b + P) == pytest.approx(P, rel=1e-14)
    assert (a + P) / (a + b + P) == pytest.approx(g, rel=1e-14)


def test_the_value_is_the_sum_of_the_costs_and_other_gains_cost_more():
    controller, y = regulator(), spinning(np.random.default_rng(0), (50,), 0.3)
    y = y[sizes(controller, y) < controller.reach]
    states = simulate_closed_loop(braked(controller), y, 100)
    taken = IMPULSE * np.linalg.norm(controller(states[:-1]), axis=-1)
    costs = (
        controller.weight_momentum * sizes(controller, states[1:]) ** 2
        + controller.weight_impulse * taken**2
    )
    # |L| is kept to rounding in each of 100 steps of 5 substeps
    np.testing.assert_allclose(
        costs.sum(axis=0), controller.value(y) - controller.value(states[-1]), rtol=1e-12
    )
    np.testing.assert_allclose(
        costs, -np.diff(controller.value(states), axis=0), rtol=1e-9, atol=1e-15
    )
    x = sizes(controller, y)
    for g in (0.8 * controller.gain, 1.2 * controller.gain):
        # sums of (1 - g)^(2 k) in closed form
        cost = (controller.weight_momentum * (1 - g) ** 2 + controller.weight_impulse * g**2) / (
            1 - (1 - g) ** 2
        )
        assert (cost * x**2 > controller.value(y) * 1.01).all()


def test_the_regulator_is_limited_beyond_its_reach_only():
    controller = regulator()
    for factor, largest in ((0.999, False), (1.001, True)):
        y = BODY.state(omega_body=[0.0, 0.0, factor * controller.reach / BODY.I3])
        assert (np.linalg.norm(controller(y)) > 1.0 - 1e-9) == largest


def test_the_brake_needs_one_step_less_after_every_step():
    controller, y = MomentumBrake(BODY, IMPULSE), spinning(np.random.default_rng(0), (50,))
    states = simulate_closed_loop(braked(controller), y, 12)
    n = controller.n_steps(
        np.where(sizes(controller, states)[..., None] > 1e-12, states, BODY.state())
    )
    assert n[0].min() < 4 < 8 < n[0].max()
    np.testing.assert_array_equal(n, np.maximum(n[0] - np.arange(13)[:, None], 0.0))


def test_no_impulse_takes_more_than_its_size():
    controller, rng = MomentumBrake(BODY, IMPULSE), np.random.default_rng(0)
    y, action = spinning(rng, (500,)), rng.normal(size=(500, 3))
    action /= np.linalg.norm(action, axis=-1, keepdims=True)
    assert (
        sizes(controller, controller.after(y, action)) > sizes(controller, y) - IMPULSE - 1e-14
    ).all()


# Tasks of a free body: solved by reference controllers, and within their bounds.


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


def test_every_start_of_every_drawn_body_can_be_held_by_the_torque_there_is():
    """Its growth on the unstable direction is less than what full torque takes away."""
    rng, task = np.random.default_rng(0), IntermediateAxisRandom()
    for I1, I2, I3 in rng.uniform(*np.transpose([task.I1, task.I2, task.I3]), (2000, 3)):
        body = saddle(np.array([I1, I2, I3]))
        second = task.start_spread * np.linspace(-1.0, 1.0, 41)
        unstable = np.sqrt(task.start_spread**2 - second**2) * np.hypot(1.0, body.ratio)
        growth = body.growth * (task.spin_rate + second) * unstable
        assert growth.max() < task.torque * (1.0 / I1 + body.ratio / I3)


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


@pytest.mark.long
@pytest.mark.push
@pytest.mark.parametrize(
    ("actuators", "least"), [("e1 e2 e3", 0.99), ("e1 e3", 0.99), ("e2 e3", 0.93), ("e1 e2", 0.9)]
)
def test_steering_captures_every_spin_and_most_of_them_in_a_minute(actuators, least):
    """Of 1000 starts in a minute: 1000, 1000, 967 and 949."""
    found = run("SpinCapture", bound(separatrix_steering), actuators=actuators)
    assert found.success.mean() >= least
    longer = {"max_episode_steps": 1500, "n_substeps": 12}
    assert run(
        "SpinCapture", bound(separatrix_steering), actuators=actuators, **longer
    ).success.all()
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


def sizes_of(found):
    """|L| before the first and after every step, shape (T + 1, N)."""
    return np.linalg.norm(found.y[..., 4:7] * [1.0, 2.0, 3.0], axis=-1)


def weights(task):
    """Of |L + j|^2 and |j|^2 in the cost of a step."""
    momentum = task.weight_momentum / task.start_momentum**2
    return momentum, task.weight_impulse / task.impulse**2


def regulator_of(task):
    return MomentumRegulator(task.system(), task.impulse, *weights(task))


@pytest.mark.parametrize("settings", SETTINGS)
def test_the_optimal_controller_costs_exactly_what_the_riccati_equation_says(settings):
    task, limit = Detumble(**settings), 50
    found = run("Detumble", bound(momentum_regulator), **settings)
    size = sizes_of(found)
    # Rounding the actions to float32 changes a least cost in the second order only, by
    # (6e-8)^2. There remain the roundings of float64: in every step those of a free drift, of 30
    # turns, which may each change |L|^2 by a few eps.
    np.testing.assert_allclose(
        -found.reward,
        regulator_of(task).riccati * (size[0] ** 2 - size[limit] ** 2),
        rtol=limit * 30 * 2.2e-16,
    )


@pytest.mark.parametrize("share", [0.05, 1.0 / 6.0, 0.4, 1.0, 3.0])
def test_with_equal_weights_the_optimal_controller_stays_within_the_ball_for_all_starts(share):
    task = Detumble(impulse=3.0 * share, n_substeps=100)
    assert regulator_of(task).reach > task.start_momentum


def test_the_optimal_controller_and_the_brake_succeed_from_every_start():
    for controller in (momentum_regulator, momentum_brake):
        found = run("Detumble", bound(controller))
        assert found.success.all()
        # both push against L only: |L| is what they cost
        np.testing.assert_allclose(found.cost, sizes_of(found)[0], rtol=1e-3)
