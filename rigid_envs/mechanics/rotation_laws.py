"""Laws of rotations: conversions, group operations, rates."""

from collections.abc import Callable

import numpy as np
from scipy.linalg import expm
from scipy.spatial.transform import Rotation, Slerp

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations as rot
from rigid_envs.mechanics.laws import EPS, Subject, axial, matrices, max_abs

SUBJECT = Subject("rotations", "quaternions, matrices, Euler angles, exp and log")

_RNG = np.random.default_rng(6)
_P, _Q = (q / np.linalg.norm(q, axis=-1, keepdims=True) for q in _RNG.normal(size=(2, 100, 4)))
_V = _RNG.normal(size=(100, 3))
_ANGLES = _RNG.uniform([-3.0, 0.1, -3.0], [3.0, 3.0, 3.0], (100, 3))
_RATES = _RNG.normal(size=(100, 3))
_ROUNDINGS = 32 * EPS
_SOME = "some ten roundings of numbers near 1"
_SLOPES = "differences of order 4 in steps of 1e-3: truncation 1e-10, roundings 1e-15 / 1e-3"


def _slope(f: Callable[[float], Array]) -> Array:
    """df/ds at s = 0."""
    h = 1e-3
    return np.asarray((8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h))


def _spin(R: Callable[[float], Array]) -> tuple[Array, Array]:
    """Angular velocity in world and in body axes of R(s) at s = 0."""
    slope, back = _slope(R), np.swapaxes(R(0.0), -1, -2)
    return axial(slope @ back), axial(back @ slope)


@SUBJECT.law("matrix_from_quaternion and back with SciPy", bound=_ROUNDINGS, why=_SOME)
def quaternions_have_their_matrices() -> float:
    """R of 100 quaternions; the quaternion of R is the one with w >= 0."""
    R = rot.matrix_from_quaternion(_Q)
    back = np.where(_Q[:, :1] < 0.0, -_Q, _Q)
    return max_abs(R - matrices(_Q), rot.quaternion_from_matrix(matrices(_Q)) - back)


@SUBJECT.law("multiply, conjugate, rotate with matrices", bound=_ROUNDINGS, why=_SOME)
def products_of_quaternions_are_products_of_matrices() -> float:
    """R(p q) = R(p) R(q), R(conj q) = R(q)^T, and both on vectors."""
    one, two = matrices(_P), matrices(_Q)
    return max_abs(
        matrices(rot.multiply(_P, _Q)) - one @ two,
        matrices(rot.conjugate(_Q)) - np.swapaxes(two, -1, -2),
        rot.rotate(_Q, _V) - np.einsum("nij,nj->ni", two, _V),
        rot.rotate_inverse(_Q, _V) - np.einsum("nji,nj->ni", two, _V),
    )


@SUBJECT.law("Euler angles and back with SciPy's z-x-z", bound=1e-13, why="roundings over sin 0.1")
def euler_angles_are_precession_nutation_and_spin() -> float:
    """R = Rz(phi) Rx(theta) Rz(psi) of 100 triples, through quaternions and matrices."""
    R = Rotation.from_euler("ZXZ", _ANGLES).as_matrix()
    return max_abs(
        rot.matrix_from_euler(_ANGLES) - R,
        rot.euler_from_matrix(R) - _ANGLES,
        rot.euler_from_quaternion(rot.quaternion_from_euler(_ANGLES)) - _ANGLES,
    )


@SUBJECT.law("exp and log with SciPy's matrix exponential", bound=1e-13, why="roundings of expm")
def exp_is_the_exponential_of_the_cross_product() -> float:
    """R(exp v) = expm of hat(v), hat(v) u = v x u, and log leads back."""
    V = rot.hat(_V)
    short = _V / np.maximum(1.0, np.linalg.norm(_V, axis=-1, keepdims=True) / 3.0)
    return max_abs(
        matrices(rot.exp(_V)) - expm(V),
        np.einsum("nij,nj->ni", V, _RATES) - np.cross(_V, _RATES),
        rot.vee(V) - _V,
        rot.log(rot.exp(short)) - short,
    )


@SUBJECT.law("axis, angle and distance with the trace of R", bound=1e-12, why="roundings over sin")
def angles_are_those_of_the_trace() -> float:
    """2 cos(angle) + 1 = tr R, R axis = axis, and the distance is the angle between."""
    R, between = matrices(_Q), np.swapaxes(matrices(_P), -1, -2) @ matrices(_Q)
    axis, angle = rot.axis_angle_from_quaternion(_Q)
    return max_abs(
        2.0 * np.cos(rot.angle(_Q)) + 1.0 - np.trace(R, axis1=-2, axis2=-1),
        2.0 * np.cos(rot.distance(_P, _Q)) + 1.0 - np.trace(between, axis1=-2, axis2=-1),
        np.einsum("nij,nj->ni", R, axis) - axis,
        matrices(rot.quaternion_from_axis_angle(axis, angle)) - R,
    )


