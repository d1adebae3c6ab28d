"""Euler's disk: closed forms and motions against references, friction at rest, the collapse."""

import math

import numpy as np
import pytest
from scipy.optimize import least_squares

from rigid_envs.mechanics.events import flat
from rigid_envs.systems.rolling_disk import closed_forms as theory
from rigid_envs.systems.rolling_disk.system import EulerDisk, RollingDisk
from tests.reference import cases, every
from tests.refusals import refuses
from tests.systems.measures import orders, refined

EPS = np.finfo(np.float64).eps
TOY = {"m": 0.4, "radius": 0.0375, "g": 9.81}
TURNING = {**TOY, "i_perp": 0.25 * 0.4 * 0.0375**2}


def body(case):
    given = case["in"]
    return {"m": given["m"], "radius": given["r"], "i_perp": given["A"], "g": given["g"]}


@every(cases("euler_disk_steady"))
def test_both_steady_motions_agree_with_the_reference(case):
    given, out = case["in"], case["out"]
    found = theory.steady_precession(given["theta"], given["w3"], i3=given["C"], **body(case))
    found = sorted(found, key=lambda circle: circle.precession)
    # a square root of some products, and five of them added up
    np.testing.assert_allclose([c.precession for c in found], out["Omega"], rtol=8 * EPS)
    np.testing.assert_allclose([c.frequency_squared for c in found], out["nut2"], rtol=16 * EPS)
    radii = [abs(c.centre_radius) for c in found]
    np.testing.assert_allclose(radii, out["path_radius"], rtol=8 * EPS)
    if given["w3"] == 0.0:
        rate = theory.stationary_centre_precession(given["theta"], **body(case))
        assert rate == pytest.approx(out["Omega"][1], rel=8 * EPS)


@every(cases("euler_disk_adiabatic"))
def test_slow_settling_agrees_with_the_reference(case):
    given, out, scalars = case["in"], case["out"], case["scalars"]
    start, parameters = given["alpha0"], body(case)
    if given["law"] == "moffatt":
        del parameters["i_perp"]
        found = theory.settle_in_air(case["t"], start, given["mu_air"], **parameters)
        cutoff = theory.air_cutoff(given["mu_air"], **parameters)
        assert cutoff == pytest.approx(scalars["tau_cutoff"], rel=8 * EPS)
    else:
        found = theory.settle(case["t"], start, given["k"], given["p"], **parameters)
    measured = found.duration, found.theta_exponent, found.precession_exponent
    names = "t0", "exponent_alpha", "exponent_Omega"
    np.testing.assert_allclose(measured, [scalars[name] for name in names], rtol=8 * EPS)
    # what is left of the time is a difference
    rtol = 8 * EPS * found.duration / (found.duration - np.array(case["t"]))
    for name, values in (("alpha", found.theta), ("Omega", found.precession)):
        assert np.all(np.abs(values / out[name] - 1.0) < rtol)


@pytest.mark.parametrize("theta", [0.01, 0.3, 1.5])
def test_a_disk_with_still_centre_has_the_energy_of_its_closed_form(theta):
    disk = RollingDisk.hoop(**TOY)
    rate = theory.stationary_centre_precession(theta, i_perp=disk.I1, **TOY)
    energy = disk.energy(disk.state(tilt=theta, precession=rate))
    assert energy == pytest.approx(
        theory.stationary_centre_energy(theta, **TOY), rel=16 * EPS / math.sin(theta)
    )


def test_drag_like_air_takes_moffatts_power_from_a_flat_disk():
    """pi viscosity g radius^2 / theta^2, where psi' is -phi'."""
    viscosity, theta = 1.8e-5, 1e-3
    drag = theory.air_drag(viscosity, radius=TOY["radius"], g=TOY["g"])
    rate = theory.stationary_centre_precession(theta, **TURNING)
    power = math.pi * viscosity * TOY["g"] * TOY["radius"] ** 2 / theta**2
    assert drag * (rate * math.cos(theta)) ** 4 == pytest.approx(power, rel=2.0 * theta**2)


def from_case(case):
    """Disk and state of Euler angles, their rates (psi' through w3) and the place of the centre."""
    given = case["in"]
    moments = given["A"], given["C"]
    disk = EulerDisk(given["m"], given["r"], *moments, given["g"], contour=given.get("k", 0.0))
    y = disk.state(
        **{"azimuth": given["phi0"], "tilt": given["theta0"], "phase": given["psi0"]},
        **{"precession": given["phid0"], "nutation": given["thetad0"], "spin": given["w3_0"]},
    )
    y[7:9] = np.array(given["xy0"]) - disk.centre(y)[:2]
    return disk, y


