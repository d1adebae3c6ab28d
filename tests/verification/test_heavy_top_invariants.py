"""What a heavy top keeps, over a million steps, also through the vertical."""

import math

import numpy as np
import pytest

from rigid_envs.systems.heavy_top.system import HeavyTop
from tests.verification.measures import (
    is_level,
    leaning,
    orders,
    random_attitude,
    random_moments,
    sample_steps,
)

TOP = HeavyTop()  # I = 1, 1, 0.5; m g ell = 1
NUTATING = TOP.state(
    q=leaning(0.5), omega_body=(0.3, -0.2, 3.0), pivot=(0.1, 0.2), pivot_velocity=(0.01, -0.02)
)


def run(top, y, dt, n_steps=10**6):
    """States at 20 000 moments on the way."""
    return top.simulate(y, sample_steps(n_steps) * dt, max_step=dt)


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


@pytest.mark.parametrize(("dt", "bound"), [(0.1, 1e-6), (0.05, 5e-8), (0.02, 2e-9)])
def test_a_million_steps_keep_the_momenta_and_bound_the_energy(dt, bound):
    # In units of m g ell = 1 J. Found: 4.9e-7, 3.0e-8 and 7.8e-10: the fourth power of the step.
    trajectory = run(TOP, NUTATING, dt)
    energy = energy_error(trajectory)
    assert np.max(np.abs(energy)) <= bound
    assert is_level(trajectory.t, energy)
    check_momenta(trajectory, 1.5)
    # The pivot coasts: x = x0 + v t, to a rounding of each of the five million sums.
    np.testing.assert_allclose(
        trajectory["pivot"],
        NUTATING[7:9] + np.outer(trajectory.t, NUTATING[9:11]),
        rtol=1e-9,
    )
    np.testing.assert_array_equal(
        trajectory["pivot_velocity"], np.tile(NUTATING[9:11], (len(trajectory), 1))
    )


def test_the_energy_error_falls_with_the_fourth_power_of_the_step():
    largest = [
        np.max(np.abs(energy_error(run(TOP, NUTATING, dt, 10**5)))) for dt in (0.1, 0.05, 0.025)
    ]
    np.testing.assert_allclose(orders(largest), 4.0, atol=0.2)


def random_top(rng, symmetric):
    moments = random_moments(rng)
    if symmetric:
        moments[1], moments[2] = moments[0], min(moments[2], 2.0 * moments[0])
    m, (I1, I2, I3) = rng.uniform(0.5, 2.0), moments
    longest = math.sqrt((I1 + I2 - I3) / (2.0 * m))  # m ell^2 is part of I1 and I2
    return HeavyTop(I1, I2, I3, m, ell=min(rng.uniform(0.05, 0.5), longest))


def check_random_top(seed, symmetric):
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


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_random_tops_at_any_rate_in_the_envelope_keep_their_invariants(seed, symmetric):
    check_random_top(seed, symmetric)


@pytest.mark.long
@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("seed", range(3, 53))
def test_a_hundred_random_tops_keep_their_invariants(seed, symmetric):
    check_random_top(seed, symmetric)


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
