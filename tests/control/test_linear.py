"""Sampling, LQR, scheduling and closed loops, against closed forms and sums."""

import numpy as np
import pytest

from rigid_envs.control import linear
from rigid_envs.systems.heavy_top.closed_forms import sleeping_exponents
from tests.refusals import refuses

DT = 0.1
DOUBLE = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]])  # x'' = u
TOP = {"i_perp": 1.3, "i3": 0.6, "mgl": 0.9}


def falling(spin):
    """A and B of a top's small tilt in complex numbers, under horizontal torque."""
    turn = 1j * TOP["i3"] * spin
    A = np.array([[0.0, 1.0], [TOP["mgl"], turn]]) / [[1.0], [TOP["i_perp"]]]
    return A, np.array([[0.0], [-1j / TOP["i_perp"]]])


def test_a_held_force_gives_a_parabola():
    F, G = linear.zero_order_hold(*DOUBLE, DT)
    np.testing.assert_allclose(F, [[1.0, DT], [0.0, 1.0]], rtol=1e-14)
    np.testing.assert_allclose(G, [[0.5 * DT**2], [DT]], rtol=1e-14)


def test_samples_move_with_the_exponents_of_the_motion():
    for spin in (0.7, -1.3, 9.0):
        F, _ = linear.zero_order_hold(*falling(spin), DT)
        expected = np.exp(DT * np.array(sleeping_exponents(spin, **TOP)))
        found = np.linalg.eigvals(F)
        # a well separated pair: a few roundings
        np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(expected), rtol=1e-13)


def test_an_input_that_turns_gives_an_arc():
    """x' = u with u turning at the rate w: x = (sin(w t), 1 - cos(w t)) / w."""
    w = 3.0
    _, G = linear.zero_order_hold(np.zeros((2, 2)), np.eye(2), DT, np.array([[0.0, -w], [w, 0.0]]))
    arc = np.array([np.sin(w * DT), 1.0 - np.cos(w * DT)]) / w
    np.testing.assert_allclose(G, [[arc[0], -arc[1]], [arc[1], arc[0]]], rtol=1e-13)


def test_the_jacobian_of_a_step_is_found_to_ten_digits():
    F, G = np.array([[0.3, -2.0], [1.5, 0.1]]), np.array([[2.0], [-0.7]])

    def advance(x, u):
        y = x - [1.0, 2.0]
        return [1.0, 2.0] + y @ F.T + u @ G.T + 5.0 * y**2 + 3.0 * y**3

    found = linear.step_jacobian(advance, np.array([1.0, 2.0]), 1)
    # squares cancel; what is left is 3 h^2 and the rounding of numbers near 2 over 2 h
    np.testing.assert_allclose(found[0], F, rtol=0, atol=3e-10 + 4 * 2.2e-16 / 1e-5)
    np.testing.assert_allclose(found[1], G, rtol=0, atol=4 * 2.2e-16 / 1e-5)


@pytest.mark.parametrize("a", [0.5, 1.0, 1.8])
def test_the_scalar_riccati_equation_has_its_closed_form(a):
    """P = q + a^2 P r / (r + b^2 P), a quadratic equation."""
    b, q, r = 0.7, 2.0, 3.0
    half = 0.5 * (q * b**2 + (a**2 - 1.0) * r)
    P = (half + np.sqrt(half**2 + q * r * b**2)) / b**2
    found = linear.lqr(np.array([[a]]), np.array([[b]]), [q], [r])
    np.testing.assert_allclose(found.riccati, [[P]], rtol=1e-12)
    np.testing.assert_allclose(found.gain, [[a * b * P / (r + b**2 * P)]], rtol=1e-12)


def cost(F, G, K, x, Q, R, n_steps):
    """Sum of x* Q x + u* R u under u = -K x."""
    total = 0.0
    for _ in range(n_steps):
        u = -K @ x
        total += np.vdot(x, Q * x).real + np.vdot(u, R * u).real
        x = F @ x + G @ u
    return total


@pytest.mark.parametrize("model", [DOUBLE, falling(1.0)], ids=["real", "complex"])
def test_the_value_is_the_sum_of_the_costs_and_other_gains_cost_more(model):
    F, G = linear.zero_order_hold(*model, DT)
    Q, R = np.array([1.0, 2.0]), np.array([0.5])
    best = linear.lqr(F, G, Q, R)
    rng = np.random.default_rng(0)
    x = rng.normal(size=2) + (1j * rng.normal(size=2) if np.iscomplexobj(F) else 0.0)
    assert np.abs(np.linalg.eigvals(F - G @ best.gain)).max() < 0.95
    # what is left after 800 steps is 0.95^1600; the Riccati equation is solved to its condition
    np.testing.assert_allclose(cost(F, G, best.gain, x, Q, R, 800), best.value(x), rtol=1e-10)
    for factor in (0.9, 1.1, 1.0 + 0.1j if np.iscomplexobj(F) else 1.2):
        assert cost(F, G, factor * best.gain, x, Q, R, 800) > best.value(x) * (1.0 + 1e-6)


