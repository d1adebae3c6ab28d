"""Flight of thrown bodies: closed forms against references, simulations against both."""

import math

import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.thrown_body import closed_forms as theory
from rigid_envs.systems.thrown_body.system import ThrownBody
from tests.reference import cases, every
from tests.systems.measures import million_steps, refined

RACKET = (0.0012, 0.0164, 0.0176)


@every(cases("flight"))
def test_a_thrown_body_agrees_with_the_reference(case):
    given, out, cond = case["in"], case["out"], case["cond"]
    body = ThrownBody(*given["I"], g=given["g"])
    q = rotations.normalize(np.array(given["q0"]))
    y = body.state(q=q, omega_body=given["w0"], position=given["r0"], velocity=given["v0"])
    motion = refined(body, y, np.array([0.0, *case["t"]]))
    found, fall = motion.trajectory, given["g"] * case["t"][-1]
    fields = (
        ("position", "r", fall * case["t"][-1]),
        ("velocity", "v", fall),
        ("omega_body", "w", motion.rate),
        ("R", "R", motion.turned),
    )
    for name, field, size in fields:
        values = found[name][1:]
        expected = np.reshape(out[field], values.shape)
        atol = motion.tolerance(name, size, cond[field])
        np.testing.assert_allclose(values, expected, rtol=0, atol=atol, err_msg=name)
    point = found["position"] + found["R"] @ np.array(given["point"])
    atol = motion.tolerance("position", fall) + motion.tolerance("R", motion.turned, cond["point"])
    np.testing.assert_allclose(point[1:], out["point"], rtol=0, atol=atol)
    scalars = case["scalars"]
    L, energy = found["L_world"][-1], found["kinetic_energy"]
    np.testing.assert_allclose(L, scalars["L_space"], rtol=0, atol=1e-13 * np.linalg.norm(L))
    np.testing.assert_allclose(2.0 * energy[0], scalars["twoT"], rtol=1e-14)


@every(cases("racket_twist"))
def test_the_twist_of_a_racket_agrees_with_the_reference(case):
    given, out = case["in"], case["out"]
    moments = [given[f"I_{name}"] for name in ("handle", "mid", "normal")]
    for row, turns in enumerate(given["flips"]):
        found = theory.racket_twist(turns, moments, *(given[k] for k in ("L", "theta0", "psi0")))
        expected = out["twist"][row], out["theta"][row], out["time"][row]
        np.testing.assert_allclose((found.psi, found.theta, found.time), expected, rtol=1e-13)
        assert found.psi / math.pi == pytest.approx(out["half_twists"][row], rel=1e-13)


@every(cases("plate_wobble"))
def test_the_wobble_of_a_plate_agrees_with_the_reference(case):
    given, out = case["in"], case["out"]
    ratio = theory.wobble_ratio(given["theta"], i_perp=given["A"], i3=given["C"])
    assert float(ratio) == pytest.approx(out["ratio_visible"], rel=1e-14)
    body = ThrownBody(given["A"], given["A"], given["C"])
    across = given["C"] * given["w3"] * math.tan(given["theta"]) / given["A"]
    y = body.state(omega_body=(across, 0.0, given["w3"]))
    turn = body.simulate(y, [0.0, math.pi / abs(out["precession"])])  # half a turn about L
    L = turn["L_world"][0]
    axis = 2.0 * (turn["R"][0, :, 2] @ L) * L / (L @ L) - turn["R"][0, :, 2]
    np.testing.assert_allclose(turn["R"][1, :, 2], axis, rtol=0, atol=1e-12)


def test_a_little_wobble_of_a_plate_is_twice_its_spin_and_of_a_football_below_it():
    assert float(theory.wobble_ratio(0.0, i_perp=1.0, i3=2.0)) == 2.0
    football = theory.wobble_ratio([0.0, 0.3, 1.0], i_perp=1.0, i3=0.6)
    assert np.all(football < 1.0) and np.all(np.diff(football) > 0.0)


@pytest.mark.parametrize("psi0", [0.5 * math.pi, 0.9, -0.4, 2.4])
@pytest.mark.parametrize("theta0", [1.5, 1.68])
def test_handedness_and_mirror_image_of_a_twist(theta0, psi0):
    one = theory.racket_twist(1.0, RACKET, 0.15, theta0, psi0)
    mirrored = theory.racket_twist(1.0, RACKET, 0.15, math.pi - theta0, -psi0)
    np.testing.assert_allclose(
        (mirrored.psi, mirrored.theta, mirrored.time),
        (-one.psi, math.pi - one.theta, one.time),
        rtol=1e-12,
    )
    half = theory.racket_twist(1.0, RACKET, 0.15, theta0, psi0 + math.pi)  # the other face
    np.testing.assert_allclose((half.psi, half.theta), (one.psi, one.theta), rtol=1e-11)


def test_a_racket_thrown_about_its_middle_axis_twists_by_half_a_turn_towards_its_handle():
    for lean in (0.01, -0.01):
        twist = theory.racket_twist(1.0, RACKET, 0.15, 0.5 * math.pi - lean, 0.5 * math.pi)
        assert twist.psi / math.pi == pytest.approx(math.copysign(0.964, lean), abs=1e-3)


def test_no_turn_is_no_twist_and_turns_add_up():
    start = theory.racket_twist(0.0, RACKET, 0.15, 1.5, 0.3)
    assert (start.psi, start.time) == pytest.approx((0.0, 0.0), abs=1e-13)
    assert start.theta == pytest.approx(1.5, rel=1e-14)
    first = theory.racket_twist(1.25, RACKET, 0.15, 1.5, 0.3)
    then = theory.racket_twist(0.75, RACKET, 0.15, first.theta, 0.3 + first.psi)
    whole = theory.racket_twist(2.0, RACKET, 0.15, 1.5, 0.3)
    assert first.psi + then.psi == pytest.approx(whole.psi, rel=1e-10)
    assert first.time + then.time == pytest.approx(whole.time, rel=1e-10)


def test_a_million_steps_of_flight_keep_what_is_kept():
    body = ThrownBody(1.0, 2.0, 3.0, g=1e-5)  # that z stays comparable with the other numbers
    y = body.state(omega_body=(0.01, 1.0, 0.01), velocity=(0.02, -0.01, 0.05))
    trajectory = million_steps(body, y, 0.02)
    found, level = trajectory.invariants, 20000.0 * 0.1
    for name in ("velocity_x", "velocity_y"):
        np.testing.assert_array_equal(found[name], found[name][0])
    np.testing.assert_allclose(found["L_squared"], found["L_squared"][0], rtol=1e-11)
    # five roundings of the height a step, all to the same side at worst, times m g
    heights = np.abs(trajectory["position"][:, 2])
    bound = 5e6 * np.finfo(np.float64).eps * (1e-5 * max(heights.max(), level) + 1.0)
    flight = found["energy"] - trajectory["kinetic_energy"]
    np.testing.assert_allclose(flight, flight[0], rtol=0, atol=bound)
    turned = FreeBody(1.0, 2.0, 3.0).simulate(y[:7], trajectory.t, max_step=0.02)
    np.testing.assert_array_equal(trajectory.y[:, :7], turned.y)
