"""Motion of the rolling disk: closed forms against references, simulations against both."""

import math

import mpmath
import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.special import conical
from rigid_envs.systems.rolling_disk import closed_forms as rolling_disk
from rigid_envs.systems.rolling_disk.system import RollingDisk
from tests.reference import cases, every
from tests.systems.measures import (
    assert_energy_stays,
    leaning,
    million_steps,
    refined,
    seeds,
)

# Closed forms of the rolling disk against reference cases and Newton's and Euler's equations.


EPS = np.finfo(np.float64).eps


# Neither a disk nor a hoop nor thin: A is not C / 2.
BODY = {"m": 0.7, "radius": 0.3, "i_perp": 0.021, "i3": 0.035}
DISK = {**BODY, "g": 9.81}
UPRIGHT = 0.5 * math.pi
THIN = RollingDisk(*BODY.values(), g=9.81)


def body(case):
    given = case["in"]
    return {"m": given["m"], "radius": given["a"], "i_perp": given["A"], "i3": given["C"]}


def disk(case):
    return {**body(case), "g": case["in"]["g"]}


def without_axis(parameters):
    return {name: value for name, value in parameters.items() if name != "i3"}


def nodding(case):
    given = case["in"]
    start = given["theta"], given["thetad"], given["phid"], given["w3"]
    return rolling_disk.fall(*start, **disk(case))


@every(cases("disk_fall"))
def test_integrals_turning_points_and_period_agree_with_the_reference(case):
    scalars, motion = case["scalars"], nodding(case)
    measured = {
        "E": motion.energy,
        "legendre_c1": motion.c1,
        "legendre_c2": motion.c2,
        "theta_min": motion.theta_min,
        "theta_max": motion.theta_max,
        "w3_crit": rolling_disk.rolling_threshold(**disk(case)),
        "spin_crit": rolling_disk.spinning_threshold(**without_axis(disk(case))),
    }
    measured["v_crit"] = case["in"]["a"] * measured["w3_crit"]
    assert measured.keys() == scalars.keys() - {"lean_period"}
    for name, value in measured.items():
        # Some sums and a linear system of two equations, of condition 10 at the most.
        np.testing.assert_allclose(value, scalars[name], rtol=16 * EPS, err_msg=name)
    # A lean, itself rounded, is the worse known the closer the turning points are to each other or
    # to upright, where the disk that starts 1e-3 from it lingers.
    start = abs(UPRIGHT - case["in"]["theta"])
    rtol = 16 * EPS / min(start, motion.theta_max - motion.theta_min, 1.0)
    np.testing.assert_allclose(motion.period, scalars["lean_period"], rtol=rtol)


@every(cases("disk_fall"))
def test_the_lean_alone_gives_the_angular_velocity_of_the_reference(case):
    theta, w = np.array(case["out"]["theta"]), np.array(case["out"]["w"])
    motion = nodding(case)
    phi_rate, omega3 = rolling_disk.spins(theta, motion.c1, motion.c2, **body(case))
    level = rolling_disk.effective_potential(theta, motion.c1, motion.c2, **disk(case))
    tipping = case["in"]["A"] + case["in"]["m"] * case["in"]["a"] ** 2
    across = 2.0 * (motion.energy - level) / tipping + (phi_rate * np.sin(theta)) ** 2
    # The lean is given to a rounding: the spins change with it as fast as the tilt does with time.
    tolerance = 16 * EPS * case["cond"]["w"]
    np.testing.assert_allclose(omega3, w[:, 2], rtol=0, atol=tolerance)
    square = w[:, 0] ** 2 + w[:, 1] ** 2
    np.testing.assert_allclose(
        across, square, rtol=0, atol=2.0 * tolerance * (1.0 + np.sqrt(np.max(square)))
    )


