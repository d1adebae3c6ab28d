"""The coin held upright against reference cases, Newton's law with multipliers and closed forms."""

import math
from operator import itemgetter

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigid_envs.mechanics.laws import EPS, matrices
from rigid_envs.systems.rolling_disk.system import RollingDisk
from rigid_envs.systems.upright_coin.system import UprightCoin
from tests.reference import cases
from tests.verification.measures import is_level, orders, refined, sample_steps, slope, through
from tests.verification.multipliers import coin_on_slope, pack

SLOPE = UprightCoin(m=1.1, radius=0.6, I1=0.13, I3=0.2, g=9.5, slope=0.3)
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


@pytest.mark.parametrize("case", cases("knife_edge_incline"), ids=itemgetter("id"))
def test_the_knife_edge_drifts_across_the_incline_and_not_down(case):
    coin, _ = knife_edge(case)
    rate, drift = case["in"]["omega"], case["out"]["drift_velocity_across"]
    # Let go heading downhill: after each turn it is as far down as it was.
    period = 2.0 * math.pi / rate
    y = coin.state(q=coin.attitude(math.pi, 0.0), steer_rate=rate)
    motion = coin.simulate(y, np.arange(11) * period)
    # Default steps, 1e-11 per radian of the fastest rate, on a way of up to 100 m.
    expected = np.stack([0.0 * motion.t, drift * motion.t], axis=-1)
    np.testing.assert_allclose(motion["contact"], expected, rtol=0, atol=1e-8)
    np.testing.assert_allclose(motion["roll_rate"], 0.0, rtol=0, atol=1e-9)


def test_a_coin_that_is_not_steered_runs_down_on_a_parabola_exactly():
    y = SLOPE.state(q=SLOPE.attitude(math.pi - 0.4, 0.3), contact=(0.1, 0.2), roll_rate=0.7)
    steps, t = 16, 0.5
    end = SLOPE.advance(y, (0.0, 0.15), t, steps)
    inertia = 0.2 + 1.1 * 0.36
    gain = (0.15 + 1.1 * 9.5 * math.sin(0.3) * 0.6 * math.cos(0.4)) / inertia
    way = 0.6 * (0.7 * t + 0.5 * gain * t**2)
    along = np.array([math.cos(0.4), -math.sin(0.4)])
    roundings = 32.0 * EPS * steps
    np.testing.assert_allclose(end[4:6], [0.1, 0.2] + way * along, rtol=0, atol=roundings)
    assert end[7] == pytest.approx(0.7 + gain * t, abs=roundings)
    assert end[6] == 0.0


def rolling(seed):
    """A coin on the slope."""
    rng = np.random.default_rng([34, seed])
    q = SLOPE.attitude(*rng.uniform(-3.0, 3.0, 2))
    rates = {"steer_rate": rng.normal(), "roll_rate": 3.0 * rng.normal()}
    return SLOPE.state(q=q, contact=rng.normal(size=2), **rates), rng


def in_the_world(y):
    """State of the model with multipliers."""
    r = np.append(SLOPE.contact(y), SLOPE.radius)
    v = np.append(SLOPE.velocity(y), 0.0)
    return pack(r, v, matrices(y[:4]), SLOPE.omega_world(y))


@pytest.mark.parametrize("seed", range(3))
def test_random_torques_on_a_slope_agree_with_newtons_law(seed):
    y, rng = rolling(seed)
    u = rng.uniform(-0.3, 0.3, (20, 2))
    z = through(lambda z, u: coin_on_slope(SLOPE, z, u).rates, in_the_world(y), 0.1, u)
    motion = SLOPE.simulate(y, np.arange(21) * 0.1, u)
    # Default steps, 3e-11 per radian were found, of some ten. DOP853 adds 1e-12.
    np.testing.assert_allclose(motion["contact"][1:], z[:, :2], rtol=0, atol=1e-9)
    np.testing.assert_allclose(z[:, 2], SLOPE.radius, rtol=0, atol=1e-11)
    np.testing.assert_allclose(motion["velocity"][1:], z[:, 3:5], rtol=0, atol=1e-9)
    np.testing.assert_allclose(motion["R"][1:].reshape(-1, 9), z[:, 6:15], rtol=0, atol=1e-9)
    np.testing.assert_allclose(motion["omega_world"][1:], z[:, 15:18], rtol=0, atol=1e-9)
    held = [coin_on_slope(SLOPE, *at) for at in zip(z, u, strict=True)]
    force = SLOPE.contact_force(motion.y[1:], u)
    np.testing.assert_allclose(force, [h.contact for h in held], rtol=0, atol=1e-8)
    torque = SLOPE.upright_torque(motion.y[1:], u)
    np.testing.assert_allclose(torque, [h.torque[0] for h in held], rtol=0, atol=1e-8)


