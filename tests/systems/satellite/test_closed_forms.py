"""Closed forms of satellites, against references and against their equations, integrated."""

import math

import numpy as np
import pytest
from scipy.integrate import dblquad, solve_ivp

from rigid_envs.mechanics.laws import EPS
from rigid_envs.systems.satellite import closed_forms as theory
from tests.reference import cases, every
from tests.refusals import refuses

YEAR = 365.25 * 86400.0  # Julian [s]


def assert_near(found, expected, cond, size=1.0):
    """Equal but for roundings: of the start, which count `cond` times, and of the evaluation."""
    np.testing.assert_allclose(found, expected, rtol=0, atol=EPS * (8.0 * cond + 16.0 * size))


# Pitch.


@every(cases("gg_pitch"))
def test_pitch_agrees_with_the_reference(case):
    given, scalars = case["in"], case["scalars"]
    start, body = (given["theta0"], given["thetad0"]), {"moments": given["I"], "n": given["n"]}
    theta, _ = theory.pitch(case["t"], *start, **body)
    assert_near(theta, case["out"]["theta"], case["cond"]["theta"])
    motion = theory.pitch_motion(*start, **body)
    p = theory.pitch_motion(0.0, 0.0, **body).period
    assert p == pytest.approx(scalars["small_period"], rel=1e-14)
    if "amplitude" in scalars:
        assert motion.period == pytest.approx(scalars["period"], rel=1e-13)
        assert motion.amplitude == pytest.approx(scalars["amplitude"], rel=1e-13)
        assert motion.sense == 0.0
    else:
        assert motion.period == pytest.approx(scalars["tumble_time_pi"], rel=1e-13)
        assert motion.amplitude == math.inf and motion.sense == math.copysign(1.0, start[1])


BODIES = {  # about roll, pitch and yaw
    "along the vertical": [2.0, 2.5, 1.0],
    "along the velocity": [1.0, 2.5, 2.0],
    "round": [2.0, 2.5, 2.0],
}
STARTS = [(0.3, 0.2), (-0.4, -0.5), (7.0, 0.1), (-9.0, 0.7), (0.2, 3.0), (2.0, -2.6), (0.0, 1.2)]


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("start", STARTS)
def test_pitch_solves_its_equation_forth_and_back(body, start):
    moments, n = BODIES[body], 0.8
    I1, I2, I3 = moments

    def slope(_, y):
        return y[1], -1.5 * n * n * (I1 - I3) / I2 * math.sin(2.0 * y[0])

    for t in (np.linspace(0.0, 15.0, 31), np.linspace(0.0, -15.0, 31)):
        accuracy = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
        expected = solve_ivp(slope, (t[0], t[-1]), start, t_eval=t, **accuracy).y
        found = theory.pitch(t, *start, moments=moments, n=n)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("start", [(0.4, 0.3), (-0.2, -0.7), (0.5, 2.5), (0.5, -2.5)])
def test_pitch_returns_after_its_period_or_half_a_turn_on(start):
    body = {"moments": [2.0, 2.5, 1.0], "n": 0.8}
    motion = theory.pitch_motion(*start, **body)
    theta, rate = theory.pitch([0.0, motion.period], *start, **body)
    assert theta[1] - theta[0] == pytest.approx(math.pi * motion.sense, abs=1e-14)
    assert rate[1] == pytest.approx(rate[0], abs=1e-14)


@pytest.mark.parametrize("excess", [-1e-3, -1e-9, -1e-15, 0.0, 1e-15, 1e-9, 1e-3])
@pytest.mark.parametrize("sense", [-1.0, 1.0])
def test_the_energy_of_pitch_is_kept_beside_the_separatrix(excess, sense):
    moments, n = [2.0, 3.0, 1.0], 1.0  # p = 1
    fast = sense * (1.0 + excess)
    motion = theory.pitch_motion(0.0, fast, moments=moments, n=n)
    expected = abs((1.0 + excess) ** 2 - 1.0)
    assert motion.m1 == pytest.approx(expected, rel=2e-3 + 1e-15 / max(abs(excess), 1e-15))
    t = np.linspace(0.0, 60.0, 601)
    theta, rate = theory.pitch(t, 0.0, fast, moments=moments, n=n)
    np.testing.assert_allclose(rate**2 + np.sin(theta) ** 2, fast**2, rtol=1e-14)
    # theta' is what theta does
    half = theory.pitch(t + 1e-3, 0.0, fast, moments=moments, n=n)[0]
    back = theory.pitch(t - 1e-3, 0.0, fast, moments=moments, n=n)[0]
    np.testing.assert_allclose((half - back) / 2e-3, rate, rtol=0, atol=2e-6)


