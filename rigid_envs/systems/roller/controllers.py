"""Pumping a roller out of a valley by its inertia ratio: bang-bang control, and least times."""

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import (
    Array,
    Bools,
    CheckedFields,
    Integers,
    Singles,
    array,
    integer,
    non_negative,
    positive,
    require,
)
from rigid_envs.control.planning.planar import PlanarMotion, gauge, regions
from rigid_envs.systems.roller.system import Roller


@dataclass(frozen=True)
class Pump(CheckedFields):
    """Bang-bang control of the inertia ratio: large while descending, small while ascending.

    The angle a = curvature s from the bottom and the momentum P = (1 + beta) v about the contact,
    which a sudden change of beta leaves alone, follow

        a' = curvature P / (1 + beta),   P' = -g sin(a),
        d(P^2 / 2)/da = -(1 + beta) (g / curvature) sin(a).

    So from rest at the height h down to the bottom P^2 / 2 grows to (1 + beta) g h if the ratio is
    held, and is used up from there to rest at the height h' likewise; the descent gives the more,
    and the ascent takes the less, the larger and the smaller the ratio is all along. Whatever
    is done, then, a pass through the bottom raises the turning point by no more than

        ``h' / h = (1 + beta + beta_change) / (1 + beta)``,

    and by just that under this controller: no other climbs out in fewer passes. The ratio is made
    small at the bottom, where that costs work and gives energy, and large at the turning point,
    where it costs nothing.

    An action is held for a period, so the controller looks at the middle of it; of the gain of a
    pass it loses the order of g curvature dt^2. Region: any state in the valley but rest at the
    bottom.

    Attributes:
        roller: in a valley (positive curvature).
        beta_change: what can be added to the inertia ratio.
        dt: control period [s].

    Raises:
        ValueError: a path that is no valley; numbers that are not positive.

    Source: Tea & Falk 1968, "Pumping on a swing", American Journal of Physics 36:1165.
    """

    roller: Roller
    beta_change: Annotated[float, positive, "1"]
    dt: Annotated[float, non_negative, "s"]

    def __post_init__(self) -> None:
        """Check the numbers."""
        super().__post_init__()
        positive(self.roller.curvature, "roller.curvature", "1/m")

    def __call__(self, y: npt.ArrayLike, change: npt.ArrayLike) -> Array:
        """The ratio to take: -1 for beta, 1 for beta + beta_change.

        Args:
            y: states (s, v) of `Roller`, shape (..., 2).
            change: what is added to the ratio at present, shape (...).

        Returns:
            Actions, shape (..., 1).

        Raises:
            ValueError: bad states, or a ratio made smaller than beta.
        """
        rows, added = self.roller.checked_state(y), array(change, "change")
        held = np.stack([0.0 * added, added], axis=-1)
        middle = rows + 0.5 * self.dt * self.roller.rhs(rows, held)
        angle = -self.roller.descent(middle)
        return np.where(angle * middle[..., 1] < 0.0, 1.0, -1.0)[..., None]

    @property
    def gain(self) -> float:
        """Largest ratio of the heights of successive turning points."""
        return 1.0 + self.beta_change / (1.0 + self.roller.beta)

    def height(self, y: npt.ArrayLike, change: npt.ArrayLike) -> Array:
        """Height above the bottom that equals the energy [m], shape (...).

        ``(1 - cos(a)) / curvature + (1 + beta + change) v^2 / (2 g)``: constant while the ratio
        stays, and at a turning point the height of that.
        """
        rows, ratio = self.roller.checked_state(y), self.roller.beta + array(change, "change")
        rise = 2.0 * np.sin(0.5 * self.roller.descent(rows)) ** 2 / self.roller.curvature
        return np.asarray(rise + 0.5 * (1.0 + ratio) * rows[..., 1] ** 2 / self.roller.g)

    def least_passes(self, y: npt.ArrayLike, rim: float) -> npt.NDArray[np.int64]:
        """Lower bound on the passes through the bottom before the rim, shape (...).

        The least n with ``h gain^n >= h_rim``, h the height of y.

        Args:
            y: states at rest, shape (..., 2).
            rim: angle of the rim from the bottom [rad].

        Raises:
            ValueError: bad states, or a start that is not at rest or at the bottom.
        """
        rows = self.roller.checked_state(y)
        start = self.height(rows, 0.0)
        resting = (rows[..., 1] == 0.0) & (start != 0.0)
        require(resting, rows, "y", "rest, and not at the bottom")
        top = 2.0 * math.sin(0.5 * positive(rim, "rim", "rad")) ** 2 / self.roller.curvature
        passes = np.ceil(np.log(top / start) / math.log(self.gain))
        return np.maximum(passes, 0.0).astype(np.int64)


