import itertools
import math
from operator import itemgetter

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rigid_envs.systems.free_body import closed_forms as free_body
from tests.reference import cases

EPS = np.finfo(np.float64).eps
BODY = (1.0, 2.0, 3.0)
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def matrices(q):
    return Rotation.from_quat(q, scalar_first=True).as_matrix()


@pytest.mark.parametrize("case", cases("free_top"), ids=itemgetter("id"))
def test_free_rotation_agrees_with_the_reference(case):
    moments, omega0, q0 = case["in"]["I"], case["in"]["w0"], case["in"]["q0"]
    omega = free_body.omega(case["t"], moments, omega0)
    rotation = matrices(free_body.attitude(case["t"], moments, omega0, q0))
    found = {
        "w": omega,
        "R": rotation.reshape(-1, 9),
        "w_space": np.einsum("nij,nj->ni", rotation, omega),
    }
    for name, values in found.items():
        # A rounding of the input moves the answer by cond eps, and each formula rounds a few times.
        # A closed form has no past to amplify its errors: even where cond is 1e17, beside the
        # separatrix, only the rounding of a phase of some hundred radians is left.
        scale = 1.0 if name == "R" else max(1.0, float(np.linalg.norm(omega0)))
        tolerance = EPS * min(8.0 * case["cond"][name], 4000.0 * scale)
        np.testing.assert_allclose(values, case["out"][name], rtol=0, atol=tolerance, err_msg=name)


@pytest.mark.parametrize("case", cases("free_top"), ids=itemgetter("id"))
def test_constants_of_the_polhode_agree_with_the_reference(case):
    scalars = case["scalars"]
    path = free_body.polhode(case["in"]["I"], case["in"]["w0"])
    np.testing.assert_allclose(path.momentum, scalars["L"], rtol=4 * EPS)
    if scalars["class"] == "asymmetric":
        # 1 - m is the one number that cancels, and it is exact: no allowance for the separatrix.
        np.testing.assert_allclose(path.m1, scalars["one_minus_m"], rtol=16 * EPS)
        np.testing.assert_allclose(path.m, scalars["ellip_m"], rtol=16 * EPS)
        np.testing.assert_allclose(path.flip_interval, float(scalars["flip_interval"]), rtol=1e-14)
        if path.m1 > 0.0:
            assert path.axes[2] + 1 == scalars["circulates_about_axis"]
    if "growth_rate" in scalars:
        spin = float(np.max(np.abs(case["in"]["w0"])))
        growth = free_body.growth_rate(case["in"]["I"], spin)
        np.testing.assert_allclose(growth, scalars["growth_rate"], rtol=8 * EPS)
        assert path.axes[1] + 1 == scalars["intermediate_axis"]


@pytest.mark.parametrize("case", cases("flip_period"), ids=itemgetter("id"))
def test_flips_down_to_a_perturbation_of_1e_10_keep_full_accuracy(case):
    path, spin = free_body.polhode(case["in"]["I"], case["in"]["w0"]), max(case["in"]["w0"])
    found = {
        "flip_interval": path.flip_interval,
        "polhode_period": path.period,
        "growth_rate": free_body.growth_rate(case["in"]["I"], spin),
        "log_asymptote_flip_interval": path.flip_asymptote,
        "p": abs(path.rate),
        "m": path.m,
        "one_minus_m": path.m1,
    }
    for name, expected in case["out"].items():
        np.testing.assert_allclose(found[name], expected, rtol=8 * EPS, err_msg=name)


def test_the_interval_of_flips_reaches_its_asymptote_with_the_square_of_the_perturbation():
    for eps in (1e-2, 1e-3, 1e-4):
        path = free_body.polhode(BODY, (eps, 1.0, 0.0))
        # K = ln(4 / k') + (ln(4 / k') - 1) m1 / 4 + O(m1^2 ln), DLMF 19.12.1.
        excess = path.m1 / 4.0 * (math.log(4.0 / math.sqrt(path.m1)) - 1.0)
        gap = 0.5 * abs(path.rate) * (path.flip_interval - path.flip_asymptote)
        assert gap == pytest.approx(excess, rel=2.0 * path.m1 * 9.0, abs=32 * EPS)


