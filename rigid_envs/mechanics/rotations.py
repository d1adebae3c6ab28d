"""Rotations on NumPy arrays: quaternions, matrices, rotation vectors, Euler angles."""

import numpy as np
from numpy.typing import ArrayLike

from rigid_envs.base.checks import Array, array, require, rotation_matrix, unit_length

# Lengths, directions and products of rows of vectors.

_ROUNDING = 4 * np.finfo(np.float64).eps  # of a length computed in float64


def norm(rows: Array) -> Array:
    """Euclidean norm along the last axis, shape (..., 1), without overflow or underflow."""
    return np.asarray(np.hypot.reduce(rows, axis=-1, keepdims=True))


def _cross(a: Array, b: Array) -> Array:
    """Products a x b along the last axis, shape (..., 3): those of NumPy, in half its time."""
    rows = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        np.subtract(a[..., i] * b[..., j], a[..., j] * b[..., i], out=rows[..., k])
    return rows


def direction(rows: Array) -> Array:
    """Unit vectors rows / |rows|, of rows of any length but zero."""
    _, exponent = np.frexp(np.max(np.abs(rows), axis=-1, keepdims=True))
    scaled = np.ldexp(rows, -exponent)  # exact, and its length is representable
    return np.asarray(scaled / norm(scaled))


def _unit(value: ArrayLike, name: str, size: int) -> Array:
    """Unit vectors, shape (..., size), normalised unless they are so to rounding.

    Raises:
        ValueError: another shape, no finite numbers, or a length that is not 1 within 1e-6.
    """
    rows = array(value, name, size)
    with np.errstate(over="ignore"):
        length = norm(rows)
    unit_length(length[..., 0], rows, name)
    return np.where(np.abs(length - 1.0) <= _ROUNDING, rows, rows / length)


# The algebra of unit quaternions, their rate, the distance of attitudes, uniform samples.


def identity(shape: tuple[int, ...] = ()) -> Array:
    """Return the quaternion of no rotation, (1, 0, 0, 0).

    Args:
        shape: leading axes.

    Returns:
        Quaternions, (*shape, 4).
    """
    return np.tile([1.0, 0.0, 0.0, 0.0], (*shape, 1))


def normalize(q: ArrayLike) -> Array:
    """Scale to unit length, q / |q|, without overflow or underflow.

    Args:
        q: any quaternion but zero, (..., 4).

    Returns:
        Unit quaternion, (..., 4).

    Raises:
        ValueError: if q is zero.
    """
    rows = array(q, "q", 4)
    expected = "a quaternion that is not zero: no rotation is (1, 0, 0, 0), see identity()"
    require(np.any(rows != 0.0, axis=-1), rows, "q", expected)
    return direction(rows)


def multiply(p: ArrayLike, q: ArrayLike) -> Array:
    """Compose two rotations, q first: the Hamilton product p q, R(p q) = R(p) R(q).

    Args:
        p: unit quaternion, (..., 4).
        q: unit quaternion, (..., 4).

    Returns:
        Unit quaternion, (..., 4).

    Raises:
        ValueError: if p or q is not unit.

    Source:
        Sola, Quaternion kinematics for the error-state Kalman filter, section 1; arXiv:1711.02508.
    """
    return _product(_unit(p, "p", 4), _unit(q, "q", 4))


def _product(p: Array, q: Array) -> Array:
    """Return the Hamilton product of any two quaternions, unchecked."""
    p_w, p_v, q_w, q_v = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    w = p_w * q_w - np.sum(p_v * q_v, axis=-1, keepdims=True)
    return np.concatenate([w, p_w * q_v + q_w * p_v + _cross(p_v, q_v)], axis=-1)


def conjugate(q: ArrayLike) -> Array:
    """Invert a rotation: (w, -x, -y, -z), world to body.

    Args:
        q: unit quaternion, (..., 4).

    Returns:
        Unit quaternion, (..., 4).

    Raises:
        ValueError: if q is not unit.
    """
    rows = _unit(q, "q", 4)
    return np.concatenate([rows[..., :1], -rows[..., 1:]], axis=-1)


