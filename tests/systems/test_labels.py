"""Which axis of a free body has which moment does not matter."""

import itertools

import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.systems.free_body import closed_forms as theory
from rigid_envs.systems.free_body.system import FreeBody

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
            motion["omega_body"], theory.omega(t, order, OMEGA), rtol=0, atol=1e-8
        )
        attitudes = theory.attitude(t, order, OMEGA, start[:4])
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
