"""Circles, still centres and straight rolling of a disk: what stays as it is, and what falls."""

import math
from operator import itemgetter

import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.laws import EPS
from rigid_envs.systems.rolling_disk.system import RollingDisk
from tests.reference import cases

UPRIGHT = 0.5 * math.pi


def disk_of(case):
    given = case["in"]
    return RollingDisk(given["m"], given["a"], given["A"], given["C"], given["g"])


def circling(disk, theta, precession, w3, falling=0.0):
    """State with Euler angles (0, theta, 0), phi' and theta' as given, and w3 = omega . e3."""
    q = rotations.quaternion_from_euler((0.0, theta, 0.0))
    return disk.state(q=q, omega_body=(falling, precession * math.sin(theta), w3))


def missed(disk, y, dt):
    """Part of an angle that the polynomial of a turn misses at a step of dt: 0.009 x^10.

    Half a turn x is taken at the longest of the five stages, 0.66 of a step.
    """
    return 0.009 * (0.5 * 0.66 * dt * disk.rate_bound(y, np.zeros(3), 0.0)) ** 10


def check_circle(disk, y, case, dt, radius_of_centre):
    """One and a half rounds: the tilt stays, the centre goes round its circle."""
    precession, steps = case["out"]["phid"], math.ceil(3.0 * math.pi / case["out"]["phid"] / dt)
    t = np.linspace(0.0, steps * dt, 16)
    motion = disk.simulate(y, t, max_step=dt)
    theta, rate = case["in"]["theta"], disk.rate_bound(y, np.zeros(3), 0.0)
    # Steady rolling is exact at any step, but for roundings and the polynomials of the turns.
    roundings = 16.0 * EPS * steps
    np.testing.assert_allclose(motion["tilt"], theta, rtol=0, atol=roundings)
    w3 = motion["omega_body"][:, 2]
    np.testing.assert_allclose(w3, case["out"]["w3"], rtol=0, atol=roundings * rate)
    # At phi = 0 the axis leans towards -y, and the disk towards the middle of its circle, +y.
    phi = precession * t
    out = np.stack([np.sin(phi), -np.cos(phi)], axis=-1)
    away = motion["centre"][:, :2] - motion["contact"]
    lean = disk.radius * math.cos(theta)
    atol = disk.radius * (roundings + missed(disk, y, dt) * rate * t[-1])
    np.testing.assert_allclose(away, -lean * out, rtol=0, atol=atol)
    middle = motion["centre"][:, :2] - radius_of_centre * out
    atol = (disk.radius + abs(radius_of_centre)) / disk.radius * atol
    np.testing.assert_allclose(middle, np.tile(middle[0], (16, 1)), rtol=0, atol=atol)


@pytest.mark.parametrize("turn", [0.05, 0.2, 0.39])
@pytest.mark.parametrize("case", cases("disk_steady"), ids=itemgetter("id"))
def test_steady_circles_are_exact_at_any_step(case, turn):
    disk, given, out = disk_of(case), case["in"], case["out"]
    y = circling(disk, given["theta"], out["phid"], out["w3"])
    dt = turn / disk.rate_bound(y, np.zeros(3), 0.0)
    check_circle(disk, y, case, dt, out["radius_centre_circle"])
    # The contact runs at phi' rho = -psi' r, on the circle of its own.
    rim = disk.radius * math.cos(given["theta"])
    assert out["radius_centre_circle"] + rim == pytest.approx(given["contact_radius"], rel=1e-14)
    speed = np.linalg.norm(disk.rhs(y)[7:9])
    assert speed == pytest.approx(out["phid"] * given["contact_radius"], rel=1e-14)
    assert speed == pytest.approx(-out["psid"] * disk.radius, rel=1e-14)


@pytest.mark.parametrize("turn", [0.05, 0.39])
@pytest.mark.parametrize("case", cases("euler_disk_still_centre"), ids=itemgetter("id"))
def test_eulers_disk_wobbles_about_a_centre_at_rest(case, turn):
    disk = disk_of(case)
    y = circling(disk, case["in"]["theta"], case["out"]["phid"], 0.0)
    np.testing.assert_allclose(disk.velocity(y), 0.0, rtol=0, atol=1e-15)
    check_circle(disk, y, case, turn / disk.rate_bound(y, np.zeros(3), 0.0), 0.0)
    weight = (0.0, 0.0, disk.m * disk.g)
    np.testing.assert_allclose(disk.contact_force(y), weight, rtol=0, atol=1e-12)


def swing(disk, y, theta, frequency, nudge):
    """Tilt over a period at 0, a, 0, -a, 0 of its harmonic, in units of a = nudge / frequency."""
    t = np.arange(5) * 0.5 * math.pi / frequency
    return (disk.simulate(y, t)["tilt"] - theta) * frequency / nudge