def rotate(q: ArrayLike, v: ArrayLike) -> Array:
    """Take a vector from body to world axes: v_world = R(q) v_body = v + w t + u x t, t = 2 u x v.

    Args:
        q: unit quaternion (w, u), (..., 4).
        v: vector in body axes, (..., 3).

    Returns:
        The same vector in world axes, (..., 3).

    Raises:
        ValueError: if q is not unit.
    """
    rows, vectors = _unit(q, "q", 4), array(v, "v", 3)
    w, u = rows[..., :1], rows[..., 1:]
    t: Array = 2.0 * _cross(u, vectors)
    return np.asarray(vectors + w * t + _cross(u, t))


def rotate_inverse(q: ArrayLike, v: ArrayLike) -> Array:
    """Take a vector from world to body axes: v_body = R(q)^T v_world.

    Args:
        q: unit quaternion, (..., 4).
        v: vector in world axes, (..., 3).

    Returns:
        The same vector in body axes, (..., 3).

    Raises:
        ValueError: if q is not unit.
    """
    return rotate(conjugate(q), v)


def quaternion_rate(q: ArrayLike, omega_body: ArrayLike) -> Array:
    """Return dq/dt = q (0, omega_body) / 2.

    Args:
        q: unit quaternion, (..., 4).
        omega_body: angular velocity in body axes [rad/s], (..., 3).

    Returns:
        Rate of the quaternion [1/s], (..., 4), orthogonal to q.

    Raises:
        ValueError: if q is not unit.

    Source:
        Sola, Quaternion kinematics for the error-state Kalman filter, section 4; arXiv:1711.02508.
    """
    omega = array(omega_body, "omega_body", 3)
    pure = np.concatenate([np.zeros_like(omega[..., :1]), omega], axis=-1)
    return 0.5 * _product(_unit(q, "q", 4), pure)


def canonicalize(q: ArrayLike) -> Array:
    """Choose between q and -q: w >= 0, and at w = 0 the first nonzero of x, y, z positive.

    Args:
        q: unit quaternion, (..., 4).

    Returns:
        Unit quaternion of the same attitude, (..., 4); the same bits for q and -q.

    Raises:
        ValueError: if q is not unit.
    """
    rows = _unit(q, "q", 4)
    first = np.argmax(rows != 0.0, axis=-1, keepdims=True)
    negative = np.take_along_axis(rows, first, axis=-1) < 0.0
    return np.where(negative, -rows, rows) + 0.0  # + 0.0 makes a zero of -0.0


def angle(q: ArrayLike) -> Array:
    """Return the angle of a rotation, 2 atan2(|(x, y, z)|, |w|): accurate near 0 and near pi.

    Args:
        q: unit quaternion, (..., 4).

    Returns:
        Angle in [0, pi] [rad], (...).

    Raises:
        ValueError: if q is not unit.
    """
    rows = _unit(q, "q", 4)
    return np.asarray(2.0 * np.arctan2(norm(rows[..., 1:])[..., 0], np.abs(rows[..., 0])))


def distance(p: ArrayLike, q: ArrayLike) -> Array:
    """Return the angle of the rotation that leads from p to q, the geodesic metric of SO(3).

    Args:
        p: unit quaternion, (..., 4).
        q: unit quaternion, (..., 4).

    Returns:
        Angle in [0, pi] [rad], (...); exactly 0 between q and -q.

    Raises:
        ValueError: if p or q is not unit.

    Source:
        Huynh, Metrics for 3D rotations, J. Math. Imaging Vision 35 (2009), Phi_6;
        doi:10.1007/s10851-009-0161-2.
    """
    return angle(multiply(conjugate(_unit(p, "p", 4)), q))


def random_quaternion(rng: np.random.Generator, shape: tuple[int, ...] = ()) -> Array:
    """Draw attitudes uniform on SO(3): a normal sample in four dimensions, normalised.

    Args:
        rng: the only source of randomness.
        shape: leading axes.

    Returns:
        Unit quaternions, (*shape, 4); both signs are equally likely.

    Raises:
        ValueError: if rng is not a numpy.random.Generator.

    Source:
        Muller, Comm. ACM 2(4) (1959) 19; doi:10.1145/377939.377946.
    """
    expected = "a numpy Generator: see np.random.default_rng"
    require(isinstance(rng, np.random.Generator), rng, "rng", expected)
    return normalize(rng.standard_normal((*shape, 4)))


# The Lie group SO(3): exp, log, axis and angle, so(3) matrices, Jacobians, geodesics.


