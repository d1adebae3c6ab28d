"""The rolling ball along segments and curves, under a plate that moves and over a plane that moves.

What the ball does is told by the velocity of its centre over the plane it rolls on: half of that of
a plate above it, and minus that of a plane which moves below a centre at rest.
"""

import math
from operator import itemgetter

import numpy as np
import pytest

from rigid_envs.systems.rolling_ball.system import RollingBall
from tests.reference import cases
from tests.systems.measures import Refined

# Of a commanded velocity and spin, what the centre has over the plane on which the ball rolls.
SHARES = {
    "fixed_plane": np.array([1.0, 1.0, 1.0]),
    "top_plate": np.array([0.5, 0.5, 1.0]),
    "plane_under_fixed_centre": np.array([-1.0, -1.0, 1.0]),
}


def variant(case):
    return case["in"].get("variant", "fixed_plane")


def commands(*names):
    return [case for case in cases("ball_kinematic") if case["in"]["command"] in names]


def place_of(case):
    """Place of the centre over the plane at the times of the case."""
    if variant(case) == "plane_under_fixed_centre":  # the centre is at rest, the plane is not
        return None
    return np.stack([case["out"]["x"], case["out"]["y"]], axis=-1)


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
    r, rate, phase = given["r"], given["rate"], given.get("phase0", 0.0)

    def circling(t):
        angle = phase + rate * t
        return (-r * rate * math.sin(angle), r * rate * math.cos(angle), spin)

    return circling


def commanded(ball, y, t, u, steps=2000):
    """The motion in so many steps and in twice as many."""
    coarse, fine = (ball.simulate(y, t, u, max_step=t[-1] / n) for n in (steps, 2 * steps))
    rate = max(float(np.linalg.norm(ball.omega_world(u(s)))) for s in np.linspace(0.0, t[-1], 101))
    return Refined(fine, coarse, 2.0 * steps, rate, rate * t[-1])


@pytest.mark.parametrize("case", commands("circle", "lissajous", "clothoid"), ids=itemgetter("id"))
def test_rolling_along_curves_agrees_with_the_reference(case):
    given, out, cond = case["in"], case["out"], case["cond"]
    ball, share, velocity = RollingBall(given["a"]), SHARES[variant(case)], command(given)
    phase = given.get("phase0", 0.0)
    begin = given.get("r", 0.0) * np.array([math.cos(phase), math.sin(phase)])  # round the origin
    start = ball.state(q=given["q0"], position=given.get("pos0", begin))
    t = np.concatenate([[0.0], case["t"]])
    motion = commanded(ball, start, t, lambda s: share * velocity(s))
    found, place = motion.trajectory, place_of(case)
    atol = motion.tolerance("R", motion.turned, cond["R"])
    expected = np.reshape(out["R"], (-1, 3, 3))
    np.testing.assert_allclose(found["R"][1:], expected, rtol=0, atol=atol)
    if place is None:
        # As seen from the plane the centre runs backwards round its circle, from where it began.
        angle = given["rate"] * t[1:]
        place = given["r"] * np.stack([1.0 - np.cos(angle), -np.sin(angle)], axis=-1)
        atol = 1e-11
    else:
        atol = motion.tolerance("position", given["a"] * motion.turned, max(cond["x"], cond["y"]))
    np.testing.assert_allclose(found["position"][1:], place, rtol=0, atol=atol)
