import math
from operator import itemgetter

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rigid_envs.systems.heavy_top import closed_forms as heavy_top
from tests.reference import cases

EPS = np.finfo(np.float64).eps
TOP = {"i_perp": 1.0, "i3": 0.5, "mgl": 1.0}  # sleeps from 4 rad/s on
UPRIGHT, HANGING = (1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0)


def top(case):
    given_ = case["in"]
    mgl = given_["M"] * given_["g"] * given_["l"]
    return {"i_perp": given_["Iperp"], "i3": given_["I3"], "mgl": mgl}


def leaning(theta):
    return (math.cos(0.5 * theta), math.sin(0.5 * theta), 0.0, 0.0)


def of(theta, precession, nutation, omega3, **body):
    """Precession of the start with Euler angles (0, theta, 0) and these rates."""
    omega0 = (nutation, precession * math.sin(theta), omega3)
    return heavy_top.precession(omega0, leaning(theta), **(body or TOP))


@pytest.mark.parametrize("case", cases("heavy_top"), ids=itemgetter("id"))
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


RATE = st.floats(-3.0, 3.0).map(lambda x: round(x, 6))


@given(theta=st.floats(0.05, 3.1), phi=RATE, swing=RATE, spin=RATE, t=st.floats(-5.0, 5.0))
def test_the_angle_per_nutation_is_gained_from_any_moment(theta, phi, swing, spin, t):
    omega0, q0 = (swing, phi * math.sin(theta), 2.0 * spin), leaning(theta)
    way, period = (
        heavy_top.precession(omega0, q0, **TOP),
        heavy_top.nutation(omega0, q0, **TOP).period,
    )
    assume(period < 30.0 and way.path != "sleeping")
    _, turned, _ = heavy_top.euler_angles([t, t + period], omega0, q0, **TOP)
    # phi' reaches 1 / sin theta: a rounding of t moves phi by that much beside a pole.
    nutation = heavy_top.nutation(omega0, q0, **TOP)
    closest = min(math.sin(nutation.theta_min), math.sin(nutation.theta_max))
    assume(closest > 1e-6)
    tolerance = 200.0 * EPS * (1.0 + period) * (1.0 + 10.0 / closest)
    assert turned[1] - turned[0] == pytest.approx(way.per_nutation, rel=0, abs=tolerance)
    assert way.mean_rate == pytest.approx(way.per_nutation / period, rel=4 * EPS)


@given(theta=st.floats(0.2, 2.9), phi=RATE, swing=RATE, spin=st.floats(-8.0, 8.0))
def test_the_kind_of_path_is_that_of_the_precession_along_it(theta, phi, swing, spin):
    omega0, q0 = (swing, phi * math.sin(theta), spin), leaning(theta)
    way, nutation = (
        solve(omega0, q0, **TOP) for solve in (heavy_top.precession, heavy_top.nutation)
    )
    assume(way.path in ("smooth", "looping") and nutation.period < 50.0)
    # phi' sin^2 theta = b - a cos theta is monotone between the turning points.
    constants = heavy_top.invariants(omega0, q0, **TOP)
    ends = constants.p_phi - constants.p_psi * np.cos([nutation.theta_min, nutation.theta_max])
    assume(np.min(np.abs(ends)) > 1e-8)
    assert way.path == ("looping" if ends[0] * ends[1] < 0.0 else "smooth")


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
    swing = heavy_top.nutation((0.0, 0.0, spin), leaning(theta), **TOP)
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


def test_on_the_way_to_upright_the_top_precesses_for_ever_at_half_the_rate_of_its_spin():
    # From the horizontal with phi' = a and theta'^2 = beta - a^2: p_phi = p_psi, E that of upright.
    omega0, q0 = (1.0, 1.0, 2.0), (0.5**0.5, 0.5**0.5, 0.0, 0.0)
    way = heavy_top.precession(omega0, q0, **TOP)
    assert heavy_top.nutation(omega0, q0, **TOP).period == math.inf
    assert (way.path, way.per_nutation, way.mean_rate) == ("smooth", math.inf, 0.5)
    rounded = (math.nextafter(1.0, 2.0), 1.0, 2.0)
    assert 30.0 < heavy_top.nutation(rounded, q0, **TOP).period < 60.0


def test_in_a_plane_the_way_to_upright_has_no_precession_but_the_jump_below():
    swing = heavy_top.precession((2.0, 0.0, 0.0), HANGING, **TOP)
    assert (swing.path, swing.mean_rate) == ("through_pole", 0.0)
    assert swing.per_nutation == pytest.approx(math.pi, rel=4 * EPS)


@pytest.mark.parametrize("theta", [0.4, 1.0, 2.3])
def test_the_fast_top_is_approached_with_the_square_of_its_spin(theta):
    errors = []
    for omega3 in (50.0, 100.0, 200.0):
        fast = heavy_top.fast_top(theta, omega3, **TOP)
        start = (0.0, 0.0, omega3), leaning(theta)
        swing, way = heavy_top.nutation(*start, **TOP), heavy_top.precession(*start, **TOP)
        found = np.array(
            [way.mean_rate, 2.0 * math.pi / swing.period, 0.5 * (swing.theta_max - swing.theta_min)]
        )
        expected = np.array([fast.precession, fast.nutation, fast.amplitude])
        errors.append(np.abs(found / expected - 1.0))
    # Relative to I mgl / (I3 omega3)^2, some 1e-3 at 50 rad/s; and four times less at twice that.
    assert np.max(errors[0]) <= 4.0 * 1.0 / 25.0**2
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.1)


def test_the_fast_top_takes_arrays_and_refuses_no_spin():
    fast = heavy_top.fast_top(np.zeros((3, 1)), np.array([-1.0, 2.0]), **TOP)
    assert fast.precession.shape == fast.nutation.shape == fast.amplitude.shape == (3, 2)
    np.testing.assert_array_equal(fast.precession[0], [-2.0, 1.0])
    np.testing.assert_array_equal(fast.nutation[0], [0.5, 1.0])
    with pytest.raises(ValueError, match=r"^omega3\[?.*\]? = 0.0; expected a spin"):
        heavy_top.fast_top(0.5, 0.0, **TOP)


def test_bad_input_is_refused_by_name():
    with pytest.raises(ValueError, match=r"^i3 = "):
        heavy_top.precession((0.0, 0.0, 1.0), UPRIGHT, i_perp=1.0, i3=-1.0, mgl=1.0)
    with pytest.raises(ValueError, match=r"^q0 = .*; expected length 1"):
        heavy_top.invariants((0.0, 0.0, 1.0), (1.0, 1.0, 0.0, 0.0), **TOP)
    with pytest.raises(ValueError, match=r"^mgl = "):
        heavy_top.steady_threshold(0.3, i_perp=1.0, i3=1.0, mgl=0.0)
