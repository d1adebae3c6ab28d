"""The attitude as it is observed: four representations of one rotation."""

import math
from operator import itemgetter

import numpy as np
import pytest
from hypothesis import given
from scipy.spatial.transform import Rotation

from rigid_envs.engine import publication as attitude
from tests.mechanics.attitudes import ULPS, quaternions, scipy_of
from tests.reference import cases


def row(array):
    return tuple(float(x) for x in array)


@given(quaternions)
def test_the_canonical_quaternion_has_no_negative_scalar_part(q):
    found = np.array(attitude.canonical(row(q)))
    assert found[0] >= 0.0
    np.testing.assert_allclose(scipy_of(found).as_matrix(), scipy_of(q).as_matrix(), atol=ULPS)


@given(quaternions)
def test_rot6d_is_the_first_two_columns(q):
    R = scipy_of(q).as_matrix()
    np.testing.assert_allclose(attitude.rot6d(row(q)), [*R[:, 0], *R[:, 1]], rtol=0, atol=ULPS)


@given(quaternions)
def test_euler_angles_rebuild_the_rotation_and_stay_in_their_ranges(q):
    phi, theta, psi = attitude.euler(row(q))
    assert 0.0 <= theta <= math.pi
    assert max(abs(phi), abs(psi)) <= math.pi
    rebuilt = Rotation.from_euler("ZXZ", (phi, theta, psi)).as_matrix()
    np.testing.assert_allclose(rebuilt, scipy_of(q).as_matrix(), rtol=0, atol=ULPS)


@pytest.mark.parametrize("case", cases("euler_angles"), ids=itemgetter("id"))
def test_euler_angles_agree_with_the_reference(case):
    given_, q = case["in"], case["out"]["q"]
    phi, theta, psi = attitude.euler(row(q))
    # Near theta = 0 only the sum of the other two is determined, to rounding over sin(theta).
    sine = math.sin(given_["theta"])
    # The printed quaternion is rounded; theta near pi loses nothing, being 2 atan2.
    assert theta == pytest.approx(given_["theta"], abs=ULPS)
    if sine > 1e-3:
        turns = (np.array([phi, psi]) - (given_["phi"], given_["psi"])) / (2.0 * math.pi)
        np.testing.assert_allclose(turns, np.round(turns), rtol=0, atol=ULPS / sine)


@pytest.mark.parametrize("q", [(1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.6, 0.8, 0.0)])
def test_euler_angles_are_finite_where_they_are_singular(q):
    assert np.isfinite(attitude.euler(q)).all()
