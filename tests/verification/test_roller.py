"""Wheels, spheres and hoops on inclines and in valleys, against closed forms and multipliers."""

import math
from operator import itemgetter

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from rigid_envs.mechanics.laws import EPS
from rigid_envs.systems.roller.system import Roller
from rigid_envs.systems.upright_coin.system import UprightCoin
from tests.reference import cases
from tests.verification.measures import is_level, orders, sample_steps, slope, through
from tests.verification.multipliers import pack, roller_in_valley

VALLEY = Roller(m=1.1, radius=0.3, beta=0.45, g=9.5, slope=0.4, curvature=0.5)
MILLION = 10**6
HILL = Roller(m=1.1, radius=0.3, beta=0.45, g=9.5, slope=0.1, curvature=-0.2)


@pytest.mark.parametrize("case", cases("incline"), ids=itemgetter("id"))
def test_a_body_let_go_on_an_incline_agrees_with_the_reference(case):
    given, out = case["in"], case["out"]
    body = Roller(m=1.7, radius=given["R"], beta=given["beta"], g=given["g"], slope=given["alpha"])
    y = body.state()
    assert body.rhs(y)[1] == pytest.approx(out["acceleration"], rel=4 * EPS)
    # In a single step of two to nine seconds: on an incline every step is exact.
    end = body.advance(y, None, out["time"])
    assert end[1] == pytest.approx(out["v"], rel=32 * EPS)
    assert body.place(end)[1] == pytest.approx(-given["h"], rel=32 * EPS)
    assert end[1] / body.radius == pytest.approx(out["omega"], rel=32 * EPS)
    assert body.turn(end) / (2.0 * math.pi) == pytest.approx(out["turns"], rel=32 * EPS)
    friction, normal = body.contact_force(y)
    share = -friction / (1.7 * given["g"])  # uphill, against the way
    assert share == pytest.approx(out["friction_over_mg"], rel=8 * EPS, abs=0.0)
    assert normal == pytest.approx(1.7 * given["g"] * math.cos(given["alpha"]), rel=8 * EPS)
    assert body.needed_friction(y) == pytest.approx(out["mu_min"], rel=8 * EPS, abs=0.0)


def test_the_race_is_won_by_beta_whatever_mass_and_radius():
    rng = np.random.default_rng(1)
    ways = []
    for beta in (0.0, 0.4, 0.5, 2.0 / 3.0, 1.0):  # block, sphere, cylinder, hollow sphere, hoop
        runners = [Roller(*rng.uniform(0.1, 5.0, 2), beta=beta, slope=0.3) for _ in range(4)]
        way = [float(runner.simulate(runner.state(), [0.0, 2.0]).y[-1, 0]) for runner in runners]
        np.testing.assert_allclose(way, way[0], rtol=16 * EPS)
        ways.append(way[0])
    # s = g sin(alpha) t^2 / 2 / (1 + beta).
    expected = 2.0 * 9.81 * math.sin(0.3) / (1.0 + np.array([0.0, 0.4, 0.5, 2.0 / 3.0, 1.0]))
    np.testing.assert_allclose(ways, expected, rtol=16 * EPS)


@pytest.mark.parametrize("case", cases("wheel"), ids=itemgetter("id"))
def test_a_point_of_the_rim_runs_on_the_reference_cycloid(case):
    given, out = case["in"], case["out"]
    r, rate, time = given["R"], given["omega"], given["T"]
    wheel = Roller(radius=r, beta=1.0)
    y = wheel.advance(wheel.state(velocity=r * rate), None, time)
    assert y[1] == pytest.approx(out["v"], rel=EPS)
    assert y[0] == pytest.approx(out["x_centre"], rel=4 * EPS)
    turn = wheel.turn(y)
    rim = (y[0] - r * math.sin(turn), r - r * math.cos(turn))
    np.testing.assert_allclose(rim, out["rim_point_started_at_contact"], rtol=0, atol=8 * EPS)
    # The same by the coin, whose attitude carries the point. It heads for -x.
    coin = UprightCoin(radius=r)
    start = coin.state(roll_rate=-rate)
    end = coin.simulate(start, [0.0, time])
    mark = end["R"][0].T @ [0.0, 0.0, -r]
    place = np.append(end["contact"][-1], r) + end["R"][-1] @ mark
    np.testing.assert_allclose(place[[0, 2]], rim, rtol=0, atol=1e-13)
    # One arch, 8 r long, as a polygon: its error is of second order in the side.
    turns = np.linspace(0.0, 2.0 * math.pi, 2001)
    points = r * np.stack([turns - np.sin(turns), 1.0 - np.cos(turns)], axis=-1)
    length = np.sum(np.linalg.norm(np.diff(points, axis=0), axis=-1))
    assert length == pytest.approx(out["cycloid_arch_length"], rel=1e-6)