@SUBJECT.law("quaternion_rate with differences of R exp(t omega)", bound=1e-9, why=_SLOPES)
def the_rate_of_a_quaternion_turns_the_body() -> float:
    """The rate is q (0, omega) / 2: the body turns with omega in its own axes."""
    q_rate = rot.quaternion_rate(_Q, _V)
    turn = Rotation.from_quat(_Q, scalar_first=True)
    return max_abs(
        _slope(lambda s: matrices(_Q + s * q_rate))
        - _slope(lambda s: (turn * Rotation.from_rotvec(s * _V)).as_matrix())
    )


@SUBJECT.law("Euler-angle rates with differences of R", bound=1e-9, why=_SLOPES)
def euler_rates_give_the_angular_velocity() -> float:
    """Angular velocities in both frames from (phi', theta', psi'), and back."""
    world, body = _spin(lambda s: Rotation.from_euler("ZXZ", _ANGLES + s * _RATES).as_matrix())
    sine = np.sin(_ANGLES[:, 1:2])
    return max_abs(
        rot.omega_body_from_euler_rates(_ANGLES, _RATES) - body,
        rot.omega_world_from_euler_rates(_ANGLES, _RATES) - world,
        sine * (rot.euler_rates_from_omega_body(_ANGLES, body) - _RATES),
        sine * (rot.euler_rates_from_omega_world(_ANGLES, world) - _RATES),
    )


@SUBJECT.law("Jacobians of exp with differences of expm", bound=1e-9, why=_SLOPES)
def jacobians_turn_rates_of_vectors_into_angular_velocities() -> float:
    """J_left v' in world and J_right v' in body axes, and the inverses of both."""
    world, body = _spin(lambda s: expm(rot.hat(_V + s * _RATES)))
    return max_abs(
        np.einsum("nij,nj->ni", rot.left_jacobian(_V), _RATES) - world,
        np.einsum("nij,nj->ni", rot.right_jacobian(_V), _RATES) - body,
        rot.left_jacobian_inverse(_V) @ rot.left_jacobian(_V) - np.eye(3),
        rot.right_jacobian_inverse(_V) @ rot.right_jacobian(_V) - np.eye(3),
    )


@SUBJECT.law("slerp with SciPy's", bound=1e-12, why="roundings, over the sine of the angle")
def slerp_is_the_shortest_way() -> float:
    """Attitudes on the way between 100 pairs."""
    t, errors = np.linspace(0.0, 1.0, 5), []
    for p, q in zip(_P, _Q, strict=True):
        ends = Rotation.from_quat([p, q], scalar_first=True)
        errors.append(matrices(rot.slerp(p, q, t)) - Slerp([0.0, 1.0], ends)(t).as_matrix())
    return max_abs(*errors)


@SUBJECT.law("rot6d with columns of R", bound=_ROUNDINGS, why=_SOME)
def six_numbers_are_enough() -> float:
    """The first two columns, in any length and skew, give R back."""
    R = matrices(_Q)
    six = rot.rot6d_from_matrix(R)
    stretched = np.concatenate([2.0 * six[:, :3], 3.0 * six[:, 3:] + 0.5 * six[:, :3]], axis=-1)
    return max_abs(
        six - np.concatenate([R[..., 0], R[..., 1]], axis=-1), rot.matrix_from_rot6d(stretched) - R
    )


@SUBJECT.law(
    "tensors and rates between frames with matrices and differences",
    bound=1e-9,
    why=_SLOPES,
)
def tensors_and_rates_are_carried_between_frames() -> float:
    """R T R^T; and v' seen from the body and from the world, which differ by omega x v."""
    R, tensor = matrices(_Q), np.einsum("ni,nj->nij", _V, _RATES)
    carried = np.einsum("nij,njk,nlk->nil", R, tensor, R)
    omega = _P[:, 1:]

    def seen_from_world(s: float) -> Array:
        turned = R @ Rotation.from_rotvec(s * omega).as_matrix()
        return np.asarray(np.einsum("nij,nj->ni", turned, _V + s * _RATES))

    rate = _slope(seen_from_world)
    return max_abs(
        rot.rotate_tensor(_Q, tensor) - carried,
        rot.transform_tensor(np.swapaxes(R, -1, -2), carried) - tensor,
        rot.world_rate(_Q, _V, _RATES, omega) - rate,
        rot.body_rate(_Q, seen_from_world(0.0), rate, omega) - _RATES,
    )


@SUBJECT.law(
    "moments of random_quaternion with those of the uniform distribution",
    bound=5.0,
    why="in standard deviations of a mean of 20000: beyond 5 once in a million",
)
def random_attitudes_are_uniform() -> float:
    """Means 0 of q_i and q_i q_j, 1/4 of q_i^2, 1/8 of q_i^4."""
    n = 20000
    q = rot.random_quaternion(np.random.default_rng(7), (n,))
    mixed = np.stack([q[:, i] * q[:, j] for i in range(4) for j in range(i)], axis=-1)
    samples = np.concatenate([q, mixed, q**2 - 0.25, q**4 - 0.125], axis=-1)
    return max_abs(np.sqrt(n) * samples.mean(axis=0) / samples.std(axis=0))
