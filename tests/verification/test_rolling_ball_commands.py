"""The rolling ball along curves, under a plate that moves and over a plane that moves.

What the ball does is told by the velocity of its centre over the plane it rolls on: half of that of
a plate above it, and minus that of a plane which moves below a centre at rest.
"""

import math
from operator import itemgetter

import numpy as np
import pytest

from rigid_envs.mechanics.laws import EPS
from rigid_envs.systems.rolling_ball.system import RollingBall
from tests.reference import cases
from tests.verification.measures import Refined

SHARE = {
    "fixed_plane": np.array([1.0, 1.0, 1.0]),
    "top_plate": np.array([0.5, 0.5, 1.0]),
    "plane_under_fixed_centre": np.array([-1.0, -1.0, 1.0]),
}


def variant(case):
    return case["in"].get("variant", "fixed_plane")


def cases_of(commands, variants):
    found = [case for case in cases("ball_kinematic") if case["in"]["command"] in commands]
    return [case for case in found if variant(case) in variants]


def command(given):
    """Velocity and spin that are commanded, of time."""
    spin = given.get("spin", 0.0)
    match given["command"]:
        case "lissajous":
            A, B, n, m = (given[name] for name in ("A", "B", "n", "m"))
            return lambda t: (A * n * math.cos(n * t), B * m * math.cos(m * t), spin)
        case "clothoid":
            speed, k = given["speed"], given["k"]

            def spiralling(t):
                heading = 0.5 * k * t * t
                return (speed * math.cos(heading), speed * math.sin(heading), spin)

            return spiralling
    r, rate = given["r"], given["rate"]
    return lambda t: (-r * rate * math.sin(rate * t), r * rate * math.cos(rate * t), spin)


def commanded(ball, y, t, u, steps=2000):
    """The motion in so many steps and in twice as many."""
    coarse, fine = (ball.simulate(y, t, u, max_step=t[-1] / n) for n in (steps, 2 * steps))
    rate = max(float(np.linalg.norm(ball.omega_world(u(s)))) for s in np.linspace(0.0, t[-1], 101))
    return Refined(fine, coarse, 2.0 * steps, rate, rate * t[-1])


CURVES = cases_of(("lissajous", "clothoid"), SHARE)
MOVING_PLANE = cases_of(("circle",), ("plane_under_fixed_centre",))


@pytest.mark.parametrize("case", CURVES + MOVING_PLANE, ids=itemgetter("id"))
def test_rolling_along_curves_agrees_with_the_reference(case):
    given, out, cond = case["in"], case["out"], case["cond"]
    ball, share, velocity = RollingBall(given["a"]), SHARE[variant(case)], command(given)
    start = ball.state(q=given["q0"], position=given["pos0"])
    t = np.concatenate([[0.0], case["t"]])
    motion = commanded(ball, start, t, lambda s: share * velocity(s))
    found = motion.trajectory
    atol = motion.tolerance("R", motion.turned, cond["R"])
    expected = np.reshape(out["R"], (-1, 3, 3))
    np.testing.assert_allclose(found["R"][1:], expected, rtol=0, atol=atol)
    if variant(case) == "plane_under_fixed_centre":
        # As seen from the plane the centre runs backwards round its circle, from where it began.
        angle = given["rate"] * t
        moved = given["r"] * np.stack([np.cos(angle) - 1.0, np.sin(angle)], axis=-1)
        place, atol = -moved, 1e-11
        np.testing.assert_allclose(found["position"], place, rtol=0, atol=atol)
    else:
        place = np.stack([out["x"], out["y"]], axis=-1)
        atol = motion.tolerance("position", given["a"] * motion.turned, max(cond["x"], cond["y"]))
        np.testing.assert_allclose(found["position"][1:], place, rtol=0, atol=atol)


@pytest.mark.parametrize(
    "case", cases_of(("segments",), ("plane_under_fixed_centre",)), ids=itemgetter("id")
)
def test_a_plane_that_moves_rolls_the_ball_as_the_reference_says(case):
    given, ball = case["in"], RollingBall(case["in"]["a"])
    segments = np.array(given["segments"])
    ends = np.concatenate([[0.0], np.cumsum(segments[:, 3])])
    t = np.union1d(ends, case["t"])
    u = SHARE[variant(case)] * segments[np.searchsorted(ends, t[:-1], side="right") - 1, :3]
    motion = ball.simulate(ball.state(q=given["q0"]), t, u)
    rows = np.searchsorted(t, case["t"])
    expected = np.reshape(case["out"]["R"], (-1, 3, 3))
    atol = 64 * EPS * case["cond"]["R"]
    np.testing.assert_allclose(motion["R"][rows], expected, rtol=0, atol=atol)


@pytest.mark.parametrize("case", cases_of(("clothoid",), SHARE)[:1], ids=itemgetter("id"))
def test_the_error_along_a_clothoid_falls_with_the_fourth_power_of_the_step(case):
    given, velocity = case["in"], command(case["in"])
    ball, expected = RollingBall(given["a"]), np.reshape(case["out"]["R"], (-1, 3, 3))[-1]
    errors = []
    for steps in (250, 500, 1000):
        t = [0.0, case["t"][-1]]
        end = ball.simulate(ball.state(q=given["q0"]), t, velocity, max_step=t[1] / steps)
        errors.append(np.max(np.abs(end["R"][-1] - expected)))
    np.testing.assert_allclose(np.log2(errors[:-1]) - np.log2(errors[1:]), 4.0, atol=0.2)
