"""Bodies that roll, by Newton's and Euler's laws in the world and the forces of their contacts.

Centre r, velocity v, attitude R and angular velocity omega are in world axes, and the contact force
is an unknown like the accelerations: ``m v' = F + C``, ``(I omega)' = rho x C + torque``, and the
second derivative of "the point at rho does not slip" closes the system. It is solved as it stands,
and integrated by DOP853 of SciPy: nothing is eliminated, and no Euler angle, quaternion or body
axis is used. A constraint that is only differentiated drifts; over some seconds by 1e-12.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from rigid_envs.base.checks import Array
from rigid_envs.systems.dynamic_ball.system import DynamicBall
from rigid_envs.systems.roller.system import Roller
from rigid_envs.systems.rolling_disk.system import RollingDisk
from rigid_envs.systems.upright_coin.system import UprightCoin
from tests.vectors import cross

E_X, E_Y, E_Z = np.eye(3)


@dataclass(frozen=True)
class Held:
    """How a body moves that is held by constraints.

    Attributes:
        rates: derivative of the whole state of the model.
        contact: force of the ground on the body, in world axes [N].
        torque: what else holds the body: torque of a further constraint [N m], or nothing.
    """

    rates: Array
    contact: Array
    torque: Array


def skew(a: Array) -> Array:
    """Matrix of b -> a x b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def pack(r: Array, v: Array, R: Array, omega: Array, *more: Array) -> Array:
    """State of a model."""
    return np.concatenate([r, v, np.ravel(R), omega, *more])


