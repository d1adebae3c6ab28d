"""Motion of the heavy top: closed forms against references, simulations against both."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rigid_envs.mechanics.laws import matrices
from rigid_envs.systems.heavy_top import closed_forms as heavy_top
from rigid_envs.systems.heavy_top.system import HeavyTop
from tests.from_pages.attitudes import quaternion_rate
from tests.reference import cases, every
from tests.refusals import refuses
from tests.systems import measures

# Tilt, attitude and steady states of the symmetric top against references and equations.


EPS = np.finfo(np.float64).eps
TOP = {"i_perp": 1.0, "i3": 0.5, "mgl": 1.0}


def top(case):
    given_ = case["in"]
    mgl = given_["M"] * given_["g"] * given_["l"]
    return {"i_perp": given_["Iperp"], "i3": given_["I3"], "mgl": mgl}


def test_the_smallest_tilt_keeps_its_digits_beside_the_vertical():
    # A cusp at the start: the smallest tilt is that of the start, from 1e-1 down to 1e-70 rad,
    # whose fourth power, in the cubic, is still a number.
    for tilt in 10.0 ** -np.arange(1.0, 71.0, 3.0):
        for spin in (2.0, 3.999, 4.001, 9.0):
            start = (0.0, 0.0, spin), measures.leaning(tilt)
            smallest = heavy_top.nutation(*start, **TOP).theta_min
            assert smallest == pytest.approx(tilt, rel=8 * EPS)
            assert heavy_top.tilt(0.0, *start, **TOP) == pytest.approx(tilt, rel=8 * EPS)


@every(cases("steady_precession"))
def test_steady_precession_agrees_with_the_reference(case):
    given_, out, body = case["in"], case["out"], top(case)
    axial = {"i_perp": body["i_perp"], "i3": body["i3"]}
    rates = heavy_top.steady_precession(given_["theta"], given_["w3"], **body)
    for rate, name in zip(rates, ("slow", "fast"), strict=True):
        frequency = heavy_top.nutation_frequency(given_["theta"], rate, given_["w3"], **axial)
        np.testing.assert_allclose(rate, out[f"phid_{name}"], rtol=8 * EPS)
        np.testing.assert_allclose(frequency, out[f"nutation_frequency_{name}"], rtol=8 * EPS)
    threshold = heavy_top.steady_threshold(given_["theta"], **body)
    np.testing.assert_allclose(threshold, out["w3_min_for_this_theta"], rtol=8 * EPS)
    fast = heavy_top.fast_top(given_["theta"], given_["w3"], **body)
    np.testing.assert_allclose(fast.precession, out["fast_top_estimate"], rtol=8 * EPS)
    sine, cosine = math.sin(given_["theta"]), math.cos(given_["theta"])
    p_psi = given_["I3"] * given_["w3"]
    p_phi = given_["Iperp"] * 0.5 * sine**2 + p_psi * cosine
    potential = heavy_top.effective_potential(
        given_["theta"], p_phi, p_psi, i_perp=body["i_perp"], mgl=body["mgl"]
    )
    # p_phi - p_psi cos theta is the difference of two numbers up to a thousand times larger.
    np.testing.assert_allclose(potential, out["V_eff_at_theta_for_phid_0.5"], rtol=1e-12)


@every(cases("sleeping_top"))
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


@every(cases("top_homoclinic"))
def test_the_homoclinic_tilt_agrees_with_the_reference(case):
    out = case["out"]
    tilt = heavy_top.homoclinic_tilt([0.0, out["t"]], case["in"]["w3"], **top(case))
    expected = out["theta_max"], out["theta_at_t_after_theta_max"]
    np.testing.assert_allclose(tilt, expected, rtol=1e-14)
    growth = heavy_top.sleeping_exponents(case["in"]["w3"], **top(case))[0].real
    np.testing.assert_allclose(growth, out["growth_rate"], rtol=8 * EPS)


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


UPRIGHT, HANGING = (1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0)


def from_euler(theta, phi, psi):
    """Quaternion of z-x-z Euler angles."""
    half = np.array([0.5 * theta, 0.5 * (phi + psi), 0.5 * (phi - psi)])
    (cos, _, _), (sin, _, _) = np.cos(half), np.sin(half)
    parts = (cos * np.cos(half[1]), sin * np.cos(half[2]), sin * np.sin(half[2]))
    return np.stack([*parts, cos * np.sin(half[1])], axis=-1)


@every(cases("heavy_top"))
def test_attitude_rates_and_angles_agree_with_the_reference(case):
    omega0, q0, body, t = case["in"]["w0"], case["in"]["q0"], top(case), case["t"]
    theta, phi, psi = heavy_top.euler_angles(t, omega0, q0, **body)
    found = {
        "R": matrices(heavy_top.attitude(t, omega0, q0, **body)).reshape(-1, 9),
        "w": heavy_top.omega(t, omega0, q0, **body),
        "theta": theta,
        "phi_unwrapped": phi,
        "psi_unwrapped": psi,
    }
    expected = {name: np.array(values) for name, values in case["out"].items()}
    for name in {"phi_unwrapped", "psi_unwrapped"} & expected.keys():
        # Whole turns are counted from another start: the same number for all times.
        turns = np.rint((expected[name][0] - found[name][0]) / (2.0 * np.pi))
        found[name] = found[name] + 2.0 * np.pi * turns
    if "theta" in expected:
        # The reference goes on beyond pi where the axis swings through the lower vertical.
        expected["theta"] = np.pi - np.abs(np.pi - expected["theta"])
    for name, values in expected.items():
        # A rounding of the input moves the answer by cond eps, and each formula rounds a few times.
        # A closed form amplifies nothing: where cond is 1e6 and more, beside a pole or the
        # separatrix, only the roundings of phases of some hundred radians are left.
        scale = float(np.linalg.norm(omega0)) if name == "w" else 1.0
        tolerance = EPS * min(8.0 * case["cond"][name], 1000.0 * scale)
        np.testing.assert_allclose(found[name], values, rtol=0, atol=tolerance, err_msg=name)


ANGLE = st.one_of(st.sampled_from([0.0, math.pi, 1e-12, 0.5 * math.pi]), st.floats(-3.2, 3.2))
RATE = st.one_of(
    st.sampled_from([0.0, -0.0, 1.0, 1e-13, -1e-6]), st.floats(-2.0, 2.0).map(lambda x: round(x, 9))
)
SPIN = st.one_of(st.sampled_from([0.0, 4.0, -4.0, 3.999999]), st.floats(-8.0, 8.0))
BODY = st.fixed_dictionaries(
    {
        "i_perp": st.one_of(st.just(1.0), st.floats(0.5, 2.0)),
        "i3": st.one_of(st.just(0.5), st.just(1.0), st.floats(0.1, 1.0)),
        "mgl": st.one_of(st.just(1.0), st.floats(0.3, 2.0)),
    }
)
START = st.tuples(ANGLE, ANGLE, ANGLE).map(lambda x: from_euler(*x))
OMEGA = st.tuples(RATE, RATE, SPIN)


def in_body(q, vector):
    """A world vector in body axes."""
    return np.einsum("...ji,j->...i", matrices(q), vector)


@given(body=BODY, q0=START, omega0=OMEGA, t=st.floats(-5.0, 5.0))
def test_the_motion_obeys_eulers_equations(body, q0, omega0, t):
    h = 1e-3
    near, weights = t + h * np.array([-2.0, -1.0, 1.0, 2.0]), np.array([1.0, -8.0, 8.0, -1.0])
    q_rate, omega_rate = (
        weights @ solve(near, omega0, q0, **body) / (12.0 * h)
        for solve in (heavy_top.attitude, heavy_top.omega)
    )
    q, omega = (solve(t, omega0, q0, **body) for solve in (heavy_top.attitude, heavy_top.omega))
    moments = np.array([body["i_perp"], body["i_perp"], body["i3"]])
    weight = np.cross([0.0, 0.0, body["mgl"]], -in_body(q, [0.0, 0.0, 1.0]))
    expected = (np.cross(moments * omega, omega) + weight) / moments
    # Five-point difference: h^4 / 30 times a fifth derivative, rate^5, and rounding eps / h; the
    # rates are those of omega, of the pendulum and of I3 omega3 / I.
    rate = 3.0 + float(np.linalg.norm(omega)) + abs(omega0[2]) * body["i3"] / body["i_perp"]
    tolerance = h**4 / 30.0 * rate**5 + 100.0 * EPS * rate / h
    np.testing.assert_allclose(q_rate, quaternion_rate(q, omega), rtol=0, atol=tolerance)
    np.testing.assert_allclose(omega_rate, expected, rtol=0, atol=rate * tolerance)


@given(body=BODY, q0=START, omega0=OMEGA)
@example(body=TOP, q0=from_euler(0.5, -3.0, -3.0), omega0=(1.0, 1.0, 1.0))  # by whole turns
def test_the_angles_are_those_of_the_attitude(body, q0, omega0):
    t = np.array([0.0, -4.1, 1.3, 7.7])
    theta, phi, psi = heavy_top.euler_angles(t, omega0, q0, **body)
    q = heavy_top.attitude(t, omega0, q0, **body)
    tilt = heavy_top.tilt(t, omega0, q0, **body)
    # 1e-13: phases of at most some 100 radians; at a pole the angles have no meaning of their own.
    np.testing.assert_allclose(theta, tilt, rtol=0, atol=1e-13)
    away = np.sin(theta) > 1e-13
    same = np.abs(np.sum(q * from_euler(theta, phi, psi), axis=-1))[away]
    np.testing.assert_allclose(same, 1.0, rtol=0, atol=1e-13)
    assert np.isfinite(phi).all() and np.isfinite(psi).all()
    assert abs(phi[0]) <= np.pi + 1e-15 and abs(psi[0]) <= np.pi + 1e-15


@pytest.mark.parametrize(
    ("theta", "across"),
    [(0.7, 0.3), (1.7, 2.5), (math.pi - 1e-5, 1e-5)],
    ids=["highest", "lowest", "hanging"],
)
def test_the_rates_of_the_start_keep_their_digits_beside_a_turning_point(theta, across):
    for climb in np.geomspace(1e-9, 0.1, 20):
        omega0 = (climb, across, 2.0)
        found = heavy_top.omega(0.0, omega0, from_euler(theta, 0.0, 0.0), **TOP)
        np.testing.assert_allclose(found, omega0, rtol=0, atol=32 * EPS)


def test_the_angles_are_continuous_beside_the_pole():
    omega0, t = (1.0, 1e-2, 1.0), np.linspace(0.0, 40.0, 40001)
    theta, phi, psi = heavy_top.euler_angles(t, omega0, from_euler(0.5, 0.3, 0.1), **TOP)
    assert theta.min() < 0.2
    for angle in (phi, psi):
        # phi' is at most some 30 rad/s here; a missed half turn would be 3.
        assert np.max(np.abs(np.diff(angle))) < 0.1


def test_through_the_pole_phi_jumps_by_half_a_turn_and_the_attitude_does_not():
    omega0 = (2.0, 0.5, 3.0)
    swing = heavy_top.nutation(omega0, UPRIGHT, **TOP)
    assert swing.theta_min == 0.0
    for passage in (0.0, swing.period, 5.0 * swing.period):
        t = passage + np.array([-1e-9, 1e-9])
        theta, phi, psi = heavy_top.euler_angles(t, omega0, UPRIGHT, **TOP)
        # In 2e-9 s at 3 rad/s nothing else moves by more than 1e-8.
        assert theta == pytest.approx([0.0, 0.0], abs=1e-8)
        assert np.diff(phi) == pytest.approx(np.pi, abs=1e-7)
        assert np.diff(psi) == pytest.approx(-np.pi, abs=1e-7)
        q = heavy_top.attitude(t, omega0, UPRIGHT, **TOP)
        np.testing.assert_allclose(q[0], q[1], rtol=0, atol=1e-8)


@pytest.mark.parametrize("spin", [0.0, 1.0, -3.9, 4.0, 4.0 + 1e-15, 20.0])
@pytest.mark.parametrize("start", [UPRIGHT, HANGING, (0.6, 0.0, 0.0, 0.8), (0.0, 0.8, -0.6, 0.0)])
def test_an_axis_exactly_on_the_vertical_stays_there(spin, start):
    t = np.linspace(-9.0, 40.0, 8)
    q = heavy_top.attitude(t, (0.0, 0.0, spin), start, **TOP)
    expected = Rotation.from_quat(start, scalar_first=True) * Rotation.from_rotvec(
        spin * t[:, None] * [0.0, 0.0, 1.0]
    )
    # A phase of up to 800 radians, rounded.
    np.testing.assert_allclose(matrices(q), expected.as_matrix(), rtol=0, atol=800 * EPS)
    omega = heavy_top.omega(t, (0.0, 0.0, spin), start, **TOP)
    np.testing.assert_array_equal(omega, np.tile((0.0, 0.0, spin), (8, 1)))
    theta, phi, psi = heavy_top.euler_angles(t, (0.0, 0.0, spin), start, **TOP)
    upright = math.hypot(start[0], start[3]) > 0.5
    np.testing.assert_array_equal(theta, 0.0 if upright else np.pi)
    turned = phi + psi if upright else psi - phi
    np.testing.assert_allclose(turned - turned[0], spin * (t - t[0]), rtol=0, atol=800 * EPS)


@pytest.mark.parametrize("start", [UPRIGHT, HANGING])
def test_what_is_too_little_to_tip_the_top_leaves_it_asleep(start):
    t, rng = np.linspace(0.0, 5.0, 6), np.random.default_rng(0)
    expected = heavy_top.attitude(t, (0.0, 0.0, 1.0), start, **TOP)
    for size in range(80, 310, 5):
        nothing = 10.0 ** -rng.integers(size, 310, 6)
        found = heavy_top.attitude(
            t, (nothing[0], nothing[1], 1.0), np.array(start) + nothing[2:], **TOP
        )
        # Where the top is not stable, it is tipped by exp(5) of its start: still nothing.
        np.testing.assert_allclose(found, expected, rtol=0, atol=4 * EPS)


def of(theta, precession, nutation, omega3, **body):
    """Precession of the start with Euler angles (0, theta, 0) and these rates."""
    omega0 = (nutation, precession * math.sin(theta), omega3)
    return heavy_top.precession(omega0, measures.leaning(theta), **(body or TOP))


@every(cases("heavy_top"))
def test_every_scalar_of_the_reference_is_found(case):
    omega0, q0, body, scalars = case["in"]["w0"], case["in"]["q0"], top(case), case["scalars"]
    way = heavy_top.precession(omega0, q0, **body)
    constants = heavy_top.invariants(omega0, q0, **body)
    swing = heavy_top.nutation(omega0, q0, **body)
    found = {
        "E": constants.energy,
        "p_phi": constants.p_phi,
        "p_psi": constants.p_psi,
        "cubic_roots_u": swing.roots,
        "w3_sleep_crit": heavy_top.sleeping_threshold(**body),
        "theta_min": swing.theta_min,
        "theta_max": swing.theta_max,
        "nutation_period": swing.period,
        "dphi_per_nutation": way.per_nutation,
        "mean_precession": way.mean_rate,
    }
    if omega0[2] != 0.0:
        found["fast_top_estimate"] = heavy_top.fast_top(0.0, omega0[2], **body).precession
    if "theta_steady" in scalars:
        theta = scalars["theta_steady"]
        rates = np.array(heavy_top.steady_precession(theta, omega0[2], **body))
        rate = rates[np.argmin(np.abs(rates - scalars["phid_steady"]))]
        axial = {"i_perp": body["i_perp"], "i3": body["i3"]}
        frequency = heavy_top.nutation_frequency(theta, rate, omega0[2], **axial)
        found |= {
            "theta_steady": swing.theta_min,
            "phid_steady": rate,
            "nutation_angular_frequency": frequency,
        }
    # The oracle took M g l, we its rounded product: 2 eps, through sums of terms of one size.
    size = max(abs(constants.energy), abs(constants.p_psi), 1.0)
    absolute = {"E": 4 * EPS * size, "p_phi": 4 * EPS * size, "cubic_roots_u": 4 * EPS}
    for name, expected in scalars.items():
        if name == "path":
            assert way.path == expected
        else:
            # A tilt of 1e-17 is what remains of a cancellation: it is exact all the same.
            np.testing.assert_allclose(
                found[name], expected, rtol=16 * EPS, atol=absolute.get(name, 0.0), err_msg=name
            )


def test_the_three_kinds_of_path_part_at_the_axis_let_go_at_rest():
    # Let go at the highest point: back against the precession, at rest, or along it.
    paths = [of(1.0, rate, 0.0, 8.0).path for rate in (-0.1, -1e-6, 0.0, 1e-6, 0.1)]
    assert paths == ["looping", "looping", "cusped", "smooth", "smooth"]


def test_an_axis_let_go_at_rest_draws_cusps_however_fast_the_top_spins():
    # The nutation falls with spin^2, from a tenth to 1e-10: its ends are rounded at 1e-16.
    assert {of(1.0, 0.0, 0.0, spin).path for spin in np.geomspace(8.0, 3e5, 60)} == {"cusped"}


def test_a_loop_or_wave_below_the_tolerance_counts_as_a_cusp():
    # phi' sin^2 = b - a u leaves a highest point at which it is 1e-9 of the way, or more, or less.
    theta, spin = 1.0, 8.0
    swing = heavy_top.nutation((0.0, 0.0, spin), measures.leaning(theta), **TOP)
    u1, u2, _ = swing.roots
    unit = 1e-9 * TOP["i3"] * spin * (u2 - u1) / math.sin(theta) ** 2
    paths = [of(theta, share * unit, 0.0, spin).path for share in (-1.1, -0.9, 0.9, 1.1)]
    assert paths == ["looping", "cusped", "cusped", "smooth"]


def test_steady_precession_counts_as_steady_up_to_its_tolerance():
    theta, spin = 0.7, 9.0
    for rate in heavy_top.steady_precession(theta, spin, **TOP):
        way = of(theta, float(rate), 0.0, spin)
        assert way.path == "steady"
        # The start is steady to a rounding of the rates, which are of some 10 rad/s.
        assert way.mean_rate == pytest.approx(float(rate), rel=64 * EPS)
        # A push of theta' makes theta swing by theta' / frequency to both sides.
        frequency = heavy_top.nutation_frequency(theta, rate, spin, i_perp=1.0, i3=0.5)
        push = 0.5e-12 / math.sin(theta) * float(frequency)
        paths = [of(theta, float(rate), share * push, spin).path for share in (0.5, 2.0)]
        assert paths == ["steady", "smooth"]


@pytest.mark.parametrize("start", [UPRIGHT, HANGING])
@pytest.mark.parametrize("spin", [0.0, 1.0, 4.0, 9.0])
def test_an_axis_on_the_vertical_sleeps_and_one_that_moves_there_passes_through(start, spin):
    still = heavy_top.precession((0.0, 0.0, spin), start, **TOP)
    assert still.path == "sleeping"
    assert math.isnan(still.per_nutation) and math.isnan(still.mean_rate)
    moving = heavy_top.precession((1.0, 0.0, spin), start, **TOP)
    assert moving.path == "through_pole"
    assert math.isfinite(moving.per_nutation) and math.isfinite(moving.mean_rate)


def test_in_a_plane_the_way_to_upright_has_no_precession_but_the_jump_below():
    swing = heavy_top.precession((2.0, 0.0, 0.0), HANGING, **TOP)
    assert (swing.path, swing.mean_rate) == ("through_pole", 0.0)
    assert swing.per_nutation == pytest.approx(math.pi, rel=4 * EPS)


@pytest.mark.parametrize("theta", [0.4, 1.0, 2.3])
def test_the_fast_top_is_approached_with_the_square_of_its_spin(theta):
    errors = []
    for omega3 in (50.0, 100.0, 200.0):
        fast = heavy_top.fast_top(theta, omega3, **TOP)
        start = (0.0, 0.0, omega3), measures.leaning(theta)
        swing, way = heavy_top.nutation(*start, **TOP), heavy_top.precession(*start, **TOP)
        found = np.array(
            [way.mean_rate, 2.0 * math.pi / swing.period, 0.5 * (swing.theta_max - swing.theta_min)]
        )
        expected = np.array([fast.precession, fast.nutation, fast.amplitude])
        errors.append(np.abs(found / expected - 1.0))
    # Relative to I mgl / (I3 omega3)^2, some 1e-3 at 50 rad/s; and four times less at twice that.
    assert np.max(errors[0]) <= 4.0 * 1.0 / 25.0**2
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.1)


def test_the_fast_top_takes_arrays():
    fast = heavy_top.fast_top(np.zeros((3, 1)), np.array([-1.0, 2.0]), **TOP)
    assert fast.precession.shape == fast.nutation.shape == fast.amplitude.shape == (3, 2)
    np.testing.assert_array_equal(fast.precession[0], [-2.0, 1.0])
    np.testing.assert_array_equal(fast.nutation[0], [0.5, 1.0])


# The motion of the heavy top against reference cases, and what it keeps over a million steps.


DEFAULT = HeavyTop()


@every(cases("driven_space"))
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
    start = DEFAULT.state(q=measures.leaning(math.pi - 1e-5))
    t = np.linspace(0.0, 50.0, 501)
    swing = DEFAULT.simulate(start, t)["R"][:, 1, 2]
    # Harmonic to the square of the amplitude; the axis leans to -y at phi = 0.
    np.testing.assert_allclose(swing, -1e-5 * np.cos(t), rtol=0, atol=1e-13)
    refuses("take n_substeps >= 10", DEFAULT.advance, start, None, 5.0)


def check_momenta(trajectory, size):
    """Vertical momentum, and spin momentum of a symmetric top, to 1e-11 of a typical momentum.

    A million steps of 25 turns and kicks are a random walk of 2e7 roundings: 1e-12 or less.
    """
    found = trajectory.invariants
    assert np.max(np.abs(found["L_vertical"] - found["L_vertical"][0])) <= 1e-11 * size
    if trajectory.system.I1 == trajectory.system.I2:
        # Nothing turns about e3 except the body itself: not even rounded.
        np.testing.assert_array_equal(found["L_spin"], found["L_spin"][0])


def random_top(rng, symmetric):
    moments = measures.random_moments(rng)
    if symmetric:
        moments[1], moments[2] = moments[0], min(moments[2], 2.0 * moments[0])
    m, (I1, I2, I3) = rng.uniform(0.5, 2.0), moments
    longest = math.sqrt((I1 + I2 - I3) / (2.0 * m))  # m ell^2 is part of I1 and I2
    return HeavyTop(I1, I2, I3, m, ell=min(rng.uniform(0.05, 0.5), longest))


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("seed", measures.seeds(2, 53))
def test_random_tops_at_any_rate_in_the_envelope_keep_their_invariants(seed, symmetric):
    rng = np.random.default_rng([8, seed])
    top = random_top(rng, symmetric)
    least = min(top.I1, top.I2, top.I3)
    fall = math.sqrt(top.m * top.g * top.ell / least)
    omega = rng.normal(size=3) * rng.uniform(0.3, 3.0) * fall
    y = top.state(q=measures.random_attitude(rng), omega_body=omega)
    rate, turn = top.rate_bound(y, np.zeros(8), 0.0), rng.uniform(0.05, top.envelope)
    trajectory = measures.million_steps(top, y, turn / rate)
    size = 0.5 * least * rate**2  # energy above that of hanging at rest
    # Fourth order: C (rate dt)^4, where C was 0.054 at most in 80 tops; and roundings. Where the
    # motion is chaotic the error wanders between bounds: a line through it is not level.
    bound, share = 0.2 * turn**4 + 1e-11, 0.1 if symmetric else 0.5
    measures.assert_energy_stays(trajectory, bound, size, share)
    check_momenta(trajectory, math.sqrt(2.0 * size * max(top.I1, top.I2, top.I3)))


@pytest.mark.parametrize("theta", [0.0, math.pi])
@pytest.mark.parametrize("spin", [0.0, 1.0, 3.9, 4.1, 20.0])
def test_a_top_exactly_on_the_vertical_stays_there(theta, spin):
    start = DEFAULT.state(q=measures.leaning(theta), omega_body=(0.0, 0.0, spin))
    trajectory = DEFAULT.simulate(start, np.linspace(0.0, 20.0, 21))
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
    start = DEFAULT.state(q=measures.leaning(theta), omega_body=(0.7, 0.0, 2.0))
    trajectory = measures.million_steps(DEFAULT, start, 0.05)
    measures.assert_energy_stays(trajectory, 1e-7, size=1.0)
    check_momenta(trajectory, 1.0)
    poles = np.min(np.abs(trajectory["tilt"] - theta))
    assert poles < 0.05
