"""What a disk without torque keeps while it rolls, over a million steps."""

import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_disk.system import RollingDisk
from tests.verification.measures import is_level, orders, sample_steps, slope

DISC = RollingDisk.uniform()
SWINGING = DISC.state(
    q=rotations.quaternion_from_euler((0.0, 1.3, 0.0)), omega_body=(0.2, 0.1, 3.0)
)
MILLION = 10**6


def run(disk, y, dt, n_steps=MILLION):
    """States at 1500 moments on the way."""
    return disk.simulate(y, sample_steps(n_steps, 1500) * dt, max_step=dt)


def energy_error(trajectory):
    energy = trajectory.invariants["energy"]
    return energy / energy[0] - 1.0


def check_state(trajectory):
    """The attitude is a rotation, and the rim on the plane."""
    assert np.max(np.abs(np.linalg.norm(trajectory["q"], axis=-1) - 1.0)) <= 1e-14
    height = trajectory["centre"][:, 2] / trajectory.system.radius
    # a rotated vector, a product and a quotient, and an angle and its sine: 20 roundings below 1
    np.testing.assert_allclose(height, np.sin(trajectory["tilt"]), rtol=0, atol=20 * 2.0**-53)


@pytest.mark.parametrize(
    ("dt", "bound"), [(0.04, 3e-7), pytest.param(0.02, 2e-8, marks=pytest.mark.long)]
)
def test_a_million_steps_bound_the_energy(dt, bound):
    # Found: 1.1e-7 and 7.1e-9, the fourth power of the step.
    trajectory = run(DISC, SWINGING, dt)
    energy = energy_error(trajectory)
    assert np.max(np.abs(energy)) <= bound
    # Seen at 1500 moments an oscillation leaves a tenth of itself.
    assert is_level(trajectory.t, energy, share=0.25)
    check_state(trajectory)


def test_the_energy_error_falls_with_the_fourth_power_of_the_step():
    largest = [
        np.max(np.abs(energy_error(DISC.simulate(SWINGING, np.arange(n) * dt, max_step=dt))))
        for n, dt in ((251, 0.04), (501, 0.02), (1001, 0.01))
    ]
    np.testing.assert_allclose(orders(largest), 4.0, rtol=0, atol=0.2)


def test_after_a_million_steps_the_contact_does_not_slip():
    y, h = DISC.simulate(SWINGING, [0.0, 4e4], max_step=0.04).y[-1], 1e-3
    near = DISC.simulate(y, 1.0 + h * np.arange(-2, 3), max_step=h)
    n = DISC.radius_up(near.y[2])
    contact = slope(near["centre"], h) - slope(near["R"], h) @ near["R"][2].T @ n
    # h^4 / 30 times the fifth power of 5 rad/s, and roundings of a place 10^4 m away over h.
    np.testing.assert_allclose(contact, 0.0, rtol=0, atol=1e-8)


def random_disk(seed):
    """A disk of any thickness that leans and rolls, and its largest rate."""
    rng = np.random.default_rng([33, seed])
    m, radius = rng.uniform(0.5, 2.0), rng.uniform(0.3, 1.0)
    I3 = m * radius**2 * rng.uniform(0.2, 1.0)
    disk = RollingDisk(m, radius, I3 * rng.uniform(0.5, 2.0), I3)
    angles = rng.uniform(-3.0, 3.0), 0.5 * np.pi + rng.uniform(-0.4, 0.4), rng.uniform(-3.0, 3.0)
    omega = rng.normal(size=3) + np.array([0.0, 0.0, 5.0])
    y = disk.state(q=rotations.quaternion_from_euler(angles), omega_body=omega)
    path = disk.simulate(y, np.linspace(0.0, 20.0, 201)).y
    return disk, y, max(disk.rate_bound(row, np.zeros(3), 0.0) for row in path), rng


def check_random_disk(seed):
    disk, y, rate, rng = random_disk(seed)
    turn = rng.uniform(0.05, 0.35)  # its rate may pass the largest that was seen
    trajectory = run(disk, y, turn / rate)
    energy = energy_error(trajectory)
    # Fourth order: C (rate dt)^4, where C was 0.0009 at most in 54 disks; and roundings.
    assert np.max(np.abs(energy)) <= 0.004 * turn**4 + 1e-11
    assert is_level(trajectory.t, energy, share=0.25)
    check_state(trajectory)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.long)])
def test_random_disks_at_any_rate_in_the_envelope_keep_their_energy(seed):
    check_random_disk(seed)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(2, 54))
def test_fifty_random_disks_keep_their_energy(seed):
    check_random_disk(seed)