# Least time to the rim.

_SIZE = 0.01  # length of chords, over the distance of the rim
_SLACK = 1.1  # for terms of higher order in the period


@dataclass(frozen=True)
class LeastTime(CheckedFields):
    """Least number of periods in which a roller can be pumped over the rim of a valley.

    The plane is that of ``(s, p)`` with ``p = P + dt / 2 g sin(curvature s)``: the momentum P about
    the contact, half a kick of the period before it ended. There the ratio of a period moves the
    roller along s, and changes p by less than

        ``dt^3 / 12 du (g curvature abs(V1 cos(a)) + 2 u P^2 curvature^2 abs(V1)) + O(dt^4)``

    with V1 = g sin(a), the angle a = curvature s, and the inverse inertia u, of range du: it is the
    error of the trapezoidal rule for the integral of the kick that a change of u makes. For
    `rigid_envs.control.planning.planar.regions` this is the margin.

    Attributes:
        pump: roller, largest addition to its ratio and period; the bottom is at s = 0.
        rim: angle of the rim from the bottom [rad].
        n_substeps: steps of the integrator in a period.

    Raises:
        ValueError: numbers that are not positive, a valley whose bottom is elsewhere.
    """

    pump: Pump
    rim: Annotated[float, positive, "rad"]
    n_substeps: Annotated[int, integer, 1] = 1

    def __post_init__(self) -> None:
        """Check the numbers."""
        super().__post_init__()
        slope = self.pump.roller.slope
        require(slope == 0.0, slope, "pump.roller.slope", "0: the bottom is at s = 0")

    @property
    def _inverse(self) -> tuple[float, float]:
        """Least and largest inverse inertia."""
        low = 1.0 + self.pump.roller.beta
        return 1.0 / (low + self.pump.beta_change), 1.0 / low

    def point(self, s: Array, momentum: Array) -> Array:
        """Points of the plane, shape (..., 2).

        Args:
            s: arc lengths, shape (...).
            momentum: (1 + beta) v, of the ratio at that time, shape (...).
        """
        return np.stack([s, momentum + self._kick(s)], axis=-1)

    def _kick(self, s: Array) -> Array:
        roller = self.pump.roller
        return np.asarray(0.5 * self.pump.dt * roller.g * np.sin(roller.curvature * s))

    def moved(self, x: Array, inputs: Array, dt: float) -> Array:
        """Points after a time dt, a period or minus one, shape (m, n, 2).

        Args:
            x: points, shape (n, 2).
            inputs: inverse inertia from 0, the least, to 1, the largest, shape (m,).
            dt: time [s].
        """
        least, largest = self._inverse
        inertia = 1.0 / (least + (largest - least) * inputs)[:, None]
        s, momentum = x[:, 0] + 0.0 * inertia, x[:, 1] - self._kick(x[:, 0])
        held = np.stack([0.0 * s, inertia - 1.0 - self.pump.roller.beta + 0.0 * s], axis=-1)
        y = np.stack([s, momentum / inertia], axis=-1)
        y = self.pump.roller.advance(y, held, dt, self.n_substeps)
        return self.point(y[..., 0], inertia * y[..., 1])

    def margin(self, x: Array) -> Array:
        """Half sides of boxes about points (n, 2), shape (n, 2): see `PlanarMotion`."""
        roller, dt, (least, largest) = self.pump.roller, self.pump.dt, self._inverse
        momentum = np.abs(x[:, 1]) + 0.5 * dt * roller.g
        way = dt * largest * momentum
        angle = np.minimum(roller.curvature * (np.abs(x[:, 0]) + way), 0.5 * np.pi)
        flat = np.where(
            angle < 0.5 * np.pi, roller.curvature * np.maximum(np.abs(x[:, 0]) - way, 0.0), 0.0
        )
        stiffness = roller.g * roller.curvature
        growth = stiffness * roller.g * np.sin(angle) * np.cos(flat)
        growth += 2.0 * largest * roller.curvature * stiffness * np.sin(angle) * momentum**2
        growth += largest * stiffness**2 * dt * momentum
        chord = _SLACK * dt * roller.curvature * stiffness * self.size**2 / 8.0
        high = chord + _SLACK * (largest - least) * dt**3 / 12.0 * growth
        return np.stack([np.full_like(high, dt * largest * chord), high], axis=-1)

    @property
    def size(self) -> float:
        """Length of chords [m]."""
        return _SIZE * self.rim / self.pump.roller.curvature

    def regions(self) -> Iterator[Array]:
        """Polygons from inside which the rim cannot be reached within 0, 1, 2, ... periods."""
        roller, dt, (least, largest) = self.pump.roller, self.pump.dt, self._inverse
        s = (1.0 - 1e-12) * self.rim / roller.curvature
        top = 2.0 * np.sin(0.5 * self.rim) ** 2 / roller.curvature
        p = 1.05 * (math.sqrt(2.0 * roller.g * top / least) + 0.5 * dt * roller.g)
        weights = (1.0, dt * largest)
        wall = np.array([[-s, -p], [s, -p], [s, p], [-s, p]])
        motion = PlanarMotion(
            lambda x, inputs: self.moved(x, inputs, -dt), self.margin, weights, self.size
        )
        return regions(wall, motion)

    def periods(self, s: Array, most: int) -> Integers:
        """Lower bound on the periods to the rim from rest, shape (n,).

        Args:
            s: arc lengths, shape (n,).
            most: number of periods at which the search ends.
        """
        x = self.point(s, np.zeros_like(s))
        least = np.zeros(len(s), dtype=np.int64)
        for k, region in enumerate(_kept(self, float(np.abs(s).min()), most)):
            least[gauge(region, x) < 1.0] = k + 1
        return least

    def actions(self, s: Array, most: int) -> Singles:
        """Plans from rest over the rim, shape (T, n, 1); zeros after it, or where none is found.

        With k periods left that ratio is taken with which the roller is further outside the
        region that needs more than k. That it is outside, rounding and the margins may prevent:
        a plan that fails is begun with a period more.

        Args:
            s: arc lengths, shape (n,).
            most: number of periods of the longest plan.
        """
        kept, least = _kept(self, float(np.abs(s).min()), most), self.periods(s, most)
        actions = np.zeros((most, len(s)), dtype=np.float32)
        rows = np.arange(len(s))
        for late in range(most):
            given = np.minimum(least[rows] + late, most)
            plans, over = self._pumped(s[rows], given, kept)
            actions[: len(plans), rows[over]] = plans[:, over]
            rows = rows[~over]
            if not len(rows):
                break
        return actions[: int(np.nonzero(actions.any(axis=1))[0].max(initial=0)) + 1, :, None]

    def _pumped(self, s: Array, given: Integers, kept: list[Array]) -> tuple[Singles, Bools]:
        """Plans of the given numbers of periods, shape (T, n), and whether they reach the rim."""
        x, over = self.point(s, np.zeros_like(s)), np.zeros(len(s), dtype=bool)
        actions = np.zeros((int(given.max()), len(s)), dtype=np.float32)
        for t, taken in enumerate(actions):
            after = self.moved(x, np.array([0.0, 1.0]), self.pump.dt)
            left = np.minimum(given - t - 1, len(kept) - 1)
            outside = np.zeros(after.shape[:2])
            for k in np.unique(left[(left >= 0) & ~over]):
                outside[:, left == k] = gauge(kept[k], after[:, left == k])
            small = outside[1] > outside[0]
            going = ~over & (left >= 0)
            taken[going] = np.where(small, -1.0, 1.0)[going]
            x = np.where(small[:, None], after[1], after[0])
            over |= going & (self.pump.roller.curvature * np.abs(x[:, 0]) >= self.rim)
        return actions, over


def _kept(least_time: LeastTime, nearest: float, most: int) -> list[Array]:
    """Regions as long as rest at an arc length is in them."""
    start = least_time.point(np.array([nearest]), np.zeros(1))
    known, more = _regions(least_time)
    for k in range(most):
        if k == len(known):
            known.append(next(more))
        if gauge(known[k], start)[0] >= 1.0:
            return known[:k]
    return known[:most]


@functools.lru_cache(maxsize=8)
def _regions(least_time: LeastTime) -> tuple[list[Array], Iterator[Array]]:
    """Regions that are computed, whatever they were needed for, and those that come after them."""
    return [], least_time.regions()