def test_pitch_at_rest_stays_and_without_gradient_turns_on():
    stable, theta = theory.pitch_motion(math.pi, 0.0, moments=[2.0, 2.5, 1.0], n=1.0), math.pi
    assert (stable.middle, stable.speed, stable.amplitude) == (theta, 0.0, 0.0)
    found = theory.pitch([0.0, 9.0], math.pi, 0.0, moments=[2.0, 2.5, 1.0], n=1.0)
    np.testing.assert_array_equal(found, [[math.pi] * 2, [0.0] * 2])
    round_body = {"moments": [2.0, 2.5, 2.0], "n": 1.0}
    assert theory.pitch_motion(0.3, 0.0, **round_body).period == math.inf
    np.testing.assert_array_equal(theory.pitch([0.0, 9.0], 0.3, 0.0, **round_body)[0], [0.3] * 2)
    found = theory.pitch([0.0, 9.0], 0.3, -0.5, **round_body)
    np.testing.assert_allclose(found, [[0.3, -4.2], [-0.5] * 2], rtol=1e-15)


# Librations and steady spin.


@every(cases("gg_stability"))
def test_exponents_of_rest_agree_with_the_reference(case):
    out, cond, n = case["out"], case["cond"], case["in"]["n"]
    found = theory.librations(case["in"]["I"], n)
    assert_near(found.roll_ratio, out["k1"], cond["k1"])
    assert_near(found.yaw_ratio, out["k3"], cond["k3"])
    assert_near(found.pitch_squared, out["pitch_lambda_squared"], cond["pitch_lambda_squared"])
    squares = np.array(found.roll_yaw_squared)
    for part, name in ((squares.real, "re"), (squares.imag, "im")):
        key = f"rollyaw_lambda_squared_{name}"
        assert_near(part, out[key], cond[key])
    assert found.region == out["region"]
    growth = np.sqrt(np.array([found.pitch_squared, *squares], dtype=complex)).real.max()
    assert growth == pytest.approx(case["scalars"]["max_growth"], rel=1e-13, abs=1e-15)


def rest_matrix(moments):
    """Departures of roll, pitch, yaw and of their rates from rest, n = 1, by their own equations.

    I d(omega)/dt = I omega x omega + 3 r x I r with omega = R^T z + rates, in central differences.
    """
    I = np.array(moments)  # noqa: E741

    def slope(x):
        a, rates = x[:3], x[3:]
        # of small turns a the body axes e1, e2, e3 are along velocity, normal and vertical
        normal = np.array([0.0, 1.0, 0.0]) - np.cross(a, [0.0, 1.0, 0.0])
        outward = np.array([0.0, 0.0, 1.0]) - np.cross(a, [0.0, 0.0, 1.0])
        omega = normal + rates
        torque = np.cross(I * omega, omega) + 3.0 * np.cross(outward, I * outward)
        turning = -np.cross(rates, normal)  # of the normal in the body
        return np.concatenate([rates, torque / I - turning])

    return np.array([(slope(1e-6 * e) - slope(-1e-6 * e)) / 2e-6 for e in np.eye(6)]).T


def test_frequencies_are_those_of_the_linear_equations():
    for moments in ([90.0, 100.0, 40.0], [2.0, 2.5, 1.0], [12.22, 10.0, 11.36]):
        found = theory.libration_frequencies(moments, 0.5)
        values = np.linalg.eigvals(rest_matrix(moments))
        expected = 0.5 * np.sort(values.imag)[3:]
        np.testing.assert_allclose(np.sort(found), expected, rtol=1e-8)
        assert found[1] < found[2]
    slow = theory.pitch_motion(0.0, 1e-6, moments=[2.0, 2.5, 1.0], n=0.5).period
    found = theory.libration_frequencies([2.0, 2.5, 1.0], 0.5)[0]
    assert found == pytest.approx(2.0 * math.pi / slow, rel=1e-11)


