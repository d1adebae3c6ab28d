"""What a contact must bear: the normal force, and the friction that rolling needs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import non_negative
from rigid_envs.systems.equations import Equations

__all__ = ["RollingContact"]

Array = npt.NDArray[np.float64]


class RollingContact(Equations):
    """A system that rolls as if it were held to its ground; these say where it would not be.

    The motion is that without slip and without lift-off: equations and integrator do not change
    where a contact could not give the force.

    Attributes:
        mu: coefficient of static friction, by which `slips` judges; the motion does not depend on
            it.
    """

    mu: float

    def contact_force(self, y: npt.ArrayLike, u: npt.ArrayLike | None = None) -> Array:
        """Force of the ground [N]: friction, and last the normal force, shape (..., n).

        By Newton's law, m a less weight and applied force. It is in axes of the plate for a
        `DynamicBall`; in those of the world for a `RollingDisk` and an `UprightCoin`, whose z is
        the normal of the plane; along the path and normal to it for a `Roller`, n = 2.

        Args:
            y: state, shape (..., n_state).
            u: input, shape (..., n_input), broadcast against y; zero if left out.

        Raises:
            ValueError: as `checked_state` and `checked_input`.
        """
        rows, inputs = self._broadcast(self.checked_state(y), self.checked_input(u))
        y_rows = np.array(rows, order="C").reshape(-1, rows.shape[-1])
        u_rows = np.array(inputs, order="C").reshape(-1, inputs.shape[-1])
        out = np.empty((len(y_rows), self.dynamics.contact.n_force))
        self.dynamics.force_rows(y_rows, u_rows, self.parameters, out)
        return out.reshape(*rows.shape[:-1], -1)

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
        self, y: npt.ArrayLike, u: npt.ArrayLike | None = None, *, mu: float | None = None
    ) -> npt.NDArray[np.bool_]:
        """Whether rolling would need more friction than there is, shape (...).

        Args:
            y: state, shape (..., n_state).
            u: input, shape (..., n_input).
            mu: coefficient of friction; that of the system if left out.

        Raises:
            ValueError: mu is negative; see `contact_force` for y and u.
        """
        coefficient = self.mu if mu is None else non_negative(mu, "mu", "1")
        return np.asarray(self.needed_friction(y, u) > coefficient)
