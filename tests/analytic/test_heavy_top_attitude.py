import math
from operator import itemgetter

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.special import ellipj

from rigid_envs.systems.free_body import closed_forms as free_body
from rigid_envs.systems.heavy_top import closed_forms as heavy_top
from tests.reference import cases

EPS = np.finfo(np.float64).eps
TOP = {"i_perp": 1.0, "i3": 0.5, "mgl": 1.0}  # sleeps from 4 rad/s on
UPRIGHT, HANGING = (1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0)


def top(case):
    given_ = case["in"]
    mgl = given_["M"] * given_["g"] * given_["l"]
    return {"i_perp": given_["Iperp"], "i3": given_["I3"], "mgl": mgl}


def matrices(q):
    return Rotation.from_quat(q, scalar_first=True).as_matrix()


def from_euler(theta, phi, psi):
    """Quaternion of z-x-z Euler angles."""
    half = np.array([0.5 * theta, 0.5 * (phi + psi), 0.5 * (phi - psi)])
    (cos, _, _), (sin, _, _) = np.cos(half), np.sin(half)
    parts = (cos * np.cos(half[1]), sin * np.cos(half[2]), sin * np.sin(half[2]))
    return np.stack([*parts, cos * np.sin(half[1])], axis=-1)


@pytest.mark.parametrize("case", cases("heavy_top"), ids=itemgetter("id"))
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


@given(body=BODY, q0=START, omega0=OMEGA)
@example(body=TOP, q0=np.array(UPRIGHT), omega0=(0.0, 0.0, 4.0))  # u3 = u1: nothing moves
@example(body=TOP, q0=np.array(HANGING), omega0=(2.0, 0.0, 0.0))  # just up to the upper vertical
@example(body=TOP, q0=np.array(HANGING), omega0=(0.0, 0.0, 0.0))
def test_energy_and_momenta_stay_for_any_top_and_start(body, q0, omega0):
    t = np.array([0.0, -3.3, 0.7, 2.0, 9.1])
    q, omega = (solve(t, omega0, q0, **body) for solve in (heavy_top.attitude, heavy_top.omega))
    assert np.all(np.abs(np.linalg.norm(q, axis=-1) - 1.0) <= 2 * EPS)
    np.testing.assert_allclose(q[0], q0, rtol=0, atol=8 * EPS)
    size = 1.0 + float(np.linalg.norm(omega0))
    np.testing.assert_allclose(omega[0], omega0, rtol=0, atol=16 * EPS * size)
    gamma = in_body(q, [0.0, 0.0, 1.0])
    momentum = omega * [body["i_perp"], body["i_perp"], body["i3"]]
    energy = 0.5 * np.sum(momentum * omega, axis=-1) + body["mgl"] * gamma[..., 2]
    vertical = np.sum(momentum * gamma, axis=-1)
    constants = heavy_top.invariants(omega0, q0, **body)
    # 100 eps: a phase of at most 100 radians is rounded once, and all else a few times.
    np.testing.assert_allclose(energy, constants.energy, rtol=0, atol=100 * EPS * 2.0 * size**2)
    np.testing.assert_allclose(vertical, constants.p_phi, rtol=0, atol=100 * EPS * 2.0 * size)
    assert constants.p_psi == pytest.approx(momentum[0, 2], abs=4 * EPS * size)
    assert np.all(omega[:, 2] == omega0[2])


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
    w, x, y, z = q
    left = np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])  # q (0, omega)
    # Five-point difference: h^4 / 30 times a fifth derivative, rate^5, and rounding eps / h; the
    # rates are those of omega, of the pendulum and of I3 omega3 / I.
    rate = 3.0 + float(np.linalg.norm(omega)) + abs(omega0[2]) * body["i3"] / body["i_perp"]
    tolerance = h**4 / 30.0 * rate**5 + 100.0 * EPS * rate / h
    np.testing.assert_allclose(q_rate, 0.5 * left @ omega, rtol=0, atol=tolerance)
    np.testing.assert_allclose(omega_rate, expected, rtol=0, atol=rate * tolerance)


@given(body=BODY, q0=START, omega0=OMEGA)
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


@pytest.mark.parametrize("speed", [1e-3, 1.0, 1.9, 2.1, 5.0])
def test_without_spin_the_top_is_a_pendulum(speed):
    # Hanging, pushed about e1: an angle from below of 2 arcsin(k sn t), or past the top 2 am.
    t, k = np.linspace(-9.0, 20.0, 59), 0.5 * speed
    if k < 1.0:
        sn, _, dn, _ = ellipj(t, k * k)
        half = np.stack([dn, k * sn])  # cosine and sine of half the angle
    else:
        sn, cn, _, _ = ellipj(k * t, 1.0 / (k * k))
        half = np.stack([cn, sn])
    q = heavy_top.attitude(t, (speed, 0.0, 0.0), HANGING, **TOP)
    # HANGING is half a turn about e1, on top of which comes the swing about the same axis.
    zero = np.zeros_like(t)
    expected = np.stack([-half[1], half[0], zero, zero], axis=-1)
    np.testing.assert_allclose(q, expected, rtol=0, atol=1e-13)


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