def test_frequencies_of_an_unstable_rest_are_refused():
    refuses(
        r"^moments = .*; expected roll, pitch, yaw", theory.libration_frequencies, [1, 2, 1.5], 1
    )


def test_every_body_rests_stably_one_way_and_some_without_damping_another():
    rng = np.random.default_rng(0)
    for second in rng.uniform(0.1, 1.0, (200, 3)):
        I = np.sort(second.sum() - second)  # noqa: E741
        regions = {
            tuple(order): theory.librations(I[list(order)], 1.0).region
            for order in ((1, 2, 0), (0, 2, 1), (2, 1, 0), (0, 1, 2), (1, 0, 2), (2, 0, 1))
        }
        # least moment along the vertical, largest along the normal
        assert [key for key, region in regions.items() if region == "Lagrange"] == [(1, 2, 0)]
        # least along the normal, largest along the velocity
        others = {key for key, region in regions.items() if region == "DeBra-Delp"}
        assert others <= {(2, 0, 1)}


def test_a_spin_at_the_rate_of_the_orbit_is_rest_in_it():
    for ratio in (0.5, 0.9, 1.2, 1.9):
        spin = theory.normal_spin(i_perp=2.0, i3=2.0 * ratio, omega3=0.7, n=0.7)
        rest = theory.librations([2.0, 2.0 * ratio, 2.0], 0.7)
        np.testing.assert_allclose(spin.squares, rest.roll_yaw_squared, rtol=1e-13)


def test_fast_spin_is_stable_both_ways_and_no_spin_is_not():
    for ratio in (0.2, 0.8, 1.3, 1.8):
        body = {"i_perp": 1.0, "i3": ratio, "n": 1.0}
        for fast in (-40.0, 40.0):
            spin = theory.normal_spin(omega3=fast, **body)
            assert spin.stable
            # seen in the orbit the axis nutates at C omega3 / A - n, and stands still in space
            nutation = math.sqrt(-spin.squares[1].real)
            assert nutation == pytest.approx(abs(ratio * fast - 1.0), rel=0.05)
            assert math.sqrt(-spin.squares[0].real) == pytest.approx(1.0, abs=0.2)
    assert theory.normal_spin(i_perp=1.0, i3=1.0, omega3=0.0, n=1.0).stable is False
    assert theory.normal_spin(i_perp=1.0, i3=1.8, omega3=0.8, n=1.0).stable
    assert not theory.normal_spin(i_perp=1.0, i3=0.5, omega3=3.0, n=1.0).stable


def test_a_spin_between_the_limits_of_thomson_is_unstable():
    """Between the limits h = 1 and h = 4 - 3 s the constant term is negative."""
    for s in (0.4, 0.7, 1.5):
        low, high = sorted((1.0, 4.0 - 3.0 * s))
        for h in np.linspace(low, high, 7)[1:-1]:
            assert not theory.normal_spin(i_perp=1.0, i3=s, omega3=h / s, n=1.0).stable


# Precession.


def test_the_regression_is_that_of_the_torque_averaged_over_the_orbit():
    A, C, spin, n, eps = 1.3, 0.9, 6.0, 0.2, 0.7
    axis = np.array([math.sin(eps), 0.0, math.cos(eps)])

    def torque(u):
        r = np.array([math.cos(u), math.sin(u), 0.0])
        return 3.0 * n**2 * (C - A) * (axis @ r) * np.cross(r, axis)

    # L' = torque turns L = C spin axis about z: the horizontal part has the size sin eps
    mean = np.mean([torque(u) for u in np.linspace(0.0, 2.0 * math.pi, 9)[1:]], axis=0)
    rate = mean[1] / (C * spin * math.sin(eps))
    found = float(theory.regression(eps, i_perp=A, i3=C, omega3=spin, n=n))
    assert found == pytest.approx(-rate, rel=1e-14)


def pulls_of(case):
    """K = G M / a^3 of Sun and Moon, from distances or by Kepler's third law."""
    given = case["in"]
    if case["kind"] == "equinox_distances":
        return [given[f"GM_{name}"] / given[f"a_{name}"] ** 3 for name in ("sun", "moon")]
    sun, moon = given["mass_ratio_sun_earthmoon"], given["mass_ratio_moon_earth"]
    shares = (sun / (1.0 + sun), moon / (1.0 + moon))
    years = (given["year_s"], given["month_s"])
    return [(2.0 * math.pi / T) ** 2 * share for T, share in zip(years, shares, strict=True)]