@every(cases("disk_steady"))
def test_steady_circles_agree_with_the_reference(case):
    given, out = case["in"], case["out"]
    circle = rolling_disk.steady_circle(given["theta"], given["contact_radius"], **disk(case))
    measured = {
        "phid": circle.precession,
        "w3": circle.omega3,
        "psid": circle.spin,
        "radius_centre_circle": circle.centre_radius,
        "small_oscillation_frequency_squared": circle.frequency_squared,
    }
    assert measured.keys() == out.keys()
    np.testing.assert_allclose(list(measured.values()), list(out.values()), rtol=16 * EPS)
    assert circle.contact_radius == pytest.approx(given["contact_radius"], rel=8 * EPS)


@every(cases("euler_disk_still_centre"))
def test_the_disk_with_still_centre_agrees_with_the_reference(case):
    given, out = case["in"], case["out"]
    rate = rolling_disk.stationary_centre_precession(given["theta"], **without_axis(disk(case)))
    np.testing.assert_allclose(rate, out["phid"], rtol=8 * EPS)
    np.testing.assert_allclose(rate**2, out["thin_disc_formula"], rtol=8 * EPS)
    circle = rolling_disk.steady_circle(
        given["theta"], given["a"] * math.cos(given["theta"]), **disk(case)
    )
    assert circle.precession == pytest.approx(rate, rel=8 * EPS)
    assert out["w3"] == 0
    assert circle.omega3 == pytest.approx(0.0, abs=4 * EPS * rate)
    # Turning either way, these are the two motions without axial spin.
    for motion in rolling_disk.steady_precession(given["theta"], 0.0, **disk(case)):
        assert abs(motion.precession) == pytest.approx(rate, rel=8 * EPS)


@every(cases("disk_thresholds"))
def test_thresholds_and_rates_agree_with_the_reference(case):
    given, out = case["in"], case["out"]
    least = rolling_disk.rolling_threshold(**disk(case))
    speed = given["a"] * least
    exponent = rolling_disk.rolling_exponent(given["w3_over_crit"] * least, **disk(case))
    measured = {
        "w3_crit": least,
        "v_crit": speed,
        "spin_crit": rolling_disk.spinning_threshold(**without_axis(disk(case))),
        "v_crit_squared_over_ga": speed**2 / (given["g"] * given["a"]),
        "lean_growth" if given["w3_over_crit"] < 1.0 else "lean_frequency": abs(exponent),
    }
    assert measured.keys() == out.keys()
    # The exponent is a root of 1 - (omega3 / threshold)^2, which is 0.19 at the least.
    np.testing.assert_allclose(
        list(measured.values()), [out[name] for name in measured], rtol=16 * EPS
    )
    assert (exponent.real > 0.0) == (given["w3_over_crit"] < 1.0)


@pytest.mark.parametrize("theta", [0.2, 0.9, 1.4, 2.1])
@pytest.mark.parametrize("omega3", [-6.0, 0.0, 0.5, 12.0])
def test_both_steady_motions_are_steady(theta, omega3):
    slow, fast = rolling_disk.steady_precession(theta, omega3, **DISK)
    assert abs(slow.precession) <= abs(fast.precession) * (1.0 + 4 * EPS)
    for motion in (slow, fast):
        rates = motion.precession * math.sin(theta), omega3
        y = THIN.state(q=leaning(theta), omega_body=(0.0, *rates))
        turning = THIN.accessors["R"](y) @ THIN.rhs(y)[4:7]
        # All of omega turns with the node, at phi' about the vertical.
        expected = motion.precession * np.cross((0.0, 0.0, 1.0), THIN.omega_world(y))
        scale = motion.precession**2 + omega3**2 + DISK["g"] / DISK["radius"]
        np.testing.assert_allclose(turning, expected, rtol=0, atol=256 * EPS * scale)
        again = rolling_disk.steady_circle(theta, motion.contact_radius, **DISK)
        assert again.precession == pytest.approx(abs(motion.precession), rel=1e-12)