@pytest.mark.parametrize("omega0", [(0.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
def test_a_body_at_rest_or_on_its_intermediate_axis_never_flips(omega0):
    path = free_body.polhode(BODY, omega0)
    assert path.flip_asymptote == path.flip_interval == path.period == math.inf


def test_a_relative_error_of_the_perturbation_moves_the_flip_by_twice_that_over_p():
    eps, share = 1e-6, 1e-3
    path, moved = (free_body.polhode(BODY, (x, 1.0, 0.0)) for x in (eps, eps * (1.0 + share)))
    shift = path.flip_interval - moved.flip_interval
    # ln(1 + x) = x - x^2 / 2: half a thousandth; the interval of 27 s is rounded at 1e-14.
    assert shift == pytest.approx(2.0 * share / abs(path.rate), rel=share)


@pytest.mark.parametrize("case", cases("racket_rates"), ids=itemgetter("id"))
def test_rates_about_the_three_axes_agree_with_the_reference(case):
    moments, spin, out = case["in"]["I"], case["in"]["w"], case["out"]
    smallest, largest = free_body.oscillation_rates(moments, spin)
    growth = free_body.growth_rate(moments, spin)
    np.testing.assert_allclose(growth, out["growth_rate_about_intermediate"], rtol=8 * EPS)
    np.testing.assert_allclose(smallest, out["frequency_about_smallest"], rtol=8 * EPS)
    np.testing.assert_allclose(largest, out["frequency_about_largest"], rtol=8 * EPS)


def test_small_oscillations_have_the_period_of_the_linear_theory():
    smallest, largest = free_body.oscillation_rates(BODY, 1.0)
    for rate, omega0 in ((smallest, (1.0, 1e-9, 0.0)), (largest, (0.0, 1e-9, 1.0))):
        period = free_body.polhode(BODY, omega0).period
        np.testing.assert_allclose(period, 2.0 * np.pi / rate, rtol=1e-14)


def test_the_chapters_racket_flips_at_its_interval():
    omega0 = (0.01, 1.0, 0.01)
    interval = free_body.polhode(BODY, omega0).flip_interval
    flipped = free_body.omega(2.0 * interval * np.arange(4), BODY, omega0)
    np.testing.assert_allclose(flipped, np.tile(omega0, (4, 1)), rtol=0, atol=1e-13)
    half = free_body.omega(interval, BODY, omega0)
    assert half[1] == pytest.approx(-1.0, abs=1e-12)


def components(limit):
    special = st.sampled_from([0.0, -0.0, 1.0, -1.0, 1e-8, -1e-12])
    # Rounded: at rates of 1e-160 rad/s the squares that the tests take underflow, not the code.
    return st.one_of(special, st.floats(-limit, limit).map(lambda x: round(x, 13)))


MOMENTS = st.lists(
    # Repeated and all but repeated moments on purpose; the range keeps growth rates below 1 / s.
    st.one_of(st.sampled_from([0.5, 1.0, 1.0 + 1e-15, 1.0 - 1e-9]), st.floats(0.5, 1.0)),
    min_size=3,
    max_size=3,
)
OMEGA = st.tuples(components(2.0), components(2.0), components(2.0))
ATTITUDE = st.integers(0, 2**32 - 1).map(
    lambda seed: Rotation.random(rng=np.random.default_rng(seed)).as_quat(scalar_first=True)
)


@settings(max_examples=200, deadline=None)
@given(moments=MOMENTS, omega0=OMEGA, q0=ATTITUDE)
def test_energy_and_spatial_momentum_stay_for_any_body_and_start(moments, omega0, q0):
    t = np.array([0.0, -7.0, 0.1, 13.0])
    omega, q = free_body.omega(t, moments, omega0), free_body.attitude(t, moments, omega0, q0)
    assert np.all(np.abs(np.linalg.norm(q, axis=-1) - 1.0) <= 8 * EPS)
    momentum = np.einsum("nij,nj->ni", matrices(q), moments * omega)
    # 100 eps: t L / J of some 50 radians is rounded once, and all else a few times.
    scale = np.dot(omega0, omega0)
    np.testing.assert_allclose(omega[0], omega0, rtol=0, atol=8 * EPS * math.sqrt(scale))
    energy = np.sum(moments * omega**2, axis=-1)
    np.testing.assert_allclose(energy, energy[0], rtol=0, atol=100 * EPS * scale)
    np.testing.assert_allclose(
        momentum, np.broadcast_to(momentum[0], (4, 3)), rtol=0, atol=100 * EPS * math.sqrt(scale)
    )


@settings(max_examples=200, deadline=None)
@given(moments=MOMENTS, omega0=OMEGA, q0=ATTITUDE, t=st.floats(-4.0, 4.0))
def test_restarting_midway_continues_the_same_motion(moments, omega0, q0, t):
    middle = free_body.omega(t, moments, omega0), free_body.attitude(t, moments, omega0, q0)
    # A rounding at the restart grows by at most exp(rate t) = exp(4).
    np.testing.assert_allclose(
        free_body.omega(3.0, moments, middle[0]),
        free_body.omega(t + 3.0, moments, omega0),
        rtol=0,
        atol=1e-12,
    )
    restarted = matrices(free_body.attitude(3.0, moments, *middle))
    straight = matrices(free_body.attitude(t + 3.0, moments, omega0, q0))
    np.testing.assert_allclose(restarted, straight, rtol=0, atol=1e-12)


@settings(max_examples=200, deadline=None)
@given(moments=MOMENTS, omega0=OMEGA, q0=ATTITUDE)
def test_the_motion_obeys_eulers_equations(moments, omega0, q0):
    h = 1e-3
    t, weights = h * np.array([-2.0, -1.0, 1.0, 2.0]), np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * h)
    omega_rate = weights @ free_body.omega(t, moments, omega0)
    q_rate = weights @ free_body.attitude(t, moments, omega0, q0)
    torque_free = np.cross(np.multiply(moments, omega0), omega0) / moments
    w, x, y, z = q0
    left = np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])  # q (0, omega)
    # Five-point difference: h^4 |omega|^5 / 30 < 1e-11, and rounding eps / h < 1e-12.
    np.testing.assert_allclose(omega_rate, torque_free, rtol=0, atol=1e-10)
    np.testing.assert_allclose(q_rate, 0.5 * left @ omega0, rtol=0, atol=1e-10)


