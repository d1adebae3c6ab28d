import math
from operator import itemgetter

import numpy as np
import pytest

from rigid_envs.systems.heavy_top import closed_forms as heavy_top
from tests.reference import cases

EPS = np.finfo(np.float64).eps
TOP = {"i_perp": 1.0, "i3": 0.5, "mgl": 1.0}


def top(case):
    given = case["in"]
    mgl = given["M"] * given["g"] * given["l"]
    return {"i_perp": given["Iperp"], "i3": given["I3"], "mgl": mgl}


def leaning(theta):
    return (math.cos(0.5 * theta), math.sin(0.5 * theta), 0.0, 0.0)


@pytest.mark.parametrize(
    "case", [c for c in cases("heavy_top") if "theta" in c["out"]], ids=itemgetter("id")
)
def test_the_tilt_at_any_time_agrees_with_the_reference(case):
    tilt = heavy_top.tilt(case["t"], case["in"]["w0"], case["in"]["q0"], **top(case))
    # The reference goes on beyond pi where the axis swings through the lower vertical.
    expected = np.pi - np.abs(np.pi - np.array(case["out"]["theta"]))
    # As for the free body: cond eps from the input, but a closed form amplifies nothing, so that
    # beside the upright separatrix only the rounding of the phase is left.
    tolerance = EPS * min(8.0 * case["cond"]["theta"], 200.0)
    np.testing.assert_allclose(tilt, expected, rtol=0, atol=tolerance)


@pytest.mark.parametrize(
    "case", [c for c in cases("heavy_top") if "theta_min" in c["scalars"]], ids=itemgetter("id")
)
def test_turning_points_and_period_agree_with_the_reference(case):
    scalars = case["scalars"]
    swing = heavy_top.nutation(case["in"]["w0"], case["in"]["q0"], **top(case))
    # Relative: tilts of 1e-12 count. The floor is for axes that pass the pole at 1e-17.
    np.testing.assert_allclose(swing.theta_min, scalars["theta_min"], rtol=8 * EPS, atol=EPS)
    np.testing.assert_allclose(swing.theta_max, scalars["theta_max"], rtol=8 * EPS)
    np.testing.assert_allclose(swing.period, scalars["nutation_period"], rtol=8 * EPS)


@pytest.mark.parametrize("case", cases("heavy_top"), ids=itemgetter("id"))
def test_the_roots_of_the_cubic_agree_with_the_reference(case):
    swing = heavy_top.nutation(case["in"]["w0"], case["in"]["q0"], **top(case))
    expected = case["scalars"]["cubic_roots_u"]
    np.testing.assert_allclose(swing.roots, expected, rtol=8 * EPS, atol=4 * EPS)
    # Where 1 - u or 1 + u is small it is kept apart, with all its digits.
    for root, depth, height in zip(swing.roots, swing.depths, swing.heights, strict=True):
        assert depth == pytest.approx(abs(1.0 - root), rel=0, abs=4 * EPS * (1.0 + abs(root)))
        assert height == pytest.approx(1.0 + root, rel=0, abs=4 * EPS * (1.0 + abs(root)))


def test_the_smallest_tilt_keeps_its_digits_beside_the_vertical():
    # A cusp at the start: the smallest tilt is that of the start, from 1e-1 down to 1e-70 rad,
    # whose fourth power, in the cubic, is still a number.
    for tilt in 10.0 ** -np.arange(1.0, 71.0, 3.0):
        for spin in (2.0, 3.999, 4.001, 9.0):
            swing = heavy_top.nutation((0.0, 0.0, spin), leaning(tilt), **TOP)
            assert swing.theta_min == pytest.approx(tilt, rel=8 * EPS)


def test_the_exactly_upright_top_stays_upright():
    for case in cases("heavy_top"):
        if case["scalars"]["path"] == "sleeping":
            tilt = heavy_top.tilt(case["t"], case["in"]["w0"], case["in"]["q0"], **top(case))
            assert not tilt.any()


@pytest.mark.parametrize("spin", [0.0, 1.0, 3.9, 4.0, 4.1, 20.0])
def test_theta_zero_and_pi_are_harmless_at_every_spin(spin):
    t = np.linspace(-5.0, 50.0, 7)
    assert not heavy_top.tilt(t, (0.0, 0.0, spin), (1.0, 0.0, 0.0, 0.0), **TOP).any()
    hanging = heavy_top.tilt(t, (0.0, 0.0, spin), (0.0, 1.0, 0.0, 0.0), **TOP)
    np.testing.assert_array_equal(hanging, np.pi)


