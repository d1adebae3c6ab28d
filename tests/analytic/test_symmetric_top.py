import math
from operator import itemgetter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_envs.systems.free_body import closed_forms as free_body
from tests.reference import cases

EPS = np.finfo(np.float64).eps
SYMMETRIC = [c for c in cases("free_top") if c["scalars"]["class"] == "symmetric"]


def angle(v, w):
    """Angle of two vectors, exact where it is small."""
    return math.atan2(float(np.linalg.norm(np.cross(v, w))), float(np.dot(v, w)))


@pytest.mark.parametrize("case", SYMMETRIC, ids=itemgetter("id"))
def test_the_cones_of_a_symmetric_top_agree_with_the_reference(case):
    moments, omega0 = np.array(case["in"]["I"]), np.array(case["in"]["w0"])
    scalars, cones = case["scalars"], free_body.symmetric_cones(moments, omega0)
    assert cones.axis + 1 == scalars["symmetry_axis"]
    assert cones.body_rate == pytest.approx(scalars["Omega_body"], rel=8 * EPS)
    assert cones.space_rate == pytest.approx(scalars["precession_rate_space"], rel=8 * EPS)
    # Along the motion of the reference, in the body and in space.
    axis = np.copysign(np.eye(3)[cones.axis], omega0[cones.axis])
    for body, world in zip(case["out"]["w"], case["out"]["w_space"], strict=True):
        assert angle(body, axis) == pytest.approx(cones.body_angle, rel=1e-13)
        assert angle(world, scalars["Lspace"]) == pytest.approx(cones.space_angle, rel=1e-13)
        assert angle(moments * body, axis) == pytest.approx(cones.tilt, rel=1e-13)


@pytest.mark.parametrize("case", cases("chandler"), ids=itemgetter("id"))
def test_the_chandler_period_agrees_with_the_reference(case):
    given_, out = case["in"], case["out"]
    body = {"i_perp": given_["Iperp"], "i3": given_["I3"]}
    period = free_body.chandler_period(given_["w3"], **body)
    moments = (given_["Iperp"], given_["Iperp"], given_["I3"])
    rate, _ = free_body.symmetric_rates(moments, (0.0, 0.0, given_["w3"]))
    found = {
        "Omega": rate,
        "period": period,
        "period_in_turns": free_body.chandler_turns(**body),
        "period_days_86400s": period / 86400.0,
    }
    for name, expected in out.items():
        # I3 - I1 of neighbouring doubles is exact: nothing is lost to the small difference.
        np.testing.assert_allclose(found[name], expected, rtol=4 * EPS, err_msg=name)


def test_the_pole_of_the_earth_runs_round_once_in_a_chandler_period():
    i_perp, i3, omega3 = 8.0101e37, 8.0365e37, 7.292115e-5
    period = free_body.chandler_period(omega3, i_perp=i_perp, i3=i3)
    omega0 = np.array([1e-6 * omega3, 0.0, omega3])
    t = period * np.array([0.25, 0.5, 1.0])
    pole = free_body.omega(t, (i_perp, i_perp, i3), omega0)[:, :2] / omega0[0]
    # Positive sense, as the Earth turns. The angle of some 2 pi is rounded a few times.
    np.testing.assert_allclose(pole, [[0.0, 1.0], [-1.0, 0.0], [1.0, 0.0]], rtol=0, atol=1e-14)


MOMENT = st.floats(0.1, 10.0)
RATE = st.one_of(st.just(0.0), st.floats(1e-3, 3.0), st.floats(-3.0, -1e-3))


@settings(max_examples=200)
@given(i_perp=MOMENT, i3=MOMENT, omega0=st.tuples(RATE, RATE, RATE), shift=st.integers(0, 2))
def test_the_body_cone_rolls_on_the_space_cone(i_perp, i3, omega0, shift):
    moments = np.roll([i_perp, i_perp, i3], shift)
    cones = free_body.symmetric_cones(moments, np.roll(omega0, shift))
    assert i_perp == i3 or cones.axis == (2 + shift) % 3
    # Without slip both edges are as long: the same product of rate and radius.
    size = abs(cones.body_rate) + cones.space_rate
    assert abs(cones.body_rate) * math.sin(cones.body_angle) == pytest.approx(
        cones.space_rate * math.sin(cones.space_angle), abs=16 * EPS * size
    )
    side = {"outside": 1.0, "inside": -1.0, "none": 0.0}[cones.space_cone]
    assert side == np.sign(i_perp - i3)
    together = cones.body_angle + side * cones.space_angle
    assert cones.tilt == pytest.approx(together, rel=0, abs=16 * EPS)


def test_a_sphere_has_no_space_cone():
    cones = free_body.symmetric_cones((2.0, 2.0, 2.0), (0.3, 0.4, 1.2))
    assert (cones.space_cone, cones.space_angle, cones.body_rate) == ("none", 0.0, 0.0)
    assert cones.space_rate == pytest.approx(1.3, rel=4 * EPS)


def test_a_symmetric_top_at_rest_has_cones_of_no_angle():
    cones = free_body.symmetric_cones((1.0, 1.0, 2.0), (0.0, 0.0, 0.0))
    assert (cones.body_angle, cones.space_angle, cones.tilt) == (0.0, 0.0, 0.0)


def test_the_limit_of_equal_moments_is_reached_without_a_step():
    omega0, t = (0.7, -0.2, 1.1), np.linspace(0.0, 20.0, 11)
    for equal in ((2.0, 2.0, 3.0), (2.0, 2.0, 1.0), (2.0, 2.0, 2.0)):
        near = np.array(equal) * [1.0, 1.0 + 1e-12, 1.0]
        for solution in (free_body.omega, free_body.herpolhode):
            found, expected = (np.asarray(solution(t, body, omega0)) for body in (near, equal))
            if solution is free_body.herpolhode:  # of a sphere only the point itself
                found, expected = found[0], expected[0]
            # The moments differ by 1e-12, for 20 s at 1 rad/s.
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


def test_bodies_that_are_not_what_is_asked_for_are_refused():
    with pytest.raises(ValueError, match="two equal"):
        free_body.symmetric_rates((1.0, 2.0, 3.0), (1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="two equal"):
        free_body.symmetric_cones((1.0, 2.0, 3.0), (1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"^i3 = 1.0; expected above"):
        free_body.chandler_period(1.0, i_perp=1.0, i3=1.0)
    with pytest.raises(ValueError, match=r"^omega3 = 0.0; expected"):
        free_body.chandler_period(0.0, i_perp=1.0, i3=1.1)
    with pytest.raises(ValueError, match=r"^i_perp = "):
        free_body.chandler_turns(i_perp=-1.0, i3=1.1)
