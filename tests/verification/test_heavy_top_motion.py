"""The motion of the heavy top against closed forms, reference cases and Newton's law."""

import math
from operator import itemgetter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_envs.mechanics.laws import EPS, integrate_newton, matrices
from rigid_envs.systems.heavy_top import closed_forms as heavy_top
from rigid_envs.systems.heavy_top.system import HeavyTop
from tests.reference import cases
from tests.verification.measures import leaning, orders

TOP = HeavyTop()
PLAIN = {"i_perp": 1.0, "i3": 0.5, "mgl": 1.0}  # the same top, as `analytic` knows it


def resolved(top, y, t, per_radian=512.0):
    """So many steps per radian of the fastest rate: truncation is (1/8)^4 of the default's."""
    rate = top.rate_bound(y, np.zeros(8), 0.0)
    return top.simulate(y, t, max_step=1.0 / (per_radian * rate)), per_radian * rate * t[-1]


def top_of(case):
    given_ = case["in"]
    top = HeavyTop(
        given_["Iperp"], given_["Iperp"], given_["I3"], given_["M"], given_["g"], given_["l"]
    )
    plain = {
        "i_perp": given_["Iperp"],
        "i3": given_["I3"],
        "mgl": given_["M"] * given_["g"] * given_["l"],
    }
    return top, plain


def precessing(top, theta, precession, omega3):
    """State with Euler angles (0, theta, 0), phi' as given, theta' = 0: omega2 = phi' sin theta."""
    return top.state(q=leaning(theta), omega_body=(0.0, precession * math.sin(theta), omega3))


@pytest.mark.parametrize("case", cases("heavy_top"), ids=itemgetter("id"))
def test_the_heavy_top_agrees_with_the_reference(case):
    top, _ = top_of(case)
    y = top.state(q=case["in"]["q0"], omega_body=case["in"]["w0"])
    trajectory, steps = resolved(top, y, np.concatenate([[0.0], case["t"]]))
    # As for the free body: roundings act like noise in the input, and their mean adds up in the
    # phase. (cond of some symmetric starts is 1e20: a push off the symmetry, which we never give.)
    cond = min(max(case["cond"][name] for name in ("w", "R")), 2e4)
    tolerance = EPS * (64.0 * cond + steps)
    size = max(1.0, float(np.linalg.norm(y[4:7])))
    R = matrices(trajectory["q"][1:]).reshape(-1, 9)
    np.testing.assert_allclose(R, case["out"]["R"], rtol=0, atol=tolerance)
    omega = trajectory["omega_body"][1:]
    np.testing.assert_allclose(omega, case["out"]["w"], rtol=0, atol=tolerance * size)


@pytest.mark.parametrize("case", cases("driven_space"), ids=itemgetter("id"))
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


RATE = st.floats(-2.0, 2.0).map(lambda x: round(x, 9))


@settings(max_examples=60)
@given(
    theta=st.floats(0.0, math.pi).map(lambda x: round(x, 12)),
    omega=st.tuples(RATE, RATE, st.floats(-8.0, 8.0).map(lambda x: round(x, 9))),
)
def test_the_tilt_of_any_start_follows_its_closed_form(theta, omega):
    y, t = TOP.state(q=leaning(theta), omega_body=omega), np.linspace(0.0, 6.0, 25)
    expected = heavy_top.tilt(t, omega, y[:4], **PLAIN)
    tilt = TOP.simulate(y, t)["tilt"]
    # Found: 7e-10 in the worst of 6000, most of them started beside one of the poles.
    np.testing.assert_allclose(tilt, expected, rtol=0, atol=1e-8)


def test_a_top_hanging_almost_at_rest_swings_like_a_pendulum():
    # It hardly moves, but gravity's own rate of 1 rad/s sets the step.
    start = TOP.state(q=leaning(math.pi - 1e-5))
    t = np.linspace(0.0, 50.0, 501)
    swing = TOP.simulate(start, t)["R"][:, 1, 2]
    # Harmonic to the square of the amplitude; the axis leans to -y at phi = 0.
    np.testing.assert_allclose(swing, -1e-5 * np.cos(t), rtol=0, atol=1e-13)
    with pytest.raises(ValueError, match="take n_substeps >= 10"):
        TOP.advance(start, None, 5.0)


