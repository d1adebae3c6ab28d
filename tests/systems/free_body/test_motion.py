"""The free body against references and Jacobi's functions; a million steps."""

import itertools
from operator import itemgetter

import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.laws import matrices
from rigid_envs.systems.free_body import closed_forms as free_body
from rigid_envs.systems.free_body.system import FreeBody
from tests.reference import cases
from tests.systems.measures import is_level, random_attitude, random_moments, sample_steps, seeds


@pytest.mark.parametrize("case", cases("driven_body"), ids=itemgetter("id"))
def test_rotation_under_body_torque_agrees_with_the_reference(case):
    given_ = case["in"]
    body, tau = FreeBody(*given_["I"]), np.array(given_["tau"])
    y = body.state(q=given_["q0"], omega_body=given_["w0"])
    u = tau
    if "tau_freq" in given_:
        u = lambda t: tau * np.cos(given_["tau_freq"] * t)  # noqa: E731
    trajectory = body.simulate(y, np.concatenate([[0.0], case["t"]]), u)
    # Default steps: near 1e-11 per radian turned, some 20 to 40 radians.
    for found, name in ((trajectory["omega_body"], "w"), (matrices(trajectory["q"]), "R")):
        expected = np.array(case["out"][name])
        np.testing.assert_allclose(
            found[1:].reshape(expected.shape), expected, rtol=0, atol=2e-10, err_msg=name
        )


def run(body, y, dt):
    """States at 20 000 moments of a million steps."""
    return body.simulate(y, sample_steps(10**6) * dt, max_step=dt)


def relative_energy(trajectory):
    energy = trajectory.invariants["energy"]
    return energy / energy[0] - 1.0


def check_momentum(trajectory):
    """Size and direction in space of L, and the length of q, to their bars.

    The turns of a step are rotations to rounding; a million steps of 20 turns are a random walk of
    2e7 roundings, which is 1e-12 or less.
    """
    found = trajectory.invariants
    np.testing.assert_allclose(found["L_squared"], found["L_squared"][0], rtol=1e-11)
    L = np.stack([found[f"L_world_{k}"] for k in "xyz"], axis=-1)
    moved = np.linalg.norm(L - L[0], axis=-1)
    assert np.max(moved) <= 1e-11 * np.linalg.norm(L[0])
    assert np.max(np.abs(np.linalg.norm(trajectory["q"], axis=-1) - 1.0)) <= 1e-14


@pytest.mark.parametrize("seed", seeds(4, 100))
def test_random_bodies_at_any_rate_in_the_envelope_keep_their_invariants(seed):
    rng = np.random.default_rng([7, seed])
    body, dt, turn = FreeBody(*random_moments(rng)), 0.1, rng.uniform(0.05, FreeBody.envelope)
    direction = rng.normal(size=3)
    fastest = body.rate_bound(body.state(omega_body=direction), np.zeros(3), 0.0)
    omega = direction * turn / dt / fastest
    trajectory = run(body, body.state(q=random_attitude(rng), omega_body=omega), dt)
    energy = relative_energy(trajectory)
    # Fourth order: C (rate dt)^4, where C was 0.0064 at most in 60 bodies; and roundings.
    assert np.max(np.abs(energy)) <= 0.02 * turn**4 + 1e-12
    assert is_level(trajectory.t, energy)
    check_momentum(trajectory)


BODIES = (
    (1.0, 2.0, 3.0),
    (0.01, 1.0, 1.0),
    (1e-4, 1.0, 1.0),
    (1e-4, 0.5, 0.5 + 1e-4),
    (1.0, 1.0, 2.0),
    (0.6, 0.8, 1.4),
    (1.0, 1.0, 1.0 + 1e-12),
)
OMEGA = np.array([0.3, 0.5, 0.7])


@pytest.mark.parametrize("moments", BODIES, ids=str)
def test_every_order_of_the_moments_follows_jacobi(moments):
    # 1e-11 per radian, some hundred radians, and 1e-10 where moments are very unequal
    t = np.linspace(0.0, 60.0, 13)
    for order in set(itertools.permutations(moments)):
        body = FreeBody(*order)
        start = body.state(omega_body=OMEGA)
        motion = body.simulate(start, t)
        np.testing.assert_array_equal(motion.y[0], start)
        np.testing.assert_allclose(
            motion["omega_body"], free_body.omega(t, order, OMEGA), rtol=0, atol=1e-8
        )
        attitudes = free_body.attitude(t, order, OMEGA, start[:4])
        np.testing.assert_allclose(motion["q"], attitudes, rtol=0, atol=1e-8)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))), ids=str)
def test_a_body_whose_axes_are_renamed_moves_as_before(order):
    rng, moments = np.random.default_rng(0), np.array([1.1, 1.7, 2.3])
    # columns: the old axes in the new ones; one of them turned round where the order is odd
    turn = np.eye(3)[list(order)]
    turn[0] *= np.linalg.det(turn)
    torques, times = rng.uniform(-1.0, 1.0, (30, 3)), 0.1 * np.arange(31)
    q = rotations.random_quaternion(rng)
    body, renamed = FreeBody(*moments), FreeBody(*moments[list(order)])
    motion = body.simulate(body.state(q=q, omega_body=OMEGA), times, torques)
    start = renamed.state(
        q=rotations.multiply(q, rotations.quaternion_from_matrix(turn.T)), omega_body=turn @ OMEGA
    )
    other = renamed.simulate(start, times, torques @ turn.T)
    np.testing.assert_allclose(other["L_world"], motion["L_world"], rtol=0, atol=1e-9)
    np.testing.assert_allclose(other["R"] @ turn, motion["R"], rtol=0, atol=1e-9)
    one = renamed.advance(start, torques[0] @ turn.T, 0.1)
    np.testing.assert_allclose(
        renamed.omega_world(one), body.omega_world(motion.y[1]), rtol=0, atol=1e-6
    )  # a single step of 0.1 s


def test_a_plan_of_more_steps_than_minutes_are_worth_is_refused_with_its_reason():
    needle = FreeBody(1.0, 1e-9, 1.0)
    start = needle.state(omega_body=(0.0, 1.0, 0.0))
    assert needle.simulate(start, [0.0, 1.0])["omega_body"][-1].tolist() == [0.0, 1.0, 0.0]
    with pytest.raises(ValueError, match=r"number of steps = .*; expected at most 1e\+09, .*rad/s"):
        needle.simulate(needle.state(omega_body=(0.0, 1e3, 1e3)), [0.0, 60.0])
