"""Holding a ball on a point of a table that is tilted: the linear-quadratic regulator."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import array, positive
from rigid_envs.control.linear import Regulator, lqr, zero_order_hold
from rigid_envs.control.saturation import clip_to_box
from rigid_envs.systems import DynamicBall

__all__ = ["PlateRegulator"]

Array = npt.NDArray[np.float64]
_PLANAR = [4, 5, 6, 7, 9, 10, 11, 12]  # X, Y, VX, VY, alpha_x, alpha_y and their rates
_SMALL = 1e-3  # weight of what is not the offset: m^2 per (m/s)^2, rad^2 and (rad/s)^2


@dataclass(frozen=True)
class PlateRegulator:
    """Leads a ball to a point and holds it there, by the rates of the two angles of the table.

    About rest on the level table, in x = (offset, velocity, tilt, tilt rates), the motion over a
    period in which the rates of the tilt change linearly to the commanded ones r is
    ``x+ = F x + G r``. The feedback ``r = -K x`` minimises the sum of
    ``|offset|^2 + small (|velocity|^2 + |tilt|^2 + |rates|^2) + input_weight |r|^2``.

    Certificate: the Riccati matrix P, with `value`, x P x, the sum from there on near the point,
    and a Lyapunov function. It takes into account that tilting moves the ball against its goal
    first, and a turntable.

    Region: an offset counts no further than `farthest`, in its direction, so that from far away the
    ball is led in no faster than it can be stopped. Measured, for a ball of radius 1 m on a table
    with 0.4 rad/s: from rest up to 10 m away, and through the point at up to 4 m/s, when the table
    is tilted by up to 0.6 rad. It also succeeds where motors stop the table at 0.1 rad, from 4 m
    away at 0.5 m/s.

    Attributes:
        ball: rolling ball with the table's parameters.
        tilt_rate: largest rate of each angle [rad/s].
        dt: control period [s].
        input_weight: weight of the commanded rates [m^2 s^2].
        farthest: offsets are cut to this length [m].

    Raises:
        ValueError: numbers that are not positive.

    Source: Anderson & Moore, *Optimal Control: Linear Quadratic Methods*, section 3.3.
    """

    ball: DynamicBall
    tilt_rate: float
    dt: float
    input_weight: float = 1.0
    farthest: float = 1.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        positive(self.tilt_rate, "tilt_rate", "rad/s")
        positive(self.dt, "dt", "s")
        positive(self.input_weight, "input_weight", "m^2 s^2")
        positive(self.farthest, "farthest", "m")

    def __call__(self, y: npt.ArrayLike, point: npt.ArrayLike) -> Array:
        """Rates to command, as parts of the largest.

        Args:
            y: states of `DynamicBall`, shape (..., 13).
            point: where the ball is to be, in plate axes, shape (..., 2) [m].

        Returns:
            Actions, shape (..., 2).

        Raises:
            ValueError: bad states or points.
        """
        error = self.error(y, point)
        distance = np.linalg.norm(error[..., :2], axis=-1, keepdims=True)
        error[..., :2] /= np.maximum(1.0, distance / self.farthest)
        return clip_to_box(self.regulator.feedback(error) / self.tilt_rate)

    def inputs(self, y: npt.ArrayLike, action: npt.ArrayLike) -> Array:
        """Input u of `DynamicBall`, shape (..., 4), that brings the rates to the commanded ones."""
        rates = self.ball.checked_state(y)[..., 11:13]
        change = (self.tilt_rate * np.asarray(action, dtype=np.float64) - rates) / self.dt
        return np.concatenate([np.zeros_like(change), change], axis=-1)

    def error(self, y: npt.ArrayLike, point: npt.ArrayLike) -> Array:
        """(offset, velocity, tilt, tilt rates) of states, shape (..., 8) [m, m/s, rad, rad/s]."""
        rows, goal = (
            self.ball.checked_state(y)[..., _PLANAR],
            array(point, "point", 2, entries="X, Y"),
        )
        return np.concatenate([rows[..., :2] - goal, rows[..., 2:] + 0.0 * goal[..., :1]], axis=-1)

    def value(self, y: npt.ArrayLike, point: npt.ArrayLike) -> Array:
        """Cost to go x P x of states near the point, shape (...)."""
        return self.regulator.value(self.error(y, point))

    @cached_property
    def regulator(self) -> Regulator:
        """K and P."""
        weights = np.array([1.0, 1.0] + [_SMALL] * 6)
        return lqr(*self.step, weights, np.full(2, self.input_weight))

    @cached_property
    def step(self) -> tuple[Array, Array]:
        """F and G of ``x+ = F x + G r``, shapes (8, 8) and (8, 2)."""
        A, B = self.ball.linearize(self.ball.state())
        F, G = zero_order_hold(A[np.ix_(_PLANAR, _PLANAR)], B[_PLANAR, 2:], self.dt)
        G = G / self.dt
        F[:, 6:] -= G  # accelerations are (r - rates) / dt
        return F, G