@pytest.mark.parametrize("branch", [0, 1])
@pytest.mark.parametrize("theta", [1e-6, 0.4, 1.3, 2.2, 3.1])
def test_steady_precession_turns_all_angles_at_constant_rates(theta, branch):
    omega3, t = 7.0, np.linspace(0.0, 20.0, 11)
    rate = float(heavy_top.steady_precession(theta, omega3, **TOP)[branch])
    omega0 = (0.0, rate * math.sin(theta), omega3)
    q = heavy_top.attitude(t, omega0, from_euler(theta, 0.0, 0.0), **TOP)
    spin = omega3 - rate * math.cos(theta)
    expected = from_euler(np.full_like(t, theta), rate * t, spin * t)
    # The start is the steady one to a rounding; phases of up to 20 (abs(rate) + abs(spin)).
    size = 1.0 + 20.0 * (abs(rate) + abs(spin))
    np.testing.assert_allclose(matrices(q), matrices(expected), rtol=0, atol=8 * EPS * size)


@pytest.mark.parametrize("spin", [1.0, -2.5, 3.9])
def test_the_homoclinic_top_turns_up_to_the_vertical_and_stays(spin):
    # From its largest tilt; p_phi = p_psi makes phi' = (I3 omega3 / I) / (1 + cos theta).
    theta = float(heavy_top.homoclinic_tilt(0.0, spin, **TOP))
    rate = 0.5 * spin / (1.0 + math.cos(theta))
    omega0, q0 = (0.0, rate * math.sin(theta), spin), from_euler(theta, 0.0, 0.0)
    growth = heavy_top.sleeping_exponents(spin, **TOP)[0].real
    t = np.linspace(-8.0, 8.0, 33) / growth
    tilt, phi, psi = heavy_top.euler_angles(t, omega0, q0, **TOP)
    expected = heavy_top.homoclinic_tilt(t, spin, **TOP)
    # Errors of the start grow by exp(8) on the way up.
    tolerance = math.exp(8.0) * 8 * EPS
    np.testing.assert_allclose(tilt, expected, rtol=0, atol=tolerance)
    # The integral of phi' over that tilt: a t / 2 + arctan(2 lambda / a tanh(lambda t)).
    turned = 0.25 * spin * t + np.arctan(4.0 * growth / spin * np.tanh(growth * t))
    np.testing.assert_allclose(phi, turned, rtol=0, atol=1e3 * tolerance)
    np.testing.assert_allclose(phi + psi, phi + psi[16] + (psi - psi[16]), rtol=0, atol=1e-15)


def test_without_weight_the_top_is_free():
    body, q0 = {"i_perp": 1.0, "i3": 0.6}, np.array([0.5, 0.1, -0.7, 0.5])
    omega0, t = (0.3, -0.4, 2.0), np.linspace(-5.0, 15.0, 11)
    moments = (1.0, 1.0, 0.6)
    for mgl in (1e-20, 1e-60):
        q = heavy_top.attitude(t, omega0, q0, mgl=mgl, **body)
        omega = heavy_top.omega(t, omega0, q0, mgl=mgl, **body)
        free = free_body.attitude(t, moments, omega0, q0)
        np.testing.assert_allclose(q, free, rtol=0, atol=100 * EPS)
        np.testing.assert_allclose(
            omega, free_body.omega(t, moments, omega0), rtol=0, atol=100 * EPS
        )


@given(body=BODY, q0=START, omega0=OMEGA, t=st.floats(-3.0, 3.0))
def test_restarting_midway_continues_the_same_motion(body, q0, omega0, t):
    middle = (
        heavy_top.omega(t, omega0, q0, **body),
        heavy_top.attitude(t, omega0, q0, **body),
    )
    restarted = heavy_top.attitude(2.0, *middle, **body)
    straight = heavy_top.attitude(t + 2.0, omega0, q0, **body)
    # A rounding grows at most by the Lyapunov rate sqrt(mgl / I) <= 2 / s: exp(4) in 2 s, and
    # phases of at most 100 radians are rounded.
    tolerance = 1000.0 * EPS * math.exp(4.0) / 8.0
    np.testing.assert_allclose(matrices(restarted), matrices(straight), rtol=0, atol=tolerance)


@pytest.mark.parametrize("shape", [(), (1,), (2, 3), (0,)])
@pytest.mark.parametrize("start", [UPRIGHT, HANGING, (0.8, 0.6, 0.0, 0.0)])
def test_times_of_any_shape_are_taken(shape, start):
    t, omega0 = np.ones(shape), (0.1, 0.2, 3.0)
    assert heavy_top.attitude(t, omega0, start, **TOP).shape == (*shape, 4)
    assert heavy_top.omega(t, omega0, start, **TOP).shape == (*shape, 3)
    for angle in heavy_top.euler_angles(t, omega0, start, **TOP):
        assert angle.shape == shape


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((math.inf, (0.0, 0.0, 1.0), UPRIGHT), "^t = inf; expected"),
        ((0.0, (0.0, math.nan, 1.0), UPRIGHT), r"^omega0\[1\] = nan; expected"),
        ((0.0, (0.0, 0.0), UPRIGHT), "omega0 has shape"),
        ((0.0, (0.0, 0.0, 1.0), (1.0, 1.0, 0.0, 0.0)), r"^q0 = .*; expected length 1"),
    ],
)
def test_bad_input_is_refused_by_name(arguments, message):
    for solve in (heavy_top.attitude, heavy_top.omega, heavy_top.euler_angles):
        with pytest.raises(ValueError, match=message):
            solve(*arguments, **TOP)
