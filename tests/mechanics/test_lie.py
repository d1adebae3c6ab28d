"""exp, log, Jacobians and geodesics against 40-digit arithmetic, matrix exponentials and SciPy."""

import mpmath
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rigid_envs.mechanics import rotations as rot
from tests.mechanics.attitudes import EPS, ULPS, quaternions, random_vectors, scipy_of, vectors

LENGTHS = [(1e-300, 1e-8), (1e-8, 1e-2), (1e-2, np.pi - 1e-9)]
every_length = pytest.mark.parametrize(("low", "high"), LENGTHS)


def exact_exp(v):
    with mpmath.workdps(40):
        x = [mpmath.mpf(float(c)) for c in v]
        half = mpmath.sqrt(sum(c * c for c in x)) / 2
        return [float(c) for c in (mpmath.cos(half), *(mpmath.sinc(half) * c / 2 for c in x))]


def exact_expm(matrix):
    with mpmath.workdps(40):
        return np.array(mpmath.expm(mpmath.matrix(matrix.tolist())).tolist(), dtype=float)


def exact_log(q):
    with mpmath.workdps(40):
        w, *u = [mpmath.mpf(float(c)) for c in q]
        length = mpmath.sqrt(sum(c * c for c in u))
        return [float(2 * mpmath.atan2(length, w) / length * c) for c in u]


@every_length
def test_exp_is_accurate_to_rounding_in_every_entry(low, high):
    v = random_vectors(np.random.default_rng(0), 200, low, high)
    v[::2] *= [1.0, 1e-5, 1e-9]  # entries of different size
    q = rot.exp(v)
    exact = np.array([exact_exp(row) for row in v])
    np.testing.assert_allclose(q[:, 1:], exact[:, 1:], rtol=4 * EPS, atol=0)
    np.testing.assert_allclose(q[:, 0], exact[:, 0], rtol=0, atol=2 * EPS)  # a cosine


@every_length
def test_log_is_accurate_to_rounding_in_every_entry(low, high):
    q = rot.exp(random_vectors(np.random.default_rng(1), 200, low, high))
    np.testing.assert_allclose(rot.log(q), [exact_log(row) for row in q], rtol=6 * EPS, atol=0)


@given(quaternions)
def test_exp_inverts_log_which_is_the_shortest_and_the_same_for_both_signs(q):
    v = rot.log(q)
    assert np.linalg.norm(v) <= np.pi * (1.0 + EPS)
    assert v.tobytes() == rot.log(-q).tobytes()
    np.testing.assert_allclose(rot.exp(v), rot.canonicalize(q), rtol=0, atol=ULPS)
    assert (scipy_of(q).inv() * Rotation.from_rotvec(v)).magnitude() <= ULPS


@given(st.floats(1e-300, 0.1), vectors.filter(lambda v: np.linalg.norm(v) > 0.1))
def test_log_is_accurate_near_a_half_turn(short, v):
    axis = v / np.linalg.norm(v)
    found = rot.log([np.sin(short / 2), *(np.cos(short / 2) * axis)])
    np.testing.assert_allclose(found, (np.pi - short) * axis, rtol=0, atol=ULPS)


def test_no_rotation_and_a_half_turn_have_finite_logarithms():
    assert np.array_equal(rot.log(rot.identity()), [0, 0, 0])
    assert np.array_equal(rot.exp([0.0, 0.0, 0.0]), rot.identity())
    assert np.array_equal(rot.log([0.0, 0.0, -1.0, 0.0]), [0, np.pi, 0])


@pytest.mark.parametrize("size", [5e-324, 1e-160, 1e17, 1e308])
def test_exp_is_unit_and_finite_for_any_finite_vector(size):
    assert np.linalg.norm(rot.exp([size, -size, size])) == pytest.approx(1.0, abs=ULPS)


@given(quaternions)
def test_axis_and_angle_go_round(q):
    axis, angle = rot.axis_angle_from_quaternion(q)
    assert 0.0 <= angle <= np.pi and abs(np.linalg.norm(axis) - 1.0) <= ULPS
    back = rot.quaternion_from_axis_angle(axis, angle)
    np.testing.assert_allclose(back, rot.canonicalize(q), rtol=0, atol=ULPS)


@pytest.mark.parametrize("size", [1e-300, 1e-8, 1.0])
def test_the_axis_of_a_tiny_turn_is_not_lost(size):
    axis, angle = rot.axis_angle_from_quaternion(rot.exp([0.0, 3 * size / 5, 4 * size / 5]))
    np.testing.assert_allclose(axis, [0.0, 0.6, 0.8], rtol=4 * EPS)
    assert angle == pytest.approx(size, rel=4 * EPS)