def unpack(z: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Centre, velocity, attitude, angular velocity, and what follows in the state."""
    return z[:3], z[3:6], z[6:15].reshape(3, 3), z[15:18], z[18:]


def accelerations(
    m: float, inertia: Array, omega: Array, wrench: Array, rows: Array, drift: Array
) -> tuple[Array, Array]:
    """Accelerations (v', omega') and multipliers of ``rows (v', omega') = drift``.

    Args:
        m: mass [kg].
        inertia: tensor about the centre, in world axes [kg m^2].
        omega: angular velocity [rad/s].
        wrench: force and torque that are given [N, N m].
        rows: coefficients of the constraints, shape (k, 6).
        drift: what their second derivatives ask for, shape (k,).
    """
    k = len(rows)
    matrix = np.zeros((6 + k, 6 + k))
    matrix[:3, :3], matrix[3:6, 3:6] = m * np.eye(3), inertia
    matrix[6:, :6], matrix[:6, 6:] = rows, -rows.T
    gyroscopic = np.concatenate([np.zeros(3), cross(omega, inertia @ omega)])
    found = np.linalg.solve(matrix, np.concatenate([wrench - gyroscopic, drift]))
    return found[:6], found[6:]


def turned(omega: Array, R: Array) -> Array:
    """R' = [omega] R."""
    return skew(omega) @ R


def ball_on_plate(ball: DynamicBall, z: Array, u: Array) -> Held:
    """The ball on a plate that tilts and turns; after the body come angles and rates of the plate.

    The plate turns by alpha_x about world x and then by alpha_y about its own y axis.
    """
    r, v, R, omega, (ax, ay, rate_x, rate_y) = unpack(z)
    tip = Rotation.from_rotvec(ax * E_X)
    across = tip.apply(E_Y)  # the second axis, carried by the first
    plate = (tip * Rotation.from_rotvec(ay * E_Y)).as_matrix()
    n = plate[:, 2]
    w = rate_x * E_X + rate_y * across
    w_t = u[2] * E_X + u[3] * across + rate_x * rate_y * cross(E_X, across)
    surface = w + ball.turntable_rate * n
    n_t = cross(w, n)
    surface_t = w_t + ball.turntable_rate * n_t
    foot, foot_t = r - ball.radius * n, v - ball.radius * n_t
    # v - omega x radius n = surface x foot, differentiated.
    rows = np.hstack([np.eye(3), ball.radius * skew(n)])
    drift = cross(surface_t, foot) + cross(surface, foot_t)
    drift = drift + ball.radius * cross(omega, n_t)
    force = plate[:, :2] @ u[:2] - ball.m * ball.g * E_Z
    inertia = ball.beta * ball.m * ball.radius**2 * np.eye(3)
    found, contact = accelerations(
        ball.m, inertia, omega, np.concatenate([force, np.zeros(3)]), rows, drift
    )
    tilts = np.array([rate_x, rate_y, u[2], u[3]])
    rates = pack(v, found[:3], turned(omega, R), found[3:], tilts)
    return Held(rates, contact, np.zeros(0))


def wheel(system: RollingDisk | UprightCoin, R: Array, omega: Array) -> tuple[Array, ...]:
    """Inertia in world axes, axis e3, radius n that points up with its derivative, direction l."""
    axis, axis_t = R[:, 2], cross(omega, R[:, 2])
    inertia = system.I1 * np.eye(3) + (system.I3 - system.I1) * np.outer(axis, axis)
    up, up_t = E_Z - axis[2] * axis, -axis_t[2] * axis - axis[2] * axis_t
    size = np.linalg.norm(up)
    n = up / size
    n_t = (up_t - n * (n @ up_t)) / size
    return inertia, axis, n, n_t, cross(axis, n)


def disk_on_plane(disk: RollingDisk, z: Array, u: Array) -> Held:
    """The disk that rolls on its rim, which is lowest at -radius n."""
    _, v, R, omega, _ = unpack(z)
    inertia, axis, n, n_t, along = wheel(disk, R, omega)
    rows = np.hstack([np.eye(3), disk.radius * skew(n)])
    torque = u[0] * n + u[1] * along + u[2] * axis
    wrench = np.concatenate([-disk.m * disk.g * E_Z, torque])
    drift = disk.radius * cross(omega, n_t)
    found, contact = accelerations(disk.m, inertia, omega, wrench, rows, drift)
    return Held(pack(v, found[:3], turned(omega, R), found[3:]), contact, np.zeros(0))


def coin_on_slope(coin: UprightCoin, z: Array, u: Array) -> Held:
    """The disk again, its axis held parallel to the plane by a torque about l: omega . l = 0."""
    _, v, R, omega, _ = unpack(z)
    inertia, axis, n, n_t, along = wheel(coin, R, omega)
    along_t = cross(cross(omega, axis), n) + cross(axis, n_t)
    rolling = np.hstack([np.eye(3), coin.radius * skew(n)])
    rows = np.vstack([rolling, np.concatenate([np.zeros(3), along])])
    drift = np.append(coin.radius * cross(omega, n_t), -omega @ along_t)
    weight = coin.m * coin.g * np.array([np.sin(coin.slope), 0.0, -np.cos(coin.slope)])
    wrench = np.concatenate([weight, u[0] * n + u[1] * axis])
    found, forces = accelerations(coin.m, inertia, omega, wrench, rows, drift)
    return Held(pack(v, found[:3], turned(omega, R), found[3:]), forces[:3], forces[3:])


def roller_in_valley(roller: Roller, z: Array, u: Array) -> Held:
    """A cylinder along y whose centre moves on a circle about a fixed point, and which rolls.

    After the body comes that point. Where the path is curved the ground is, too, but what rolls on
    it still touches it along the normal of the path.
    """
    r, v, R, omega, pivot = unpack(z)
    sign = np.sign(roller.curvature)  # the circle's centre lies above a valley, below a hill
    arm = r - pivot
    down = sign * arm / np.linalg.norm(arm)
    down_t = sign * (v - arm * (arm @ v) / (arm @ arm)) / np.linalg.norm(arm)
    along = cross(down, E_Y)  # to +x at the bottom of a valley
    # Rolling: along . (v + omega x radius down) = 0; on the circle: down . v = 0; in the plane.
    still = np.hstack([np.zeros((3, 3)), np.eye(3)])[[0, 2]]
    lever = cross(roller.radius * down, along)
    rows = np.vstack(
        [
            np.concatenate([along, lever]),
            np.concatenate([down, np.zeros(3)]),
            np.concatenate([E_Y, np.zeros(3)]),
            still,
        ]
    )
    along_t = cross(down_t, E_Y)
    lever_t = roller.radius * (cross(down_t, along) + cross(down, along_t))
    drift = np.array([-v @ along_t - omega @ lever_t, -v @ down_t, 0.0, 0.0, 0.0])
    inertia = (roller.beta + u[1]) * roller.m * roller.radius**2 * np.eye(3)
    force = u[0] * along - roller.m * roller.g * E_Z
    found, forces = accelerations(
        roller.m, inertia, omega, np.concatenate([force, np.zeros(3)]), rows, drift
    )
    rates = pack(v, found[:3], turned(omega, R), found[3:], np.zeros(3))
    return Held(rates, np.array([forces[0], -forces[1]]), np.zeros(0))
