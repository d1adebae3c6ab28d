"""Holding, capturing and flipping a spin: their cost functions, and from how far they succeed."""

import itertools

import numpy as np
import pytest
from scipy import sparse
from scipy.optimize import linprog

import rigid_envs
from rigid_envs.control.linear import (
    region_of_attraction,
    simulate_closed_loop,
    step_jacobian,
    zero_order_hold,
)
from rigid_envs.systems.free_body.closed_forms import growth_rate
from rigid_envs.systems.free_body.controllers import (
    EnergyCasimir,
    ForcedFlip,
    MinimumFuelSpin,
    SeparatrixSteering,
    SingleTorque,
    SpinRegulator,
    TimedFlip,
    saddle,
)
from rigid_envs.systems.free_body.system import FreeBody
from tests.refusals import refuses
from tests.systems.claims import assert_optimal, rate_along, spinning

BODY, RATE, DT = FreeBody(1.1, 1.7, 2.3), 1.3, 0.1
OMEGA = slice(4, 7)
E2 = np.array([0.0, 1.0, 0.0])
FREE = 1e9  # N m, no limit


def step(controller, dt=DT, n_substeps=4):
    return lambda y: controller.body.advance(y, controller.inputs(controller(y)), dt, n_substeps)


def rate_of(controller, y, *more):
    """Derivative of the state under a controller."""
    return controller.body.rhs(y, controller.inputs(controller(y, *more)))


def regulator(torque=0.2):
    return SpinRegulator(BODY, RATE, torque, DT)


def test_the_sampled_linearisation_is_that_of_the_steps_of_the_body():
    def advance(x, u):
        y = BODY.state(omega_body=x + RATE * E2)
        return BODY.advance(y, u, DT, 8)[..., OMEGA] - RATE * E2

    F, G = step_jacobian(advance, np.zeros(3), 3)
    for controller, most in ((regulator(FREE), 0.9), (steering(dt=DT), 0.95)):
        costs = np.eye(3), controller.input_weight * np.eye(3)
        # with the error 1e-10 of the differences and that of the integrator
        assert_optimal(F, G, *controller.regulator, *costs, most, rtol=1e-6, atol=1e-7)


def test_the_riccati_value_is_the_sum_of_the_costs_and_decreases():
    controller, rng = regulator(FREE), np.random.default_rng(0)
    y = BODY.state(omega_body=RATE * E2 + 1e-6 * rng.normal(size=(20, 3)))
    states = simulate_closed_loop(step(controller), y, 200)
    torque = controller.inputs(controller(states))
    cost = np.sum(controller.error(states) ** 2, axis=-1) + controller.input_weight * np.sum(
        torque**2, axis=-1
    )
    # what is not linear is 1e-6 of the rest, the rounding of omega near 1 1e-10
    np.testing.assert_allclose(cost.sum(axis=0), controller.value(y), rtol=1e-5)
    far = simulate_closed_loop(
        step(controller), BODY.state(omega_body=RATE * E2 + rng.normal(size=(200, 3))), 30
    )
    value = controller.value(far)
    assert (np.diff(value, axis=0) < 0.0)[value[:-1] > 1e-20].all()


def test_one_torque_makes_its_lyapunov_function_decrease_as_stated():
    controller, y = SingleTorque(BODY, RATE, FREE), spinning(np.random.default_rng(0), (100,), 2.0)
    found = rate_along(controller.lyapunov, y, rate_of(controller, y), OMEGA)
    expected = -(BODY.I3 - BODY.I2) * controller.k * y[:, 6] ** 2
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(found).max())


