"""What a contact must bear: the normal force, and the friction that rolling needs."""

from __future__ import annotations

import abc

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import non_negative

__all__ = ["RollingContact"]

Array = npt.NDArray[np.float64]


class RollingContact(abc.ABC):
    """A system that rolls as if it were held to its ground; these say where it would not be.

    The motion is that without slip and without lift-off: equations and integrator do not change
    where a contact could not give the force.
    """

    @abc.abstractmethod
    def contact_force(self, y: npt.ArrayLike, u: npt.ArrayLike | None = None) -> Array:
        """Force of the ground [N]: friction, and last the normal force, shape (..., n)."""

    def normal_force(self, y: npt.ArrayLike, u: npt.ArrayLike | None = None) -> Array:
        """Force of the ground along its normal [N], shape (...): below 0 it would lift off."""
        return np.asarray(self.contact_force(y, u)[..., -1])

    def needed_friction(self, y: npt.ArrayLike, u: npt.ArrayLike | None = None) -> Array:
        """Least coefficient of friction without slip, shape (...); infinite without contact."""
        force = self.contact_force(y, u)
        friction, normal = np.linalg.norm(force[..., :-1], axis=-1), force[..., -1]
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = friction / np.maximum(normal, 0.0)
        return np.asarray(np.where(normal > 0.0, ratio, np.inf))

    def slips(
        self, y: npt.ArrayLike, u: npt.ArrayLike | None = None, *, mu: float
    ) -> npt.NDArray[np.bool_]:
        """Whether rolling would need more friction than the coefficient mu gives, shape (...).

        Raises:
            ValueError: mu is negative; see `contact_force` for y and u.
        """
        return np.asarray(self.needed_friction(y, u) > non_negative(mu, "mu", "1"))