@pytest.mark.parametrize("branch", [0, 1])
@pytest.mark.parametrize("theta", [0.3, 1.0, 1.4, 2.2])
def test_steady_precession_is_steady_at_the_rate_of_the_theory(theta, branch):
    omega3 = 7.0
    rate = float(heavy_top.steady_precession(theta, omega3, **PLAIN)[branch])
    t = np.linspace(0.0, 10.0, 21)
    trajectory = TOP.simulate(precessing(TOP, theta, rate, omega3), t)
    np.testing.assert_allclose(trajectory["tilt"], theta, rtol=0, atol=1e-9)
    # The axis goes round the vertical, phi = phi' t; at phi = 0 it leans towards -y.
    axis = trajectory["R"][:, :2, 2] / math.sin(theta)
    phi = rate * t
    np.testing.assert_allclose(axis, np.stack([np.sin(phi), -np.cos(phi)], -1), rtol=0, atol=1e-8)


@pytest.mark.parametrize("case", cases("steady_precession"), ids=itemgetter("id"))
def test_a_nudged_steady_precession_nutates_at_the_reference_frequency(case):
    top, _ = top_of(case)
    given_, out = case["in"], case["out"]
    for name in ("slow", "fast"):
        period = 2.0 * math.pi / out[f"nutation_frequency_{name}"]
        start = precessing(top, given_["theta"], out[f"phid_{name}"], given_["w3"])
        start[4] += 1e-5 / period  # a small theta'
        t = np.arange(5) * period / 4.0
        tilt = top.simulate(start, t)["tilt"] - given_["theta"]
        # Harmonic to the square of the amplitude: 0, a, 0, -a, 0 of theta' over the frequency.
        amplitude = 1e-5 / (2.0 * math.pi)
        expected = amplitude * np.array([0.0, 1.0, 0.0, -1.0, 0.0])
        np.testing.assert_allclose(tilt, expected, rtol=0, atol=1e-2 * amplitude)


@pytest.mark.parametrize("spin", [0.0, 1.0, 3.0, 3.9])
def test_below_the_threshold_an_upright_top_falls_at_the_rate_of_the_theory(spin):
    growing = heavy_top.sleeping_exponents(spin, **PLAIN)[0]
    # z = theta exp(i phi) = 1e-8 exp(s t): theta' / theta and phi' are the parts of s.
    theta = 1e-8
    y = precessing(TOP, theta, growing.imag, spin)
    y[4] = theta * growing.real
    t = np.linspace(0.0, 4.0, 9) / max(growing.real, 0.2)
    trajectory = TOP.simulate(y, t)
    tilt = trajectory["tilt"]
    np.testing.assert_allclose(np.log(tilt / theta), growing.real * t, rtol=0, atol=1e-6)
    axis = trajectory["R"][:, :, 2] / tilt[:, None]
    z = 1j * (axis[:, 0] + 1j * axis[:, 1])  # phi is counted from -y
    np.testing.assert_allclose(z, np.exp(1j * growing.imag * t), rtol=0, atol=1e-6)


@pytest.mark.parametrize("spin", [4.1, 6.0, 20.0])
def test_above_the_threshold_an_upright_top_sleeps(spin):
    y = TOP.state(q=leaning(1e-3), omega_body=(1e-3, 0.0, spin))
    slow, fast = heavy_top.sleeping_exponents(spin, **PLAIN)
    # Two circles in the plane of z, their radii from z and z' at the start: at most their sum.
    gap = fast.imag - slow.imag
    largest = 1e-3 * (fast.imag + 1.0 + slow.imag + 1.0) / gap
    assert np.max(TOP.simulate(y, np.linspace(0.0, 100.0, 1001))["tilt"]) <= 1.01 * largest


@pytest.mark.parametrize("case", cases("top_homoclinic"), ids=itemgetter("id"))
def test_the_falling_upright_top_follows_the_homoclinic_motion(case):
    top, plain = top_of(case)
    out, omega3 = case["out"], case["in"]["w3"]
    theta = out["theta_max"]
    # p_phi = p_psi: phi' = I3 omega3 (1 - cos theta) / (I sin^2 theta).
    precession = plain["i3"] * omega3 / plain["i_perp"] / (1.0 + math.cos(theta))
    y = precessing(top, theta, precession, omega3)
    t = np.union1d([0.0, out["t"]], np.linspace(0.3, 5.1, 9) / out["growth_rate"])
    tilt = top.simulate(y, t)["tilt"]
    # On the way up to the unstable upright state an error grows by exp(5).
    expected = heavy_top.homoclinic_tilt(t, omega3, **plain)
    np.testing.assert_allclose(tilt, expected, rtol=0, atol=1e-8)
    k = int(np.flatnonzero(t == out["t"])[0])
    assert tilt[k] == pytest.approx(out["theta_at_t_after_theta_max"], abs=1e-9)
    back = top.simulate(y, -t[: k + 1])["tilt"]  # and it came from there
    np.testing.assert_allclose(back, expected[: k + 1], rtol=0, atol=1e-9)


