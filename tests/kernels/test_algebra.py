"""Algebra of vectors and quaternions: turns, their polynomials, weights of the parts of a step."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rigid_envs.engine import algebra
from tests.mechanics.attitudes import ULPS, quaternions, scipy_of, vectors


def row(array):
    return tuple(float(x) for x in array)


def close(found, expected, size=1.0):
    np.testing.assert_allclose(found, expected, rtol=0, atol=ULPS * size)


@given(vectors, vectors)
def test_products_of_vectors_are_numpys(a, b):
    close(algebra.dot(row(a), row(b)), np.dot(a, b))
    close(algebra.cross(row(a), row(b)), np.cross(a, b))
    assert algebra.scaled(2.5, row(a)) == row(2.5 * a)


@given(quaternions)
def test_matrix_and_vertical_are_those_of_the_rotation(q):
    R = scipy_of(q).as_matrix()
    close(np.reshape(algebra.matrix(row(q)), (3, 3)), R)
    close(algebra.vertical(row(q)), R.T @ (0.0, 0.0, 1.0))


@given(quaternions, quaternions)
def test_the_product_of_a_matrix_and_a_transpose_is_numpys(p, q):
    A, B = scipy_of(p).as_matrix(), scipy_of(q).as_matrix()
    close(np.reshape(algebra.matrix_product(row(A.ravel()), row(B.ravel())), (3, 3)), A @ B.T)


@given(quaternions)
@example((1.0, 0.0, 0.0, 0.0))
@example((0.0, 1.0, 0.0, 0.0))
@example((0.0, 0.0, 1.0, 0.0))
@example((0.0, 0.0, 0.0, 1.0))
def test_the_quaternion_of_a_matrix_turns_as_it_does(q):
    R = scipy_of(q).as_matrix()
    found = algebra.unit_quaternion(row(R.ravel()))
    close(np.dot(found, found), 1.0)
    close(scipy_of(found).as_matrix(), R)


@given(quaternions)
def test_the_logarithm_is_the_rotation_vector(q):
    found = np.array(algebra.log_rotation(row(q)))
    expected = scipy_of(q).as_rotvec()
    # At half a turn both signs of the axis are right.
    if np.linalg.norm(expected) > math.pi - 1e-6:
        found, expected = np.outer(found, found), np.outer(expected, expected)
    close(found, expected, 2.0 * math.pi)


@given(st.floats(1e-300, 1e-3), vectors.filter(lambda v: np.linalg.norm(v) > 0.1))
def test_the_logarithm_of_a_small_turn_keeps_its_relative_accuracy(angle, v):
    axis = v / np.linalg.norm(v)
    q = (math.cos(0.5 * angle), *row(math.sin(0.5 * angle) * axis))
    close(np.array(algebra.log_rotation(q)) / angle, axis)


def test_the_logarithm_of_no_turn_is_zero():
    assert algebra.log_rotation((1.0, 0.0, 0.0, 0.0)) == (0.0, 0.0, 0.0)
    assert not any(algebra.log_rotation((-1.0, 0.0, 0.0, 0.0)))


@pytest.mark.parametrize("excess", [1e-15, -1e-12, 1e-9, -1e-8])
def test_one_newton_step_restores_a_length_that_is_nearly_one(excess):
    q = (1.0 + excess) * np.array([0.5, -0.5, 0.1, 0.7])
    # Newton's step on 1 / sqrt: what is left is 1.5 excess^2, and roundings.
    length = np.linalg.norm(algebra.normalize_near_unit(row(q)))
    assert length == pytest.approx(1.0, abs=1.5 * excess**2 + ULPS)


EPS = float(np.finfo(np.float64).eps)
TINY = [0.0, 1e-300, 1e-20]


@pytest.mark.parametrize("x", [0.01, 0.1, 0.2, 0.3, 0.4, 0.5])
def test_the_tangent_of_half_a_turn_is_exact_but_for_its_first_neglected_term(x):
    exact = mpmath.tan(mpmath.mpf(x)) / mpmath.mpf(x)
    error = abs(float(algebra.tangent(x * x) - exact))
    assert error <= 0.01 * x**10 + 2.0 * EPS


@pytest.mark.parametrize("z", TINY)
def test_the_tangent_of_no_turn_is_its_argument(z):
    assert algebra.tangent(z) == 1.0


@pytest.mark.parametrize("a", [0.0, 1e-9, -0.3, 1.0, 7.0])
def test_versine_and_sine_of_a_cayley_turn_are_those_of_its_angle(a):
    versine, sine = algebra.cayley(a)
    angle = 2 * mpmath.atan(mpmath.mpf(a))
    assert sine == pytest.approx(float(mpmath.sin(angle)), rel=4.0 * EPS)
    assert versine == pytest.approx(float(1 - mpmath.cos(angle)), rel=8.0 * EPS)


def test_suzuki_coefficients_are_the_closed_form_rounded_once():
    outer = float(1 / (4 - mpmath.cbrt(mpmath.mpf(4))))
    assert algebra.SUZUKI == (outer, outer, 1.0 - 4.0 * outer, outer, outer)


def test_suzuki_coefficients_fulfil_the_order_conditions_of_a_symmetric_fourth_order_method():
    assert algebra.SUZUKI == algebra.SUZUKI[::-1]
    # Consistency, and no third-order term: Hairer, Lubich & Wanner, theorem II.4.1.
    assert sum(algebra.SUZUKI) == 1.0  # exactly: a million steps last a million steps
    assert sum(weight**3 for weight in algebra.SUZUKI) == pytest.approx(0.0, abs=2e-16)


def test_the_exact_flow_is_taken_in_one_piece():
    assert algebra.EXACT == (1.0,)