def test_one_torque_leads_to_e2_from_all_that_is_certified_and_not_from_all_else():
    controller, y = SingleTorque(BODY, RATE, FREE), spinning(np.random.default_rng(0), (200,), 2.0)
    certified = controller.certified(y)
    assert 50 < certified.sum() < 180
    # the motion with the same constant of torque about e3 that spins about e1 alone
    share = BODY.I2 * (BODY.I3 - BODY.I2) / (BODY.I1 * (BODY.I3 - BODY.I1))
    turned = BODY.state(
        omega_body=np.sqrt(y[:, 4:6] ** 2 @ [1.0, share])[:, None] * [1.0, 0.0, 0.0]
    )
    below = controller.lyapunov(y) < controller.lyapunov(turned)
    np.testing.assert_array_equal(certified, below & (y[:, 5] > 0.0))
    states = simulate_closed_loop(step(controller, 0.04), y, 1500)
    ahead = (states[..., 5] > 0.0).all(axis=0)
    assert ahead[certified].all()
    assert not ahead[~certified].all()
    left = controller.lyapunov(states[-1]) / controller.lyapunov(y)
    assert (left[certified] < 1e-3).all()  # the slowest at 0.3 rad/s about e2
    weak, beside = SingleTorque(BODY, RATE, FREE, 1.0), BODY.state(omega_body=[0.1, 1.0, 0.0])
    np.testing.assert_allclose(rate_of(weak, beside)[OMEGA], 0.0, atol=1e-15)  # it stays there
    assert not weak.certified(beside)


@pytest.mark.parametrize("strength", [0.9, 1.1, 3.0])
def test_one_torque_is_stable_above_its_threshold_and_only_there(strength):
    controller = SingleTorque(BODY, RATE, FREE, strength)
    assert controller.threshold == pytest.approx(BODY.I2 - BODY.I1, rel=1e-15)

    def rate(x):
        y = BODY.state(omega_body=x + RATE * E2)
        return rate_of(controller, y)[..., OMEGA]

    h = 1e-6 * np.eye(3)
    jacobian = (rate(h) - rate(-h)).T / 2e-6
    found = np.linalg.eigvals(jacobian)
    expected = np.append(controller.exponents(), 0.0)  # the rate about e2 is not changed
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(expected), atol=1e-9)
    assert (expected.real <= 0.0).all() == (strength > 1.0)


@pytest.mark.parametrize(("strength", "damping"), [(1.1, 0.3), (3.0, 3.0), (2.0, 0.1), (9.0, 1.0)])
def test_the_energy_casimir_function_decreases_everywhere_as_stated(strength, damping):
    controller = EnergyCasimir(BODY, RATE, FREE, strength, damping)
    y = spinning(np.random.default_rng(0), (500,), 3.0)
    found = rate_along(controller.lyapunov, y, rate_of(controller, y), OMEGA)
    np.testing.assert_allclose(found, controller.lyapunov_rate(y), atol=1e-12 * np.abs(found).max())
    assert (found < 0.0).all()
    faster = BODY.state(omega_body=(RATE + 1.0) * E2)  # V is s I2 (I3 - I2) / (I3 - I1) / 2
    expected = damping**2 * BODY.moments.prod() / (BODY.I3 - BODY.I1)
    assert controller.lyapunov(faster) == pytest.approx(expected, rel=1e-12)


def test_the_energy_casimir_controller_leads_to_the_spin_from_everywhere_without_limits():
    controller, y = EnergyCasimir(BODY, RATE, FREE), spinning(np.random.default_rng(0), (200,), 3.0)
    states = simulate_closed_loop(step(controller, 0.01, 2), y, 600)
    value = controller.lyapunov(states)
    assert (np.diff(value, axis=0) < 0.0)[value[:-1] > 1e-20].all()
    np.testing.assert_allclose(controller.error(states[-1]), 0.0, atol=1e-6)


# The least torque impulse that cancels what grows: beside a linear programme.


def minimum_fuel(torque, tolerance):
    """The controller for a tolerance [rad/s], which leaves s as much time as it takes."""
    return MinimumFuelSpin(BODY, RATE, torque, DT, tolerance / RATE, settle=100.0)


def perturbed(n, size):
    """States beside the spin by a size in any direction [rad/s]."""
    x = np.random.default_rng(1).normal(size=(n, 3))
    return BODY.state(omega_body=RATE * E2 + size * x / np.linalg.norm(x, axis=-1, keepdims=True))


def test_where_torque_is_enough_one_period_cancels_d_and_leads_to_the_edge_of_the_tolerance():
    size, tolerance = 1e-4, 2e-5
    y, controller = perturbed(50, size), minimum_fuel(FREE, tolerance)
    after = step(controller)(y)
    d, _ = controller.saddle.coordinates(after[:, OMEGA])
    assert np.abs(d).max() < 10.0 * size**2  # what is not linear
    late = simulate_closed_loop(lambda y: BODY.advance(y, None, DT, 4), after, 100)[-1]
    outside = np.abs(y[:, 5] - RATE) > tolerance
    assert 20 < outside.sum() < 50
    rest = np.abs(late[:, 5] - RATE)
    np.testing.assert_allclose(rest[outside], tolerance, atol=10.0 * size**2)
    assert (rest < tolerance + 10.0 * size**2).all()


