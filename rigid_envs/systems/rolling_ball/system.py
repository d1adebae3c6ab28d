"""Ball that rolls without slipping on a plane, its velocity given: the kinematic ball."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, positive
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.equations import instead
from rigid_envs.mechanics.system import System
from rigid_envs.systems.rolling_ball.dynamics import ROLLING_BALL


@dataclass(frozen=True)
class RollingBall(System):
    """Ball on the plane z = 0; the velocity of its centre and its spin are the inputs.

    Rolling without slipping, $v = omega_world x radius e_z$, fixes the horizontal angular velocity:
    $omega_world = (-VY / radius, VX / radius, spin)$. Then $q' = (0, omega_world) q / 2$, $X' =
    VX$, $Y' = VY$: five dimensions, of which two controls reach all.

    Contact forces are those of its acceleration, which neither state nor input says: take
    `DynamicBall` for them.

    State $y = (w, x, y, z, X, Y)$: attitude, body to world, and position of the centre [m]. Input
    $u = (VX, VY, spin)$: velocity of the centre [m/s], angular velocity about the vertical [rad/s];
    held over a step, the step is the exact rotation.

    Attributes:
        radius: radius of the ball [m].

    Raises:
        ValueError: a radius that is not positive.

    Source: Jurdjevic 1993, "The geometry of the plate-ball problem", doi:10.1007/BF00375605.
    """

    radius: float = 1.0

    dynamics: ClassVar = ROLLING_BALL
    components: ClassVar[Mapping[str, slice]] = {"q": slice(0, 4), "position": slice(4, 6)}
    # a quarter turn, where the rotation is exact to rounding
    envelope: ClassVar[float] = 1.5707963267948966
    default_step_angle: ClassVar[float] = 1.5707963267948966

    def __post_init__(self) -> None:
        """Check the radius."""
        positive(self.radius, "radius", "m")
        super().__post_init__()

    @classmethod
    def state(
        cls, *, rotation_vector: npt.ArrayLike | None = None, **components: npt.ArrayLike
    ) -> Array:
        """State row of attitude and components; those left out are 0, the ball upright.

        Args:
            rotation_vector: axis times angle by which the ball is turned, world axes [rad], shape
                (..., 3).
            **components: position of the centre [m], shape (..., 2); q in place of the
                rotation vector.

        Returns:
            y of shape (..., 6).

        Raises:
            ValueError: as `System.state`; a rotation vector beside q.
        """
        if rotation_vector is not None:
            instead(components, "q", {"rotation_vector": rotation_vector})
            components["q"] = rotations.exp(rotation_vector)
        return super().state(**components)

    def position(self, y: npt.ArrayLike) -> Array:
        """Position of the centre (X, Y) on the plane [m], shape (..., 2)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 4:6])

    def omega_world(self, u: npt.ArrayLike) -> Array:
        """Angular velocity in world axes [rad/s] under input u, shape (..., 3)."""
        rows = self.checked_input(u)
        vx, vy, spin = rows[..., 0], rows[..., 1], rows[..., 2]
        return np.stack([-vy / self.radius, vx / self.radius, spin], axis=-1)

    def rate_bound(self, y: Array, u: Array, duration: float) -> float:
        """Angular rate [rad/s] under input u."""
        rate = np.linalg.norm(self.omega_world(u), axis=-1)
        return float(np.max(rate, initial=0.0))
