"""Motion of the dynamic ball: closed forms against references, simulations against both."""

import math

import numpy as np
import pytest

from rigid_envs.mechanics.laws import EPS
from rigid_envs.systems.dynamic_ball import closed_forms as theory
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from tests.mechanics.attitudes import scipy_of
from tests.reference import cases, every
from tests.systems.measures import is_level, million_steps, refined

# Closed forms of a ball on a plate against reference cases and Newton's and Euler's equations.


BETA = {"solid_sphere": 2.0 / 5.0, "hollow_sphere": 2.0 / 3.0}
BALL = {"beta": 0.4, "radius": 0.2}
START = {"place": (0.4, -0.3), "omega": (2.0, -1.0, 0.7)}


def on(*plates):
    return [c for c in cases("ball_dynamic") if c["in"]["plate"] in plates]


def rolled(case, t):
    given = case["in"]
    ball = {"beta": BETA[given["beta"]], "radius": given["a"]}
    if given["plate"] == "shaken":
        ball["amplitudes"] = given["A"], given["B"]
        ball["frequencies"] = given["nu"], given["nv"]
        return theory.roll_on_shaken_plate(t, given["XY0"], given["w0"], **ball)
    ball["turntable_rate"] = given.get("Omega", 0.0)
    ball["tilt"] = given.get("tilt", 0.0)
    return theory.roll_on_plate(t, given["XY0"], given["w0"], g=given["g"], **ball)


@every(on("turntable", "fixed_tilt", "shaken"))
def test_centre_and_angular_velocity_agree_with_the_reference(case):
    motion = rolled(case, case["t"])
    for name, value in (("r", motion.centre), ("w_space", motion.omega)):
        # cond eps from the input; r and w_space are sums of up to a handful of terms besides.
        tolerance = 8 * EPS * case["cond"][name]
        np.testing.assert_allclose(value, case["out"][name], rtol=0, atol=tolerance)
    begin = rolled(case, 0.0).centre
    np.testing.assert_allclose(begin, case["scalars"]["r0"], rtol=0, atol=4 * EPS)


@every([c for c in on("turntable") if "circle_rate" in c["scalars"]])
def test_the_ball_runs_round_its_circle_at_the_rate_of_the_reference(case):
    given = case["in"]
    circle = theory.turntable_circle(
        given["XY0"],
        given["w0"],
        beta=BETA[given["beta"]],
        radius=given["a"],
        turntable_rate=given["Omega"],
    )
    np.testing.assert_allclose(circle.rate, case["scalars"]["circle_rate"], rtol=4 * EPS)
    arm = np.array(case["out"]["r"])[:, :2] - circle.centre
    distance, angle = np.hypot(*arm.T), np.unwrap(np.arctan2(arm[:, 1], arm[:, 0]))
    tolerance = 8 * EPS * case["cond"]["r"]
    np.testing.assert_allclose(distance, circle.circle_radius, rtol=0, atol=tolerance)
    if circle.circle_radius > 1e-9:
        turned = circle.rate * (np.array(case["t"]) - case["t"][0])
        np.testing.assert_allclose(
            angle - angle[0], turned, rtol=0, atol=2.0 * tolerance / circle.circle_radius
        )


@every([c for c in on("turntable") if "drift_vx" in c["scalars"]])
def test_the_drift_across_the_slope_agrees_with_the_reference_and_the_motion(case):
    given = case["in"]
    plate = {"turntable_rate": given["Omega"], "tilt": given["tilt"]}
    drift = theory.drift_across_slope(beta=BETA[given["beta"]], g=given["g"], **plate)
    assert case["scalars"]["drift_vy"] == 0
    np.testing.assert_allclose(drift, case["scalars"]["drift_vx"], rtol=8 * EPS)
    rounds = 2.0 * math.pi / (BETA[given["beta"]] / (1.0 + BETA[given["beta"]]) * given["Omega"])
    moved = np.diff(rolled(case, np.array([0.0, 10.0 * rounds])).centre, axis=0)[0]
    # 63 radians are rounded, on circles of less than 2 m and ways of 45 m.
    np.testing.assert_allclose(
        moved, (10.0 * rounds * drift, 0.0, 0.0), rtol=0, atol=63 * 2 * 8 * EPS
    )