def test_the_axis_of_no_turn_is_vertical():
    axis, angle = rot.axis_angle_from_quaternion([-1.0, 0.0, 0.0, 0.0])
    assert np.array_equal(axis, [0, 0, 1]) and angle == 0.0


# so(3) and Jacobians
@given(vectors, vectors)
@example(np.array([0.0, 0.0, 4.19644759e-308]), np.zeros(3))  # its half is subnormal
def test_hat_is_the_cross_product_and_vee_its_inverse(v, u):
    np.testing.assert_allclose(rot.hat(v) @ u, np.cross(v, u), rtol=0, atol=4 * EPS)
    assert np.array_equal(rot.vee(rot.hat(v)), v)


@given(vectors)
def test_the_matrix_exponential_of_hat_is_the_matrix_of_exp(v):
    R = rot.matrix_from_quaternion(rot.exp(3.0 * v))
    np.testing.assert_allclose(R, exact_expm(rot.hat(3.0 * v)), rtol=0, atol=ULPS)


def test_vee_refuses_a_matrix_that_is_not_skew():
    with pytest.raises(ValueError, match=r"^skew\[1\] = .*skew-symmetric"):
        rot.vee([np.zeros((3, 3)), np.eye(3)])


@pytest.mark.parametrize(("low", "high"), [(1e-300, 1e-2), (1e-2, 1.1), (0.9, 20.0)])
def test_the_left_jacobian_is_the_integral_of_the_rotation_along_the_way(low, high):
    for v in random_vectors(np.random.default_rng(3), 50, low, high):
        # exp of [[V, 1], [0, 0]] has the integral of exp(s V) over s in [0, 1] in its corner
        block = np.block([[rot.hat(v), np.eye(3)], [np.zeros((3, 6))]])
        J = rot.left_jacobian(v)
        np.testing.assert_allclose(J, exact_expm(block)[:3, 3:], rtol=0, atol=ULPS)
        np.testing.assert_allclose(rot.right_jacobian(v), J.T, rtol=0, atol=EPS)


@pytest.mark.parametrize("a", [1e-300, 1e-9, 1e-3, 0.5, 1.0 - EPS, 1.0, 1.5, 3.0, 6.0])
def test_the_left_jacobian_is_accurate_in_every_entry(a):
    with mpmath.workdps(40 if a > 1e-10 else 700):
        x = mpmath.mpf(a)
        one, quadratic = (1 - mpmath.cos(x)) / x, 1 - mpmath.sinc(x)
        axis = mpmath.mpf(0.6), mpmath.mpf(0.8)
        row = [1 - quadratic * axis[1] ** 2, quadratic * axis[0] * axis[1], one * axis[1]]
        exact = [float(entry) for entry in row]
    J = rot.left_jacobian([0.6 * a, 0.8 * a, 0.0])
    np.testing.assert_allclose(J[0], exact, rtol=16 * EPS, atol=1e-320)


@given(vectors)
def test_inverse_jacobians_invert(v):
    v = 3.0 * v  # up to 5.2: the condition number is a / (2 sin(a / 2)) < 6
    for one, other in (
        (rot.left_jacobian(v), rot.left_jacobian_inverse(v)),
        (rot.right_jacobian(v), rot.right_jacobian_inverse(v)),
    ):
        np.testing.assert_allclose(one @ other, np.eye(3), rtol=0, atol=6 * ULPS)


@pytest.mark.parametrize("inverse", [rot.left_jacobian_inverse, rot.right_jacobian_inverse])
def test_inverse_jacobians_refuse_a_full_turn(inverse):
    with pytest.raises(ValueError, match=r"rotation_vector\[1\].*below 2 pi"):
        inverse([[0.0, 0.0, 6.28], [0.0, 0.0, 2 * np.pi]])


# Geodesics
@given(quaternions, quaternions, st.floats(0.0, 1.0))
def test_slerp_turns_at_constant_rate_on_the_shortest_way(p, q, t):
    way, turn = rot.slerp(p, q, t), rot.distance(p, q)
    assert rot.distance(p, way) == pytest.approx(t * turn, abs=ULPS)
    assert rot.distance(way, q) == pytest.approx((1.0 - t) * turn, abs=ULPS)
    assert rot.distance(rot.slerp(p, -q, t), way) <= ULPS


def test_slerp_starts_exactly_at_its_start_and_goes_on_beyond_its_end():
    p, q = rot.exp([[0.0, 0.0, 0.2], [0.0, 0.0, 0.5]])
    assert np.array_equal(rot.slerp(p, q, 0.0), p)
    np.testing.assert_allclose(rot.log(rot.slerp(p, q, [-1.0, 2.0]))[:, 2], [-0.1, 0.8], rtol=ULPS)
