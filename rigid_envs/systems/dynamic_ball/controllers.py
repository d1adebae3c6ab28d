"""Controllers of a ball by forces and by a plate."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, CheckedFields, Integers, array, positive, require
from rigid_envs.control import linear
from rigid_envs.control.predictive import Symbols, size
from rigid_envs.mechanics.symbolic import casadi
from rigid_envs.systems.dynamic_ball.system import DynamicBall

# Holding a ball on a point of a table that is tilted: the linear-quadratic regulator.

_PLANAR = [4, 5, 6, 7, 9, 10, 11, 12]  # X, Y, VX, VY, alpha_x, alpha_y and their rates
_SMALL = 1e-3  # weight of what is not the offset: m^2 per (m/s)^2, rad^2 and (rad/s)^2


@dataclass(frozen=True)
class PlateRegulator(CheckedFields):
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
    tilt_rate: Annotated[float, positive, "rad/s"]
    dt: Annotated[float, positive, "s"]
    input_weight: Annotated[float, positive, "m^2 s^2"] = 1.0
    farthest: Annotated[float, positive, "m"] = 1.0

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
        return linear.clip_to_box(self.regulator.feedback(error) / self.tilt_rate)

    def inputs(self, y: npt.ArrayLike, action: npt.ArrayLike) -> Array:
        """Input u of `DynamicBall`, shape (..., 4), that brings the rates to the commanded ones."""
        rates = self.ball.checked_state(y)[..., 11:13]
        change = (self.tilt_rate * np.asarray(action, dtype=np.float64) - rates) / self.dt
        return np.concatenate([np.zeros_like(change), change], axis=-1)

    def error(self, y: npt.ArrayLike, point: npt.ArrayLike) -> Array:
        """(offset, velocity, tilt, tilt rates) of states, shape (..., 8) [m, m/s, rad, rad/s]."""
        rows = self.ball.checked_state(y)[..., _PLANAR]
        goal = array(point, "point", 2, entries="X, Y")
        return np.concatenate([rows[..., :2] - goal, rows[..., 2:] + 0.0 * goal[..., :1]], axis=-1)

    def value(self, y: npt.ArrayLike, point: npt.ArrayLike) -> Array:
        """Cost to go x P x of states near the point, shape (...)."""
        return self.regulator.value(self.error(y, point))

    @cached_property
    def regulator(self) -> linear.Regulator:
        """K and P."""
        weights = np.array([1.0, 1.0] + [_SMALL] * 6)
        return linear.lqr(*self.step, weights, np.full(2, self.input_weight))

    @cached_property
    def step(self) -> tuple[Array, Array]:
        """F and G of ``x+ = F x + G r``, shapes (8, 8) and (8, 2)."""
        A, B = self.ball.linearize(self.ball.state())
        F, G = linear.zero_order_hold(A[np.ix_(_PLANAR, _PLANAR)], B[_PLANAR, 2:], self.dt)
        G = G / self.dt
        F[:, 6:] -= G  # accelerations are (r - rates) / dt
        return F, G


# Rolling a ball along a polygon: as it is told, or pushed, from rest to rest along each side.


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
class PushAlong(CheckedFields):
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
    force: Annotated[float, positive, "N"]
    dt: Annotated[float, positive, "s"]
    share: Annotated[float, positive, "1"] = 0.98
    rate: Annotated[float, positive, "1/s"] = 2.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        super().__post_init__()
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
        still = np.all(self.ball.velocity(start) == 0.0, axis=-1)
        resting = still & (self.ball.spin(start) == 0.0)
        require(resting, start, "y", "a ball at rest, at the start of a plan")
        lengths = np.linalg.norm(sides, axis=-1)
        halves = np.ceil(np.sqrt(lengths / (self.share * self._largest)) / self.dt)
        each = sides / (np.maximum(halves, 1.0) * self.dt)[..., None] ** 2
        there_and_back = np.stack([each, -each], axis=-2)
        counts = np.repeat(halves.astype(np.int64), 2, axis=-1)
        pushes = linear.piecewise_constant(there_and_back.reshape(*counts.shape, 2), counts)
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
        return linear.clip_to_ball((push + error) / self._largest)

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


# Problems for predictive control: a spin about the middle axis, a top on its pivot, a ball.


@dataclass(frozen=True)
class HeldBall(CheckedFields):
    """Holding a ball on a point of a table, by the rates of the two angles of the table.

    Coordinates x: the state without the attitude of the ball. The goal is the point (X, Y). The
    rates change linearly to the commanded ones over an interval, and the angles stay such that the
    table can stop within its limit. Cost: ``distance + 0.01 |rates|^2`` [m, rad/s]. The distance
    itself and not its square: the ball is to be there soon.

    Attributes:
        ball: ball on a plate, a turntable or not.
        tilt_rate: largest rate of each angle [rad/s].
        tilt_limit: largest angle [rad].
        dt: control period [s].

    Raises:
        ValueError: numbers that are not positive.
    """

    ball: DynamicBall
    tilt_rate: Annotated[float, positive, "rad/s"]
    tilt_limit: Annotated[float, positive, "rad"]
    dt: Annotated[float, positive, "s"]

    sizes: ClassVar[tuple[int, int, int]] = (9, 2, 2)

    def coordinates(self, y: npt.ArrayLike) -> Array:
        """Of states y."""
        return self.ball.checked_state(y)[..., 4:]

    def step(self, x: Symbols, a: Symbols, h: float) -> Symbols:
        """Coordinates after a time h [s]; they do not depend on the attitude."""
        ca = casadi()
        y, change = ca.vertcat(ca.DM(4, 1), x), (self.tilt_rate * a - x[7:]) / h
        return self.ball.symbolic().step(h)(y, ca.vertcat(0.0, 0.0, change))[4:]

    def cost(self, x: Symbols, a: Symbols, goal: Symbols) -> Symbols:
        """Distance from the point, and rates of the table."""
        return size(x[:2] - goal, 0.05) + 0.01 * casadi().sumsqr(x[7:])

    def limits(self, x: Symbols, a: Symbols) -> Symbols:
        """Angles at which the table stops in the next period."""
        stops = x[5:7] + 0.5 * self.dt * x[7:]
        return casadi().vertcat(stops - self.tilt_limit, -stops - self.tilt_limit)