@pytest.mark.parametrize("case", cases("disk_steady"), ids=itemgetter("id"))
def test_a_nudged_circle_swings_at_the_reference_frequency(case):
    disk, out, theta = disk_of(case), case["out"], case["in"]["theta"]
    frequency = math.sqrt(out["small_oscillation_frequency_squared"])
    nudge = 1e-6 * frequency
    y = circling(disk, theta, out["phid"], out["w3"], nudge)
    # Harmonic to the amplitude, 1e-6, times some ten.
    expected = (0.0, 1.0, 0.0, -1.0, 0.0)
    found = swing(disk, y, theta, frequency, nudge)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4)


def exponents(disk, w3):
    """Eigenvalues of straight rolling, from `linearize`.

    In axes that do not spin with the disk, p = q conj(q_spin), straight rolling stands still and
    has constant coefficients, for a disk has no marks.
    """
    A, _ = disk.linearize(circling(disk, UPRIGHT, 0.0, w3))
    half = 0.5 * w3
    by_spin = np.array([[0, 0, 0, -half], [0, 0, half, 0], [0, -half, 0, 0], [half, 0, 0, 0]])
    A[:4, :4] -= by_spin  # q -> q (0, omega) / 2 of the spin alone
    A[4:7, 4:7] += np.array([[0.0, -w3, 0.0], [w3, 0.0, 0.0], [0.0, 0.0, 0.0]])
    return np.linalg.eigvals(A[:7, :7])


@pytest.mark.parametrize("case", cases("disk_thresholds"), ids=itemgetter("id"))
def test_the_lean_of_an_upright_disk_grows_or_swings_at_the_reference_rate(case):
    disk, out = disk_of(case), case["out"]
    w3 = case["in"]["w3_over_crit"] * out["w3_crit"]
    growth, frequency = out.get("lean_growth"), out.get("lean_frequency")
    expected = growth if growth else 1j * frequency
    found = exponents(disk, w3)
    for exponent in (expected, -expected):
        # All the others are 0, some of them twice: only this pair is simple and exact.
        assert np.min(np.abs(found - exponent)) <= 1e-12 * abs(expected)
    # delta theta = a exp(s t); what turns with it is wn = (I3 / I1) w3 delta theta.
    a = 1e-7
    if growth:
        y = circling(disk, UPRIGHT + a, disk.I3 / disk.I1 * w3 * a, w3, growth * a)
        t = np.linspace(0.0, 8.0, 9) / growth
        lean = disk.simulate(y, t)["tilt"] - UPRIGHT
        # Third order in a lean of at most 3e-4; roundings of 1e-16 beside 1e-7.
        np.testing.assert_allclose(np.log(lean / a), growth * t, rtol=0, atol=1e-6)
    else:
        y = circling(disk, UPRIGHT, 0.0, w3, frequency * a)
        found = swing(disk, y, UPRIGHT, frequency, frequency * a)
        # Some thousand steps, and their roundings of 1e-16 beside 1e-7.
        np.testing.assert_allclose(found, (0.0, 1.0, 0.0, -1.0, 0.0), rtol=0, atol=1e-5)


@pytest.mark.parametrize(
    # v^2 = g r / 3 of a thin disk, g r / 4 of a hoop: Routh, section 244.
    ("make", "square"),
    [(RollingDisk.uniform, 1.0 / 3.0), (RollingDisk.hoop, 1.0 / 4.0)],
)
def test_an_upright_disk_is_stable_just_above_its_threshold_and_falls_just_below(make, square):
    disk = make(m=1.7, radius=0.4)
    threshold = math.sqrt(square * disk.g * disk.radius)
    t, nudge = np.linspace(0.0, 30.0, 121), 1e-4
    largest = []
    for share in (0.99, 1.01):
        w3 = share * threshold / disk.radius
        found = exponents(disk, w3)
        largest.append(np.max(found.real) / np.max(np.abs(found)))
        lean = disk.simulate(circling(disk, UPRIGHT, 0.0, w3, nudge), t)["tilt"] - UPRIGHT
        largest.append(np.max(np.abs(lean)))
    rate = math.sqrt(disk.m * disk.g * disk.radius / (disk.I1 + disk.m * disk.radius**2))
    rate *= math.sqrt(1.01**2 - 1.0)
    assert largest[0] > 0.9  # the real pair is the largest of all
    assert largest[1] > 0.1
    assert largest[2] < 1e-6
    assert largest[3] <= 1.01 * nudge / rate  # it swings with the amplitude of the nudge


@pytest.mark.parametrize("make", [RollingDisk.uniform, RollingDisk.hoop])
def test_a_fast_upright_disk_rolls_straight(make):
    disk, w3 = make(m=1.7, radius=0.4), 9.0
    y = circling(disk, UPRIGHT, 0.0, w3)
    t = np.linspace(0.0, 50.0, 11)
    motion = disk.simulate(y, t, max_step=0.02)
    # 2500 steps and their roundings; what they lean swings, and turns the way.
    np.testing.assert_allclose(motion["tilt"], UPRIGHT, rtol=0, atol=1e-13)
    way = np.stack([-0.4 * 9.0 * t, 0.0 * t], axis=-1)  # l = -x at phi = 0
    np.testing.assert_allclose(motion["contact"], way, rtol=0, atol=1e-9)
    np.testing.assert_allclose(motion["omega_body"][:, 2], w3, rtol=0, atol=1e-13)
