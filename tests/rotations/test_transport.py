"""Tensors and rates in two frames, against SciPy, invariants and differences along a motion."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rigid_envs.mechanics import rotations as rot
from tests.rotations.attitudes import ULPS, quaternions, scipy_of, vectors

tensors = st.lists(st.floats(-1.0, 1.0), min_size=9, max_size=9).map(
    lambda entries: np.reshape(entries, (3, 3))
)


@given(quaternions, tensors, vectors)
def test_a_tensor_maps_the_same_vectors_in_every_frame(q, tensor, v):
    seen = rot.rotate_tensor(q, tensor) @ scipy_of(q).apply(v)
    np.testing.assert_allclose(seen, scipy_of(q).apply(tensor @ v), rtol=0, atol=2 * ULPS)


@given(quaternions, tensors)
def test_the_coefficients_of_the_characteristic_polynomial_do_not_change(q, tensor):
    turned = rot.rotate_tensor(q, tensor)
    for of in (np.trace, np.linalg.det, lambda t: np.trace(t @ t)):
        # entries up to 1 make determinants and traces of squares up to 6 and 9
        np.testing.assert_allclose(of(turned), of(tensor), rtol=0, atol=9 * ULPS)


@given(quaternions, tensors)
def test_the_matrix_does_as_its_quaternion_and_its_transpose_leads_back(q, tensor):
    R = scipy_of(q).as_matrix()
    turned = rot.transform_tensor(R, tensor)
    np.testing.assert_allclose(turned, rot.rotate_tensor(q, tensor), rtol=0, atol=2 * ULPS)
    np.testing.assert_allclose(rot.transform_tensor(R.T, turned), tensor, rtol=0, atol=2 * ULPS)
    back = rot.rotate_tensor(rot.conjugate(q), turned)
    np.testing.assert_allclose(back, tensor, rtol=0, atol=2 * ULPS)


@given(quaternions, vectors)
def test_the_tensor_of_a_cross_product_is_that_of_the_turned_vector(q, v):
    turned = rot.rotate_tensor(q, rot.hat(v))
    np.testing.assert_allclose(turned, rot.hat(scipy_of(q).apply(v)), rtol=0, atol=2 * ULPS)


@given(quaternions, vectors, vectors, vectors)
def test_the_world_rate_is_the_derivative_of_the_turning_vector(q, v, rate, omega):
    h = 1e-5  # central difference: truncation h^2 |omega|^2 (|omega| |v| + 3 |rate|) / 6 < 5e-10,

    def seen(t):  # rounding 16 eps |v| / h < 7e-10
        turn = scipy_of(q) * scipy_of(rot.exp(t * omega))
        return turn.apply(v + t * rate)

    slope = (seen(h) - seen(-h)) / (2 * h)
    np.testing.assert_allclose(rot.world_rate(q, v, rate, omega), slope, rtol=0, atol=1.2e-9)


@given(quaternions, vectors, vectors, vectors)
def test_the_body_rate_undoes_the_world_rate(q, v, rate, omega):
    there = rot.world_rate(q, v, rate, omega)
    back = rot.body_rate(q, rot.rotate(q, v), there, omega)
    np.testing.assert_allclose(back, rate, rtol=0, atol=2 * ULPS)


@given(quaternions, vectors, vectors)
def test_what_rests_in_the_world_goes_round_the_other_way_in_the_body(q, v, omega):
    still = rot.body_rate(q, rot.rotate(q, v), np.zeros(3), omega)
    np.testing.assert_allclose(still, np.cross(v, omega), rtol=0, atol=2 * ULPS)
    assert np.array_equal(rot.world_rate(q, omega, np.zeros(3), omega), np.zeros(3))
