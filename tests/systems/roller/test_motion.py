"""Motion of the roller: closed forms against references, simulations against both."""

import math

import numpy as np
import pytest

from rigid_envs.systems.roller import closed_forms as roller
from rigid_envs.systems.roller.system import Roller
from tests.reference import cases, every
from tests.systems.measures import assert_energy_stays, million_steps

# Closed forms of what rolls straight, slides or swings, against references and an integrator.


EPS = np.finfo(np.float64).eps
BETA = {"solid_sphere": 2.0 / 5.0, "hollow_sphere": 2.0 / 3.0}
VALLEY = {"curvature": 0.8, "beta": 0.4, "g": 9.81}
BALL = {"beta": 0.4, "radius": 0.3, "mu": 0.2, "g": 9.81}


@every(cases("incline"))
def test_rolling_down_an_incline_agrees_with_the_reference(case):
    given, out = case["in"], case["out"]
    end = roller.descend(
        given["h"], slope=given["alpha"], beta=given["beta"], radius=given["R"], g=given["g"]
    )
    measured = {
        "v": end.speed,
        "acceleration": end.acceleration,
        "time": end.time,
        "omega": end.angular_velocity,
        "turns": end.turns,
        "mu_min": end.least_friction,
        "friction_over_mg": end.friction_over_weight,
    }
    assert measured.keys() == out.keys()
    # A handful of products and roots, each exact to a rounding.
    np.testing.assert_allclose(list(measured.values()), list(out.values()), rtol=8 * EPS)


@every(cases("wheel"))
def test_the_wheel_and_its_cycloid_agree_with_the_reference(case):
    given, out = case["in"], case["out"]
    wheel = {"radius": given["R"], "omega": given["omega"]}
    centre, rim = roller.roll_wheel(given["T"], **wheel)
    speed, _ = roller.roll_wheel(1.0, **wheel)
    # Some roundings of the angle, 7.5 radians at the most.
    tolerance = 16 * EPS
    np.testing.assert_allclose(speed, out["v"], rtol=4 * EPS)
    np.testing.assert_allclose(centre, out["x_centre"], rtol=4 * EPS)
    np.testing.assert_allclose(rim, out["rim_point_started_at_contact"], rtol=0, atol=tolerance)
    assert roller.cycloid_arch_length(given["R"]) == pytest.approx(out["cycloid_arch_length"])


@every(cases("slip_to_roll"))
def test_sliding_until_rolling_agrees_with_the_reference(case):
    given, out = case["in"], case["out"]
    ball = {"beta": BETA[given["body"]], "radius": given["a"], "mu": given["mu"], "g": given["g"]}
    end = roller.slip_to_roll(given["v0"], given["w0_space"], **ball)
    measured = {
        "t_roll": end.time,
        "v_final": end.velocity,
        "w_final": end.omega,
        "x_at_roll": end.position,
        "slip0": end.slip,
        "wdot": end.omega_rate,
    }
    assert measured.keys() == out.keys()
    for name, value in measured.items():
        # The slip is a sum of two terms, up to 22 times as large as its smaller component.
        np.testing.assert_allclose(value, out[name], rtol=100 * EPS, atol=4 * EPS, err_msg=name)


def test_sliding_keeps_the_angular_momentum_about_the_ground():
    v0, w0 = np.array([2.0, -1.0]), np.array([9.0, 4.0, 3.0])
    t = np.linspace(0.0, 3.0, 31)
    _, v, w = roller.slide(t, v0, w0, **BALL)
    about_ground = v + BALL["beta"] * BALL["radius"] * np.stack([w[:, 1], -w[:, 0]], axis=-1)
    np.testing.assert_allclose(about_ground, np.tile(about_ground[0], (31, 1)), rtol=16 * EPS)


def test_a_sliding_ball_is_where_its_velocity_takes_it_and_rolls_in_the_end():
    v0, w0 = np.array([2.0, -1.0]), np.array([9.0, 4.0, 3.0])
    end = roller.slip_to_roll(v0, w0, **BALL)
    place, v, w = roller.slide([0.0, end.time, end.time + 2.0], v0, w0, **BALL)
    np.testing.assert_allclose(place[0], 0.0, rtol=0, atol=4 * EPS)
    np.testing.assert_allclose(v[0], v0, rtol=4 * EPS)
    np.testing.assert_allclose(w[0], w0, rtol=4 * EPS)
    np.testing.assert_allclose(place[1], end.position, rtol=4 * EPS)
    np.testing.assert_allclose(place[2], end.position + 2.0 * end.velocity, rtol=4 * EPS)
    rolling = BALL["radius"] * np.array([w[2, 1], -w[2, 0]])
    np.testing.assert_allclose(v[2], rolling, rtol=16 * EPS)