@settings(max_examples=200, deadline=None)
@given(moments=MOMENTS, omega0=OMEGA)
@example(moments=BODY, omega0=(0.0, 0.0, 0.0))
@example(moments=(1.0, 1.0, 1.0), omega0=(0.1, 0.2, 0.3))
def test_the_parameter_and_its_complement_make_one_for_any_body_and_start(moments, omega0):
    path = free_body.polhode(moments, omega0)
    assert path.m + path.m1 == pytest.approx(1.0, abs=16 * EPS)


@pytest.mark.parametrize("scale", [2.0**-500, 2.0**400])
@pytest.mark.parametrize("omega0", [(0.1, 1.0, -0.2), (1e-12, -1.0, 0.0), (1e-200, 1.0, 0.0)])
def test_slow_and_fast_motions_run_through_the_same_curve(scale, omega0):
    rates = scale * np.array(omega0)
    here, there = free_body.polhode(BODY, omega0), free_body.polhode(BODY, rates)
    assert there.m1 == here.m1
    assert there.flip_interval == pytest.approx(here.flip_interval / scale, rel=4 * EPS)
    np.testing.assert_allclose(free_body.omega(0.0, BODY, rates), rates, atol=1e-15 * scale)


@pytest.mark.parametrize("axes", list(itertools.permutations(range(3))))
def test_spin_exactly_about_any_axis_never_changes(axes):
    moments, t = np.array(BODY)[list(axes)], np.linspace(-50.0, 50.0, 11)
    for k in range(3):
        omega0 = 1.3 * np.eye(3)[k]
        np.testing.assert_array_equal(free_body.omega(t, moments, omega0), np.tile(omega0, (11, 1)))
        turned = matrices(free_body.attitude(t, moments, omega0, UPRIGHT))
        expected = Rotation.from_rotvec(np.outer(t, omega0)).as_matrix()
        np.testing.assert_allclose(turned, expected, rtol=0, atol=1e-13)


def test_a_body_at_rest_stays():
    t = np.linspace(0.0, 9.0, 4)
    for moments in (BODY, (1.0, 1.0, 2.0), (1.0, 1.0, 1.0)):
        assert not free_body.omega(t, moments, (0.0, -0.0, 0.0)).any()
        q = free_body.attitude(t, moments, (0.0, -0.0, 0.0), (0.6, 0.0, 0.8, 0.0))
        np.testing.assert_allclose(q, np.tile((0.6, 0.0, 0.8, 0.0), (4, 1)), rtol=0, atol=2 * EPS)


