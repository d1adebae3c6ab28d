"""Rolling a ball along a polygon: as it is told, or pushed, from rest to rest along each side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import array, positive, positive_array, require
from rigid_envs.control.plans import piecewise_constant
from rigid_envs.control.saturation import clip_to_ball
from rigid_envs.systems import DynamicBall

__all__ = ["PushAlong", "PushPlan", "RollPlan", "roll_along"]

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


@dataclass(frozen=True)
class RollPlan:
    """A plan of balls along straight rolls.

    Attributes:
        actions: velocities as parts of the largest, in a disk; zero after a row has arrived, and at
            last for all rows; shape (T, ..., 2).
        length: of the path [m], shape (...).
        steps: number of steps until a row has arrived, shape (...).
    """

    actions: Array
    length: Array
    steps: Integers


def roll_along(rolls: npt.ArrayLike, reach: npt.ArrayLike) -> RollPlan:
    """Roll straight rolls one after the other, each in equal steps, as few as can be.

    A straight roll turns the ball about one axis, so its steps make up the whole exactly: the plan
    leads where the polygon leads.

    Args:
        rolls: displacements of the centre in turn, shape (..., K, 2) [m].
        reach: largest displacement in one step, shape (...) [m].

    Raises:
        ValueError: bad shapes or numbers.
    """
    sides, step = array(rolls, "rolls", 2, entries="X, Y"), positive_array(reach, "reach", "m")
    lengths = np.linalg.norm(sides, axis=-1)
    counts = np.ceil(lengths / step[..., None] - 1e-9).astype(np.int64)
    each = sides / (np.maximum(counts, 1) * step[..., None])[..., None]
    return RollPlan(
        piecewise_constant(each, counts), np.sum(lengths, axis=-1), np.sum(counts, axis=-1)
    )


@dataclass(frozen=True)
class PushPlan:
    """A motion of balls that are pushed along straight rolls, and the pushes that make it.

    Attributes:
        pushes: accelerations in each period; zero after a row has arrived, and at last for all
            rows; shape (T, ..., 2) [m/s^2].
        positions: at the start and after each period, shape (T + 1, ..., 2) [m].
        velocities: the same, shape (T + 1, ..., 2) [m/s].
        length: of the path [m], shape (...).
        steps: number of periods until a row has arrived, shape (...).
    """

    pushes: Array
    positions: Array
    velocities: Array
    length: Array
    steps: Integers


@dataclass(frozen=True)
class PushAlong:
    """Pushes a ball along straight rolls, from rest to rest along each, and keeps it to that.

    On a level plate ``m (1 + beta) v' = F``. A roll of length L takes 2 n periods dt, half of them
    at the acceleration L / (n dt)^2 and half at its opposite, n the least for which `share` of the
    force is enough: the fastest there is, but for whole periods. With the force held over each
    period the planned motion (A, X, V) is exact. What the rest of the force is for:

        F = m (1 + beta) (A + g1 (X - x) + g2 (V - v)),
        g1 = (1 - z)^2 / dt^2,   g2 = (1 - z) (3 + z) / (2 dt),   z = exp(-rate dt).

    Certificate: sampled at the periods, the error (x - X, v - V) is multiplied by `closed_loop`,
    both of whose eigenvalues are z, so it dies out like that of a critically damped oscillator at
    `rate`, for every dt. Region: any error for which the force suffices; beyond, it is cut to the
    largest. The attitude is not fed back: it is off by what the loop between the planned and the
    rolled path encloses.

    Attributes:
        ball: on a plate that does not turn.
        force: largest force [N].
        dt: control period [s].
        share: part of the force that plans use.
        rate: at which errors die out [1/s].

    Raises:
        ValueError: numbers that are not positive, a share above 1, a turntable.

    Source: Åström & Wittenmark, *Computer-Controlled Systems*, section 4.3 (pole placement).
    """

    ball: DynamicBall
    force: float
    dt: float
    share: float = 0.98
    rate: float = 2.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        positive(self.force, "force", "N")
        positive(self.dt, "dt", "s")
        positive(self.share, "share", "1")
        positive(self.rate, "rate", "1/s")
        require(self.share <= 1.0, self.share, "share", "a part of the force, at most 1")
        table = self.ball.turntable_rate
        expected = "0: on a turntable a ball is not turned by its path alone"
        require(table == 0.0, table, "ball.turntable_rate", expected)

    def plan(self, y: npt.ArrayLike, rolls: npt.ArrayLike) -> PushPlan:
        """The fastest motion along straight rolls.

        Args:
            y: states of `DynamicBall` at the start, at rest, shape (..., 13).
            rolls: displacements of the centre in turn, shape (..., K, 2) [m].

        Raises:
            ValueError: bad shapes or numbers, or a ball that is not at rest.
        """
        start, sides = self.ball.checked_state(y), array(rolls, "rolls", 2, entries="X, Y")
        resting = np.all(start[..., 6:9] == 0.0, axis=-1)
        require(resting, start, "y", "a ball at rest, at the start of a plan")
        lengths = np.linalg.norm(sides, axis=-1)
        halves = np.ceil(np.sqrt(lengths / (self.share * self._largest)) / self.dt)
        each = sides / (np.maximum(halves, 1.0) * self.dt)[..., None] ** 2
        there_and_back = np.stack([each, -each], axis=-2)
        counts = np.repeat(halves.astype(np.int64), 2, axis=-1)
        pushes = piecewise_constant(there_and_back.reshape(*counts.shape, 2), counts)
        rest = np.zeros((1, *pushes.shape[1:]))
        velocities = np.concatenate([rest, np.cumsum(self.dt * pushes, axis=0)])
        moved = np.cumsum(0.5 * self.dt * (velocities[1:] + velocities[:-1]), axis=0)
        positions = start[..., 4:6] + np.concatenate([rest, moved])
        steps = np.sum(counts, axis=-1)
        return PushPlan(pushes, positions, velocities, np.sum(lengths, axis=-1), steps)

    def __call__(self, y: npt.ArrayLike, push: Array, position: Array, velocity: Array) -> Array:
        """Forces that track a plan, over the largest, in the unit disk.

        Args:
            y: states of `DynamicBall`, shape (..., 13).
            push: planned acceleration of this period, shape (..., 2) [m/s^2].
            position: planned position at its beginning, shape (..., 2) [m].
            velocity: planned velocity at its beginning, shape (..., 2) [m/s].

        Returns:
            Actions, shape (..., 2).

        Raises:
            ValueError: bad states.
        """
        rows = self.ball.checked_state(y)
        g1, g2 = self._gains
        error = g1 * (position - rows[..., 4:6]) + g2 * (velocity - rows[..., 6:8])
        return clip_to_ball((push + error) / self._largest)

    @property
    def closed_loop(self) -> Array:
        """Closed-loop matrix of the (position, velocity) error in a period, shape (2, 2)."""
        (g1, g2), dt = self._gains, self.dt
        free = np.array([[1.0, dt], [0.0, 1.0]])
        return np.asarray(free - np.outer([0.5 * dt * dt, dt], [g1, g2]))

    @property
    def _gains(self) -> tuple[float, float]:
        z = float(np.exp(-self.rate * self.dt))
        return (1.0 - z) ** 2 / self.dt**2, (1.0 - z) * (3.0 + z) / (2.0 * self.dt)

    @property
    def _largest(self) -> float:
        """Largest acceleration [m/s^2]."""
        return float(self.force / (self.ball.m * (1.0 + self.ball.beta)))