@pytest.mark.parametrize("descent", [0.2, 1.5, 3.0])
@pytest.mark.parametrize("beta", [0.0, 0.4, 1.0])
def test_in_a_valley_a_body_swings_like_a_pendulum_of_jacobi(beta, descent):
    body = Roller(beta=beta, radius=0.2, curvature=0.6, slope=descent)
    rate = math.sqrt(0.6 * 9.81 / (1.0 + beta))
    k = math.sin(0.5 * descent)
    period = 4.0 * ellipk(k * k) / rate
    t = np.linspace(0.0, 2.0 * period, 41)
    # Let go at rest: sin(descent / 2) = k cd(rate t | k^2).
    _, cn, dn, _ = ellipj(rate * t, k * k)
    expected = 2.0 * np.arcsin(k * cn / dn)
    motion = body.simulate(body.state(), t)
    # Default steps, 1e-11 per radian of some 40; where it nearly stands on its head errors grow by
    # the time that it hesitates, exp(3).
    np.testing.assert_allclose(motion["descent"], expected, rtol=0, atol=1e-9)


def swinging(system, seed):
    rng = np.random.default_rng([35, seed])
    return system.state(arc_length=rng.uniform(-0.5, 0.5), velocity=rng.normal()), rng


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("system", [VALLEY, HILL], ids=["valley", "hill"])
def test_random_forces_agree_with_newtons_law(system, seed):
    y, rng = swinging(system, seed)
    u = rng.uniform((-3.0, 0.0), (3.0, 0.6), (20, 2))
    (x, z), descent = system.place(y), float(system.descent(y))
    # The middle of the circle lies over s = 0 along the normal there.
    middle = np.array([math.sin(system.slope), 0.0, math.cos(system.slope)]) / system.curvature
    v = y[1] * np.array([math.cos(descent), 0.0, -math.sin(descent)])
    omega = np.array([0.0, y[1] / system.radius, 0.0])
    start = pack(np.array([x, 0.0, z]), v, np.eye(3), omega, middle)
    ends = through(lambda z, u: roller_in_valley(system, z, u).rates, start, 0.1, u)
    motion = system.simulate(y, np.arange(21) * 0.1, u)
    # Default steps, 1e-11 per radian of some ten. DOP853 adds 1e-12.
    np.testing.assert_allclose(motion["place"][1:], ends[:, [0, 2]], rtol=0, atol=1e-9)
    rolled = motion["velocity"][1:] / system.radius
    np.testing.assert_allclose(rolled, ends[:, 16], rtol=0, atol=1e-9)
    force = [roller_in_valley(system, *at).contact for at in zip(ends, u, strict=True)]
    np.testing.assert_allclose(system.contact_force(motion.y[1:], u), force, rtol=0, atol=1e-8)
    turned = ends[-1, 6:15].reshape(3, 3)  # about +y: the body turns forwards
    angle = float(system.turn(motion.y[-1]) - system.turn(y))
    np.testing.assert_allclose(turned[:, 0], (math.cos(angle), 0.0, -math.sin(angle)), atol=1e-8)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("system", [VALLEY, HILL], ids=["valley", "hill"])
def test_the_energy_grows_by_the_power_of_the_force(system, seed):
    y, rng = swinging(system, 100 + seed)
    u, h = np.array([rng.normal(), 0.0]), 1e-3
    near = np.array([system.advance(y, u, k * h) if k else y for k in (-2, -1, 0, 1, 2)])
    # h^4 / 30 times fifth derivatives, and roundings of 10 J over h.
    assert slope(system.energy(near), h) == pytest.approx(u[0] * y[1], abs=1e-10)


@pytest.mark.parametrize("beta", [0.4, 0.5, 1.0])
@pytest.mark.parametrize("share", [0.2, 1.0, 3.0])
def test_on_an_incline_a_body_slips_where_friction_is_below_its_share_of_the_slope(beta, share):
    mu = 0.25
    steepest = math.atan(mu * (1.0 + beta) / beta)  # mu = tan(alpha) beta / (1 + beta)
    for factor, expected in ((1.0 - 1e-12, False), (1.0 + 1e-12, True)):
        body = Roller(beta=beta, slope=factor * steepest, mu=mu)
        assert bool(body.slips(body.state(velocity=share))) is expected