def exp(rotation_vector: ArrayLike) -> Array:
    """Turn about a vector by its length: (cos(a / 2), sin(a / 2) / a * v), a = |v|.

    Args:
        rotation_vector: axis * angle [rad], of any length, (..., 3).

    Returns:
        Unit quaternion, (..., 4), accurate to rounding in every entry, however small.

    Source:
        Sola, Quaternion kinematics for the error-state Kalman filter, section 2; arXiv:1711.02508.
    """
    half = 0.5 * array(rotation_vector, "rotation_vector", 3)
    half_angle = norm(half)
    return np.concatenate([np.cos(half_angle), _sinc(half_angle) * half], axis=-1)


def log(q: ArrayLike) -> Array:
    """Return the shortest rotation vector, 2 atan2(|u|, w) u / |u| of the canonical (w, u).

    Args:
        q: unit quaternion, (..., 4).

    Returns:
        axis * angle [rad], angle in [0, pi], (..., 3); the inverse of `exp` for angles below pi.

    Raises:
        ValueError: if q is not unit.

    Source:
        Sola, Quaternion kinematics for the error-state Kalman filter, section 2; arXiv:1711.02508.
    """
    rows = canonicalize(q)
    w, u = rows[..., :1], rows[..., 1:]
    return 2.0 * _quotient(np.arctan2(norm(u), w), norm(u)) * u


def _quotient(numerator: Array, denominator: Array) -> Array:
    """Divide, with the limit 1 where the denominator is 0."""
    return np.divide(numerator, denominator, np.ones_like(denominator), where=denominator != 0.0)


def _sinc(x: Array) -> Array:
    """Return sin(x) / x: the quotient itself is accurate to rounding for every x but 0."""
    return _quotient(np.sin(x), x)