def test_a_ball_that_stands_in_space_turns_as_in_the_reference():
    (case,) = (c for c in on("turntable") if c["id"] == "turntable-3")
    given = case["in"]
    omega, turn = theory.stand_in_space(
        case["t"],
        given["XY0"],
        spin=given["w0"][2],
        radius=given["a"],
        turntable_rate=given["Omega"],
    )
    np.testing.assert_allclose(omega, given["w0"], rtol=4 * EPS)
    attitude = scipy_of(turn) * scipy_of(given["q0"])
    expected = np.array(case["out"]["R"]).reshape(-1, 3, 3)
    tolerance = 8 * EPS * case["cond"]["R"]
    np.testing.assert_allclose(attitude.as_matrix(), expected, rtol=0, atol=tolerance)


@pytest.mark.parametrize("table", [2.5, -1.2])
def test_rolling_round_the_axis_is_a_motion_of_the_turntable(table):
    t = np.linspace(0.0, 12.0, 7)
    plate = {"turntable_rate": table, **BALL}
    motion, _ = theory.roll_round_axis(t, circle_radius=0.9, phase=0.4, spin=1.1, **plate)
    general = theory.roll_on_plate(t, motion.centre[0, :2], motion.omega[0], g=9.81, **plate)
    for steady, value in zip(motion, general, strict=True):
        np.testing.assert_allclose(steady, value, rtol=0, atol=256 * EPS)
    circle = theory.turntable_circle(motion.centre[0, :2], motion.omega[0], **plate)
    np.testing.assert_allclose(circle.centre, 0.0, rtol=0, atol=8 * EPS)


def test_a_plate_that_turns_ever_slower_is_one_at_rest():
    t = np.linspace(0.0, 3.0, 4)
    rest = theory.roll_on_plate(t, **START, **BALL, tilt=0.2, g=9.81)
    slow = theory.roll_on_plate(t, **START, **BALL, tilt=0.2, g=9.81, turntable_rate=1e-200)
    for a, b in zip(rest, slow, strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-13)


# The ball on its plate against reference cases, Newton's law with multipliers, a million steps.


def ball_of(case):
    given = case["in"]
    rate = given.get("Omega", 0.0)
    return DynamicBall(
        radius=given["a"], beta=BETA[given["beta"]], g=given["g"], turntable_rate=rate
    )


def plate_of(case):
    """Angles and rates of the plate at the start, input of time, and where O is at a time."""
    given, still = case["in"], lambda t: np.zeros((len(t), 3))
    match given["plate"]:
        case "tilting":
            size, rate, phase = given["al0"], given["nu"], given["phase"]

            def tilted(t):
                return (0.0, 0.0, -size * rate**2 * math.sin(rate * t + phase), 0.0)

            start = (size * math.sin(phase), 0.0, size * rate * math.cos(phase), 0.0)
            return start, tilted, still
        case "two_axis":
            a, b, c, d = (given[name] for name in ("ax0", "nux", "ay0", "nuy"))

            def tipped(t):
                return (0.0, 0.0, -a * b**2 * math.sin(b * t), -c * d**2 * math.sin(d * t))

            return (0.0, 0.0, a * b, c * d), tipped, still
        case "shaken":  # m = 1: the force that a plate accelerated by A seems to exert is -A
            a, b, c, d = (given[name] for name in ("A", "nu", "B", "nv"))

            def shaken(t):
                return (a * b**2 * math.sin(b * t), c * d**2 * math.sin(d * t), 0.0, 0.0)

            def moved(t):
                return np.stack([a * np.sin(b * t), c * np.sin(d * t), 0.0 * t], axis=-1)

            return (0.0, 0.0, 0.0, 0.0), shaken, moved
    return (given.get("tilt", 0.0), 0.0, 0.0, 0.0), None, still


def rolling(ball, q, position, omega_world, tilt, tilt_rate):
    """State whose velocity makes the contact move with the surface."""
    y = ball.state(q=q, position=position, tilt=tilt, tilt_rate=tilt_rate)
    P = ball.plate(y)
    w = tilt_rate[0] * np.array([1.0, 0.0, 0.0]) + tilt_rate[1] * P[:, 1]
    centre, n = ball.centre(y), P[:, 2]
    surface = np.cross(w + ball.turntable_rate * n, centre - ball.radius * n)
    velocity = surface + np.cross(omega_world, ball.radius * n)
    y[6:8] = (P.T @ (velocity - np.cross(w, centre)))[:2]
    y[8] = n @ omega_world
    return y


