"""Pose tracking of a rolling reference ball: damping control, and preview control."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.checks import array, positive, require
from rigid_envs.control.linear import Regulator
from rigid_envs.control.rolling import AXES, difference
from rigid_envs.systems import RollingBall

__all__ = ["DampedFollower", "FarSightedFollower", "elastica_headings", "pose_error"]

Array = npt.NDArray[np.float64]
_TINY = 1e-300  # no division by zero


def pose_error(ball: RollingBall, y: npt.ArrayLike, reference: npt.ArrayLike) -> Array:
    """Pose error of the ball: offset p [radii], rotation vector theta of q q_ref^-1 [rad], world.

    Args:
        ball: either ball.
        y: states of `RollingBall`, shape (..., 6).
        reference: the same.

    Returns:
        (p, theta), shape (..., 5).

    Raises:
        ValueError: bad states.
    """
    turn, offset = difference(reference, y, ball.radius)
    return np.concatenate([offset, rotations.log(turn)], axis=-1)


@dataclass(frozen=True)
class DampedFollower:
    """Follows by the reference's own velocity and a correction down the slope of the error.

    With p the offset in radii, theta the rotation vector from its attitude to the ball's and w the
    velocity relative to it in radii, ``p' = w`` and ``theta . theta' = theta . (-w_y, w_x, 0)``:
    how the reference turns makes no difference to the angle. So for

        V = (|p|^2 + turn |theta|^2) / 2,   w = -gain s (p_x + turn theta_y, p_y - turn theta_x)

    V' = -|w|^2 / (gain s): the Lyapunov function V does not grow, from any start with an angle
    below pi (where theta jumps). s, at most 1, is the largest for which the whole velocity is
    possible. V tends to 0 where the path bends: straight on, theta_y - p_x, x along the line, would
    stay.

    Attributes:
        ball: both balls.
        rate: largest rolling rate [rad/s].
        gain: of the correction [1/s].
        turn: weight of the attitude against the position.

    Raises:
        ValueError: numbers that are not positive.

    Source: damping control, Jurdjevic & Quinn 1978, doi:10.1016/0022-0396(78)90135-3.
    """

    ball: RollingBall
    rate: float
    gain: float = 0.6
    turn: float = 1.2

    def __post_init__(self) -> None:
        """Check the numbers."""
        positive(self.rate, "rate", "rad/s")
        positive(self.gain, "gain", "1/s")
        positive(self.turn, "turn", "1")

    def __call__(
        self, y: npt.ArrayLike, reference: npt.ArrayLike, velocity: npt.ArrayLike
    ) -> Array:
        """Velocity of the centre over the largest, in the unit disk.

        Args:
            y: states of `RollingBall`, shape (..., 6).
            reference: those of the ball ahead, shape (..., 6).
            velocity: at which it goes on, shape (..., 2) [m/s].

        Returns:
            Actions, shape (..., 2).

        Raises:
            ValueError: bad states, or a reference faster than the ball can be.
        """
        p_x, p_y, theta_x, theta_y, _ = np.moveaxis(pose_error(self.ball, y, reference), -1, 0)
        slope = np.stack([p_x + self.turn * theta_y, p_y - self.turn * theta_x], axis=-1)
        return _added(self.ball, self.rate, velocity, -self.gain * slope)

    def lyapunov(self, y: npt.ArrayLike, reference: npt.ArrayLike) -> Array:
        """V of the error, shape (...); arguments as above."""
        square = pose_error(self.ball, y, reference) ** 2
        weighed = np.sum(square[..., :2], axis=-1) + self.turn * np.sum(square[..., 2:], axis=-1)
        return np.asarray(0.5 * weighed)


@dataclass(frozen=True)
class FarSightedFollower:
    """Follows by the linear-quadratic regulator along the known path of the reference.

    The error e = (p, theta) of small size changes in a period dt, in which the reference rolls by
    the rotation vector a and the ball by J w dt more,

        p+ = p + w dt,   theta+ = exp(a) theta + J(a) (-w_y, w_x, 0) dt,

    with J the left Jacobian: only where the reference rolls on, and bends, is every error within
    reach. With e+ = F_k e + G_k w, ``w = -K_k e`` minimises the sum of ``|e|^2 + r |w|^2`` over the
    horizon, r the `input_weight`,

        K_k = (r + G_k' P G_k)^-1 G_k' P F_k,   P_k = 1 + F_k' P (F_k - G_k K_k)

    with P = P_(k+1), and ``e P_k e`` is the cost to go. As in `DampedFollower`, w is cut to
    what is possible. Region, measured: all errors up to 1 radius and 1 rad, behind a reference that
    rolls at half of the largest rate along waves, loops and curls.

    Attributes:
        ball: both balls.
        rate: largest rolling rate [rad/s].
        dt: control period [s].
        input_weight: weight of the correcting velocity, in radii, against the error [s^2].

    Raises:
        ValueError: numbers that are not positive.

    Source: Anderson & Moore, *Optimal Control: Linear Quadratic Methods*, sections 2.4 and 4.1.
    """

    ball: RollingBall
    rate: float
    dt: float
    input_weight: float = 0.03

    def __post_init__(self) -> None:
        """Check the numbers."""
        positive(self.rate, "rate", "rad/s")
        positive(self.dt, "dt", "s")
        positive(self.input_weight, "input_weight", "s^2")

    def __call__(
        self,
        y: npt.ArrayLike,
        reference: npt.ArrayLike,
        velocity: npt.ArrayLike,
        gain: npt.ArrayLike,
    ) -> Array:
        """Velocity of the centre over the largest, in the unit disk.

        Args:
            y: states of `RollingBall`, shape (..., 6).
            reference: those of the ball ahead, shape (..., 6).
            velocity: at which it goes on in this period, shape (..., 2) [m/s].
            gain: K of this period from `regulator`, shape (..., 2, 5).

        Returns:
            Actions, shape (..., 2).

        Raises:
            ValueError: bad states, or a reference faster than the ball can be.
        """
        error = pose_error(self.ball, y, reference)
        correction = -np.einsum("...ij,...j->...i", array(gain, "gain", 2, 5), error)
        return _added(self.ball, self.rate, velocity, correction)

    def regulator(self, velocities: npt.ArrayLike) -> Regulator:
        """Gains K_k and matrices P_k for each period of the path ahead.

        Args:
            velocities: of the reference in the T periods to come, shape (T, ..., 2) [m/s].

        Returns:
            `Regulator` with arrays of shapes (T, ..., 2, 5) and (T, ..., 5, 5).

        Raises:
            ValueError: bad shapes or numbers.
        """
        F, G = self._steps(array(velocities, "velocities", 2, entries="VX, VY"))
        P = np.broadcast_to(np.eye(5), F.shape[1:])
        gains, values = [], []
        for f, g in zip(F[::-1], G[::-1], strict=True):
            back = np.swapaxes(g, -1, -2) @ P
            K = np.linalg.solve(self.input_weight * np.eye(2) + back @ g, back @ f)
            P = np.eye(5) + np.swapaxes(f, -1, -2) @ P @ (f - g @ K)
            P = 0.5 * (P + np.swapaxes(P, -1, -2))
            gains.append(K)
            values.append(P)
        return Regulator(np.stack(gains[::-1]), np.stack(values[::-1]))

    def _steps(self, velocities: Array) -> tuple[Array, Array]:
        """F_k, shape (T, ..., 5, 5), and G_k, shape (T, ..., 5, 2), of each period."""
        turns = self.dt / self.ball.radius * velocities @ AXES.T
        F = np.zeros((*turns.shape[:-1], 5, 5))
        F[..., :2, :2] = np.eye(2)
        F[..., 2:, 2:] = rotations.matrix_from_quaternion(rotations.exp(turns))
        rolled = rotations.left_jacobian(turns) @ AXES
        straight = np.broadcast_to(np.eye(2), (*turns.shape[:-1], 2, 2))
        return F, self.dt * np.concatenate([straight, rolled], axis=-2)


def elastica_headings(
    heading: Array, curvature: Array, force: Array, side: npt.ArrayLike, n: int
) -> Array:
    """Headings of n sides of a polygon along Euler's elastica, each as long as `side`.

    ``heading' = curvature``, ``curvature' = heading x force`` with a constant force: half a change
    of curvature, a turn, and another half; symmetric, so of second order.

    Args:
        heading: unit vector of the first side, shape (..., 2).
        curvature: there, shape (...) [1/m].
        force: shape (..., 2) [1/m^2].
        side: length of each side, shape (...) [m].
        n: number of sides.

    Returns:
        Unit vectors, shape (n, ..., 2).

    Source: Love, *Mathematical Theory of Elasticity*, section 262.
    """
    step, found = np.asarray(side, dtype=np.float64), [heading]
    for _ in range(n - 1):
        h_x, h_y = np.moveaxis(found[-1], -1, 0)
        curvature = curvature + 0.5 * step * (h_x * force[..., 1] - h_y * force[..., 0])
        c, s = np.cos(step * curvature), np.sin(step * curvature)
        h_x, h_y = c * h_x - s * h_y, s * h_x + c * h_y
        curvature = curvature + 0.5 * step * (h_x * force[..., 1] - h_y * force[..., 0])
        found.append(np.stack([h_x, h_y], axis=-1))
    return np.stack(found)


def _added(ball: RollingBall, rate: float, velocity: npt.ArrayLike, correction: Array) -> Array:
    """Action for a velocity [m/s] and as much of a correction [radii/s] as is possible."""
    velocity = array(velocity, "velocity", 2, entries="VX, VY")
    first = velocity / (ball.radius * rate)
    more = correction / rate
    room = 1.0 - np.sum(first**2, axis=-1)
    expected = f"at most radius * rate = {ball.radius * rate:.6g} [m/s]"
    require(room >= -1e-6, velocity, "velocity", expected)
    # the largest s <= 1 with |first + s more| <= 1, written without cancellation
    room = np.maximum(room, 0.0)
    a, b = np.sum(more**2, axis=-1), np.sum(first * more, axis=-1)
    root = np.sqrt(b**2 + a * room)
    inward = (root - b) / np.maximum(a, _TINY)
    s = np.minimum(1.0, np.where(b < 0.0, inward, room / np.maximum(root + b, _TINY)))
    return np.asarray(first + s[..., None] * more)