@every(cases("euler_disk"))
def test_a_spinning_coin_agrees_with_the_reference(case):
    disk, y = from_case(case)
    t, out, cond = np.array([0.0, *case["t"]]), case["out"], case["cond"]
    motion = refined(disk, y, t)
    found = motion.trajectory
    fields = (
        ("tilt", "theta", motion.turned),
        ("R", "R", motion.turned),
        ("centre", "com", disk.radius * motion.turned),
        ("contact", "contact", disk.radius * motion.turned),
        ("contact_force", "F", disk.m * disk.radius * motion.rate**2),
    )
    for name, field, size in fields:
        expected = np.reshape(out[field], found[name][1:].shape)
        atol = motion.tolerance(name, size, cond[field])
        np.testing.assert_allclose(found[name][1:], expected, rtol=0, atol=atol, err_msg=name)
    axial = motion.tolerance("omega_body", motion.rate, cond["w3"])
    np.testing.assert_allclose(found["omega_body"][1:, 2], out["w3"], rtol=0, atol=axial)
    energies = case["scalars"]["energy"]
    size = disk.I1 * motion.rate**2
    atol = motion.tolerance("energy", size, energies[0] / size)
    np.testing.assert_allclose(found["energy"][1:], energies, rtol=0, atol=atol)


def test_the_contact_runs_along_the_rim_at_the_rate_of_psi():
    tilt, precession, spin = np.array([0.2, 1.5, 2.7]), np.array([3.0, -0.4, 1.0]), 0.7
    y = EulerDisk.state(tilt=tilt, precession=precession, spin=spin, azimuth=0.3, phase=2.0)
    psi_rate = spin - precession * np.cos(tilt)
    np.testing.assert_allclose(EulerDisk().contact_rate(y), psi_rate, rtol=0, atol=64 * EPS)


# Dry friction at rest: the contact stays where it is, and the disk falls about it.

HELD = EulerDisk.uniform(1.3, 0.5, contour=3.0)
HELD_Y = HELD.state(
    tilt=1.1, azimuth=0.3, phase=0.2, precession=2.0, nutation=1.4, spin=2.0 * math.cos(1.1)
)
HELD_T = np.linspace(0.0, 0.4, 9)


def turned_about_the_vertical(motion):
    """Angular momentum about the vertical through a contact at rest, with psi' = 0."""
    tilt, disk = motion["tilt"], motion.system
    precession = np.sum(motion["omega_world"] * disk.radius_up(motion.y), axis=-1) / np.sin(tilt)
    axial = disk.I3 + disk.m * disk.radius**2
    return precession * (disk.I1 * np.sin(tilt) ** 2 + axial * np.cos(tilt) ** 2)


def test_where_dry_friction_holds_the_contact_the_disk_falls_about_it_to_first_order():
    errors = []
    for step in (0.01, 0.005, 0.0025):
        motion = HELD.simulate(HELD_Y, HELD_T, max_step=step)
        # roundings of rates of some rad/s: after each step it is at rest
        np.testing.assert_allclose(HELD.contact_rate(motion.y), 0.0, atol=16 * EPS)
        kept = motion["energy"], turned_about_the_vertical(motion), motion["contact"]
        errors.append([np.max(np.abs(values - values[0])) for values in kept])
    for error in np.transpose(errors):
        np.testing.assert_allclose(orders(error), 1.0, atol=0.2)
    assert np.max(errors[-1]) < 1e-3


@pytest.mark.parametrize("spin", [3.0, -3.0])
def test_a_disk_that_has_come_to_rest_stays_at_rest(spin):
    disk = EulerDisk.uniform(1.3, 0.5, contour=0.3, drag=0.02)
    motion = disk.simulate(disk.state(spin=spin), np.linspace(0.0, 20.0, 41))
    still = np.flatnonzero(np.abs(disk.contact_rate(motion.y)) < 1e-300)
    assert 10 < len(still) < 35 and still[-1] == 40
    np.testing.assert_array_equal(np.ptp(motion["contact"][still], axis=0), 0.0)