@pytest.mark.parametrize("case", cases("steady_precession"), ids=itemgetter("id"))
def test_steady_precession_agrees_with_the_reference(case):
    given, out, body = case["in"], case["out"], top(case)
    axial = {"i_perp": body["i_perp"], "i3": body["i3"]}
    rates = heavy_top.steady_precession(given["theta"], given["w3"], **body)
    for rate, name in zip(rates, ("slow", "fast"), strict=True):
        frequency = heavy_top.nutation_frequency(given["theta"], rate, given["w3"], **axial)
        np.testing.assert_allclose(rate, out[f"phid_{name}"], rtol=8 * EPS)
        np.testing.assert_allclose(frequency, out[f"nutation_frequency_{name}"], rtol=8 * EPS)
    threshold = heavy_top.steady_threshold(given["theta"], **body)
    np.testing.assert_allclose(threshold, out["w3_min_for_this_theta"], rtol=8 * EPS)
    fast = heavy_top.fast_top(given["theta"], given["w3"], **body)
    np.testing.assert_allclose(fast.precession, out["fast_top_estimate"], rtol=8 * EPS)
    sine, cosine = math.sin(given["theta"]), math.cos(given["theta"])
    p_psi = given["I3"] * given["w3"]
    p_phi = given["Iperp"] * 0.5 * sine**2 + p_psi * cosine
    potential = heavy_top.effective_potential(
        given["theta"], p_phi, p_psi, i_perp=body["i_perp"], mgl=body["mgl"]
    )
    # p_phi - p_psi cos theta is the difference of two numbers up to a thousand times larger.
    np.testing.assert_allclose(potential, out["V_eff_at_theta_for_phid_0.5"], rtol=1e-12)


def test_no_steady_precession_below_the_least_spin_and_one_at_the_horizontal():
    theta = np.array([0.3, 1.2])
    least = heavy_top.steady_threshold(theta, **TOP)
    np.testing.assert_allclose(least, 4.0 * np.sqrt(np.cos(theta)), rtol=4 * EPS)
    assert np.isnan(heavy_top.steady_precession(theta, 0.999 * least, **TOP)).all()
    assert np.isfinite(heavy_top.steady_precession(theta, 1.001 * least, **TOP)).all()
    slow, fast = heavy_top.steady_precession(0.5 * np.pi, 6.0, **TOP)
    assert slow == pytest.approx(1.0 / 3.0, rel=1e-15)
    assert abs(fast) > 1e15
    assert heavy_top.steady_threshold(2.0, **TOP) == 0.0
    assert heavy_top.steady_threshold(0.0, **TOP) == heavy_top.sleeping_threshold(**TOP)


@pytest.mark.parametrize("branch", [0, 1])
@pytest.mark.parametrize("theta", [0.4, 1.3, 2.2])
def test_steady_precession_sits_at_the_minimum_of_the_effective_potential(theta, branch):
    omega3 = 7.0
    rate = float(heavy_top.steady_precession(theta, omega3, **TOP)[branch])
    p_psi = TOP["i3"] * omega3
    p_phi = TOP["i_perp"] * rate * math.sin(theta) ** 2 + p_psi * math.cos(theta)
    h = 1e-3
    values = heavy_top.effective_potential(
        theta + h * np.arange(-2, 3), p_phi, p_psi, i_perp=TOP["i_perp"], mgl=TOP["mgl"]
    )
    slope = values @ np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12.0 * h)
    curvature = values @ np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / (12.0 * h * h)
    frequency = heavy_top.nutation_frequency(theta, rate, omega3, i_perp=1.0, i3=0.5)
    # Five points: h^4 times a sixth derivative of some thousands, and eps / h^2.
    assert slope == pytest.approx(0.0, abs=1e-8)
    assert curvature / TOP["i_perp"] == pytest.approx(frequency**2, rel=1e-7)


@pytest.mark.parametrize("case", cases("sleeping_top"), ids=itemgetter("id"))
def test_sleeping_threshold_and_rates_agree_with_the_reference(case):
    out = case["out"]
    threshold = heavy_top.sleeping_threshold(**top(case))
    np.testing.assert_allclose(threshold, out["w3_crit"], rtol=4 * EPS)
    first, second = heavy_top.sleeping_exponents(case["in"]["w3"], **top(case))
    # The square root of 1 - (omega3 / threshold)^2 amplifies roundings: it is 1e-3 at the least.
    if "growth_rate" in out:
        np.testing.assert_allclose(first.real, out["growth_rate"], rtol=1e3 * EPS)
        assert second.real == -first.real
        np.testing.assert_allclose(
            (first.imag, second.imag), out["precession_rate_of_growing_mode"], rtol=8 * EPS
        )
    else:
        assert first.real == second.real == 0.0
        np.testing.assert_allclose(
            (first.imag, second.imag), (out["freq_slow"], out["freq_fast"]), rtol=1e3 * EPS
        )


