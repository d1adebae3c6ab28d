"""Between quaternions, matrices, the 6-D form and z-x-z Euler angles, and Euler-angle rates."""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.checks import Array, array, require, rotation_matrix
from rigid_envs.rotations.lie import hat
from rigid_envs.rotations.quaternions import canonicalize, rotate, rotate_inverse
from rigid_envs.rotations.vectors import direction, norm, unit

__all__ = [
    "euler_from_matrix",
    "euler_from_quaternion",
    "euler_rates_from_omega_body",
    "euler_rates_from_omega_world",
    "matrix_from_euler",
    "matrix_from_quaternion",
    "matrix_from_rot6d",
    "omega_body_from_euler_rates",
    "omega_world_from_euler_rates",
    "quaternion_from_euler",
    "quaternion_from_matrix",
    "rot6d_from_matrix",
]

LOCKED = 1e-15  # a sine that the rounding of a unit quaternion cannot tell from 0


def matrix_from_quaternion(q: ArrayLike) -> Array:
    """Return R with v_world = R v_body: its columns are the body axes seen from the world.

    R = 1 + 2 w U + 2 U^2, with U = hat(u), q = (w, u).

    Args:
        q: unit quaternion, (..., 4).

    Returns:
        Rotation matrix, (..., 3, 3).

    Raises:
        ValueError: if q is not unit.
    """
    rows = unit(q, "q", 4)
    cross = hat(rows[..., 1:])
    return np.eye(3) + 2.0 * rows[..., :1, None] * cross + 2.0 * cross @ cross


def quaternion_from_matrix(R: ArrayLike) -> Array:
    """Return the quaternion of a rotation matrix.

    The sums and differences of the entries of R fill the matrix 4 q q^T; its row with the largest
    diagonal entry is q up to length, and nowhere near zero: no case is special.

    Args:
        R: rotation matrix, (..., 3, 3).

    Returns:
        Unit quaternion, canonical (w >= 0), (..., 4).

    Raises:
        ValueError: if R is not orthonormal and right-handed.

    Source:
        Shepperd, Quaternion from rotation matrix, J. Guidance Control 1 (1978) 223;
        doi:10.2514/3.55767b.
    """
    m = rotation_matrix(R, "R")
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = np.moveaxis(m, (-2, -1), (0, 1))
    wx, wy, wz, yx, zx, zy = zy - yz, xz - zx, yx - xy, yx + xy, zx + xz, zy + yz
    rows = [
        np.stack([1.0 + xx + yy + zz, wx, wy, wz], axis=-1),
        np.stack([wx, 1.0 + xx - yy - zz, yx, zx], axis=-1),
        np.stack([wy, yx, 1.0 - xx + yy - zz, zy], axis=-1),
        np.stack([wz, zx, zy, 1.0 - xx - yy + zz], axis=-1),
    ]
    outer = np.stack(rows, axis=-2)
    largest = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)[..., None, None]
    return canonicalize(direction(np.take_along_axis(outer, largest, axis=-2)[..., 0, :]))


def quaternion_from_euler(euler: ArrayLike) -> Array:
    """Return the quaternion of Rz(phi) Rx(theta) Rz(psi).

    With s = (phi + psi) / 2 and d = (phi - psi) / 2 it is
    (cos(theta/2) cos s, sin(theta/2) cos d, sin(theta/2) sin d, cos(theta/2) sin s).

    Args:
        euler: any angles (phi, theta, psi) [rad], (..., 3).

    Returns:
        Unit quaternion, (..., 4), continuous in the angles, so not canonical.

    Source:
        Goldstein, Poole & Safko, Classical Mechanics (3rd ed.), section 4.5.
    """
    phi, theta, psi = 0.5 * np.moveaxis(array(euler, "euler", 3), -1, 0)
    cos, sin = np.cos(theta), np.sin(theta)
    w, z = cos * np.cos(phi + psi), cos * np.sin(phi + psi)
    x, y = sin * np.cos(phi - psi), sin * np.sin(phi - psi)
    return np.stack([w, x, y, z], axis=-1)