def test_exactly_on_the_separatrix_omega_is_sech_and_tanh():
    moments, omega0 = (2.0, 5.0, 6.0), (0.5, 1.0, 0.5)  # 2 T 5 = L^2 in binary
    path = free_body.polhode(moments, omega0)
    assert path.m1 == 0.0
    assert path.flip_interval == math.inf
    late = free_body.omega(200.0, moments, omega0)
    np.testing.assert_allclose(np.abs(late), (0.0, path.amplitudes[1], 0.0), rtol=0, atol=1e-15)


def test_the_quaternion_is_continuous():
    t = np.linspace(0.0, 120.0, 6001)
    q = free_body.attitude(t, BODY, (0.01, 1.0, 0.01), UPRIGHT)
    assert np.max(np.linalg.norm(np.diff(q, axis=0), axis=-1)) < 0.02


@pytest.mark.parametrize("shape", [(), (1,), (2, 3), (0,)])
def test_times_of_any_shape_are_taken(shape):
    assert free_body.omega(np.ones(shape), BODY, (1.0, 2.0, 3.0)).shape == (*shape, 3)
    assert free_body.attitude(np.ones(shape), BODY, (1.0, 2.0, 3.0), UPRIGHT).shape == (*shape, 4)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            (0.0, (1.0, -2.0, 3.0), (1.0, 0.0, 0.0), UPRIGHT),
            r"^moments\[1\] = -2.0; ",
        ),
        ((0.0, (1.0, 2.0), (1.0, 0.0, 0.0), UPRIGHT), "moments has shape"),
        ((0.0, BODY, (1.0, math.nan, 0.0), UPRIGHT), r"^omega0\[1\] = nan; expected"),
        ((0.0, BODY, (1.0, 0.0, 0.0), (1.0, 1.0, 0.0, 0.0)), "^q0 = .*; expected length 1"),
        ((math.inf, BODY, (1.0, 0.0, 0.0), UPRIGHT), "^t = inf; expected"),
    ],
)
def test_bad_input_is_refused_by_name(arguments, message):
    with pytest.raises(ValueError, match=message):
        free_body.attitude(*arguments)


@pytest.mark.parametrize("size", [1e-300, 1e-200, 1e-155, 1e155, 1e200, 1e300])
@pytest.mark.parametrize("heft", [1e-5, 1.0, 1e5])
@pytest.mark.parametrize("moments", [BODY, (1.0, 1.0, 2.0), (2.0, 2.0, 2.0)])
def test_slow_and_fast_motions_are_one_motion_in_other_units_of_time(moments, heft, size):
    omega0, q0 = np.array([0.3, 0.5, 0.2]), np.array([0.5, 0.5, -0.5, 0.5])
    inertia, t = heft * np.array(moments), np.linspace(0.0, 3.0, 4)
    expected = free_body.attitude(t, moments, omega0, q0)
    found = free_body.attitude(t / size, inertia, size * omega0, q0)
    # The units are no powers of two: some roundings of a phase of 3 radians.
    np.testing.assert_allclose(found, expected, rtol=0, atol=64 * EPS)
    rates = free_body.omega(t / size, inertia, size * omega0) / size
    np.testing.assert_allclose(rates, free_body.omega(t, moments, omega0), rtol=0, atol=64 * EPS)
    radius, angle = free_body.herpolhode(t / size, inertia, size * omega0)
    other = free_body.herpolhode(t, moments, omega0)
    np.testing.assert_allclose(radius / size, other[0], rtol=0, atol=64 * EPS)
    if other[0].max() > 64 * EPS:  # else it is a point, which has no angle
        np.testing.assert_allclose(angle, other[1], rtol=0, atol=256 * EPS)


def test_angular_momenta_and_phases_beyond_double_precision_are_refused():
    for inertia, rate in ((1e-200, 1e-200), (1e200, 1e200), (1.0, 1e-310)):
        with pytest.raises(ValueError, match=r"^omega0 = .*; expected an angular momentum within"):
            free_body.polhode(np.array(BODY) * inertia, (0.3 * rate, 0.5 * rate, 0.0))
    with pytest.raises(ValueError, match=r"^t = .*; expected times with a finite phase"):
        free_body.omega(1e200, BODY, (1e200, 0.5e200, 0.0))
