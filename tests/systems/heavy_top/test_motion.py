"""The motion of the heavy top against reference cases, and what it keeps over a million steps."""

import math
from operator import itemgetter

import numpy as np
import pytest

from rigid_envs.mechanics.laws import matrices
from rigid_envs.systems.heavy_top.system import HeavyTop
from tests.reference import cases
from tests.systems.measures import (
    is_level,
    leaning,
    random_attitude,
    random_moments,
    sample_steps,
    seeds,
)

TOP = HeavyTop()


@pytest.mark.parametrize("case", cases("driven_space"), ids=itemgetter("id"))
def test_a_torque_fixed_in_space_agrees_with_the_reference(case):
    given_ = case["in"]
    top = HeavyTop(*given_["I"], g=0.0, ell=0.0)
    y = top.state(q=given_["q0"], omega_body=given_["w0"])
    u = (0.0, 0.0, 0.0, *given_["N"], 0.0, 0.0)
    trajectory = top.simulate(y, np.concatenate([[0.0], case["t"]]), u)
    # Default steps: near 1e-11 per radian turned, some 20 radians.
    R = matrices(trajectory["q"][1:]).reshape(-1, 9)
    np.testing.assert_allclose(trajectory["omega_body"][1:], case["out"]["w"], rtol=0, atol=1e-10)
    np.testing.assert_allclose(R, case["out"]["R"], rtol=0, atol=1e-10)
    L = np.array(case["out"]["Lspace"])
    np.testing.assert_allclose(trajectory["L_world"][1:], L, rtol=0, atol=1e-11)


def test_a_top_hanging_almost_at_rest_swings_like_a_pendulum():
    # It hardly moves, but gravity's own rate of 1 rad/s sets the step.
    start = TOP.state(q=leaning(math.pi - 1e-5))
    t = np.linspace(0.0, 50.0, 501)
    swing = TOP.simulate(start, t)["R"][:, 1, 2]
    # Harmonic to the square of the amplitude; the axis leans to -y at phi = 0.
    np.testing.assert_allclose(swing, -1e-5 * np.cos(t), rtol=0, atol=1e-13)
    with pytest.raises(ValueError, match="take n_substeps >= 10"):
        TOP.advance(start, None, 5.0)


def run(top, y, dt):
    """States at 20 000 moments of a million steps."""
    return top.simulate(y, sample_steps(10**6) * dt, max_step=dt)


def energy_error(trajectory):
    energy = trajectory.invariants["energy"]
    return energy - energy[0]


def check_momenta(trajectory, size):
    """Vertical momentum, and spin momentum of a symmetric top, to 1e-11 of a typical momentum.

    A million steps of 25 turns and kicks are a random walk of 2e7 roundings: 1e-12 or less.
    """
    found = trajectory.invariants
    assert np.max(np.abs(found["L_vertical"] - found["L_vertical"][0])) <= 1e-11 * size
    if trajectory.system.I1 == trajectory.system.I2:
        # Nothing turns about e3 except the body itself: not even rounded.
        np.testing.assert_array_equal(found["L_spin"], found["L_spin"][0])
    gamma = np.linalg.norm(trajectory["gamma"], axis=-1)
    assert np.max(np.abs(gamma**2 - 1.0)) <= 1e-14
    assert np.max(np.abs(np.linalg.norm(trajectory["q"], axis=-1) - 1.0)) <= 1e-14


def random_top(rng, symmetric):
    moments = random_moments(rng)
    if symmetric:
        moments[1], moments[2] = moments[0], min(moments[2], 2.0 * moments[0])
    m, (I1, I2, I3) = rng.uniform(0.5, 2.0), moments
    longest = math.sqrt((I1 + I2 - I3) / (2.0 * m))  # m ell^2 is part of I1 and I2
    return HeavyTop(I1, I2, I3, m, ell=min(rng.uniform(0.05, 0.5), longest))


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("seed", seeds(2, 53))
def test_random_tops_at_any_rate_in_the_envelope_keep_their_invariants(seed, symmetric):
    rng = np.random.default_rng([8, seed])
    top = random_top(rng, symmetric)
    least = min(top.I1, top.I2, top.I3)
    fall = math.sqrt(top.m * top.g * top.ell / least)
    omega = rng.normal(size=3) * rng.uniform(0.3, 3.0) * fall
    y = top.state(q=random_attitude(rng), omega_body=omega)
    rate, turn = top.rate_bound(y, np.zeros(8), 0.0), rng.uniform(0.05, top.envelope)
    trajectory = run(top, y, turn / rate)
    size = 0.5 * least * rate**2  # energy above that of hanging at rest
    energy = energy_error(trajectory) / size
    # Fourth order: C (rate dt)^4, where C was 0.054 at most in 80 tops; and roundings.
    assert np.max(np.abs(energy)) <= 0.2 * turn**4 + 1e-11
    # Where the motion is chaotic the error wanders between bounds: a line through it is not level.
    assert is_level(trajectory.t, energy, share=0.1 if symmetric else 0.5)
    check_momenta(trajectory, math.sqrt(2.0 * size * max(top.I1, top.I2, top.I3)))


@pytest.mark.parametrize("theta", [0.0, math.pi])
@pytest.mark.parametrize("spin", [0.0, 1.0, 3.9, 4.1, 20.0])
def test_a_top_exactly_on_the_vertical_stays_there(theta, spin):
    top = HeavyTop()
    start = top.state(q=leaning(theta), omega_body=(0.0, 0.0, spin))
    trajectory = top.simulate(start, np.linspace(0.0, 20.0, 21))
    # cos(pi / 2) is 6e-17 and not 0: where upright is exact, hanging is so to rounding.
    np.testing.assert_allclose(
        trajectory["tilt"], theta, rtol=0, atol=0.0 if theta == 0.0 else 1e-14
    )
    np.testing.assert_allclose(trajectory["omega_body"][:, :2], 0.0, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(trajectory["omega_body"][:, 2], spin)
    # It only spins, and e1 goes round the vertical by omega3 t.
    e1 = trajectory["R"][:, :, 0]
    angle = trajectory.t * spin * (1.0 if theta == 0.0 else -1.0)
    np.testing.assert_allclose(e1[:, :2] @ (1.0, 0.0), np.cos(angle), rtol=0, atol=1e-11)
    np.testing.assert_allclose(e1[:, :2] @ (0.0, 1.0), np.sin(angle), rtol=0, atol=1e-11)


@pytest.mark.parametrize("theta", [0.0, math.pi])
def test_a_million_steps_through_the_vertical_keep_the_invariants(theta):
    # Started on the vertical with a sideways rate, the axis comes back through it again and again.
    start = TOP.state(q=leaning(theta), omega_body=(0.7, 0.0, 2.0))
    trajectory = run(TOP, start, 0.05)
    energy = energy_error(trajectory)
    assert np.isfinite(trajectory.y).all()
    assert np.max(np.abs(energy)) <= 1e-7
    assert is_level(trajectory.t, energy)
    check_momenta(trajectory, 1.0)
    poles = np.min(np.abs(trajectory["tilt"] - theta))
    assert poles < 0.05
