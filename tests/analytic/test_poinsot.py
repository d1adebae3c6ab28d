import math
from operator import itemgetter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rigid_envs.systems.free_body import closed_forms as free_body
from tests.reference import cases

EPS = np.finfo(np.float64).eps
BODY = (1.0, 2.0, 3.0)
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def rotated(q, vectors):
    return Rotation.from_quat(q, scalar_first=True).apply(vectors)


def contact(t, moments, omega0, q0):
    """Radius and angle in the plane across L, from angular velocity and attitude."""
    normal, distance = free_body.invariable_plane(moments, omega0, q0)
    omega = rotated(free_body.attitude(t, moments, omega0, q0), free_body.omega(t, moments, omega0))
    across = Rotation.align_vectors([[0.0, 0.0, 1.0]], [normal])[0].apply(omega)
    assert np.allclose(across[:, 2], distance, rtol=0, atol=1e-12 * (1.0 + distance))
    return across[:, 0] + 1j * across[:, 1]


@pytest.mark.parametrize("case", cases("free_top"), ids=itemgetter("id"))
def test_poinsots_construction_agrees_with_the_reference(case):
    moments, omega0, scalars = case["in"]["I"], case["in"]["w0"], case["scalars"]
    roll = free_body.poinsot(moments, omega0)
    found = {
        "L": roll.momentum,
        "twoT": 2.0 * roll.energy,
        "plane_distance_rho": roll.ellipsoid_distance,
        "omega_along_L": roll.distance,
        "herpolhode_rmin": roll.radius_min,
        "herpolhode_rmax": roll.radius_max,
        "herpolhode_advance_per_polhode_period": roll.advance,
        "polhode_period": roll.period,
    }
    for name, expected in scalars["poinsot"].items():
        # Relative to the last bits, the radius of 1e-14 beside the separatrix too; on the
        # separatrix the 50 digits of the reference leave 1e-43 of what is 0.
        np.testing.assert_allclose(
            found[name], float(expected), rtol=16 * EPS, atol=1e-40, err_msg=name
        )
    assert 2.0 * roll.energy == pytest.approx(scalars["twoT"], rel=8 * EPS)
    normal, distance = free_body.invariable_plane(moments, omega0, case["in"]["q0"])
    np.testing.assert_allclose(
        normal * roll.momentum, scalars["Lspace"], rtol=0, atol=8 * EPS * roll.momentum
    )
    assert distance == roll.distance


@pytest.mark.parametrize("case", cases("free_top"), ids=itemgetter("id"))
def test_the_herpolhode_agrees_with_the_reference(case):
    moments, omega0, n = case["in"]["I"], case["in"]["w0"], np.array(case["scalars"]["Lspace"])
    n /= np.linalg.norm(n)
    omega = np.array(case["out"]["w_space"])
    expected = omega - np.outer(omega @ n, n)
    radius, angle = free_body.herpolhode(case["t"], moments, omega0)
    # As for omega: cond eps from the input, and the rounding of a phase of some hundred radians.
    scale = max(1.0, float(np.linalg.norm(omega0)))
    tolerance = EPS * min(16.0 * case["cond"]["w_space"], 4000.0 * scale)
    np.testing.assert_allclose(radius, np.linalg.norm(expected, axis=-1), rtol=0, atol=tolerance)
    # The angle is counted from t = 0, which is not among the samples: from the first one instead.
    first = expected[0]
    along, left = expected @ first, expected @ np.cross(n, first)
    turned = np.stack([along, left]) / (np.linalg.norm(first) or 1.0)
    found = radius * np.stack([np.cos(angle - angle[0]), np.sin(angle - angle[0])])
    # The direction of a short first radius is uncertain, of one that is 0 without meaning.
    lever = np.max(radius) / max(radius[0], tolerance)
    np.testing.assert_allclose(found, turned, rtol=0, atol=4.0 * tolerance * max(lever, 1.0))


MOMENTS = st.lists(
    st.one_of(st.sampled_from([0.5, 1.0, 1.0 + 1e-15]), st.floats(0.5, 1.0)),
    min_size=3,
    max_size=3,
)
RATE = st.one_of(
    st.sampled_from([0.0, -0.0, 1.0, -1.0, 1e-8]), st.floats(-2.0, 2.0).map(lambda x: round(x, 13))
)
OMEGA = st.tuples(RATE, RATE, RATE)


@settings(max_examples=200)
@given(moments=MOMENTS, omega0=OMEGA, seed=st.integers(0, 2**32 - 1))
def test_the_herpolhode_is_where_the_attitude_takes_omega(moments, omega0, seed):
    q0 = Rotation.random(rng=np.random.default_rng(seed)).as_quat(scalar_first=True)
    t = np.array([0.0, -7.0, 0.3, 2.0, 11.0])
    z = contact(t, moments, omega0, q0)
    radius, angle = free_body.herpolhode(t, moments, omega0)
    assert angle[0] == 0.0
    found = radius * np.exp(1j * angle)
    # 200 eps: t omega of some 25 radians is rounded once, and all else a few times.
    tolerance = 200.0 * EPS * (1.0 + float(np.linalg.norm(omega0)))
    turn = np.vdot(found, z)
    if abs(turn) > 0.0:  # else both are the centre
        found = found * turn / abs(turn)
    np.testing.assert_allclose(found, z, rtol=0, atol=tolerance)
    roll = free_body.poinsot(moments, omega0)
    assert np.all(radius <= roll.radius_max + tolerance)
    assert np.all(radius >= roll.radius_min - tolerance)
    assert math.isfinite(roll.distance) and math.isfinite(roll.ellipsoid_distance)