@pytest.mark.parametrize("seed", range(20))
def test_accelerations_and_forces_are_those_of_the_multipliers(seed):
    y, rng = rolling(100 + seed)
    u = rng.normal(size=2)
    held = coin_on_slope(SLOPE, in_the_world(y), u)
    # The conditioning of the ten equations, and sums of terms up to 100 N.
    np.testing.assert_allclose(SLOPE.contact_force(y, u), held.contact, rtol=0, atol=1e-11)
    assert SLOPE.upright_torque(y, u) == pytest.approx(held.torque[0], abs=1e-11)
    rates = SLOPE.rhs(y, u)
    axis, omega = matrices(y[:4])[:, 2], SLOPE.omega_world(y)
    # omega = phi' e_z + psi' e3, whose axis turns with omega.
    grown = rates[6] * np.array([0.0, 0.0, 1.0]) + rates[7] * axis + y[7] * np.cross(omega, axis)
    np.testing.assert_allclose(grown, held.rates[15:18], rtol=0, atol=1e-11)


@pytest.mark.parametrize("seed", range(10))
def test_the_torque_that_holds_the_coin_holds_a_free_disk(seed):
    coin = UprightCoin(m=1.1, radius=0.6, I1=0.13, I3=0.2, g=9.5)  # level
    disk = RollingDisk(m=1.1, radius=0.6, I1=0.13, I3=0.2, g=9.5)
    y, rng = rolling(200 + seed)
    u = rng.normal(size=2)
    R = matrices(y[:4])
    leaning = disk.state(q=y[:4], omega_body=R.T @ coin.omega_world(y), contact=y[4:6])
    torques = np.array([u[0], coin.upright_torque(y, u), u[1]])
    found, expected = disk.rhs(leaning, torques), coin.rhs(y, u)
    np.testing.assert_allclose(found[:4], expected[:4], rtol=0, atol=1e-14)
    np.testing.assert_allclose(found[7:], expected[4:6], rtol=0, atol=1e-14)
    n, axis = np.array([0.0, 0.0, 1.0]), R[:, 2]
    along = np.cross(axis, n)
    omega, turned = coin.omega_world(y), R @ found[4:7]
    # psi'' and phi'' as torqued, and no lean: omega' . l is what the turning l asks for.
    assert turned @ n == pytest.approx(expected[6], abs=1e-12)
    assert turned @ axis == pytest.approx(expected[7], abs=1e-12)
    leaned = turned @ along + omega @ np.cross(np.cross(omega, axis), n)
    assert leaned == pytest.approx(0.0, abs=1e-12)
    force = disk.contact_force(leaning, torques)
    np.testing.assert_allclose(force, coin.contact_force(y, u), rtol=0, atol=1e-12)


def test_a_disk_that_is_held_rolls_as_the_coin_does():
    coin, disk = UprightCoin(), RollingDisk()
    start = coin.state(steer_rate=0.8, roll_rate=5.0)
    R = matrices(start[:4])
    leaning = disk.state(q=start[:4], omega_body=R.T @ coin.omega_world(start))
    t = np.linspace(0.0, 3.0, 13)
    held = disk.simulate(leaning, t, (0.0, float(coin.upright_torque(start)), 0.0))
    motion = coin.simulate(start, t)
    # The lean that roundings make swings: the spin is far above the threshold.
    np.testing.assert_allclose(held["R"], motion["R"], rtol=0, atol=1e-11)
    np.testing.assert_allclose(held["contact"], motion["contact"], rtol=0, atol=1e-11)


@pytest.mark.parametrize("seed", range(5))
def test_the_energy_grows_by_the_power_of_the_torques(seed):
    y, rng = rolling(300 + seed)
    u, h = rng.normal(size=2), 2e-4
    near = np.array([SLOPE.advance(y, u, k * h) if k else y for k in (-2, -1, 0, 1, 2)])
    # The energy is some 10 J: roundings over h are 1e-11, h^4 / 30 times the fifth power 1e-12.
    assert slope(SLOPE.energy(near), h) == pytest.approx(u @ y[6:8], abs=1e-9)


def pushed(t):
    return (0.2 * math.cos(2.0 * t), 0.3 * math.sin(3.0 * t))


@pytest.mark.parametrize("u", [None, (0.2, -0.1), pushed])
def test_the_measured_order_is_four(u):
    y, _ = rolling(7)
    t = np.linspace(0.0, 1.6, 5)
    fine = SLOPE.simulate(y, t, u, max_step=0.001).y[-1]
    errors = [
        np.max(np.abs(SLOPE.simulate(y, t, u, max_step=step).y[-1] - fine))
        for step in (0.08, 0.04, 0.02)
    ]
    np.testing.assert_allclose(orders(errors), 4.0, rtol=0, atol=0.2)


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


def test_steering_and_rolling_to_and_fro_moves_the_coin_sideways():
    coin = UprightCoin(radius=0.7)

    def after(y, **rates):  # for a second
        for name, where in (("steer_rate", 6), ("roll_rate", 7)):
            y = y.copy()
            y[where] = rates.get(name, 0.0)
        return coin.simulate(y, [0.0, 1.0]).y[-1]

    y = start = coin.state(q=coin.attitude(0.3, 0.0))
    a, b = 0.2, 0.5
    for rates in ({"roll_rate": b}, {"steer_rate": a}, {"roll_rate": -b}, {"steer_rate": -a}):
        y = after(y, **rates)
    moved = (
        0.7 * b * np.array([math.cos(0.3 + a) - math.cos(0.3), math.sin(0.3 + a) - math.sin(0.3)])
    )
    np.testing.assert_allclose(y[4:6], moved, rtol=0, atol=1e-13)
    np.testing.assert_allclose(matrices(y[:4]), matrices(start[:4]), rtol=0, atol=1e-13)