def test_a_ball_that_rolls_already_goes_on_so():
    end = roller.slip_to_roll((0.6, 0.0), (0.0, 2.0, 1.0), **BALL)
    assert end.time == 0.0
    place, _, w = roller.slide(2.0, (0.6, 0.0), (0.0, 2.0, 1.0), **BALL)
    np.testing.assert_array_equal(place, (1.2, 0.0))
    np.testing.assert_array_equal(w, (0.0, 2.0, 1.0))


@pytest.mark.parametrize("s0", [0.0, 1e-6, -1.9, 3.8, 9.0, 20.0])
@pytest.mark.parametrize("v0", [0.0, 0.7, -2.5, 7.0, -9.0])
def test_rolling_in_a_valley_follows_its_closed_form(s0, v0):
    t = np.linspace(0.0, 8.0, 33)
    place, speed = roller.valley(t, s0, v0, **VALLEY)
    motion = Roller(**VALLEY).simulate((s0, v0), t)
    # Stated: 1e-11 per radian, of some 50 radians and beside the top of the circle.
    np.testing.assert_allclose(motion["arc_length"], place, rtol=0, atol=1e-9)
    np.testing.assert_allclose(motion["velocity"], speed, rtol=0, atol=1e-9)


def test_small_swings_have_the_textbook_period_and_wide_ones_the_known_ratio():
    slow = math.sqrt(VALLEY["g"] * VALLEY["curvature"] / (1.0 + VALLEY["beta"]))
    small = roller.swing(1e-9, 0.0, **VALLEY)
    assert small.period == pytest.approx(2.0 * math.pi / slow, rel=4 * EPS)
    wide = roller.swing(0.5 * math.pi / VALLEY["curvature"], 0.0, **VALLEY)
    # A pendulum let go at 90 degrees: 2 K(1/2) / pi, Gauss's constant times sqrt(2).
    assert wide.period / small.period == pytest.approx(1.1803405990160962260, rel=8 * EPS)
    assert wide.reach == pytest.approx(0.5 * math.pi / VALLEY["curvature"], rel=4 * EPS)


@pytest.mark.parametrize("v0", [1.0, -4.0, 9.0])
def test_the_motion_returns_after_one_period(v0):
    path = roller.swing(0.4, v0, **VALLEY)
    place, speed = roller.valley(path.period * np.array([0.0, 1.0]), 0.4, v0, **VALLEY)
    round_trip = 0.0 if math.isfinite(path.reach) else 2.0 * math.pi / VALLEY["curvature"]
    assert place[1] - place[0] == pytest.approx(math.copysign(round_trip, v0), abs=64 * EPS)
    assert speed[1] == pytest.approx(speed[0], rel=64 * EPS)


def test_with_just_the_energy_of_the_top_the_roller_creeps_up_to_it():
    # From the bottom at k = 1 sin(a / 2) = tanh(w t), here w = 2 and all numbers are exact.
    exact = {"curvature": 1.0, "beta": 1.0, "g": 8.0}
    path = roller.swing(0.0, 4.0, **exact)
    assert math.isinf(path.period) and path.reach == pytest.approx(math.pi, rel=EPS)
    t = np.linspace(-2.0, 8.0, 11)
    s, v = roller.valley(t, 0.0, 4.0, **exact)
    np.testing.assert_allclose(s, 4.0 * np.arctan(np.tanh(t)), rtol=8 * EPS)
    np.testing.assert_allclose(v, 4.0 / np.cosh(2.0 * t), rtol=64 * EPS)


# Wheels, spheres and hoops on inclines and in valleys, against references and multipliers.


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


def test_a_million_steps_in_a_valley_keep_the_energy():
    system = Roller(m=1.1, radius=0.3, beta=0.45, g=9.5, slope=0.4, curvature=0.5)
    motion = million_steps(system, system.state(arc_length=0.2, velocity=1.5), 0.1)
    assert_energy_stays(motion, 2e-5)  # found: 1.0e-5
