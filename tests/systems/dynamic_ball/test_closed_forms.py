"""Closed forms of a ball on a plate against reference cases and Newton's and Euler's equations."""

import math
from operator import itemgetter

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigid_envs.systems.dynamic_ball import closed_forms as theory
from tests.reference import cases

EPS = np.finfo(np.float64).eps
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


@pytest.mark.parametrize("case", on("turntable", "fixed_tilt", "shaken"), ids=itemgetter("id"))
def test_centre_and_angular_velocity_agree_with_the_reference(case):
    motion = rolled(case, case["t"])
    for name, value in (("r", motion.centre), ("w_space", motion.omega)):
        # cond eps from the input; r and w_space are sums of up to a handful of terms besides.
        tolerance = 8 * EPS * case["cond"][name]
        np.testing.assert_allclose(value, case["out"][name], rtol=0, atol=tolerance)
    begin = rolled(case, 0.0).centre
    np.testing.assert_allclose(begin, case["scalars"]["r0"], rtol=0, atol=4 * EPS)


@pytest.mark.parametrize(
    "case", [c for c in on("turntable") if "circle_rate" in c["scalars"]], ids=itemgetter("id")
)
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


@pytest.mark.parametrize(
    "case", [c for c in on("turntable") if "drift_vx" in c["scalars"]], ids=itemgetter("id")
)
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
    attitude = Rotation.from_quat(turn, scalar_first=True) * Rotation.from_quat(
        given["q0"], scalar_first=True
    )
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