def test_the_two_impulses_are_at_right_angles():
    cancel, correct = minimum_fuel(FREE, 1e-3).impulses(perturbed(50, 0.3))
    lengths = np.linalg.norm(cancel, axis=-1) * np.linalg.norm(correct, axis=-1)
    assert lengths.min() > 0.0
    assert (np.abs(np.sum(cancel * correct, axis=-1)) < 1e-14 * lengths.max()).all()


def least_impulse(x, torque, tolerance, n):
    """Least impulse for n steps of the linearisation from x, to d = 0 and omega2 in tolerance.

    A linear programme: |tau| is the largest component along 600 directions, 0.6 % too small at
    most.
    """
    A, B = BODY.linearize(BODY.state(omega_body=RATE * E2))
    F, G = zero_order_hold(A[OMEGA, OMEGA], B[OMEGA], DT)
    powers = [np.linalg.matrix_power(F, n - k) for k in range(n + 1)]
    end, moved = powers[0] @ x, np.concatenate([power @ G for power in powers[1:]], axis=1)
    values, vectors = np.linalg.eig(F.T)
    d = vectors[:, np.argmax(values.real)].real
    height = 1.0 - 2.0 * (np.arange(600) + 0.5) / 600
    turn, side = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(600), np.sqrt(1.0 - height**2)
    directions = np.stack([side * np.cos(turn), side * np.sin(turn), height], axis=-1)
    along = sparse.kron(sparse.eye(n), directions), sparse.kron(sparse.eye(n), -np.ones((600, 1)))
    rate, none = np.stack([moved[1], -moved[1]]), np.zeros((2, n))
    found = linprog(
        np.repeat([0.0, DT], [3 * n, n]),
        A_ub=sparse.vstack([sparse.hstack(along), sparse.csr_array(np.hstack([rate, none]))]),
        b_ub=np.concatenate([np.zeros(600 * n), [tolerance - end[1], tolerance + end[1]]]),
        A_eq=np.append(d @ moved, np.zeros(n))[None],
        b_eq=[-d @ end],
        bounds=[(-torque, torque)] * (3 * n) + [(0.0, None)] * n,
    )
    return found.fun


def test_the_impulse_is_the_least_one_of_the_linearisation_under_limits():
    size = 1e-3
    torque, tolerance = size, 0.2 * size
    y, controller = perturbed(6, size), minimum_fuel(torque, tolerance)
    states = simulate_closed_loop(step(controller), y, 60)
    impulses = DT * np.linalg.norm(controller.inputs(controller(states)), axis=-1)
    assert ((impulses > 0.5 * torque * DT).sum(axis=0) > 5).sum() == 5  # limits count, but for one
    least = [least_impulse(x, torque, tolerance, 25) for x in controller.error(y)]
    ratio = impulses.sum(axis=0) / least
    assert ratio.min() > 1.0 - 1e-3 and ratio.max() < 1.01, ratio


SLOW, WEAK = {"I1": 2.0, "I2": 2.1, "I3": 2.5}, {"torque": 0.1, "start_spread": 0.1}


# s of the slow body does not decay in time by itself
@pytest.mark.parametrize(("config", "most"), [({}, 0.7), (SLOW, 0.8), (WEAK, 0.6)])
def test_episodes_of_the_least_impulse_succeed_at_less_than_those_of_the_regulator(config, most):
    found, regulated = (
        rigid_envs.evaluate("IntermediateAxis", name, n=100, seed=1, config=config)
        for name in ("minimum_fuel", "lqr")
    )
    assert found.successes.all() and regulated.successes.all()
    assert found.costs.mean() < most * regulated.costs.mean()


LIMITED = [
    (SpinRegulator(FreeBody(), 1.0, 0.2, DT), 0.26),
    (MinimumFuelSpin(FreeBody(), 1.0, 0.2, DT, 0.05, settle=12.5), 0.32),
    (EnergyCasimir(FreeBody(), 1.0, 0.2), 0.26),
    (SingleTorque(FreeBody(), 1.0, 0.45), 0.22),
]