def test_a_block_needs_no_friction_and_a_push_at_the_centre_needs_some():
    block, wheel = Roller(beta=0.0, slope=0.7, mu=0.0), Roller(m=2.0, beta=0.5, mu=0.1)
    assert not block.slips(block.state())
    # F beta / (1 + beta) of a push F on level ground, backwards.
    friction, normal = wheel.contact_force(wheel.state(), [6.0, 0.0])
    assert friction == pytest.approx(-2.0, rel=4 * EPS)
    assert wheel.needed_friction(wheel.state(), [6.0, 0.0]) == pytest.approx(
        2.0 / normal, rel=4 * EPS
    )
    assert wheel.slips(wheel.state(), [6.0, 0.0])
    np.testing.assert_array_equal(
        wheel.slips(np.zeros((3, 2)), [[0.0, 0.0], [5.0, 0.0], [6.0, 0.0]]), [0, 0, 1]
    )


@pytest.mark.parametrize(
    # Down from the top of a sphere, at rest there: a block leaves it at cos = 2/3, a rolling
    # sphere at 10/17, and 2 / (3 + beta) in general.
    ("beta", "cosine"),
    [(0.0, 2.0 / 3.0), (0.4, 10.0 / 17.0), (1.0, 1.0 / 2.0)],
)
def test_a_body_leaves_the_hill_where_the_textbook_says(beta, cosine):
    hill = Roller(beta=beta, curvature=-0.5)
    motion = hill.simulate(hill.state(velocity=1e-4), np.linspace(0.0, 10.0, 2001))
    off = np.isinf(motion["needed_friction"])
    first = int(np.argmax(off))
    before, after = np.cos(motion["descent"][first - 1 : first + 1])
    assert before > cosine > after
    assert before - after < 0.02
    assert hill.slips(motion.y[first])


def test_at_the_bottom_of_a_valley_the_ground_carries_more_than_the_weight():
    body = Roller(m=2.0, curvature=0.5)
    friction, normal = body.contact_force(body.state(velocity=3.0))
    assert friction == 0.0
    assert normal == pytest.approx(2.0 * (9.81 + 9.0 * 0.5), rel=4 * EPS)


def pushed(t):
    return math.cos(3.0 * t), 0.1 + 0.1 * math.sin(2.0 * t)


@pytest.mark.parametrize("u", [None, (0.7, 0.2), pushed])
def test_the_measured_order_is_four(u):
    y, t = VALLEY.state(arc_length=0.2, velocity=1.0), np.linspace(0.0, 3.2, 5)
    fine = VALLEY.simulate(y, t, u, max_step=0.001).y[-1]
    errors = [
        np.max(np.abs(VALLEY.simulate(y, t, u, max_step=step).y[-1] - fine))
        for step in (0.1, 0.05, 0.025)
    ]
    np.testing.assert_allclose(orders(errors), 4.0, rtol=0, atol=0.2)


@pytest.mark.parametrize(("dt", "bound"), [(0.1, 2e-5), (0.05, 1.3e-6)])
def test_a_million_steps_in_a_valley_keep_the_energy(dt, bound):
    y = VALLEY.state(arc_length=0.2, velocity=1.5)
    motion = VALLEY.simulate(y, sample_steps(MILLION) * dt, max_step=dt)
    energy = motion.invariants["energy"] / motion.invariants["energy"][0] - 1.0
    assert np.max(np.abs(energy)) <= bound  # found: 1.0e-5 and 6.5e-7, the fourth power
    assert is_level(motion.t, energy)


def test_straight_down_a_body_keeps_its_energy_to_rounding():
    body, n_steps = Roller(slope=0.3, beta=0.4), 10**5
    y = body.state(velocity=-2.0)  # up and down again
    motion = body.simulate(y, np.linspace(0.0, 3.0, 11), max_step=3.0 / n_steps)
    # Ten kicks a step are rounded by half a unit, to the same side at worst.
    energy = motion.invariants["energy"]
    np.testing.assert_allclose(energy, energy[0], rtol=0, atol=5.0 * EPS * n_steps * 5.0)
    way = -2.0 * motion.t + 0.5 * 9.81 * math.sin(0.3) / 1.4 * motion.t**2
    np.testing.assert_allclose(motion["arc_length"], way, rtol=0, atol=5.0 * EPS * n_steps * 6.0)
