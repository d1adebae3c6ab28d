"""Controllers of a ball by forces and by a plate."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import (
    Array,
    CheckedFields,
    Integers,
    array,
    integer,
    positive,
    require,
)
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


# Tilting a table so that a ball is on a point soon, and stays there: linear programmes.

_REST = [2, 3, 5, 6, 7, 8]  # velocities, tilt and its rates among the coordinates of a plan
_N_SIDES = 12  # of the polygon around the tolerance
_SETTLE = 10  # periods after the time for which the ball is to stay, until it rests
_INSIDE = 0.9  # parts of the tolerance below which an error does not count
_CHANGE = 1e-3  # price of changed rates [s/rad]
_UNREST = 20.0  # price of what does not rest at the end
_AT_LIMIT = 0.9999  # part of the largest tilt that is used: what the motor would stop is not linear


class TiltPlan(NamedTuple):
    """Commanded rates of a table, and what comes of them.

    Attributes:
        rates: shape (T, 2) [rad/s].
        x: expected coordinates before each period and at the end, shape (T + 1, 9).
        error: largest distance from the point after the deadline, over the tolerance, and what
            does not rest at the end, priced.
    """

    rates: Array
    x: Array
    error: float


class AffineSteps(NamedTuple):
    """Steps x+ = F x + G r + c of the coordinates under commanded rates r.

    Attributes:
        F: shape (T, 9, 9).
        G: shape (T, 9, 2).
        c: shape (T, 9).
    """

    F: Array
    G: Array
    c: Array


@dataclass(frozen=True)
class TiltTransfer(CheckedFields):
    """Leads a ball to a point of a table by a deadline, and holds it there until it rests.

    Coordinates x = (X, Y, VX, VY, spin, tilt, tilt rates), of which every step is linearised. Over
    the commanded rates r_t this is a linear programme: the least largest distance from the point
    from the deadline on, with ``abs(r_t) <= tilt_rate``, the table able to stop within its limit,
    ``abs(alpha_t + dt r_t / 2) <= tilt_limit``, and rest at the end. A distance is the largest of
    its components in some directions. As the motion is nearly linear, the optimum changes little
    from one linearisation to the next, where rates that need not change do not: a change has a
    small price, and none is below 0.9 of the tolerance.

    Attributes:
        regulator: of the same table.
        tilt_limit: largest angle [rad].
        tolerance: largest distance from the point [m].
        hold: periods for which the ball is to stay.
        n_substeps: steps of the integrator in a period.
    """

    regulator: PlateRegulator
    tilt_limit: Annotated[float, positive, "rad"]
    tolerance: Annotated[float, positive, "m"]
    hold: Annotated[int, integer, 1]
    n_substeps: Annotated[int, integer, 1] = 1

    def periods(self, deadline: int) -> int:
        """Number of periods of a plan."""
        return deadline + self.hold + _SETTLE

    def level(self, n_steps: int) -> AffineSteps:
        """Steps near rest on the level table."""
        F, G = np.eye(9), np.zeros((9, 2))
        planar = [k - 4 for k in _PLANAR]
        F[np.ix_(planar, planar)], G[planar] = self.regulator.step
        F, G = np.broadcast_to(F, (n_steps, 9, 9)), np.broadcast_to(G, (n_steps, 9, 2))
        return AffineSteps(F, G, np.zeros((n_steps, 9)))

    def along(self, x: Array) -> AffineSteps:
        """Steps linearised along a motion, shape (T + 1, 9)."""
        rates, small = x[1:, 7:], 1e-6
        rows = np.concatenate([x[:-1], rates], axis=1)
        moved = rows + small * np.concatenate([np.zeros((1, 11)), np.eye(11)])[:, None]
        after = self.advance(moved[..., :9], moved[..., 9:])
        slopes = np.moveaxis((after[1:] - after[0]) / small, 0, -1)
        c = x[1:] - (slopes @ rows[..., None])[..., 0]
        return AffineSteps(slopes[..., :9], slopes[..., 9:], c)

    def advance(self, x: Array, rates: Array) -> Array:
        """Coordinates after a period in which the tilt rates come to be `rates`, shape (..., 9)."""
        ball, change = self.regulator.ball, (rates - x[..., 7:]) / self.regulator.dt
        y = np.concatenate([np.broadcast_to(ball.state()[:4], (*x.shape[:-1], 4)), x], axis=-1)
        u = np.concatenate([np.zeros_like(change), change], axis=-1)
        return ball.advance(y, u, self.regulator.dt, self.n_substeps)[..., 4:]

    def plan(
        self,
        start: Array,
        point: Array,
        deadline: int,
        steps: AffineSteps,
        near: Array,
        reach: float,
    ) -> TiltPlan | None:
        """Rates after which the ball is nearest to the point from a deadline on.

        Args:
            start: coordinates, shape (9,).
            point: shape (2,) [m].
            deadline: number of periods after which the ball is to be there.
            steps: linearised, as many at least as the plan has.
            near: rates that are changed, shape (n, 2) [rad/s].
            reach: how much each may change [rad/s].
        """
        T = self.periods(deadline)
        affine = self._affine(start, T, steps)
        offsets = affine[deadline:, :2].copy()
        offsets[..., -1] -= point
        angles = 2.0 * np.pi * np.arange(_N_SIDES) / _N_SIDES
        sides = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        far = (sides @ offsets).reshape(-1, 2 * T + 1)
        stops = affine[1:, 5:7].copy()
        stops[np.arange(T), :, :-1] += 0.5 * self.regulator.dt * np.eye(2 * T).reshape(T, 2, -1)
        stops = stops.reshape(-1, 2 * T + 1)
        found = self._solve(far, stops, affine[-1, _REST], near[:T].ravel(), reach)
        if found is None:
            return None
        rates, error = found
        return TiltPlan(rates.reshape(T, 2), affine @ np.append(rates, 1.0), error)

    @staticmethod
    def _affine(start: Array, n_steps: int, steps: AffineSteps) -> Array:
        """Coordinates as affine functions of all rates, shape (T + 1, 9, 2 T + 1)."""
        x = np.zeros((n_steps + 1, 9, 2 * n_steps + 1))
        x[0, :, -1] = start
        for t in range(n_steps):
            x[t + 1] = steps.F[t] @ x[t]
            x[t + 1, :, 2 * t : 2 * t + 2] += steps.G[t]
            x[t + 1, :, -1] += steps.c[t]
        return x

    def _solve(
        self, far: Array, stops: Array, rest: Array, near: Array, reach: float
    ) -> tuple[Array, float] | None:
        """Rates, and the largest error; arguments are affine in the rates, in the last column 1.

        Variables: what is added to rates and taken off, what rest lacks either way, the error.
        """
        from scipy.optimize import linprog  # slow to import

        n, limit, rate = len(near), _AT_LIMIT * self.tilt_limit, self.regulator.tilt_rate
        below = np.concatenate([far, stops, -stops])
        bounds = np.concatenate([np.zeros(len(far)), np.full(2 * len(stops), limit)])
        loads = np.zeros((len(below), 1))
        loads[: len(far)] = -self.tolerance
        none, unit = np.zeros((len(below), 12)), np.eye(6)
        upper = np.hstack([below[:, :-1], -below[:, :-1], none, loads])
        equal = np.hstack([rest[:, :-1], -rest[:, :-1], unit, -unit, np.zeros((6, 1))])
        price = np.concatenate([np.full(2 * n, _CHANGE), np.full(12, _UNREST), [1.0]])
        low, high = np.zeros(2 * n + 13), np.full(2 * n + 13, np.inf)
        high[: 2 * n] = np.minimum(reach, np.concatenate([rate - near, rate + near]))
        low[-1] = _INSIDE
        found = linprog(
            price,
            upper,
            bounds - below @ np.append(near, 1.0),
            equal,
            -rest @ np.append(near, 1.0),
            np.stack([low, high], axis=1),
        )
        if found.status != 0:
            return None
        x = found.x
        return near + x[:n] - x[n : 2 * n], float(x[-1] + _UNREST * x[2 * n : -1].sum())


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
