"""D'Alembert's principle for a rigid body, seen as mass points in world axes.

    sum over all points of (m x'' - f) . dx = 0

for every displacement dx that the constraints admit: forces of constraint drop out. For a rigid
body of mass m with centre r and attitude R it reads

    (m r'' - F) . dr + (D - tau) . dtheta = 0,    D_i = eps_ijk (R J R''^T)_jk,

where J is the second moment of the mass, in body axes: D, the sum of x cross m x'', is the rate of
the angular momentum. Neither an angular velocity nor an equation of Euler's occurs in it.

Source: Lanczos, *The Variational Principles of Mechanics*, chapter IV.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs.laws.stencil import Window, largest

__all__ = ["FREE_TURNS", "Body", "imbalance", "missing"]

Array = npt.NDArray[np.float64]
Vectors = Callable[[Array, Array], Array]

FREE_TURNS = np.eye(3)[:, None]
"""Displacements dtheta of a body that may turn anyhow, shape (3, 1, 3)."""


@dataclass(frozen=True)
class Body:
    """What the principle has to know of a system that consists of one rigid body.

    States y have shape (..., n_state), inputs u (..., n_input); vectors are in world axes, shape
    (..., 3).

    Attributes:
        mass: [kg].
        moments: about the centre of mass, along the body axes, shape (3,) [kg m^2].
        centre: of mass [m], of y.
        force: sum of the applied forces [N], of y and u.
        torque: of the applied forces about the centre of mass [N m], of y and u.
        displacements: admissible dr [m] and dtheta [rad], of y: k of each, shape (k, ..., 3).
    """

    mass: float
    moments: Array
    centre: Callable[[Array], Array]
    force: Vectors
    torque: Vectors
    displacements: Callable[[Array], tuple[Array, Array]]


def imbalance(body: Body, around: Window) -> float:
    """Largest violation of the principle, per unit of displacement [J]."""
    force, torque = missing(body, around)
    dr, dtheta = body.displacements(around.now)
    return largest(np.sum(force * dr, axis=-1) + np.sum(torque * dtheta, axis=-1))


def missing(body: Body, around: Window) -> tuple[Array, Array]:
    """Force m r'' - F [N] and torque D - tau [N m] of the constraints, each of shape (..., 3)."""
    R = around.system.accessors["R"](around.y)
    second_moment = np.diag(0.5 * np.sum(body.moments) - body.moments)
    push = body.mass * around.acceleration(body.centre(around.y))
    turn = _axial(R[4] @ second_moment @ np.swapaxes(around.acceleration(R), -1, -2))
    force, torque = body.force(around.now, around.u), body.torque(around.now, around.u)
    return push - force, turn - torque


def _axial(matrix: Array) -> Array:
    """The vector eps_ijk M_jk, shape (..., 3)."""
    odd = matrix - np.swapaxes(matrix, -1, -2)
    return np.stack([odd[..., 1, 2], odd[..., 2, 0], odd[..., 0, 1]], axis=-1)
