"""Motion of the upright coin: closed forms against references, simulations against both."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import fresnel

from rigid_envs.systems.upright_coin import closed_forms as upright_coin
from rigid_envs.systems.upright_coin.system import UprightCoin
from tests.reference import cases, every
from tests.systems.measures import assert_energy_stays, million_steps

# Closed forms of the upright coin against reference cases, Fresnel and an integrator.


EPS = np.finfo(np.float64).eps
COIN = {"m": 0.7, "radius": 0.3, "i_perp": 0.02, "i3": 0.04}


@every(cases("coin_upright"))
def test_rolling_and_steering_at_constant_rates_agrees_with_the_reference(case):
    given, out = case["in"], case["out"]
    motion = upright_coin.roll_coin(
        given["t"],
        radius=given["a"],
        phi_rate=given["phid"],
        psi_rate=given["psid"],
        phi=given["phi0"],
        psi=given["psi0"],
        place=given["xy0"],
    )
    # Angles of up to 50 radians are rounded, and the centre swings with them.
    turned = float(max(np.max(np.abs(motion.phi)), np.max(np.abs(motion.psi))))
    expected = np.stack([out["x"], out["y"]], axis=-1)
    tolerance = 4 * EPS * max(turned, np.max(np.abs(expected)))
    np.testing.assert_allclose(motion.place, expected, rtol=0, atol=tolerance)
    np.testing.assert_allclose(motion.phi, out["phi"], rtol=0, atol=2 * EPS * turned)
    np.testing.assert_allclose(motion.psi, out["psi"], rtol=0, atol=2 * EPS * turned)
    attitude = Rotation.from_quat(motion.attitude, scalar_first=True).as_matrix()
    rows = np.array(out["R"]).reshape(-1, 3, 3)
    np.testing.assert_allclose(attitude, rows, rtol=0, atol=4 * EPS * turned)
    if out["radius"] not in ("inf", 0.0):
        start = np.array(given["xy0"])
        heading = np.array([math.cos(given["phi0"]), math.sin(given["phi0"])])
        arm = -given["a"] * given["psid"] / given["phid"] * np.array([-heading[1], heading[0]])
        distances = np.linalg.norm(motion.place - (start + arm), axis=-1)
        np.testing.assert_allclose(distances, out["radius"], rtol=0, atol=tolerance)


@every(cases("coin_upright_torques"))
def test_the_driven_coin_agrees_with_the_reference(case):
    given, out = case["in"], case["out"]
    motion = upright_coin.drive_coin(
        given["t"],
        m=given["m"],
        radius=given["a"],
        i_perp=given["A"],
        i3=given["C"],
        torques=(given["tau_phi"], given["tau_psi"]),
        phi_rate=given["phid0"],
        psi_rate=given["psid0"],
    )
    # Sums of a few dozen terms, all of them below the sum of their sizes.
    tolerance = 16 * EPS * np.max(np.abs(out["psi"]))
    for name, value in (("x", motion.place[:, 0]), ("y", motion.place[:, 1])):
        np.testing.assert_allclose(value, out[name], rtol=0, atol=tolerance)
    np.testing.assert_allclose(motion.phi, out["phi"], rtol=0, atol=tolerance)
    np.testing.assert_allclose(motion.psi, out["psi"], rtol=0, atol=tolerance)


@pytest.mark.parametrize("steering", [0.03, -0.2])
def test_the_driven_coin_draws_fresnels_integrals(steering):
    # From phi' = 0 and with constant psi': a clothoid.
    t = np.linspace(-4.0, 9.0, 14)
    motion = upright_coin.drive_coin(t, torques=(steering, 0.0), psi_rate=2.0, **COIN)
    scale = math.sqrt(math.pi * COIN["i_perp"] / abs(steering))
    sine, cosine = fresnel(t / scale)
    expected = -0.6 * scale * np.stack([cosine, math.copysign(1.0, steering) * sine], axis=-1)
    # Headings of up to 405 radians are rounded, along a way of up to 5.4 m.
    np.testing.assert_allclose(motion.place, expected, rtol=0, atol=405 * 5.4 * EPS)


def test_without_torques_the_driven_coin_is_the_free_one():
    rates = {"phi_rate": 1.7, "psi_rate": -4.0, "phi": 0.2, "psi": -0.3, "place": (1.0, 2.0)}
    t = np.linspace(-20.0, 20.0, 9)
    driven = upright_coin.drive_coin(t, torques=(0.0, 0.0), **rates, **COIN)
    free = upright_coin.roll_coin(t, radius=COIN["radius"], **rates)
    for a, b in zip(driven, free, strict=True):
        # Headings of up to 34 radians are rounded, along a way of up to 24 m.
        np.testing.assert_allclose(a, b, rtol=0, atol=34 * 24 * EPS)


@every(cases("knife_edge_incline"))
def test_the_knife_edge_on_an_incline_agrees_with_the_reference(case):
    given, out = case["in"], case["out"]
    plane = {"slope": given["alpha"], "beta": given["beta"], "g": given["g"]}
    steer = {"steering_rate": given["omega"]}
    motion = upright_coin.steer_on_incline(
        given["t"], speed=given["v0"], heading=given["phi0"], **plane, **steer
    )
    # Headings of up to 12 radians and places of some metres.
    tolerance = 32 * EPS * np.max(np.abs(out["y_across"]))
    np.testing.assert_allclose(motion.place[:, 0], out["x_downhill"], rtol=0, atol=tolerance)
    np.testing.assert_allclose(motion.place[:, 1], out["y_across"], rtol=0, atol=tolerance)
    np.testing.assert_allclose(motion.speed, out["v"], rtol=0, atol=tolerance)
    np.testing.assert_allclose(motion.heading, out["heading"], rtol=0, atol=16 * EPS)
    drift = upright_coin.drift_across_slope(**plane, **steer)
    np.testing.assert_allclose(drift, out["drift_velocity_across"], rtol=8 * EPS)


def test_without_steering_it_slides_straight_and_steering_little_changes_little():
    plane = {"slope": 0.3, "beta": 0.0, "g": 10.0, "speed": 0.4, "heading": 0.6}
    t = np.linspace(0.0, 3.0, 4)
    straight = upright_coin.steer_on_incline(t, steering_rate=0.0, **plane)
    along = 0.4 * t + 0.5 * 10.0 * math.sin(0.3) * math.cos(0.6) * t * t
    expected = along[:, None] * np.array([math.cos(0.6), math.sin(0.6)])
    np.testing.assert_allclose(straight.place, expected, rtol=8 * EPS)
    bent = upright_coin.steer_on_incline(t, steering_rate=1e-150, **plane)
    np.testing.assert_allclose(bent.place, straight.place, rtol=8 * EPS)


# The coin held upright against reference cases, Newton's law with multipliers, a million steps.


@pytest.mark.long
def test_a_million_steps_keep_the_circle_of_a_coin_left_alone():
    coin = UprightCoin()
    y = coin.state(contact=(0.5, 0.0), steer_rate=0.9, roll_rate=2.0)
    motion = million_steps(coin, y, 0.05, 500)
    t = motion.t
    np.testing.assert_array_equal(motion.y[:, 6:], np.tile(y[6:], (len(t), 1)))
    assert np.max(np.abs(np.linalg.norm(motion["q"], axis=-1) - 1.0)) <= 1e-14
    # It is as upright as on the first day, and its circle is where it was: 1e7 roundings.
    assert np.max(np.abs(motion["gamma"][:, 2])) <= 1e-11
    along, radius = motion["direction"], 2.0 / 0.9
    middle = motion["contact"] + radius * np.stack([-along[:, 1], along[:, 0]], axis=-1)
    np.testing.assert_allclose(middle, np.tile(middle[0], (len(t), 1)), rtol=0, atol=1e-10)


@pytest.mark.long
def test_a_million_steps_on_a_slope_keep_the_energy_and_the_height():
    coin = UprightCoin(slope=0.3)
    y = coin.state(q=coin.attitude(math.pi, 0.0), steer_rate=1.2)
    motion = million_steps(coin, y, 0.04, 1500)
    assert_energy_stays(motion, 2e-7, size=1.0, share=0.25)  # found: 7e-8
    np.testing.assert_array_equal(motion["steer_rate"], 1.2)
    # Down by at most g sin(slope) / omega^2 / (1 + beta), for ever.
    lowest = 9.81 * math.sin(0.3) / 1.44 / 1.5
    assert np.max(motion["contact"][:, 0]) <= lowest * (1.0 + 1e-6)
    assert np.min(motion["contact"][:, 0]) >= -1e-5