@every(cases("ball_dynamic"))
def test_the_ball_on_its_plate_agrees_with_the_reference(case):
    given, out, cond = case["in"], case["out"], case["cond"]
    ball = ball_of(case)
    (ax, ay, rate_x, rate_y), u, origin = plate_of(case)
    y = rolling(ball, given["q0"], given["XY0"], given["w0"], (ax, ay), (rate_x, rate_y))
    np.testing.assert_allclose(ball.centre(y), case["scalars"]["r0"], rtol=0, atol=4 * EPS)
    t = np.concatenate([[0.0], case["t"]])
    motion = refined(ball, y, t, u)
    found = motion.trajectory
    fields = (
        ("centre", "r", ball.radius * motion.turned),
        ("omega_world", "w_space", motion.rate),
        ("R", "R", motion.turned),
    )
    for name, field, size in fields:
        values = found[name][1:] + (origin(np.array(case["t"])) if name == "centre" else 0.0)
        expected = np.array(out[field]).reshape(values.shape)
        atol = motion.tolerance(name, size, cond[field])
        np.testing.assert_allclose(values, expected, rtol=0, atol=atol)


@pytest.mark.parametrize("beta", [0.0, 0.4, 2.0 / 3.0])
@pytest.mark.parametrize("steps", [10, 23])
def test_on_a_fixed_tilt_the_ball_follows_a_parabola_exactly(beta, steps):
    ball, tilt = DynamicBall(radius=0.5, beta=beta), (0.2, -0.1)
    y = ball.state(position=(0.1, 0.2), velocity=(-0.3, 0.4), spin=0.7, tilt=tilt)
    end, t = ball.advance(y, (0.3, -0.2, 0.0, 0.0), 0.5, steps), 0.5
    # Gravity in plate axes, from the plate's own matrix; a force divides by the mass, 1 kg.
    g = ball.plate(y).T @ [0.0, 0.0, -9.81]
    a = (g[:2] + np.array([0.3, -0.2])) / (1.0 + beta)
    roundings = 5.0 * EPS * steps
    np.testing.assert_allclose(end[6:8], y[6:8] + a * t, rtol=0, atol=2.0 * roundings)
    np.testing.assert_allclose(
        end[4:6], y[4:6] + y[6:8] * t + 0.5 * a * t**2, rtol=0, atol=roundings
    )
    assert end[8] == 0.7  # no moment about the normal


TABLE = DynamicBall(m=1.2, radius=0.5, beta=0.4, turntable_rate=1.7)
CIRCLING = TABLE.state(position=(0.1, 0.2), velocity=(0.3, 0.2), spin=1.0)


@pytest.mark.long
def test_a_million_steps_on_a_level_turntable_keep_speed_spin_and_circle():
    trajectory = million_steps(TABLE, CIRCLING, 0.02, 1500)
    found, speed = trajectory.invariants, np.linalg.norm(trajectory["velocity"], axis=-1)
    # Turns of the velocity are rotations to rounding: a random walk of 1e7 of them.
    np.testing.assert_allclose(speed, speed[0], rtol=1e-11)
    np.testing.assert_allclose(found["energy"], found["energy"][0], rtol=1e-11)
    np.testing.assert_array_equal(found["spin"], 1.0)
    assert np.max(np.abs(np.linalg.norm(trajectory["q"], axis=-1) - 1.0)) <= 1e-14
    # The centre of the circle is r + n x v / (k Omega). It trembles by the fourth power of the
    # step, but goes nowhere.
    rate = 2.0 / 7.0 * 1.7
    v = trajectory["velocity"]
    centre = trajectory["position"] + np.stack([-v[:, 1], v[:, 0]], axis=-1) / rate
    moved = centre - centre[0]
    assert np.max(np.abs(moved)) <= 1e-10
    for k in range(2):
        assert is_level(trajectory.t, moved[:, k])