@pytest.mark.parametrize("case", cases("top_homoclinic"), ids=itemgetter("id"))
def test_the_homoclinic_tilt_agrees_with_the_reference(case):
    out = case["out"]
    tilt = heavy_top.homoclinic_tilt([0.0, out["t"]], case["in"]["w3"], **top(case))
    expected = out["theta_max"], out["theta_at_t_after_theta_max"]
    np.testing.assert_allclose(tilt, expected, rtol=1e-14)
    growth = heavy_top.sleeping_exponents(case["in"]["w3"], **top(case))[0].real
    np.testing.assert_allclose(growth, out["growth_rate"], rtol=8 * EPS)


def test_the_homoclinic_tilt_grows_out_of_the_sleeping_top_at_its_rate():
    growth = heavy_top.sleeping_exponents(1.0, **TOP)[0].real
    early = heavy_top.homoclinic_tilt(np.array([-21.0, -20.0]), 1.0, **TOP)
    assert math.log(early[1] / early[0]) == pytest.approx(growth, rel=1e-13)


def test_no_homoclinic_motion_from_the_threshold_on():
    threshold = heavy_top.sleeping_threshold(**TOP)
    with pytest.raises(ValueError, match="below the threshold"):
        heavy_top.homoclinic_tilt(0.0, threshold, **TOP)


@pytest.mark.parametrize("theta", [1e-9, 0.3, 2.0, np.pi - 1e-9])
@pytest.mark.parametrize("omega0", [(0.3, -0.2, 3.0), (0.0, 0.0, 6.0), (-1.0, 2.0, 0.0)])
def test_the_tilt_obeys_the_energy_equation(theta, omega0):
    w1, w2, w3 = omega0
    t, h = np.linspace(0.0, 20.0, 41), 1e-3
    stencil = h * np.array([-2.0, -1.0, 1.0, 2.0])
    u, near = (
        np.cos(heavy_top.tilt(x, omega0, leaning(theta), **TOP)) for x in (t, t[:, None] + stencil)
    )
    rate = near @ np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * h)
    # I^2 u'^2 = I (1 - u^2)(2 E - I3 omega3^2 - 2 mgl u) - (p_phi - p_psi u)^2, with I = mgl = 1.
    energy = w1**2 + w2**2 + 2.0 * math.cos(theta)
    p_psi = TOP["i3"] * w3
    p_phi = math.sin(theta) * w2 + p_psi * math.cos(theta)
    expected = (1.0 - u**2) * (energy - 2.0 * u) - (p_phi - p_psi * u) ** 2
    np.testing.assert_allclose(rate**2, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["i_perp", "i3", "mgl"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan])
def test_bad_parameters_are_refused_by_name(name, value):
    with pytest.raises(ValueError, match=f"^{name} = "):
        heavy_top.nutation((0.0, 0.0, 1.0), leaning(0.1), **{**TOP, name: value})


@pytest.mark.parametrize("name", ["i_perp", "mgl"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan])
def test_the_potential_of_no_top_is_refused_by_name(name, value):
    with pytest.raises(ValueError, match=f"^{name} = "):
        heavy_top.effective_potential(0.5, 1.0, 1.0, **{"i_perp": 1.0, "mgl": 1.0, name: value})


def test_times_of_any_shape_are_taken():
    t = np.zeros((2, 3))
    assert heavy_top.tilt(t, (0.0, 0.0, 1.0), leaning(0.1), **TOP).shape == (2, 3)
    assert heavy_top.homoclinic_tilt(t, 1.0, **TOP).shape == (2, 3)


def test_the_potential_of_the_sleeping_top_is_its_weight_upright():
    # Its limit: ((p_phi - p_psi cos theta) / sin theta)^2 -> (p_psi theta / 2)^2 for p_phi = p_psi
    theta, p = np.array([0.0, 1e-300, 1e-8, 1e-3]), 1.7
    found = heavy_top.effective_potential(theta, p, p, i_perp=1.3, mgl=0.9)
    assert found[0] == 0.9
    expected = 0.9 + (p**2 / 8.0 / 1.3 - 0.45) * theta**2
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)  # theta^4 is left out
    hanging = heavy_top.effective_potential(np.pi, -p, p, i_perp=1.3, mgl=0.9)
    np.testing.assert_allclose(hanging, -0.9, rtol=1e-15)
    assert heavy_top.effective_potential(0.0, p, 1.6, i_perp=1.3, mgl=0.9) == np.inf


def test_starts_whose_ratios_leave_double_precision_are_refused():
    body = {"i_perp": 1.0, "i3": 0.5, "mgl": 1.0}
    for omega, changed in (((0.0, 1e100, 0.0), {}), ((0.1, 0.2, 0.3), {"mgl": 1e-310})):
        with pytest.raises(ValueError, match=r"^omega0 = .*; expected rates, moments and weight"):
            heavy_top.tilt(1.0, omega, (0.8, 0.6, 0.0, 0.0), **{**body, **changed})
    for bad in (None, "fast", 1j, True, 10**400):
        with pytest.raises(ValueError, match=r"^precession = "):
            heavy_top.nutation_frequency(0.3, bad, 2.0, i_perp=1.0, i3=0.5)
