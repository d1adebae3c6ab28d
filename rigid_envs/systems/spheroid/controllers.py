"""Controllers of a tippe top."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, CheckedFields, non_negative, positive, require
from rigid_envs.mechanics.equations import gamma
from rigid_envs.systems.spheroid.system import Spheroid


@dataclass(frozen=True)
class TippeTopSpin(CheckedFields):
    """Turns a tippe top over by torque about its axis, which changes Jellett's integral.

    ``J' = (r cos(theta) - a) tau``. Friction turns the top over if J is large enough, and the
    torque only has to bring J there: to `rise` while r cos(theta) - a is above `least_arm`, to
    `stand` while it is below -`least_arm`. Between the two, torque would do little.

    Attributes:
        top: a sphere with its centre of mass off its centre.
        limit: largest torque [N m].
        dt: control period [s].
        rise: J that the top gets at the beginning [N m^2 s].
        stand: J that it gets when it has turned over [N m^2 s].
        least_arm: least lever of the torque [m].

    Raises:
        ValueError: no sphere, numbers that are not positive.
    """

    top: Spheroid
    limit: Annotated[float, positive, "N m"]
    dt: Annotated[float, positive, "s"]
    rise: Annotated[float, positive, "N m^2 s"]
    stand: Annotated[float, positive, "N m^2 s"]
    least_arm: Annotated[float, non_negative, "m"] = 0.0

    def __post_init__(self) -> None:
        """Check the numbers, and that the top is a sphere."""
        super().__post_init__()
        require(self.top.radius == self.top.half_height, self.top, "top", "a sphere")

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, torque over the largest, shape (..., 1), of states y (..., 11)."""
        rows = Spheroid.checked_state(y)
        J = self.top.invariants(rows)["jellett"]
        arm = self.top.radius * gamma(rows)[..., 2] - self.top.offset
        needed = np.where(arm > 0.0, self.rise, self.stand)
        missing = np.where(np.abs(arm) > self.least_arm, np.maximum(needed - np.abs(J), 0.0), 0.0)
        sense = np.where(J < 0.0, -1.0, 1.0)
        reach = np.where(arm == 0.0, 1.0, arm) * self.dt * self.limit
        return np.clip(sense * missing / reach, -1.0, 1.0)[..., None]

    def inputs(self, action: npt.ArrayLike) -> Array:
        """Input u of `Spheroid`, shape (..., 5), of actions (..., 1)."""
        given = np.asarray(action, dtype=np.float64)
        u = np.zeros((*given.shape[:-1], 5))
        u[..., 2] = self.limit * given[..., 0]
        return u
