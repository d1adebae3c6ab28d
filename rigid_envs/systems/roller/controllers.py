"""Pumping a roller out of a valley by its inertia ratio: bang-bang control, and its bound."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, CheckedFields, array, non_negative, positive, require
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