def held(controller):
    """Whether perturbations are brought back while omega2 stays positive."""

    def succeeds(perturbation):
        y = controller.body.state(omega_body=controller.rate * E2 + perturbation)
        omega = simulate_closed_loop(step(controller), y, 300)[..., OMEGA]
        side = np.hypot(omega[-1, ..., 0], omega[-1, ..., 2])
        return (omega[..., 1] > 0.0).all(axis=0) & (side < 0.05 * omega[-1, ..., 1])

    return succeeds


@pytest.mark.long
@pytest.mark.parametrize(("controller", "size"), LIMITED)
def test_limited_torque_succeeds_from_where_the_controller_says(controller, size):
    directions = np.random.default_rng(0).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    sizes = np.arange(0.02, size + 0.05, 0.02)  # the least one does not need larger ones
    found = region_of_attraction(held(controller), directions, sizes)
    assert size - 1e-9 < found.min() < size + 0.03  # of 200 directions, in steps of 0.02


@pytest.mark.parametrize(("controller", "d"), [(LIMITED[0][0], 0.55), (LIMITED[-1][0], 0.46)])
def test_along_the_unstable_direction_a_controller_holds_what_can_be_held(controller, d):
    r, growth, _ = saddle(controller.body.moments)
    first = 1.0 / controller.body.I1 if isinstance(controller, SpinRegulator) else 0.0
    most = controller.torque * (first + r / controller.body.I3) / growth
    found = region_of_attraction(
        held(controller), [[0.5, 0.0, -0.5 / r], [-0.5, 0.0, 0.5 / r]], np.arange(0.01, 1.0, 0.01)
    )
    np.testing.assert_allclose(found, d, rtol=1e-12)
    np.testing.assert_allclose(found, most, rtol=0.03)  # omega2 changes on the way


def test_bodies_gains_and_numbers_that_make_no_controller_are_refused():
    with pytest.raises(ValueError, match=r"expected I1 < I2 < I3: e2 is the intermediate axis"):
        SingleTorque(FreeBody(1.0, 3.0, 2.5), 1.0, 0.2)
    with pytest.raises(ValueError, match=r"^strength = 1\.0; expected more than 1, the threshold"):
        EnergyCasimir(BODY, 1.0, 0.2, strength=1.0)
    refuses("y has shape", regulator(), np.zeros(3))


TORQUE = 0.1
AXES = [axes for axes in itertools.product((True, False), repeat=3) if axes[0] or axes[2]]


def steering(axes=(True, True, True), body=BODY, rate=RATE, dt=DT):
    return SeparatrixSteering(body, rate, TORQUE, dt, axes)


def starts(rng, n, low=0.5, high=1.5):
    """Spins about any direction, of rates between two ones."""
    y = spinning(rng, (n,))
    size = np.linalg.norm(y[:, 4:7], axis=-1, keepdims=True)
    y[:, 4:7] *= rng.uniform(low, high, (n, 1)) / size
    return y


def test_saddle_coordinates_turn_eulers_equations_into_theirs():
    rng = np.random.default_rng(0)
    for moments in ((1.0, 2.0, 3.0), (1.1, 1.8, 2.5), (0.3, 0.4, 0.5)):
        r, growth, share = body = saddle(moments)
        assert growth == pytest.approx(growth_rate(moments, 1.0), rel=1e-14)
        y = FreeBody.state(omega_body=rng.normal(size=(50, 3)))
        rates = FreeBody(*moments).rhs(y)[:, 4:7]
        (d, s), w2 = body.coordinates(y[:, 4:7]), y[:, 5]
        d_rate, s_rate = body.coordinates(rates)
        for found, expected in (
            (d_rate, growth * w2 * d),
            (s_rate, -growth * w2 * s),
            (rates[:, 1], share * growth * (s**2 - d**2)),
        ):
            # a few roundings of terms of the size r omega^2
            np.testing.assert_allclose(found, expected, atol=1e-14 * (1.0 + r) * np.max(y**2))


