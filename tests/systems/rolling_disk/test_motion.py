"""The rolling disk against reference cases, Newton's law with multipliers, a million steps."""

import math
from operator import itemgetter

import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.systems.rolling_disk.system import RollingDisk
from tests.reference import cases
from tests.systems.measures import is_level, refined, sample_steps, seeds


def from_case(case):
    """Disk and state of Euler angles, their rates (psi' through w3) and the place of the centre."""
    given = case["in"]
    disk = RollingDisk(given["m"], given["a"], given["A"], given["C"], given["g"])
    angles = given["phi"], given["theta"], given["psi"]
    q = rotations.quaternion_from_euler(angles)
    # omega = phi' e_z + theta' (line of nodes) + psi' e3, in body axes.
    s, c = math.sin(given["psi"]), math.cos(given["psi"])
    wn, nodes = given["phid"] * math.sin(given["theta"]), given["thetad"]
    omega = (nodes * c + wn * s, wn * c - nodes * s, given["w3"])
    y = disk.state(q=q, omega_body=omega)
    y[7:9] = np.array(given["xy0"]) - disk.centre(y)[:2]
    return disk, y


@pytest.mark.parametrize("case", cases("disk_fall"), ids=itemgetter("id"))
def test_the_falling_disk_agrees_with_the_reference(case):
    disk, y = from_case(case)
    assert disk.energy(y) == pytest.approx(case["scalars"]["E"], rel=1e-15)
    t = np.union1d(case["t"], np.linspace(0.0, case["t"][-1], 61))  # to see where it is fastest
    motion, rows = refined(disk, y, t, per_radian=32.0), np.searchsorted(t, case["t"])
    found, out, cond = motion.trajectory, case["out"], case["cond"]
    fields = (
        ("R", "R", motion.turned),
        ("centre", "r", disk.radius * motion.turned),
        ("omega_body", "w", motion.rate),
        ("contact", "contact", disk.radius * motion.turned),
        ("contact_force", "F", disk.m * disk.radius * motion.rate**2),
        ("tilt", "theta", motion.turned),
    )
    for name, field, size in fields:
        expected = np.reshape(out[field], found[name][rows].shape)
        atol = motion.tolerance(name, size, cond[field])
        np.testing.assert_allclose(found[name][rows], expected, rtol=0, atol=atol)


@pytest.mark.parametrize("case", cases("disk_fall"), ids=itemgetter("id"))
def test_the_lean_swings_between_the_reference_limits_in_the_reference_period(case):
    disk, y = from_case(case)
    scalars = case["scalars"]
    period, low, high = (scalars[name] for name in ("lean_period", "theta_min", "theta_max"))
    motion = disk.simulate(y, np.linspace(0.0, period, 101))
    tilt = motion["tilt"]
    # Default steps, and how a whole swing stretches an error of the start.
    atol = 1e-10 * max(1.0, case["cond"]["theta"])
    assert tilt[-1] == pytest.approx(tilt[0], abs=atol)
    assert falling(disk, motion.y[-1]) == pytest.approx(falling(disk, y), abs=10.0 * atol)
    assert np.min(tilt) >= low - atol
    assert np.max(tilt) <= high + atol
    if case["in"]["thetad"] == 0.0:  # it starts at one of the limits: half a swing to the other
        assert tilt[50] == pytest.approx(low + high - tilt[0], abs=atol)


def falling(disk, y):
    """theta', the rate about the line of nodes, from d(cos theta)/dt = -theta' sin(theta)."""
    axis = disk.accessors["R"](y)[:, 2]
    return -np.cross(disk.omega_world(y), axis)[2] / math.sin(disk.tilt(y))


DISC = RollingDisk.uniform()
SWINGING = DISC.state(
    q=rotations.quaternion_from_euler((0.0, 1.3, 0.0)), omega_body=(0.2, 0.1, 3.0)
)


def run(disk, y, dt):
    """States at 1500 moments of a million steps."""
    return disk.simulate(y, sample_steps(10**6, 1500) * dt, max_step=dt)


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


@pytest.mark.parametrize("seed", seeds(0, 54))
def test_random_disks_at_any_rate_in_the_envelope_keep_their_energy(seed):
    disk, y, rate, rng = random_disk(seed)
    turn = rng.uniform(0.05, 0.35)  # its rate may pass the largest that was seen
    trajectory = run(disk, y, turn / rate)
    energy = energy_error(trajectory)
    # Fourth order: C (rate dt)^4, where C was 0.0009 at most in 54 disks; and roundings.
    assert np.max(np.abs(energy)) <= 0.004 * turn**4 + 1e-11
    assert is_level(trajectory.t, energy, share=0.25)
    check_state(trajectory)