@pytest.mark.parametrize("seed", range(8))
def test_energy_never_grows_whatever_the_friction(seed):
    rng = np.random.default_rng([52, seed])
    contour, drag = 10.0 ** rng.uniform(-2.0, 1.0), 10.0 ** rng.uniform(-3.0, 0.0)
    disk = EulerDisk(m=1.2, radius=0.7, I1=0.21, I3=0.35, g=2.5, contour=contour, drag=drag)
    y = disk.state(tilt=rng.uniform(0.7, 2.4, 20), **dict(zip(
        ("precession", "nutation", "spin"), rng.normal(size=(3, 20)), strict=True)))  # fmt: skip
    path = [y]
    for _ in range(60):
        path.append(disk.advance(path[-1], None, 0.002))
    energy = disk.energy(np.array(path))
    # steps of rolling keep it to 1e-11
    assert np.max(np.diff(energy, axis=0)) < 1e-11 * np.max(energy)


# The collapse.


def settled(loss, power, start, last):
    """A simulated disk with still centre, until a part of the time is left; and the theory."""
    law = {"contour": loss} if power == 1 else {"drag": loss}
    disk = EulerDisk.uniform(**TOY, **law)
    end = theory.settle(0.0, start, loss, power, **TURNING).duration
    t = end - end * np.append(1.0, np.geomspace(1.0, last, 200)[1:])
    rate = theory.stationary_centre_precession(start, **TURNING)
    motion = disk.simulate(disk.state(tilt=start, precession=rate), t)
    return motion, theory.settle(t, start, loss, power, **TURNING)


def exponents(motion, slow):
    """Powers of the time left of angle and rate, with the end that fits best."""
    t, angle = motion.t, np.log(motion["tilt"])
    rate = np.log(np.abs(motion.system.contact_rate(motion.y)))

    def misfit(x):
        left = np.log(x[4] * slow.duration - t)
        return np.concatenate([x[0] + x[1] * left - angle, x[2] + x[3] * left - rate])

    guess = angle[0], slow.theta_exponent, rate[0], slow.precession_exponent, 1.02
    return least_squares(misfit, guess, x_scale=(1.0, 0.1, 1.0, 0.1, 0.01)).x[[1, 3]]


AIR = theory.air_drag(1.78e-5, radius=TOY["radius"], g=TOY["g"])


@pytest.mark.long
@pytest.mark.parametrize(
    ("power", "losses", "start"), [(1, (2e-4, 2e-5), 0.03), (4, (100.0 * AIR, 10.0 * AIR), 0.06)]
)
def test_a_disk_collapses_with_the_exponents_of_slow_settling(power, losses, start):
    apart, wrong = [], []
    for loss in losses:
        motion, slow = settled(loss, power, start, 0.1)
        apart.append(np.max(np.abs(motion["tilt"] / slow.theta - 1.0)[:100]))
        found = np.array(exponents(motion, slow))
        expected = np.array([slow.theta_exponent, slow.precession_exponent])
        wrong.append(np.max(np.abs(found / expected - 1.0)))
    assert apart[1] < 0.6 * apart[0] and wrong[1] < wrong[0], (apart, wrong)
    # A nod of this part of the angle turns a line over ln(10) = 2.3 of the time left by as much.
    assert wrong[1] < apart[1] < 0.03, (apart, wrong)


def test_a_disk_that_becomes_flat_ends_its_motion_with_words():
    disk = EulerDisk.uniform(**TOY, contour=2e-3)
    rate = theory.stationary_centre_precession(0.1, **TURNING)
    y = disk.state(tilt=0.1, precession=rate)
    refuses(r"^at t = 0\.0\d+ s the motion ends: sin\(theta\) = .* lies flat", disk.simulate,
            y, [0.0, 5.0])  # fmt: skip
    settled = disk.simulate(y, np.linspace(0.0, 5.0, 11), events=flat(1e-3))
    assert settled.status == 1
    assert settled["tilt"][-1] == pytest.approx(1e-3, rel=1e-6)
    assert np.isfinite(settled.y).all()
    left = disk.simulate(y, np.linspace(0.0, 5.0, 11), events=lambda t, y: 1.0)
    assert left.status == -1 and "lies flat" in left.message


def test_drag_that_stops_the_disk_within_a_step_is_refused():
    disk = EulerDisk(drag=100.0)
    refuses("take n_substeps", disk.advance, disk.state(spin=1.0), None, 0.02)
    assert disk.rate(disk.state(spin=1.0)) > RollingDisk().rate(disk.state(spin=1.0)) + 50.0