def euler_from_quaternion(q: ArrayLike) -> Array:
    """Return the z-x-z Euler angles, the inverse of `quaternion_from_euler`.

    Where sin(theta / 2) or cos(theta / 2) is at most 1e-15, only phi + psi or phi - psi is
    defined (gimbal lock): psi is 0 there, and phi has all the turn.

    Args:
        q: unit quaternion, (..., 4).

    Returns:
        (phi, theta, psi) [rad], (..., 3); phi and psi in (-pi, pi], theta in [0, pi].

    Raises:
        ValueError: if q is not unit.
    """
    w, x, y, z = np.moveaxis(canonicalize(q), -1, 0)
    sin, cos = np.hypot(x, y), np.hypot(w, z)
    half_sum = np.where(cos > LOCKED, np.arctan2(z, w), np.arctan2(y, x))
    half_difference = np.where(sin > LOCKED, np.arctan2(y, x), np.arctan2(z, w))
    locked = np.minimum(sin, cos) <= LOCKED
    phi = _wrapped(half_sum + half_difference)
    psi = np.where(locked, 0.0, _wrapped(half_sum - half_difference))
    return np.stack([phi, 2.0 * np.arctan2(sin, cos), psi], axis=-1)


def _wrapped(turn: Array) -> Array:
    """Bring angles of up to 3 pi into (-pi, pi]."""
    down = np.where(turn > np.pi, turn - 2.0 * np.pi, turn)
    return np.where(down <= -np.pi, down + 2.0 * np.pi, down)


def matrix_from_euler(euler: ArrayLike) -> Array:
    """Return R = Rz(phi) Rx(theta) Rz(psi).

    Args:
        euler: any angles (phi, theta, psi) [rad], (..., 3).

    Returns:
        Rotation matrix, (..., 3, 3).
    """
    return matrix_from_quaternion(quaternion_from_euler(euler))


def euler_from_matrix(R: ArrayLike) -> Array:
    """Return the z-x-z Euler angles of R; psi is 0 at gimbal lock, as in `euler_from_quaternion`.

    Args:
        R: rotation matrix, (..., 3, 3).

    Returns:
        (phi, theta, psi) [rad], (..., 3); phi and psi in (-pi, pi], theta in [0, pi].

    Raises:
        ValueError: if R is not orthonormal and right-handed.
    """
    return euler_from_quaternion(quaternion_from_matrix(R))


def rot6d_from_matrix(R: ArrayLike) -> Array:
    """Return the first two columns of R, one after the other.

    Layout: (R00, R10, R20, R01, R11, R21), the body axes e1 and e2 in world axes.

    Args:
        R: rotation matrix, (..., 3, 3).

    Returns:
        The six numbers, (..., 6).

    Raises:
        ValueError: if R is not orthonormal and right-handed.

    Source:
        Zhou et al., On the continuity of rotation representations in neural networks, CVPR (2019);
        doi:10.1109/CVPR.2019.00589.
    """
    m = rotation_matrix(R, "R")
    return np.concatenate([m[..., 0], m[..., 1]], axis=-1)


def matrix_from_rot6d(rot6d: ArrayLike) -> Array:
    """Orthonormalise two columns (Gram-Schmidt) and complete them: e3 = e1 x e2.

    Args:
        rot6d: two columns of any length, one after the other, (..., 6).

    Returns:
        Rotation matrix, (..., 3, 3); `rot6d_from_matrix` is its right inverse.

    Raises:
        ValueError: if a column is zero, or they are parallel to 1e-6.

    Source:
        Zhou et al. (2019); doi:10.1109/CVPR.2019.00589.
    """
    rows = array(rot6d, "rot6d", 6)
    columns = rows.reshape(*rows.shape[:-1], 2, 3)
    expected = "two columns that are neither zero nor parallel: perturb one of them"
    require(np.all(np.any(columns, axis=-1), axis=-1), rows, "rot6d", expected)
    e1, second = direction(columns[..., 0, :]), direction(columns[..., 1, :])
    across = _reject(second, e1)
    require(norm(across)[..., 0] > 1e-6, rows, "rot6d", expected)
    e2 = direction(_reject(direction(across), e1))  # twice is enough for rounding (Parlett)
    return np.stack([e1, e2, np.cross(e1, e2)], axis=-1)