def test_what_is_steered_is_energy_and_momentum():
    """W is 0 where 2 T I2 = L^2 and L = I2 Omega."""
    controller, y = steering(), spinning(np.random.default_rng(0), (50,))
    I1, I2, I3 = BODY.moments
    square = np.sum(BODY.L_body(y) ** 2, axis=-1)
    apart = 2.0 * BODY.kinetic_energy(y) * I2 - square
    p = apart / (I1 * (I2 - I1))
    # of all quadratic forms of energy and momentum the one without omega1^2 - r^2 omega3^2
    E = (square + 0.5 * apart * (I3 / (I3 - I2) - I1 / (I2 - I1))) / I2**2
    slope = (E - y[:, 5] ** 2) / (y[:, 4] ** 2 + controller.saddle.ratio**2 * y[:, 6] ** 2)
    np.testing.assert_allclose(slope, slope[0], rtol=1e-9)
    expected = 0.5 * ((p / RATE**2) ** 2 + (E / RATE**2 - 1.0) ** 2)
    np.testing.assert_allclose(controller.lyapunov(y), expected, rtol=1e-11)


@pytest.mark.parametrize("axes", AXES)
def test_actions_are_off_the_axes_without_actuator(axes):
    controller, y = steering(axes), starts(np.random.default_rng(0), 50)
    y[:10, 4:7] = [0.01, RATE, -0.02] + 0.02 * y[:10, 4:7]
    assert controller.steers(y).any() and not controller.steers(y).all()
    assert (controller(y)[:, ~np.array(axes)] == 0.0).all()


@pytest.mark.parametrize("axes", AXES)
def test_no_torque_that_steers_adds_to_the_lyapunov_function(axes):
    controller, y = steering(axes), starts(np.random.default_rng(0), 1000, 0.1, 3.0)
    y = y[controller.steers(y)]
    rate, h = rate_of(controller, y) - BODY.rhs(y), 1e-6
    after, before = (
        controller.lyapunov(y + s * h * rate * ([0.0] * 4 + [1.0] * 3)) for s in (1.0, -1.0)
    )
    slope = (after - before) / (2.0 * h)
    assert (slope <= 1e-9 * controller.lyapunov(y).max()).all()
    if sum(axes) > 1:
        assert (slope < 0.0).mean() > 0.99


def test_between_samples_the_lyapunov_function_is_kept_and_over_them_it_falls():
    controller, y = steering(dt=0.05), starts(np.random.default_rng(0), 100)
    value = controller.lyapunov(
        simulate_closed_loop(lambda y: BODY.advance(y, None, 0.05, 2), y, 100)
    )
    np.testing.assert_allclose(value, np.broadcast_to(value[0], value.shape), rtol=1e-6, atol=1e-9)
    states = simulate_closed_loop(step(controller, 0.05, 2), y, 800)
    value, steers = controller.lyapunov(states), controller.steers(states)
    rise = np.where(steers[:-1] & steers[1:], np.diff(value, axis=0), 0.0)
    assert rise.max() < 1e-3  # a held torque may outlast the sign of the gradient
    assert (value[-1] < 1e-2).mean() > 0.97


def test_a_body_at_rest_is_not_near_minus_e2_and_is_left_alone():
    """The gradient of W is 0 there."""
    assert not steering()(BODY.state()).any() and steering().steers(BODY.state())


def test_what_is_caught_is_held():
    """The unstable direction is within the reach of the torque, and omega2 is led back too."""
    controller, rng = steering(), np.random.default_rng(0)
    omega = RATE * np.array([0.0, 1.0, 0.0]) + rng.uniform(-0.4, 0.4, (4000, 3))
    y = BODY.state(omega_body=omega)
    y = y[~controller.steers(y)]
    assert len(y) > 100
    states = simulate_closed_loop(step(controller, DT, 3), y, 300)
    assert (np.linalg.norm(controller.error(states[-1]), axis=-1) < 1e-6 * RATE).all()


def test_an_actuator_about_e2_alone_is_refused():
    refuses(r"axes = \(False, True, False\); expected an actuator", steering, (False, True, False))


