"""Matrices, the 6-D form and Euler angles against SciPy and the reference cases."""

from operator import itemgetter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rigid_envs.mechanics import rotations as rot
from tests.reference import cases
from tests.rotations.attitudes import EPS, ULPS, angles, quaternions, scipy_of, vectors

every_euler_case = pytest.mark.parametrize("case", cases("euler_angles"), ids=itemgetter("id"))
corners = st.sampled_from([0.0, 1e-300, 1e-12, 1e-8, 0.5, np.pi - 1e-8, np.pi - 1e-12, np.pi])
nutations = st.one_of(st.floats(0.0, np.pi), corners)


@given(quaternions)
def test_quaternion_and_matrix_go_round_in_every_branch(q):
    R = rot.matrix_from_quaternion(q)
    back = rot.quaternion_from_matrix(R)
    np.testing.assert_allclose(back * np.sign(back @ q), q, rtol=0, atol=ULPS)
    np.testing.assert_allclose(R.T @ R, np.eye(3), rtol=0, atol=ULPS)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, -1, 0), (0, 0, 1), (1, 0, 1), (1, -1, 1)])
@pytest.mark.parametrize("angle", [1e-12, 1.0, 2.0, np.pi - 1e-9, np.pi])
def test_quaternions_of_matrices_near_half_turns_are_accurate(axis, angle):
    turn = Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis))
    found = rot.quaternion_from_matrix(turn.as_matrix())
    assert rot.distance(found, turn.as_quat(scalar_first=True)) <= ULPS


@every_euler_case
def test_reference_attitudes_of_euler_angles(case):
    euler = [case["in"][name] for name in ("phi", "theta", "psi")]
    R, q = np.reshape(case["out"]["R"], (3, 3)), np.array(case["out"]["q"])
    np.testing.assert_allclose(rot.matrix_from_euler(euler), R, rtol=4 * EPS, atol=4 * EPS)
    unsigned = rot.canonicalize(rot.quaternion_from_euler(euler))
    np.testing.assert_allclose(unsigned, q, rtol=8 * EPS, atol=2 * EPS)
    for found in (rot.euler_from_quaternion(q), rot.euler_from_matrix(R)):
        turn = found[0] + found[2] - case["out"]["phi_plus_psi_mod_2pi"]
        assert abs(np.exp(1j * turn) - 1.0) * np.cos(euler[1] / 2) <= ULPS  # undefined at pi
        assert rot.distance(rot.quaternion_from_euler(found), q) <= ULPS
        if euler[1] > 0.0:  # the entries of q and R that carry phi - psi are rounded by 1e-16
            np.testing.assert_allclose(found, euler, rtol=0, atol=ULPS / np.sin(euler[1]))


@every_euler_case
def test_reference_angular_velocities_of_euler_angle_rates(case):
    euler, rates = [case["in"][name] for name in ("phi", "theta", "psi")], case["in"]["rates"]
    body, world = case["out"]["w_body"], case["out"]["w_space"]
    found = rot.omega_body_from_euler_rates(euler, rates)
    np.testing.assert_allclose(found, body, rtol=0, atol=ULPS)
    found = rot.omega_world_from_euler_rates(euler, rates)
    np.testing.assert_allclose(found, world, rtol=0, atol=ULPS)
    if case["out"]["kinematic_determinant"] == 0.0:
        with pytest.raises(ValueError, match="sin"):
            rot.euler_rates_from_omega_body(euler, body)
        with pytest.raises(ValueError, match="sin"):
            rot.euler_rates_from_omega_world(euler, world)
    else:
        lost = 2 * ULPS / case["out"]["kinematic_determinant"]
        found = rot.euler_rates_from_omega_body(euler, body)
        np.testing.assert_allclose(found, rates, rtol=0, atol=lost)
        found = rot.euler_rates_from_omega_world(euler, world)
        np.testing.assert_allclose(found, rates, rtol=0, atol=lost)


@given(angles, nutations, angles)
def test_euler_angles_go_round_within_their_ranges(phi, theta, psi):
    q = rot.quaternion_from_euler([phi, theta, psi])
    oracle = Rotation.from_euler("ZXZ", [phi, theta, psi])
    assert (oracle.inv() * scipy_of(q)).magnitude() <= ULPS
    found = rot.euler_from_quaternion(q)
    assert rot.distance(rot.quaternion_from_euler(found), q) <= ULPS
    assert np.all(abs(found) <= np.pi) and np.all(found > [-np.pi, -1e-300, -np.pi])
    assert np.array_equal(found, rot.euler_from_quaternion(-q))
    assert found[1] == pytest.approx(theta, rel=ULPS, abs=1e-300)


