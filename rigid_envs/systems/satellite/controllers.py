"""Controllers of a satellite that is turned by magnetic coils."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, CheckedFields, positive
from rigid_envs.systems.satellite.system import Satellite


@dataclass(frozen=True)
class FieldBrake(CheckedFields):
    """Brakes the angular momentum across the field, at a rate matched to the turning of the field.

    m = k L x B / |B|^2 gives the torque -k L across B, so L decays there at the rate k. The part
    along B waits until the field has turned. A gain too large is as bad as one too small: what the
    field uncovers is braked away at once, L follows the field and keeps its size. ``k = 2 n (1 +
    sin i)`` is in the middle, as in Avanzini & Giulietti 2012, doi:10.2514/1.53074, with the least
    moment times omega in place of L.

    Attributes:
        satellite: to control.
        dipole: largest dipole [A m^2].

    Raises:
        ValueError: a dipole that is not positive.
    """

    satellite: Satellite
    dipole: Annotated[float, positive, "A m^2"]

    @property
    def gain(self) -> float:
        """Rate k at which L across the field decays [1/s]."""
        return 2.0 * self.satellite.n * (1.0 + abs(math.sin(self.satellite.inclination)))

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, dipoles over the largest, shape (..., 3).

        Args:
            y: states, shape (..., 8).
        """
        B, L = self.satellite.field_body(y), self.satellite.L_body(y)
        square = np.maximum(np.sum(B * B, axis=-1, keepdims=True), np.finfo(float).tiny)
        m = self.gain / self.dipole * np.cross(L, B) / square
        return np.asarray(m / np.maximum(np.linalg.norm(m, axis=-1, keepdims=True), 1.0))