def test_the_motion_to_join_is_a_free_one():
    """Each f(time_left) obeys Euler's equations and has the momentum and energy of the spin."""
    controller, y = TimedFlip(BODY, RATE, 0.5), spinning(np.random.default_rng(0), (10,))
    left, h = np.linspace(0.1, 15.0, 200)[:, None], 1e-5
    f = controller.reference(y, left)
    slope = (controller.reference(y, left - h) - controller.reference(y, left + h)) / (2.0 * h)
    euler = BODY.rhs(BODY.state(omega_body=f))[..., OMEGA]
    np.testing.assert_allclose(slope, euler, atol=1e-9)  # h^2 and eps / h
    L = BODY.moments * f
    np.testing.assert_allclose(np.sum(L**2, axis=-1), (BODY.I2 * RATE) ** 2, rtol=1e-13)
    np.testing.assert_allclose(np.sum(L * f, axis=-1), BODY.I2 * RATE**2, rtol=1e-13)


def test_at_the_commanded_time_the_motion_is_a_margin_away_from_the_flipped_spin():
    controller, y = (
        TimedFlip(BODY, RATE, 0.5, margin=0.02),
        spinning(np.random.default_rng(0), (10,)),
    )
    off = controller.reference(y, 1e-9) + [0.0, RATE, 0.0] * np.ones((10, 1))
    # but for the second order of the margin, in omega2
    np.testing.assert_allclose(np.linalg.norm(off, axis=-1), 0.02 * RATE, rtol=0.02)


def test_the_error_of_brute_force_decreases_everywhere_as_stated():
    controller, y = ForcedFlip(BODY, RATE, FREE), spinning(np.random.default_rng(0), (500,), 3.0)
    found = rate_along(controller.lyapunov, y, rate_of(controller, y), OMEGA)
    value = controller.lyapunov(y)
    I1, _, I3 = BODY.moments
    stated = RATE * (I3 - I1) * y[:, 4] * y[:, 6] - 2.0 * controller.gain * RATE * value
    np.testing.assert_allclose(found, stated, atol=1e-12 * np.abs(found).max())
    assert (found <= -(2.0 * controller.gain - (I3 - I1) / np.sqrt(I1 * I3)) * RATE * value).all()


def test_the_error_of_the_timed_flip_decreases_everywhere_as_stated():
    controller, rng = TimedFlip(BODY, RATE, FREE), np.random.default_rng(0)
    y, left = spinning(rng, (500,), 3.0), rng.uniform(0.1, 12.0, 500)
    f, h = controller.reference(y, left), 1e-6
    body_rate = rate_of(controller, y, left)[:, OMEGA]
    error_rate = body_rate - BODY.rhs(BODY.state(omega_body=f))[:, OMEGA]
    error = y[:, OMEGA] - f
    found = np.sum(BODY.moments * error * error_rate, axis=-1)
    value = controller.lyapunov(y, left)
    I1, I2, I3 = BODY.moments
    slowest = 2.0 * controller.gain - np.sqrt(I2 / I1) * (I3 - I1) / np.sqrt(I1 * I3)
    assert (found <= -slowest * RATE * value).all()
    after = y.copy()
    after[:, OMEGA] += h * body_rate
    difference = (controller.lyapunov(after, left - h) - value) / h
    same_side = np.abs(y[:, 4] - y[:, 6]) > 1e-2  # where the sign of d does not change in h
    np.testing.assert_allclose(difference[same_side], found[same_side], rtol=1e-3, atol=1e-3)


def test_without_limits_both_flips_come_from_everywhere():
    y = spinning(np.random.default_rng(0), (100,), 1.5)
    forced = ForcedFlip(BODY, RATE, FREE)
    states = simulate_closed_loop(step(forced, 0.02, 2), y, 400)
    assert (np.diff(forced.lyapunov(states), axis=0)[:100] < 0.0).all()
    np.testing.assert_allclose(states[-1, :, OMEGA], [[0.0, -RATE, 0.0]] * 100, atol=1e-9)
    timed, dt = TimedFlip(BODY, RATE, FREE), 0.02
    for k in range(500, -100, -1):
        y = BODY.advance(y, timed.inputs(timed(y, k * dt)), dt, 2)
        if k <= 1:
            off = np.linalg.norm(y[:, OMEGA] + [[0.0, RATE, 0.0]], axis=-1)
            assert off.max() < 0.05 * RATE


def test_gains_that_do_not_make_the_error_decrease_are_refused():
    refuses(r"^gain = 0\.3; expected more than 0\.377", ForcedFlip, BODY, RATE, 0.5, gain=0.3)
    refuses(r"^gain = 0\.4; expected more than 0\.4689", TimedFlip, BODY, RATE, 0.5, gain=0.4)