def all_inputs(t):
    body = (0.3 * np.cos(2.0 * t), -0.2 * np.sin(t), 0.1)
    world = (0.2, 0.1 * np.sin(3.0 * t), -0.1)
    return np.array([*body, *world, np.cos(t), 0.3])


@pytest.mark.parametrize("u", [None, (0.3, -0.2, 0.1, 0.1, 0.2, -0.1, 0.3, 0.2), all_inputs])
def test_the_measured_order_is_four(u):
    y = TOP.state(q=leaning(0.5), omega_body=(0.3, -0.2, 2.0), pivot_velocity=(0.1, 0.2))
    t = np.linspace(0.0, 6.4, 17)
    fine = TOP.simulate(y, t, u, max_step=0.0016).y[-1]
    errors = [
        np.max(np.abs(TOP.simulate(y, t, u, max_step=step).y[-1] - fine))
        for step in (0.08, 0.04, 0.02, 0.01, 0.005)
    ]
    np.testing.assert_allclose(orders(errors), 4.0, rtol=0, atol=0.2)


def torque(top):
    """Torque about the pivot in world axes: of weight and inertial force at the centre of mass."""

    def total(R, u):
        force = top.m * np.array([-u[6], -u[7], -top.g])
        return R @ u[:3] + u[3:6] + np.cross(top.ell * R[:, 2], force)

    return total


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "top",
    [TOP, HeavyTop(1.3, 1.1, 0.6, m=0.8, g=9.5, ell=0.13)],
    ids=["symmetric", "asymmetric"],
)
def test_two_hundred_random_inputs_agree_with_newtons_law(top, seed):
    rng = np.random.default_rng([10, seed])
    y = top.state(q=leaning(rng.uniform(0.0, 0.2)), omega_body=(0.1, 0.1, rng.uniform(1.2, 3.0)))
    inputs = rng.uniform(-1.0, 1.0, (200, 8)) * ([0.1] * 6 + [1.0] * 2)
    R, omega = integrate_newton(top.moments, matrices(y[:4]), y[4:7], 0.05, inputs, torque(top))
    # Beside the unstable upright state errors grow by up to exp(10) in 10 s.
    trajectory = top.simulate(y, np.arange(201) * 0.05, inputs, max_step=0.0125)
    np.testing.assert_allclose(trajectory["omega_body"][1:], omega, rtol=0, atol=1e-8)
    np.testing.assert_allclose(trajectory["R"][1:], R, rtol=0, atol=1e-8)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    # Found at 0.05 s, the control period: 4e-8 in the median, 1.2e-7 in the worst run.
    ("dt", "bar"),
    [(0.025, 1e-7), (0.05, 5e-7)],
)
def test_two_hundred_random_world_torques_near_upright_agree_with_newtons_law(dt, bar, seed):
    rng = np.random.default_rng([11, seed])
    spin = TOP.critical_spin * rng.uniform(0.3, 0.95)
    y = TOP.state(q=leaning(rng.uniform(0.0, 0.2)), omega_body=(0.0, 0.0, spin))
    angle, radius = rng.uniform(0.0, 2.0 * np.pi, 200), 0.3 * np.sqrt(rng.random(200))
    inputs = np.zeros((200, 8))
    inputs[:, 3], inputs[:, 4] = radius * np.cos(angle), radius * np.sin(angle)
    R, omega = integrate_newton(TOP.moments, matrices(y[:4]), y[4:7], dt, inputs, torque(TOP))
    trajectory = TOP.simulate(y, np.arange(201) * dt, inputs, max_step=dt)
    np.testing.assert_allclose(trajectory["omega_body"][1:], omega, rtol=0, atol=bar)
    np.testing.assert_allclose(trajectory["R"][1:], R, rtol=0, atol=bar)