def test_feedback_and_value_take_leading_axes_of_states_and_of_gains():
    best = linear.lqr(*linear.zero_order_hold(*falling(1.0), DT), [1.0, 1.0], [1.0])
    x = np.random.default_rng(0).normal(size=(3, 4, 2)) + 1j
    stacked = linear.Regulator(np.broadcast_to(best.gain, (4, 1, 2)), best.riccati)
    for row in np.ndindex(3, 4):
        u = -best.gain @ x[row]
        np.testing.assert_allclose(best.feedback(x)[row], u, rtol=1e-14)
        np.testing.assert_allclose(stacked.feedback(x)[row], u, rtol=1e-14)
        expected = np.vdot(x[row], best.riccati @ x[row]).real
        np.testing.assert_allclose(stacked.value(x)[row], expected, rtol=1e-13)


def test_a_scheduled_regulator_is_exact_at_the_nodes_and_near_between_them():
    def at(spin, weight):
        return linear.lqr(*linear.zero_order_hold(*falling(spin), DT), [1.0, 1.0], [weight])

    spins, prices = np.linspace(-3.0, 3.0, 31), np.array([0.5, 1.0, 1.5])
    look_up = linear.scheduled(at, spins, prices)
    nodes = look_up(spins[:, None], prices)
    assert nodes.gain.shape == (31, 3, 1, 2)
    assert nodes.riccati.shape == (31, 3, 2, 2)
    for k in (0, 7, 30):
        np.testing.assert_allclose(nodes.gain[k, 2], at(spins[k], 1.5).gain, rtol=1e-14)
        np.testing.assert_allclose(nodes.riccati[k, 2], at(spins[k], 1.5).riccati, rtol=1e-14)
    between = look_up(0.5 * (spins[1:] + spins[:-1]), 1.0).gain
    for k in range(30):
        # linear between nodes 0.2 apart, where second derivatives are below 1
        exact = at(0.5 * (spins[k] + spins[k + 1]), 1.0).gain
        np.testing.assert_allclose(between[k], exact, atol=0.2**2 / 8.0)
    np.testing.assert_array_equal(look_up(99.0, 0.0).gain, nodes.gain[-1, 0])
    alone = linear.scheduled(at, spins[:1], prices[:1])  # the nearest of one node is that one
    np.testing.assert_array_equal(alone(99.0, 0.0).gain, nodes.gain[0, 0])


def test_what_cannot_be_held_or_weighed_is_refused():
    F, G = np.diag([2.0, 0.5]), np.array([[0.0], [1.0]])
    with pytest.raises(ValueError, match="expected inputs by which feedback can stabilise F"):
        linear.lqr(F, G, [1.0, 1.0], [1.0])
    with pytest.raises(ValueError, match=r"^Q\[1\] = 0\.0; expected positive finite numbers"):
        linear.lqr(F, G, [1.0, 0.0], [1.0])
    refuses(r"^R has shape \(2,\); expected \(1,\)", linear.lqr, F, G, [1.0, 1.0], [1.0, 1.0])


def saturated(x):
    """x+ = 2 x + clip(-2 x): brought to 0 at once from |x| <= 1/2, held for |x| < 1."""
    return 2.0 * x + linear.clip_to_box(-2.0 * x)


def test_a_motion_is_the_step_repeated():
    x = linear.simulate_closed_loop(saturated, np.array([[0.75], [0.25], [-1.5]]), 3)
    np.testing.assert_array_equal(
        x[:, :, 0], np.transpose([[0.75, 0.5, 0, 0], [0.25, 0, 0, 0], [-1.5, -2, -3, -5]])
    )
    np.testing.assert_array_equal(linear.simulate_closed_loop(saturated, [0.75], 0), [[0.75]])


def test_the_region_of_a_scalar_loop_is_where_its_actuator_can_hold_it():
    def comes_back(x):
        return np.abs(linear.simulate_closed_loop(saturated, x, 60)[-1, ..., 0]) < 1e-3

    sizes = np.arange(0.05, 2.0, 0.1)  # 0.95 and 1.05 among them
    np.testing.assert_allclose(
        linear.region_of_attraction(comes_back, [[1.0], [-1.0], [2.0]], sizes), [0.95, 0.95, 0.45]
    )


def test_what_lies_beyond_a_failure_does_not_count():
    found = linear.region_of_attraction(
        lambda x: np.abs(x[..., 0] - 2.0) > 0.5, [[1.0], [0.1], [10.0]], [0.2, 1.0, 2.0, 3.0]
    )
    np.testing.assert_array_equal(found, [1.0, 3.0, 0.0])


def test_sizes_out_of_order_are_refused():
    for sizes in ([0.0, 1.0], [1.0, 0.5], [[1.0]]):
        with pytest.raises(
            ValueError, match=r"^sizes .*; expected (positive .* ascending order|\(M,\))"
        ):
            linear.region_of_attraction(lambda x: x[..., 0] > 0.0, [[1.0]], sizes)


def test_limits_keep_what_is_inside_and_the_direction_of_what_is_not():
    action = np.array([[0.3, -0.4, 0.5], [3.0, 0.0, -4.0]])
    np.testing.assert_array_equal(linear.clip_to_box(action), [[0.3, -0.4, 0.5], [1.0, 0.0, -1.0]])
    np.testing.assert_allclose(
        linear.clip_to_ball(action), [[0.3, -0.4, 0.5], [0.6, 0.0, -0.8]], rtol=1e-15
    )