@pytest.mark.parametrize("omega3", [-6.0, 0.0, 12.0])
@pytest.mark.parametrize("theta", [0.5, 1.4])
def test_small_nods_have_the_frequency_of_the_steady_motion(theta, omega3):
    for circle in rolling_disk.steady_precession(theta, omega3, **DISK):
        assert circle.frequency_squared > 0.0
        period = 2.0 * math.pi / math.sqrt(circle.frequency_squared)
        start = (circle.precession, omega3)
        steady = rolling_disk.fall(theta, 0.0, *start, **DISK)
        assert steady.theta_max - steady.theta_min < 1e-12
        assert steady.period == pytest.approx(period, rel=8 * EPS)
        push = 1e-3 * math.sqrt(circle.frequency_squared)
        nod = rolling_disk.fall(theta, push, *start, **DISK)
        # Half of push / frequency to each side, and anharmonic by its square.
        assert nod.theta_max - nod.theta_min == pytest.approx(2e-3, rel=0.02)
        assert nod.period == pytest.approx(period, rel=1e-4)
        share = 0.019 * math.sin(theta)  # of the push; what is anharmonic goes with its square
        smaller = rolling_disk.fall(theta, share * push, *start, **DISK)
        expected = period + share**2 * (nod.period - period)
        assert smaller.period == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("share", [0.0, 0.5, 0.95, 1.05, 3.0])
def test_the_upright_exponents_are_the_curvature_of_the_potential(share):
    rolling = share * rolling_disk.rolling_threshold(**DISK)
    spinning = share * rolling_disk.spinning_threshold(**without_axis(DISK))
    for exponent, rates in (
        (rolling_disk.rolling_exponent(rolling, **DISK), (0.0, rolling)),
        (rolling_disk.spinning_exponent(spinning, **without_axis(DISK)), (spinning, 0.0)),
    ):
        square = rolling_disk.lean_frequency_squared(UPRIGHT, *rates, **DISK)
        scale = DISK["g"] / DISK["radius"]
        assert (exponent**2).real == pytest.approx(-square, abs=64 * EPS * scale)
        c1, c2 = rolling_disk.legendre_constants(UPRIGHT, *rates, **BODY)
        h = 1e-3
        level = rolling_disk.effective_potential(UPRIGHT + h * np.arange(-2, 3), c1, c2, **DISK)
        curvature = level @ np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / (12.0 * h * h)
        tipping = BODY["i_perp"] + BODY["m"] * BODY["radius"] ** 2
        # Five points: h^4 times a sixth derivative of some thousands, and eps / h^2.
        assert curvature / tipping == pytest.approx(square, abs=1e-8 * scale * (1.0 + share**2))


def test_a_disk_that_rolls_upright_a_rounding_below_the_threshold_never_nods():
    # Its frequency squared is -5e-11, beyond the rounding of g / radius. The potential falls from
    # there by less than its own rounding, in which turning points seem to be near.
    least = rolling_disk.rolling_threshold(**DISK)
    assert rolling_disk.lean_frequency_squared(UPRIGHT, 0.0, (1.0 - 1e-12) * least, **DISK) < 0.0
    assert rolling_disk.fall(UPRIGHT, 0.0, 0.0, (1.0 - 1e-12) * least, **DISK).period == math.inf


def test_a_disk_without_any_spin_falls_flat_and_with_a_little_it_stands_up_again():
    flat = rolling_disk.fall(1.0, 0.0, 0.0, 0.0, **DISK)
    assert (flat.theta_min, flat.period) == (0.0, math.inf)
    assert flat.theta_max == pytest.approx(1.0, rel=4 * EPS)
    over = rolling_disk.fall(1.0, 30.0, 0.0, 0.0, **DISK)
    assert (over.theta_min, over.theta_max) == (0.0, math.pi)
    little = rolling_disk.fall(1.0, 0.0, 0.0, 1e-6, **DISK)
    assert 0.0 < little.theta_min < 1e-6
    assert math.isfinite(little.period)


@pytest.mark.parametrize("below", [0.11, 0.03, 0.01])  # wider and narrower than a panel
def test_a_nod_that_ends_below_the_hill_of_rolling_upright_is_the_same_from_its_other_end(below):
    """Slower than the threshold, to roll upright is a maximum of the potential."""
    slow = 0.6 * rolling_disk.rolling_threshold(**DISK)
    c, theta = rolling_disk.legendre_constants(UPRIGHT, 0.0, slow, **BODY), UPRIGHT - below
    for _ in range(2):
        spins = map(float, rolling_disk.spins(theta, *c, **BODY))
        nod = rolling_disk.fall(theta, 0.0, *spins, **DISK)
        theta = nod.theta_min
    assert UPRIGHT - nod.theta_max == pytest.approx(below, rel=1e-9)


