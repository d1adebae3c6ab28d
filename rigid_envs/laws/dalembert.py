"""D'Alembert's principle for a rigid body of mass points, in world axes.

    sum over all points of (m x'' - f) . dx = 0

for every virtual displacement dx that the constraints admit: constraint forces do no virtual work.
For a rigid body of mass m with centre r and attitude R it reads

    (m r'' - F) . dr + (D - tau) . dtheta = 0,    D_i = eps_ijk (R J R''^T)_jk,

where J is the second moment of the mass, in body axes: D, the sum of x cross m x'', is the rate of
the angular momentum. Neither angular velocities nor Euler's equations occur in it.

Source: Lanczos, *The Variational Principles of Mechanics*, chapter IV.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs.laws.numerics import max_abs
from rigid_envs.laws.stencil import Stencil

__all__ = ["VIRTUAL_ROTATIONS", "RigidBodyModel", "constraint_wrench", "virtual_work"]

Array = npt.NDArray[np.float64]
Vectors = Callable[[Array, Array], Array]

VIRTUAL_ROTATIONS = np.eye(3)[:, None]
"""Virtual rotations dtheta of a body without constraint on its attitude, shape (3, 1, 3)."""


@dataclass(frozen=True)
class RigidBodyModel:
    """Mass, applied forces and constraints of a system that is one rigid body.

    States y have shape (..., n_state), inputs u (..., n_input); vectors are in world axes, shape
    (..., 3).

    Attributes:
        mass: [kg].
        moments: about the centre of mass, along the body axes, shape (3,) [kg m^2].
        centre: centre of mass [m], of y.
        force: sum of the applied forces [N], of y and u.
        torque: applied torque about the centre of mass [N m], of y and u.
        displacements: basis of the virtual displacements dr [m] and dtheta [rad], of y: k of each,
            shape (k, ..., 3).
    """

    mass: float
    moments: Array
    centre: Callable[[Array], Array]
    force: Vectors
    torque: Vectors
    displacements: Callable[[Array], tuple[Array, Array]]


def virtual_work(body: RigidBodyModel, motion: Stencil) -> float:
    """Largest virtual work of the constraints, per unit of displacement [J]; 0 by the principle."""
    force, torque = constraint_wrench(body, motion)
    dr, dtheta = body.displacements(motion.middle)
    return max_abs(np.sum(force * dr, axis=-1) + np.sum(torque * dtheta, axis=-1))


def constraint_wrench(body: RigidBodyModel, motion: Stencil) -> tuple[Array, Array]:
    """Force m r'' - F [N] and torque D - tau [N m] of the constraints, each of shape (..., 3)."""
    R = motion.system.accessors["R"](motion.y)
    R_middle = motion.system.accessors["R"](motion.middle)
    second_moment = np.diag(0.5 * np.sum(body.moments) - body.moments)
    p_rate = body.mass * motion.acceleration(body.centre(motion.y))
    L_rate = _axial(R_middle @ second_moment @ np.swapaxes(motion.acceleration(R), -1, -2))
    y, u = motion.middle, motion.u
    return p_rate - body.force(y, u), L_rate - body.torque(y, u)


def _axial(matrix: Array) -> Array:
    """The vector eps_ijk M_jk, shape (..., 3)."""
    odd = matrix - np.swapaxes(matrix, -1, -2)
    return np.stack([odd[..., 1, 2], odd[..., 2, 0], odd[..., 0, 1]], axis=-1)