@given(angles, angles, st.sampled_from([0.0, np.pi]))
def test_at_gimbal_lock_phi_has_all_the_turn(phi, psi, theta):
    found = rot.euler_from_quaternion(rot.quaternion_from_euler([phi, theta, psi]))
    turn = phi + psi if theta == 0.0 else phi - psi
    assert found[1] == theta and found[2] == 0.0
    assert abs(np.exp(1j * found[0]) - np.exp(1j * turn)) <= ULPS


@given(angles, angles, nutations)
def test_angles_of_a_matrix_are_finite_and_rebuild_it_at_gimbal_lock_too(phi, psi, theta):
    R = Rotation.from_euler("ZXZ", [phi, theta, psi]).as_matrix()
    found = rot.euler_from_matrix(R)
    assert np.all(np.isfinite(found))
    np.testing.assert_allclose(rot.matrix_from_euler(found), R, rtol=0, atol=2 * ULPS)


@pytest.mark.parametrize("theta", [0.0, -0.0, 1e-300, 1e-16, np.pi, -np.pi, 2 * np.pi])
@pytest.mark.parametrize("name", ["euler_rates_from_omega_body", "euler_rates_from_omega_world"])
def test_rates_are_refused_where_they_do_not_exist_and_the_row_is_named(name, theta):
    rows = [[0.1, 1.0, 0.2], [0.1, theta, 0.2]]
    with pytest.raises(ValueError, match=r"^euler\[1\] = .*sin.*quaternion_rate"):
        getattr(rot, name)(rows, [0.0, 0.0, 1.0])  # even where a limit exists: it is not unique


@given(angles, st.floats(2e-15, 1e-3), st.booleans(), angles, vectors)
def test_rates_beside_gimbal_lock_are_finite_and_give_back_the_angular_velocity(
    phi, near, top, psi, omega
):
    euler = [phi, np.pi - near if top else near, psi]
    if abs(np.sin(euler[1])) > 2e-15:  # pi - 2e-15 is rounded by 4e-16
        rates = rot.euler_rates_from_omega_body(euler, omega)
        assert np.all(np.isfinite(rates))
        found = rot.omega_body_from_euler_rates(euler, rates)
        # psi' cancels phi' cos(theta), which grows like |omega| / sin(theta)
        lost = ULPS * (1.0 + np.linalg.norm(omega) / abs(np.sin(euler[1])))
        np.testing.assert_allclose(found[:2], omega[:2], rtol=0, atol=ULPS)
        np.testing.assert_allclose(found[2], omega[2], rtol=0, atol=lost)


def test_rot6d_is_the_first_two_columns_one_after_the_other():
    R = rot.matrix_from_quaternion(rot.exp([0.1, 0.2, 0.3]))
    assert np.array_equal(rot.rot6d_from_matrix(R), [*R[:, 0], *R[:, 1]])


@given(quaternions, st.floats(1e-300, 1e300), st.floats(-1e3, 1e3))
def test_gram_schmidt_ignores_length_and_shear(q, scale, shear):
    R = rot.matrix_from_quaternion(q)
    sheared = np.concatenate([R[:, 0], R[:, 1] + shear * R[:, 0]]) * min(scale, 1e300 / 1e3)
    found = rot.matrix_from_rot6d(sheared)
    np.testing.assert_allclose(found, R, rtol=0, atol=(1.0 + abs(shear)) * ULPS)
    np.testing.assert_allclose(found.T @ found, np.eye(3), rtol=0, atol=ULPS)


@pytest.mark.parametrize(
    "columns",
    [[0, 0, 0, 0, 1, 0], [1, 0, 0, 0, 0, 0], [1, 2, 3, -2, -4, -6], [1, 0, 0, 1, 1e-7, 0]],
)
def test_columns_that_span_no_plane_are_refused(columns):
    with pytest.raises(ValueError, match=r"rot6d = \[.*parallel"):
        rot.matrix_from_rot6d(columns)
