"""Problems for predictive control: a spin about the middle axis, a top on its pivot, a ball."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import positive, require
from rigid_envs.control.spin import SpinLaw
from rigid_envs.symbolic import SymbolicModel, casadi
from rigid_envs.systems import DynamicBall, HeavyTop

__all__ = ["BalancedTop", "HeldBall", "HeldSpin"]

Array = npt.NDArray[np.float64]
Symbols = Any  # casadi.SX, a column


def size(a: Symbols, rounding: float = 0.01) -> Symbols:
    """Length of a vector, rounded off at 0 so that it has derivatives there."""
    ca = casadi()
    return ca.sqrt(ca.sumsqr(a) + rounding**2)


@dataclass(frozen=True)
class HeldSpin(SpinLaw):
    """Holding a spin about the intermediate axis at the least torque impulse.

    Coordinates x: omega in body axes. Cost: ``|tau| + weight |omega - Omega e2|^2``.

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega of the spin about e2 [rad/s].
        torque: largest torque about each axis [N m].
        weight: of the deviation [N m / (rad/s)^2].

    Raises:
        ValueError: moments in another order, or numbers that are not positive.
    """

    weight: float = 1.0

    sizes: ClassVar[tuple[int, int, int]] = (3, 3, 0)

    def __post_init__(self) -> None:
        """Check the weight too."""
        super().__post_init__()
        positive(self.weight, "weight", "N m / (rad/s)^2")

    def coordinates(self, y: npt.ArrayLike) -> Array:
        """Angular velocity of states y."""
        return self.omega(y)

    def step(self, x: Symbols, a: Symbols, h: float) -> Symbols:
        """Angular velocity after a time h [s]; it does not depend on the attitude."""
        y = casadi().vertcat(1.0, 0.0, 0.0, 0.0, x)
        return self._model.step(h)(y, self.torque * a)[4:]

    def cost(self, x: Symbols, a: Symbols, goal: Symbols) -> Symbols:
        """Torque and deviation."""
        off = x - casadi().DM([0.0, self.rate, 0.0])
        return self.torque * size(a) + self.weight * casadi().sumsqr(off)

    def limits(self, x: Symbols, a: Symbols) -> Symbols:
        """None but those of the actions."""
        return casadi().SX(0, 1)

    @cached_property
    def _model(self) -> SymbolicModel:
        return self.body.symbolic()


@dataclass(frozen=True)
class BalancedTop:
    """Keeping a symmetric top upright by acceleration of its pivot, at the least of it.

    A symmetric top has no phase: of all states that turns about e3 lead to one another, the plan
    knows the one with z = 0 in its quaternion. Coordinates x = (x, y; omega; X, Y, VX, VY) of it.
    With the tilt theta the cost is ``push |a| + weight (2 - 2 cos(theta) + omega1^2 + omega2^2 +
    0.05 |X|^2 + 0.2 |V|^2)``.

    Attributes:
        top: symmetric top, I1 = I2.
        push: largest acceleration of the pivot [m/s^2].
        weight: of the deviation [m/s^2].

    Raises:
        ValueError: a top that is not symmetric, or numbers that are not positive.
    """

    top: HeavyTop
    push: float
    weight: float = 3.0

    sizes: ClassVar[tuple[int, int, int]] = (9, 2, 0)

    def __post_init__(self) -> None:
        """Check the symmetry of the top and the numbers."""
        require(self.top.I1 == self.top.I2, self.top, "top", "a symmetric top, I1 = I2")
        positive(self.push, "push", "m/s^2")
        positive(self.weight, "weight", "m/s^2")

    def coordinates(self, y: npt.ArrayLike) -> Array:
        """Of states y."""
        rows = np.moveaxis(self.top.checked_state(y), -1, 0)
        return np.stack(np.broadcast_arrays(*_without_phase(rows)), axis=-1)

    def step(self, x: Symbols, a: Symbols, h: float) -> Symbols:
        """Coordinates after a time h [s]."""
        ca = casadi()
        y = ca.vertcat(ca.sqrt(1.0 - x[0] ** 2 - x[1] ** 2), x[:2], 0.0, x[2:])
        u = ca.vertcat(ca.DM.zeros(6), self.push * a)
        return ca.vertcat(*_without_phase(ca.vertsplit(self._model.step(h)(y, u))))

    def cost(self, x: Symbols, a: Symbols, goal: Symbols) -> Symbols:
        """Acceleration and deviation; 2 - 2 cos(theta) is 4 (x^2 + y^2)."""
        squares = casadi().DM([4.0, 4.0, 1.0, 1.0, 0.0, 0.05, 0.05, 0.2, 0.2])
        return self.push * size(a) + self.weight * casadi().dot(squares, x**2)

    def limits(self, x: Symbols, a: Symbols) -> Symbols:
        """Actions are in the disk."""
        return casadi().sumsqr(a) - 1.0

    @cached_property
    def _model(self) -> SymbolicModel:
        return self.top.symbolic()


def _without_phase(y: Any) -> tuple[Any, ...]:
    """Entries x, y, omega and pivot after the turn about e3 that takes z of the quaternion to 0."""
    w, x, y_, z, w1, w2, w3, *pivot = y
    square = w * w + z * z
    c, s = (w * w - z * z) / square, 2.0 * w * z / square
    root = square**0.5
    tilt = (x * w - y_ * z) / root, (y_ * w + x * z) / root
    return (*tilt, c * w1 - s * w2, s * w1 + c * w2, w3, *pivot)


@dataclass(frozen=True)
class HeldBall:
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
    tilt_rate: float
    tilt_limit: float
    dt: float

    sizes: ClassVar[tuple[int, int, int]] = (9, 2, 2)

    def __post_init__(self) -> None:
        """Check the numbers."""
        positive(self.tilt_rate, "tilt_rate", "rad/s")
        positive(self.tilt_limit, "tilt_limit", "rad")
        positive(self.dt, "dt", "s")

    def coordinates(self, y: npt.ArrayLike) -> Array:
        """Of states y."""
        return self.ball.checked_state(y)[..., 4:]

    def step(self, x: Symbols, a: Symbols, h: float) -> Symbols:
        """Coordinates after a time h [s]; they do not depend on the attitude."""
        ca = casadi()
        y, change = ca.vertcat(1.0, 0.0, 0.0, 0.0, x), (self.tilt_rate * a - x[7:]) / h
        return self._model.step(h)(y, ca.vertcat(0.0, 0.0, change))[4:]

    def cost(self, x: Symbols, a: Symbols, goal: Symbols) -> Symbols:
        """Distance from the point, and rates of the table."""
        return size(x[:2] - goal, 0.05) + 0.01 * casadi().sumsqr(x[7:])

    def limits(self, x: Symbols, a: Symbols) -> Symbols:
        """Angles at which the table stops in the next period."""
        stops = x[5:7] + 0.5 * self.dt * x[7:]
        return casadi().vertcat(stops - self.tilt_limit, -stops - self.tilt_limit)

    @cached_property
    def _model(self) -> SymbolicModel:
        return self.ball.symbolic()