def quaternion_from_axis_angle(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Turn about a unit axis: (cos(angle / 2), sin(angle / 2) axis).

    Args:
        axis: unit vector, (..., 3).
        angle: any angle [rad], (...).

    Returns:
        Unit quaternion, (..., 4).

    Raises:
        ValueError: if the axis is not unit (`exp` takes axis * angle).
    """
    half = 0.5 * array(angle, "angle")[..., None]
    vector = np.sin(half) * _unit(axis, "axis", 3)
    scalar = np.broadcast_to(np.cos(half), (*vector.shape[:-1], 1))
    return np.concatenate([scalar, vector], axis=-1)


def axis_angle_from_quaternion(q: ArrayLike) -> tuple[Array, Array]:
    """Split a rotation into its axis and its angle.

    Args:
        q: unit quaternion, (..., 4).

    Returns:
        Unit axis, (..., 3), the same in body and world axes, (0, 0, 1) where there is no
        rotation; and angle in [0, pi] [rad], (...).

    Raises:
        ValueError: if q is not unit.
    """
    rows = canonicalize(q)
    u = rows[..., 1:]
    axis = np.where(norm(u) == 0.0, np.array([0.0, 0.0, 1.0]), u)
    return axis / norm(axis), angle(rows)


def hat(v: ArrayLike) -> Array:
    """Return the so(3) matrix of a vector, V u = v x u for every u.

    Args:
        v: vector, (..., 3).

    Returns:
        Skew-symmetric matrix, (..., 3, 3).
    """
    x, y, z = np.moveaxis(array(v, "v", 3), -1, 0)
    o = np.zeros_like(x)
    return np.stack([o, -z, y, z, o, -x, -y, x, o], axis=-1).reshape(*x.shape, 3, 3)


def vee(skew: ArrayLike) -> Array:
    """Return the vector of a cross-product matrix, the inverse of `hat`.

    Args:
        skew: skew-symmetric matrix, (..., 3, 3).

    Returns:
        Vector, (..., 3).

    Raises:
        ValueError: if an entry of skew + skew^T exceeds 1e-6 of the largest of skew.
    """
    m = array(skew, "skew", 3, 3)
    with np.errstate(over="ignore"):  # then it is not skew-symmetric
        even = 0.5 * (m + np.swapaxes(m, -1, -2))
    size = np.max(np.abs(m), axis=(-1, -2))
    skew_symmetric = np.max(np.abs(even), axis=(-1, -2)) <= 0.5e-6 * size
    expected = "a skew-symmetric matrix: take (m - m.T) / 2 of it first"
    require(skew_symmetric, m, "skew", expected)
    return (m - even)[..., [2, 0, 1], [1, 2, 0]]  # exact where even is 0, subnormal numbers too


def left_jacobian(rotation_vector: ArrayLike) -> Array:
    """Return J of omega_world = J dv/dt: exp(v + dv) = exp(J dv) exp(v) to first order.

    J = 1 + (1 - cos a) / a^2 V + (a - sin a) / a^3 V^2, with V = hat(v), a = |v|.

    Args:
        rotation_vector: v = axis * angle [rad], (..., 3).

    Returns:
        Matrix, (..., 3, 3); singular where the angle is a multiple of 2 pi, but for 0.

    Source:
        Barfoot, State Estimation for Robotics (2017), section 7.1.
    """
    v = array(rotation_vector, "rotation_vector", 3)
    a = norm(v)[..., None]
    linear = 0.5 * _sinc(0.5 * a) ** 2 * hat(v)
    root = np.sqrt(_cubic_coefficient(a)) * hat(v)  # its square cannot overflow
    return np.eye(3) + linear + root @ root


def _cubic_coefficient(a: Array) -> Array:
    """Return (a - sin a) / a^3: below 1, where it cancels, by its series."""
    square = np.minimum(a, 1.0) ** 2
    series = np.zeros_like(a)
    for k in range(21, 4, -2):  # Horner: 1/3! - a^2/5! + ... - a^18/21!
        series = (1.0 - series) * square / (k * (k - 1))
    large = np.maximum(a, 1.0)
    return np.where(a < 1.0, (1.0 - series) / 6.0, (1.0 - np.sin(large) / large) / large / large)


def right_jacobian(rotation_vector: ArrayLike) -> Array:
    """Return J of omega_body = J dv/dt: exp(v + dv) = exp(v) exp(J dv) to first order.

    It is the left Jacobian of -v, and its transpose.

    Args:
        rotation_vector: v = axis * angle [rad], (..., 3).

    Returns:
        Matrix, (..., 3, 3).

    Source:
        Barfoot, State Estimation for Robotics (2017), section 7.1.
    """
    return left_jacobian(-array(rotation_vector, "rotation_vector", 3))


def left_jacobian_inverse(rotation_vector: ArrayLike) -> Array:
    """Return J^-1 of dv/dt = J^-1 omega_world.

    Args:
        rotation_vector: v = axis * angle [rad], shorter than 2 pi, (..., 3).

    Returns:
        Matrix, (..., 3, 3); its condition number is a / (2 sin(a / 2)), pi / 2 at a = pi.

    Raises:
        ValueError: if the angle is 2 pi or more, where the inverse does not exist or is not wanted.
    """
    v = array(rotation_vector, "rotation_vector", 3)
    expected = "an angle below 2 pi: take log(exp(v)), the shortest vector of this rotation"
    require(norm(v)[..., 0] < 2.0 * np.pi, v, "rotation_vector", expected)
    return np.asarray(np.linalg.inv(left_jacobian(v)), dtype=np.float64)


def right_jacobian_inverse(rotation_vector: ArrayLike) -> Array:
    """Return J^-1 of dv/dt = J^-1 omega_body.

    Args:
        rotation_vector: v = axis * angle [rad], shorter than 2 pi, (..., 3).

    Returns:
        Matrix, (..., 3, 3).

    Raises:
        ValueError: if the angle is 2 pi or more.
    """
    return left_jacobian_inverse(-array(rotation_vector, "rotation_vector", 3))


def slerp(p: ArrayLike, q: ArrayLike, t: ArrayLike) -> Array:
    """Interpolate between attitudes at constant rate on the geodesic: p exp(t log(p^-1 q)).

    Args:
        p: unit quaternion at t = 0, (..., 4).
        q: unit quaternion at t = 1, (..., 4).
        t: fraction of the angle, beyond [0, 1] too, (...).

    Returns:
        Unit quaternion, (..., 4), continuous in t from p: at t = 1 it is q or -q.

    Raises:
        ValueError: if p or q is not unit.

    Source:
        Shoemake, Animating rotation with quaternion curves, SIGGRAPH (1985);
        doi:10.1145/325334.325242.
    """
    start = _unit(p, "p", 4)
    vector = array(t, "t")[..., None] * log(multiply(conjugate(start), q))
    return multiply(start, exp(vector))


# Between quaternions, matrices, the 6-D form and z-x-z Euler angles, and Euler-angle rates.

_LOCKED = 1e-15  # a sine that the rounding of a unit quaternion cannot tell from 0


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
    rows = _unit(q, "q", 4)
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
    half_sum = np.where(cos > _LOCKED, np.arctan2(z, w), np.arctan2(y, x))
    half_difference = np.where(sin > _LOCKED, np.arctan2(y, x), np.arctan2(z, w))
    locked = np.minimum(sin, cos) <= _LOCKED
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
    return np.asarray(v - np.sum(v * axis, axis=-1, keepdims=True) * axis)


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
    require(np.abs(np.sin(theta)) > _LOCKED, angles, "euler", expected)
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


# Transport between frames: tensors of rank two, and the rates of vectors seen from two frames.


def rotate_tensor(q: ArrayLike, tensor: ArrayLike) -> Array:
    """Take a tensor of rank two from body to world axes: T_world = R(q) T_body R(q)^T.

    The inverse is that of the conjugate quaternion.

    Args:
        q: unit quaternion, (..., 4).
        tensor: tensor in body axes, such as an inertia tensor, (..., 3, 3).

    Returns:
        The same tensor in world axes, (..., 3, 3).

    Raises:
        ValueError: if q is not unit.

    Source:
        Goldstein, Poole & Safko, Classical Mechanics (3rd ed.), section 5.2.
    """
    return transform_tensor(matrix_from_quaternion(q), tensor)


def transform_tensor(R: ArrayLike, tensor: ArrayLike) -> Array:
    """Take a tensor of rank two from body to world axes: T_world = R T_body R^T.

    The inverse is that of R^T.

    Args:
        R: rotation matrix, v_world = R v_body, (..., 3, 3).
        tensor: tensor in body axes, (..., 3, 3).

    Returns:
        The same tensor in world axes, (..., 3, 3).

    Raises:
        ValueError: if R is not orthonormal and right-handed.

    Source:
        Goldstein, Poole & Safko, Classical Mechanics (3rd ed.), section 5.2.
    """
    m = rotation_matrix(R, "R")
    return np.asarray(m @ array(tensor, "tensor", 3, 3) @ np.swapaxes(m, -1, -2))


def world_rate(
    q: ArrayLike, v_body: ArrayLike, rate_body: ArrayLike, omega_body: ArrayLike
) -> Array:
    """Return the rate of a vector in world axes from its rate in body axes.

    d(v_world)/dt = R (d(v_body)/dt + omega_body x v_body), the transport theorem.

    Args:
        q: attitude of the body, unit quaternion, (..., 4).
        v_body: the vector in body axes, of any unit, (..., 3).
        rate_body: d(v_body)/dt, the rate of its components in body axes, (..., 3).
        omega_body: angular velocity of the body in body axes [rad/s], (..., 3).

    Returns:
        d(v_world)/dt, the rate of its components in world axes, (..., 3).

    Raises:
        ValueError: if q is not unit.

    Source:
        Goldstein, Poole & Safko, Classical Mechanics (3rd ed.), section 4.9.
    """
    v, rate = array(v_body, "v_body", 3), array(rate_body, "rate_body", 3)
    return rotate(q, rate + _cross(array(omega_body, "omega_body", 3), v))


def body_rate(
    q: ArrayLike, v_world: ArrayLike, rate_world: ArrayLike, omega_body: ArrayLike
) -> Array:
    """Return the rate of a vector in body axes, the inverse of `world_rate`.

    d(v_body)/dt = R^T d(v_world)/dt - omega_body x v_body, with v_body = R^T v_world.

    Args:
        q: attitude of the body, unit quaternion, (..., 4).
        v_world: the vector in world axes, of any unit, (..., 3).
        rate_world: d(v_world)/dt, the rate of its components in world axes, (..., 3).
        omega_body: angular velocity of the body in body axes [rad/s], (..., 3).

    Returns:
        d(v_body)/dt, the rate of its components in body axes, (..., 3).

    Raises:
        ValueError: if q is not unit.

    Source:
        Goldstein, Poole & Safko, Classical Mechanics (3rd ed.), section 4.9.
    """
    v, rate = array(v_world, "v_world", 3), array(rate_world, "rate_world", 3)
    carried = _cross(array(omega_body, "omega_body", 3), rotate_inverse(q, v))
    return rotate_inverse(q, rate) - carried