def test_the_herpolhode_touches_both_circles_and_closes_its_shape_after_half_a_period():
    omega0 = (0.3, 1.0, 0.1)
    path, roll = free_body.polhode(BODY, omega0), free_body.poinsot(BODY, omega0)
    extremes = (np.arange(9) * 0.25 * path.period - path.start / path.rate).reshape(9)
    radius, angle = free_body.herpolhode(extremes, BODY, omega0)
    np.testing.assert_allclose(radius[::2], roll.radius_max, rtol=1e-13)
    np.testing.assert_allclose(radius[1::2], roll.radius_min, rtol=1e-13)
    np.testing.assert_allclose(np.diff(angle), roll.advance / 4.0, rtol=1e-13)


def test_the_ellipsoid_rolls_without_slip():
    # The length of the polhode is that of the herpolhode: both are drawn by the same contact.
    omega0, t = (0.3, 1.0, 0.1), np.linspace(0.0, 9.0, 200001)
    radius, angle = free_body.herpolhode(t, BODY, omega0)
    plane = radius * np.exp(1j * angle)
    body = free_body.omega(t, BODY, omega0)
    lengths = [
        np.sum(np.linalg.norm(np.diff(curve, axis=0), axis=-1))
        for curve in (np.stack([plane.real, plane.imag], axis=-1), body)
    ]
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-9)  # chords: (kappa ds)^2 / 24


def test_the_herpolhode_of_a_symmetric_body_is_the_edge_of_its_space_cone():
    moments, omega0 = (1.3, 1.3, 0.7), (0.4, -0.3, 1.1)
    roll, cones = free_body.poinsot(moments, omega0), free_body.symmetric_cones(moments, omega0)
    edge = math.hypot(*omega0) * math.sin(cones.space_angle)
    assert roll.radius_min == pytest.approx(edge, rel=1e-14)
    assert roll.radius_max == pytest.approx(edge, rel=1e-14)
    assert roll.advance / roll.period == pytest.approx(cones.space_rate, rel=1e-14)


def test_a_body_at_rest_or_in_steady_rotation_has_a_contact_that_stands_still():
    t = np.linspace(0.0, 5.0, 3)
    for moments in (BODY, (1.0, 1.0, 2.0), (1.0, 1.0, 1.0)):
        for omega0 in ((0.0, 0.0, 0.0), *(2.0 * np.eye(3))):
            roll = free_body.poinsot(moments, omega0)
            assert roll.distance == pytest.approx(np.linalg.norm(omega0), rel=1e-15)
            assert roll.radius_min == roll.radius_max == 0.0
            assert not free_body.herpolhode(t, moments, omega0)[0].any()
            normal, _ = free_body.invariable_plane(moments, omega0, UPRIGHT)
            assert np.linalg.norm(normal) == pytest.approx(1.0, rel=1e-15)
            if any(omega0):
                axis = int(np.argmax(omega0))
                assert normal[axis] == 1.0
                inertia = moments[axis]
                assert roll.ellipsoid_distance == pytest.approx(inertia**-0.5, rel=1e-15)


@pytest.mark.parametrize("scale", [2.0**-500, 2.0**400])
def test_slow_and_fast_motions_draw_the_same_herpolhode(scale):
    omega0 = np.array([0.1, 1.0, -0.2])
    here, there = (free_body.poinsot(BODY, s * omega0) for s in (1.0, scale))
    assert there.distance == pytest.approx(scale * here.distance, rel=4 * EPS)
    assert there.ellipsoid_distance == pytest.approx(here.ellipsoid_distance, rel=4 * EPS)
    assert there.advance == pytest.approx(here.advance, rel=4 * EPS)
    t = np.linspace(0.0, 7.0, 5)
    (radius, angle), (far, turn) = (
        free_body.herpolhode(t / s, BODY, s * omega0) for s in (1.0, scale)
    )
    np.testing.assert_allclose(far, scale * radius, rtol=16 * EPS)
    np.testing.assert_allclose(turn, angle, rtol=16 * EPS)


def test_bad_input_is_refused_by_name():
    with pytest.raises(ValueError, match=r"^moments\[1\] = -2.0; expected positive"):
        free_body.poinsot((1.0, -2.0, 3.0), (1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"^q0 = .*; expected length 1"):
        free_body.invariable_plane(BODY, (1.0, 0.0, 0.0), (1.0, 1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"^t = inf; expected"):
        free_body.herpolhode(math.inf, BODY, (1.0, 0.0, 0.0))
