"""The coin held upright against reference cases, Newton's law with multipliers, a million steps."""

import math
from operator import itemgetter

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigid_envs.mechanics.laws import EPS
from rigid_envs.systems.upright_coin.system import UprightCoin
from tests.reference import cases
from tests.systems.measures import is_level, refined, sample_steps

MILLION = 10**6


def upright(phi, psi):
    """Rotation matrices Rz(phi) Rx(pi / 2) Rz(psi), shape (n, 3, 3)."""
    angles = np.stack([phi, np.full_like(phi, 0.5 * math.pi), psi], axis=-1)
    return Rotation.from_euler("ZXZ", angles).as_matrix()


@pytest.mark.parametrize("steps", [30, 300])
@pytest.mark.parametrize("case", cases("coin_upright"), ids=itemgetter("id"))
def test_a_coin_left_alone_rolls_the_reference_arc_exactly_at_any_step(case, steps):
    given, out = case["in"], case["out"]
    coin = UprightCoin(radius=given["a"])
    q = coin.attitude(given["phi0"], given["psi0"])
    rates = {"steer_rate": given["phid"], "roll_rate": given["psid"]}
    y = coin.state(q=q, contact=given["xy0"], **rates)
    t = np.concatenate([[0.0], given["t"]])
    fastest = max(abs(given["phid"]), abs(given["psid"]))
    dt = t[-1] / steps * min(1.0, 0.4 * steps / (t[-1] * max(fastest, 1.0)))
    motion = coin.simulate(y, t, max_step=dt)
    # Roundings, and what the polynomials of the turns miss: 0.009 x^10 of an angle, x half the
    # longest of the five turns of a step.
    missed = 0.009 * (0.33 * dt * fastest) ** 10 * fastest * t[-1]
    angle = 16.0 * EPS * (1.0 + fastest * t[-1] + t[-1] / dt) + missed
    place = np.stack([out["x"], out["y"]], axis=-1)
    way = given["a"] * (abs(given["psid"]) * t[-1] + 1.0)
    np.testing.assert_allclose(motion["contact"][1:], place, rtol=0, atol=way * angle)
    np.testing.assert_allclose(motion["R"][1:].reshape(-1, 9), out["R"], rtol=0, atol=angle)
    R = upright(np.array(out["phi"]), np.array(out["psi"]))
    np.testing.assert_allclose(motion["R"][1:], R, rtol=0, atol=angle)


@pytest.mark.parametrize("case", cases("coin_upright_torques"), ids=itemgetter("id"))
def test_a_coin_under_torques_agrees_with_the_reference(case):
    given, out = case["in"], case["out"]
    coin = UprightCoin(given["m"], given["a"], given["A"], given["C"])
    y = coin.state(steer_rate=given["phid0"], roll_rate=given["psid0"])
    u, t = (given["tau_phi"], given["tau_psi"]), np.concatenate([[0.0], given["t"]])
    motion = refined(coin, y, t, u)
    found = motion.trajectory
    place = np.stack([out["x"], out["y"]], axis=-1)
    atol = motion.tolerance("contact", coin.radius * motion.turned)
    np.testing.assert_allclose(found["contact"][1:], place, rtol=0, atol=atol)
    R = upright(np.array(out["phi"]), np.array(out["psi"]))
    atol = motion.tolerance("R", motion.turned)
    np.testing.assert_allclose(found["R"][1:], R, rtol=0, atol=atol)


def knife_edge(case):
    """The skate of mass 1 heads downhill at phi = pi; beta is I3 / (m r^2)."""
    given = case["in"]
    coin = UprightCoin(1.0, 1.0, 0.5, given["beta"], given["g"], given["alpha"])
    q = coin.attitude(math.pi + given["phi0"], 0.0)
    return coin, coin.state(q=q, steer_rate=given["omega"], roll_rate=given["v0"])


@pytest.mark.parametrize("case", cases("knife_edge_incline"), ids=itemgetter("id"))
def test_the_knife_edge_on_an_incline_agrees_with_the_reference(case):
    coin, y = knife_edge(case)
    out, t = case["out"], np.concatenate([[0.0], case["in"]["t"]])
    motion = refined(coin, y, t)
    found = motion.trajectory
    place = np.stack([out["x_downhill"], out["y_across"]], axis=-1)
    atol = motion.tolerance("contact", motion.turned)
    np.testing.assert_allclose(found["contact"][1:], place, rtol=0, atol=atol)
    atol = motion.tolerance("roll_rate", motion.rate)
    np.testing.assert_allclose(found["roll_rate"][1:], out["v"], rtol=0, atol=atol)
    heading = np.stack([np.cos(out["heading"]), np.sin(out["heading"])], axis=-1)
    atol = motion.tolerance("direction", motion.turned)
    np.testing.assert_allclose(found["direction"][1:], heading, rtol=0, atol=atol)


def test_a_million_steps_keep_the_circle_of_a_coin_left_alone():
    coin = UprightCoin()
    y = coin.state(contact=(0.5, 0.0), steer_rate=0.9, roll_rate=2.0)
    t = sample_steps(MILLION, 500) * 0.05
    motion = coin.simulate(y, t, max_step=0.05)
    np.testing.assert_array_equal(motion.y[:, 6:], np.tile(y[6:], (len(t), 1)))
    assert np.max(np.abs(np.linalg.norm(motion["q"], axis=-1) - 1.0)) <= 1e-14
    # It is as upright as on the first day, and its circle is where it was: 1e7 roundings.
    assert np.max(np.abs(motion["gamma"][:, 2])) <= 1e-11
    along, radius = motion["direction"], 2.0 / 0.9
    middle = motion["contact"] + radius * np.stack([-along[:, 1], along[:, 0]], axis=-1)
    np.testing.assert_allclose(middle, np.tile(middle[0], (len(t), 1)), rtol=0, atol=1e-10)


def test_a_million_steps_on_a_slope_keep_the_energy_and_the_height():
    coin = UprightCoin(slope=0.3)
    y = coin.state(q=coin.attitude(math.pi, 0.0), steer_rate=1.2)
    t = sample_steps(MILLION, 1500) * 0.04
    motion = coin.simulate(y, t, max_step=0.04)
    energy = motion.invariants["energy"] - motion.invariants["energy"][0]
    assert np.max(np.abs(energy)) <= 2e-7  # found: 7e-8
    assert is_level(t, energy, share=0.25)
    np.testing.assert_array_equal(motion["steer_rate"], 1.2)
    # Down by at most g sin(slope) / omega^2 / (1 + beta), for ever.
    lowest = 9.81 * math.sin(0.3) / 1.44 / 1.5
    assert np.max(motion["contact"][:, 0]) <= lowest * (1.0 + 1e-6)
    assert np.min(motion["contact"][:, 0]) >= -1e-5