def test_a_nod_is_the_same_from_whichever_face_it_starts():
    c = 1e-9, 1e-9  # so little spin that it turns back 1e-9 from either face
    energy = 20.0 + rolling_disk.effective_potential(UPRIGHT, *c, **DISK)
    tipping, found = BODY["i_perp"] + BODY["m"] * BODY["radius"] ** 2, []
    for theta in (1e-6, math.pi - 1e-6):
        kinetic = energy - rolling_disk.effective_potential(theta, *c, **DISK)
        spins = (float(spin) for spin in rolling_disk.spins(theta, *c, **BODY))
        found.append(rolling_disk.fall(theta, math.sqrt(2.0 * kinetic / tipping), *spins, **DISK))
    low, high = found
    assert 0.0 < low.theta_min < 1e-8 and low.theta_max < math.pi
    assert high.theta_min == pytest.approx(low.theta_min, rel=1e-9)
    assert high.theta_max == pytest.approx(low.theta_max, rel=4 * EPS)
    assert high.period == pytest.approx(low.period, rel=1e-6)


@pytest.mark.parametrize("mu", [1e-6, 0.1, 0.25, 1.0, 4.0 / 3.0, 2.0])
def test_the_conical_function_keeps_its_digits(mu):
    for x in (0.0, 1e-9, 0.3, 0.5, 0.500001, 0.8, 0.999, 1.0 - 1e-9):
        with mpmath.workdps(40):
            xi = 0.5 + mpmath.sqrt(mpmath.mpc(0.25 - mpmath.mpf(mu)))
            value = mpmath.hyp2f1(xi, 1 - xi, 1, mpmath.mpf(x)).real
            slope = mu * mpmath.hyp2f1(xi + 1, 2 - xi, 2, mpmath.mpf(x)).real
        found = conical(np.array(x), np.array(1.0 - x), mu)
        # Series of some dozen positive terms; the logarithm against its companions loses a digit.
        np.testing.assert_allclose(found, (float(value), float(slope)), rtol=64 * EPS)


# The rolling disk against reference cases, Newton's law with multipliers, a million steps.


def from_case(case):
    """Disk and state of Euler angles, their rates (psi' through w3) and the place of the centre."""
    given = case["in"]
    disk = RollingDisk(given["m"], given["a"], given["A"], given["C"], given["g"])
    angles = given["phi"], given["theta"], given["psi"]
    spin = given["w3"] - given["phid"] * math.cos(given["theta"])
    rates = given["phid"], given["thetad"], spin
    omega = rotations.omega_body_from_euler_rates(angles, rates)
    y = disk.state(q=rotations.quaternion_from_euler(angles), omega_body=omega)
    y[7:9] = np.array(given["xy0"]) - disk.centre(y)[:2]
    return disk, y


@every(cases("disk_fall"))
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


DISC = RollingDisk.uniform()
SWINGING = DISC.state(
    q=rotations.quaternion_from_euler((0.0, 1.3, 0.0)), omega_body=(0.2, 0.1, 3.0)
)


@pytest.mark.long
@pytest.mark.parametrize(("dt", "bound"), [(0.04, 3e-7), (0.02, 2e-8)])
def test_a_million_steps_bound_the_energy(dt, bound):
    # Found: 1.1e-7 and 7.1e-9, the fourth power of the step.
    trajectory = million_steps(DISC, SWINGING, dt, 1500)
    # Seen at 1500 moments an oscillation leaves a tenth of itself.
    assert_energy_stays(trajectory, bound, share=0.25)


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
    trajectory = million_steps(disk, y, turn / rate, 1500)
    # Fourth order: C (rate dt)^4, where C was 0.0009 at most in 54 disks; and roundings.
    assert_energy_stays(trajectory, 0.004 * turn**4 + 1e-11, share=0.25)