def _reject(v: Array, axis: Array) -> Array:
    """Return the part of v orthogonal to a unit axis."""
    along: Array = np.sum(v * axis, axis=-1, keepdims=True)
    return v - along * axis


def omega_body_from_euler_rates(euler: ArrayLike, rates: ArrayLike) -> Array:
    """Return the angular velocity in body axes.

    omega1 = phi' sin(theta) sin(psi) + theta' cos(psi)
    omega2 = phi' sin(theta) cos(psi) - theta' sin(psi)
    omega3 = phi' cos(theta) + psi'

    Args:
        euler: (phi, theta, psi) [rad], (..., 3).
        rates: (phi', theta', psi') [rad/s], (..., 3).

    Returns:
        Angular velocity in body axes [rad/s], (..., 3).

    Source:
        Landau & Lifshitz, Mechanics (3rd ed.), eq. 35.1.
    """
    _, theta, psi = np.moveaxis(array(euler, "euler", 3), -1, 0)
    phi_rate, theta_rate, psi_rate = np.moveaxis(array(rates, "rates", 3), -1, 0)
    across = phi_rate * np.sin(theta)
    omega1 = across * np.sin(psi) + theta_rate * np.cos(psi)
    omega2 = across * np.cos(psi) - theta_rate * np.sin(psi)
    return np.stack([omega1, omega2, phi_rate * np.cos(theta) + psi_rate], axis=-1)


def euler_rates_from_omega_body(euler: ArrayLike, omega_body: ArrayLike) -> Array:
    """Return the Euler-angle rates, the inverse of `omega_body_from_euler_rates`.

    Args:
        euler: (phi, theta, psi) [rad], (..., 3).
        omega_body: angular velocity in body axes [rad/s], (..., 3).

    Returns:
        (phi', theta', psi') [rad/s], (..., 3).

    Raises:
        ValueError: if |sin(theta)| is at most 1e-15, where the rates do not exist.
    """
    angles = array(euler, "euler", 3)
    _, theta, psi = np.moveaxis(angles, -1, 0)
    omega1, omega2, omega3 = np.moveaxis(array(omega_body, "omega_body", 3), -1, 0)
    expected = "sin(theta) != 0, where Euler-angle rates exist: use quaternion_rate"
    require(np.abs(np.sin(theta)) > LOCKED, angles, "euler", expected)
    phi_rate = (omega1 * np.sin(psi) + omega2 * np.cos(psi)) / np.sin(theta)
    theta_rate = omega1 * np.cos(psi) - omega2 * np.sin(psi)
    return np.stack([phi_rate, theta_rate, omega3 - phi_rate * np.cos(theta)], axis=-1)


def omega_world_from_euler_rates(euler: ArrayLike, rates: ArrayLike) -> Array:
    """Return the angular velocity in world axes, R omega_body.

    Args:
        euler: (phi, theta, psi) [rad], (..., 3).
        rates: (phi', theta', psi') [rad/s], (..., 3).

    Returns:
        Angular velocity in world axes [rad/s], (..., 3).
    """
    return rotate(quaternion_from_euler(euler), omega_body_from_euler_rates(euler, rates))


def euler_rates_from_omega_world(euler: ArrayLike, omega_world: ArrayLike) -> Array:
    """Return the Euler-angle rates, the inverse of `omega_world_from_euler_rates`.

    Args:
        euler: (phi, theta, psi) [rad], (..., 3).
        omega_world: angular velocity in world axes [rad/s], (..., 3).

    Returns:
        (phi', theta', psi') [rad/s], (..., 3).

    Raises:
        ValueError: if |sin(theta)| is at most 1e-15, where the rates do not exist.
    """
    omega = array(omega_world, "omega_world", 3)
    q = quaternion_from_euler(euler)
    return euler_rates_from_omega_body(euler, rotate_inverse(q, omega))