@every([*cases("equinox"), *cases("equinox_distances")])
def test_the_precession_of_the_equinoxes_agrees_with_the_reference(case):
    given, out, cond = case["in"], case["out"], case["cond"]
    planet = {"flattening": given["H"], "spin": given["omega_earth"]}
    planet["obliquity"] = given["obliquity"]
    orbits = [given["e_sun"], given["e_moon"]], [0.0, given["i_moon"]]
    sun, moon = theory.precession_of_equinoxes(pulls_of(case), *orbits, **planet)
    rates = {"rate_sun": sun, "rate_moon": moon, "rate_total": sun + moon}
    for name, rate in rates.items():
        assert rate == pytest.approx(out[name], rel=0, abs=EPS * (8.0 * cond[name] + 16.0 * rate))
    total = sun + moon
    assert 2.0 * math.pi / total / YEAR == pytest.approx(out["period_years"], rel=1e-14)
    seconds = math.degrees(total * YEAR) * 3600.0
    assert seconds == pytest.approx(out["arcsec_per_julian_year"], rel=1e-14)


def test_an_eccentric_inclined_orbit_pulls_as_its_mean_over_anomaly_and_node():
    e, i, eps = 0.3, 0.4, 0.41
    axis = np.array([math.sin(eps), 0.0, math.cos(eps)])

    def pull(anomaly, node):
        """Torque along the line of nodes of the equator, times the time, over both angles."""
        s, c = math.sin(anomaly), math.cos(anomaly)  # perigee at the node, which goes round
        across = np.array([-math.sin(node), math.cos(node), 0.0])
        r = c * np.array([math.cos(node), math.sin(node), 0.0])
        r = r + s * (math.cos(i) * across + [0.0, 0.0, math.sin(i)])
        torque = 3.0 * (axis @ r) * np.cross(axis, r)[1] / math.sin(eps)
        closer = (1.0 + e * c) / (1.0 - e * e)  # a / r
        time = 1.0 / (closer**2 * math.sqrt(1.0 - e * e) * (2.0 * math.pi) ** 2)
        return torque * closer**3 * time

    mean, _ = dblquad(pull, 0.0, 2.0 * math.pi, 0.0, 2.0 * math.pi, epsabs=1e-10)
    given = {"flattening": 1.0, "spin": 1.0, "obliquity": eps}
    found = theory.precession_of_equinoxes([1.0], [e], [i], **given)[0]
    assert found == pytest.approx(mean, rel=1e-9)


# Detumbling.


def test_a_sphere_detumbles_as_its_equation_says():
    B, rates, given = np.array([0.3, -0.2, 0.5]), [0.4, 0.7, -0.1], {"gain": 0.6, "moment": 0.8}
    t = np.linspace(0.0, 12.0, 13)

    def slope(_, omega):
        return 0.6 * np.cross(np.cross(omega, B), B) / 0.8

    expected = solve_ivp(slope, (0.0, 12.0), rates, "DOP853", t, rtol=1e-12, atol=1e-14).y.T
    found = theory.detumble(t, rates, B, **given)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    power = theory.detumbling_power(found, B, np.zeros(3))
    assert np.all(power < 0.0)
    # T' of T = I omega^2 / 2, from the decay of what is across
    across = np.cross(found, B)
    np.testing.assert_allclose(power, -np.sum(across**2, axis=-1), rtol=1e-14)


def test_energy_falls_where_the_body_turns_faster_than_the_field_and_can_rise_where_it_does_not():
    rng = np.random.default_rng(0)
    omega, B, D = rng.normal(size=(3, 1000, 3))
    power = theory.detumbling_power(omega, B, D)
    faster = np.linalg.norm(np.cross(omega, B), axis=-1) > np.linalg.norm(D, axis=-1)
    assert np.all(power[faster] < 0.0) and np.any(power[~faster] > 0.0)
    dipole = np.cross(omega, B) - D
    work = np.sum(np.cross(dipole, B) * omega, axis=-1)
    np.testing.assert_allclose(power, work, rtol=0, atol=1e-13)
