"""Rolling balls: along plans of straight rolls, kinematic or pushed; following; on a plate."""

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm, solve_discrete_are

from rigid_envs import rotations
from rigid_envs.tasks import BallParkDynamic, BallPlate, BallSteer

__all__ = ["balance", "keep_up", "plate_gain", "push_along", "roll_along", "track"]

Array = npt.NDArray[np.float64]


def roll_along(rolls: Array, reach: float) -> Array:
    """Actions that roll straight rolls one after the other, each in equal steps, as few as can be.

    Args:
        rolls: displacements, shape (N, 3, 2) [radii].
        reach: largest roll in one step [rad].

    Returns:
        Actions, shape (T, N, 2): velocities as parts of the largest; at last zero.
    """
    counts = np.ceil(np.linalg.norm(rolls, axis=-1) / reach).astype(int)
    actions = np.zeros((np.max(np.sum(counts, axis=-1)) + 1, len(rolls), 2))
    for row, (legs, n) in enumerate(zip(rolls, counts, strict=True)):
        steps = np.repeat(legs / np.maximum(n, 1)[:, None] / reach, n, axis=0)
        actions[: len(steps), row] = steps
    return actions


def push_along(task: BallParkDynamic, y: Array, rolls: Array) -> tuple[Array, Array, Array]:
    """Forces that roll a ball from rest to rest along straight rolls, and the motion they make.

    Each roll of length L is rolled in 2 n periods, half of them at the acceleration L / (n dt)^2
    and half at its opposite, n the least for which the force suffices: the fastest there is but for
    whole periods. The acceleration is constant in a period, so the motion is known exactly.

    Args:
        task: the task, with numbers for its parameters.
        y: states at the start, at rest, shape (N, 13).
        rolls: displacements, shape (N, 3, 2) [m].

    Returns:
        Accelerations, shape (T, N, 2) [m/s^2]; positions [m] and velocities [m/s] before and after
        each, shape (T + 1, N, 2).
    """
    system = task.system()
    largest = 0.98 * task.force / (system.m * (1.0 + system.beta))  # the rest is for tracking
    lengths = np.linalg.norm(rolls, axis=-1)
    halves = np.ceil(np.sqrt(lengths / largest) / task.dt).astype(int)
    pushes = np.zeros((np.max(np.sum(2 * halves, axis=-1)) + 1, len(rolls), 2))
    for row, (legs, n) in enumerate(zip(rolls, halves, strict=True)):
        each = legs / (np.maximum(n, 1)[:, None] * task.dt) ** 2
        there_and_back = np.stack([each, -each], axis=1).reshape(-1, 2)
        steps = np.repeat(there_and_back, np.repeat(n, 2), axis=0)
        pushes[: len(steps), row] = steps
    rest = np.zeros((1, len(rolls), 2))
    velocity = np.concatenate([rest, np.cumsum(task.dt * pushes, axis=0)])
    way = np.cumsum(0.5 * task.dt * (velocity[1:] + velocity[:-1]), axis=0)
    return pushes, y[:, 4:6] + np.concatenate([rest, way]), velocity


def track(task: BallParkDynamic, y: Array, push: Array, position: Array, velocity: Array) -> Array:
    """Actions for a push [m/s^2], corrected for where the ball is: critically damped.

    ``m (1 + beta) (push + k^2 (position - X) + 2 k (velocity - V))`` with k = 2 / s.

    Args:
        task: the task, with numbers for its parameters.
        y: states, shape (..., 13).
        push: accelerations that are due, shape (..., 2) [m/s^2].
        position: where the ball should be, shape (..., 2) [m].
        velocity: and how fast, shape (..., 2) [m/s].

    Returns:
        Actions, shape (..., 2).
    """
    system, k = task.system(), 2.0
    back = k * k * (position - y[..., 4:6]) + 2.0 * k * (velocity - y[..., 6:8])
    return system.m * (1.0 + system.beta) / task.force * (push + back)


def keep_up(task: BallSteer, y: Array, memo: Array, gain: float = 0.6, turn: float = 1.2) -> Array:
    """Actions that follow the reference: its own, and a correction down the slope of the error.

    With p the offset in radii, theta the rotation vector from its attitude to the ball's and w the
    velocity relative to it in radii, ``p' = w`` and ``theta . theta' = theta . (-w_y, w_x, 0)``:
    how the reference turns makes no difference to the angle. So V = (|p|^2 + turn |theta|^2) / 2
    does not grow under ``w = -gain (p_x + turn theta_y, p_y - turn theta_x)``, and tends to 0 where
    the path bends: straight on, theta_y - p_x would stay.

    Args:
        task: the task, with numbers for its parameters.
        y: states, shape (..., 6).
        memo: what the task remembers, shape (..., 13).
        gain: of the correction [1/s].
        turn: weight of the attitude against the position.

    Returns:
        Actions, shape (..., 2).

    Source: damping control, Jurdjevic & Quinn 1978, doi:10.1016/0022-0396(78)90135-3.
    """
    away = (y[..., 4:6] - memo[..., 4:6]) / task.system().radius
    theta = rotations.log(rotations.multiply(y[..., :4], rotations.conjugate(memo[..., :4])))
    across = np.stack([theta[..., 1], -theta[..., 0]], axis=-1)
    back = -gain * (away + turn * across)
    return task.reference_speed * memo[..., 6:8] + back * task.dt / task.roll_per_step


_PLANAR = [4, 5, 6, 7, 9, 10, 11, 12]  # X, Y, VX, VY, alpha_x, alpha_y and their rates


def plate_gain(task: BallPlate, effort: float = 1.0) -> Array:
    """Gain K of the linear-quadratic regulator: rates = -K (offset, velocity, tilt, tilt rates).

    The ball at rest on the level plate, linearised, over a control period in which the rates of the
    tilt change linearly to the commanded ones; the cost is |offset|^2 + effort |rates|^2 per step.

    Args:
        task: the task, with numbers for its parameters.
        effort: weight of the commanded rates [m^2 s^2].

    Returns:
        K, shape (2, 8).

    Source: Anderson & Moore, *Optimal Control: Linear Quadratic Methods*, chapter 2.
    """
    system = task.system()
    a, b = system.linearize(system.state())
    both = np.zeros((10, 10))
    both[:8] = np.concatenate([a[np.ix_(_PLANAR, _PLANAR)], b[_PLANAR, 2:]], axis=1)
    held = expm(task.dt * both)
    drift, kick = held[:8, :8].copy(), held[:8, 8:] / task.dt
    drift[:, 6:] -= kick  # accelerations are (commanded - present rate) / dt
    cost = np.diag([1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    value = solve_discrete_are(drift, kick, cost, effort * np.eye(2))
    return np.linalg.solve(effort * np.eye(2) + kick.T @ value @ kick, kick.T @ value @ drift)


def balance(task: BallPlate, gain: Array, y: Array, point: Array, farthest: float = 1.0) -> Array:
    """Actions of the regulator, for an offset that counts no further than it can be tilted for.

    Args:
        task: the task.
        gain: of `plate_gain`.
        y: states, shape (..., 13).
        point: commanded points, shape (..., 2) [m].
        farthest: offsets are cut to this length [m].

    Returns:
        Actions, shape (..., 2).
    """
    error = y[..., _PLANAR]
    error[..., :2] -= point
    distance = np.linalg.norm(error[..., :2], axis=-1, keepdims=True)
    error[..., :2] /= np.maximum(1.0, distance / farthest)
    return -error @ gain.T / task.tilt_rate
