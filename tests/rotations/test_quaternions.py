"""The algebra of attitudes against the axioms of a group, SciPy, and the law of uniform samples."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from rigid_envs.mechanics import rotations as rot
from tests.rotations.attitudes import EPS, ULPS, quaternions, scipy_of, vectors


@given(quaternions)
def test_a_normalised_quaternion_passes_bit_for_bit(q):
    q = rot.normalize(q)
    assert np.array_equal(rot.conjugate(rot.conjugate(q)), q)
    assert np.array_equal(abs(rot.canonicalize(q)), abs(q))


@pytest.mark.parametrize("scale", [5e-324, 1e-300, 1e300])
def test_normalize_neither_overflows_nor_underflows(scale):
    q = rot.normalize([scale, 0.0, -scale, 0.0])
    np.testing.assert_allclose(q, [0.5**0.5, 0.0, -(0.5**0.5), 0.0], rtol=2 * EPS)


@given(quaternions, quaternions, quaternions)
def test_attitudes_form_a_group(p, q, r):
    one = rot.identity()
    triple = rot.multiply(p, rot.multiply(q, r))
    np.testing.assert_allclose(rot.multiply(rot.multiply(p, q), r), triple, rtol=0, atol=ULPS)
    np.testing.assert_allclose(rot.multiply(q, rot.conjugate(q)), one, rtol=0, atol=ULPS)
    assert np.array_equal(rot.multiply(one, rot.normalize(q)), rot.normalize(q))
    assert abs(np.linalg.norm(rot.multiply(p, q)) - 1.0) <= ULPS


@given(quaternions, quaternions, vectors)
def test_products_rotations_and_matrices_agree_with_scipy(p, q, v):
    both = scipy_of(p) * scipy_of(q)
    R = rot.matrix_from_quaternion(rot.multiply(p, q))
    np.testing.assert_allclose(R, both.as_matrix(), rtol=0, atol=ULPS)
    np.testing.assert_allclose(rot.rotate(q, v), scipy_of(q).apply(v), rtol=0, atol=ULPS)
    back = scipy_of(q).apply(v, inverse=True)
    np.testing.assert_allclose(rot.rotate_inverse(q, v), back, rtol=0, atol=ULPS)


@given(quaternions)
def test_canonical_quaternions_have_the_same_bits_for_both_signs_and_no_negative_zero(q):
    for same in (q, q * [0, 1, 1, 1], q * [0, 0, 1, 1], q * [0, 0, 0, 1]):
        if np.any(same):
            same = rot.normalize(same)
            chosen = rot.canonicalize(same)
            assert chosen.tobytes() == rot.canonicalize(-same).tobytes()
            assert chosen[np.flatnonzero(chosen)[0]] > 0.0
            assert not np.any(np.signbit(chosen[chosen == 0.0]))


@given(quaternions, vectors)
def test_the_quaternion_rate_is_the_derivative_along_a_turn_in_the_body(q, omega):
    h = 1e-5  # central difference: error h^2 |omega|^3 / 48 < 2e-11, rounding 8 eps / h = 2e-10
    ahead, behind = (scipy_of(q) * Rotation.from_rotvec(s * h * omega) for s in (1, -1))
    change = ahead.as_quat(scalar_first=True), behind.as_quat(scalar_first=True)
    signed = [c * np.sign(c @ q) for c in change]
    slope = (signed[0] - signed[1]) / (2 * h)
    np.testing.assert_allclose(rot.quaternion_rate(q, omega), slope, rtol=0, atol=2e-10)


# Distance


@given(quaternions, quaternions, quaternions)
def test_distance_is_a_metric_of_attitudes_that_turning_both_leaves_alone(p, q, r):
    d = rot.distance(p, q)
    assert 0.0 <= d <= np.pi
    assert d == pytest.approx((scipy_of(p).inv() * scipy_of(q)).magnitude(), abs=ULPS)
    assert rot.distance(p, p) == rot.distance(p, -p) == 0.0
    assert rot.distance(q, p) == pytest.approx(d, abs=ULPS)
    assert d <= rot.distance(p, r) + rot.distance(r, q) + ULPS
    for left, right in (
        (rot.multiply(r, p), rot.multiply(r, q)),
        (rot.multiply(p, r), rot.multiply(q, r)),
    ):
        assert rot.distance(left, right) == pytest.approx(d, abs=ULPS)


@given(st.floats(1e-300, np.pi))
def test_the_angle_keeps_its_relative_accuracy_down_to_nothing(turn):
    q = np.array([np.cos(turn / 2), 0.0, -np.sin(turn / 2), 0.0])
    assert rot.angle(q) == pytest.approx(turn, rel=4 * EPS)
    assert rot.distance(rot.identity((2,)), -q) == pytest.approx(turn, rel=4 * EPS)


@given(st.floats(1e-300, 0.1))
def test_the_angle_is_accurate_near_a_half_turn(short):
    q = np.array([np.sin(short / 2), 0.0, 0.0, np.cos(short / 2)])
    assert rot.angle(q) == pytest.approx(np.pi - short, rel=2 * EPS)


# Samples


def test_random_attitudes_are_uniform():
    n = 100_000
    q = rot.random_quaternion(np.random.default_rng(0), (n,))
    # Uniform on the 3-sphere: E q_i q_j = d_ij / 4, E q_i^4 = 1/8, so that the standard deviation
    # of an entry of q q^T is at most 1/4, and of q 1/2. Five of them: one seed in 1e5 fails.
    np.testing.assert_allclose(q.mean(axis=0), 0.0, atol=5 * 0.5 / n**0.5)
    np.testing.assert_allclose(q.T @ q / n, np.eye(4) / 4, atol=5 * 0.25 / n**0.5)
    np.testing.assert_allclose((q**4).mean(axis=0), 1 / 8, atol=5 * 0.15 / n**0.5)


def test_the_angle_of_a_random_attitude_has_density_one_minus_cosine_over_pi():
    a = rot.angle(rot.random_quaternion(np.random.default_rng(1), (20_000,)))
    assert kstest(a, lambda x: (x - np.sin(x)) / np.pi).pvalue > 1e-3


def test_samples_come_from_the_generator_alone_and_have_the_asked_shape():
    one, two = (rot.random_quaternion(np.random.default_rng(5), (2, 3)) for _ in range(2))
    assert one.shape == (2, 3, 4) and np.array_equal(one, two)
    assert rot.random_quaternion(np.random.default_rng(5)).shape == (4,)
    with pytest.raises(ValueError, match="rng = 5; expected a numpy Generator"):
        rot.random_quaternion(5)


def test_the_identity_has_the_asked_shape_and_turns_nothing():
    assert rot.identity((2, 3)).shape == (2, 3, 4)
    assert np.array_equal(rot.rotate(rot.identity((2,)), [1.0, 2.0, 3.0]), [[1, 2, 3]] * 2)
