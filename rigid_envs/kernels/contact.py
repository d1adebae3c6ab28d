"""What a contact bears: the force of the ground, and the friction that rolling needs."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import select, sqrt

__all__ = ["NO_CONTACT", "Contact", "on_ground"]

Function = Callable[..., Any]


class Grip(NamedTuple):
    """Normal force [N], and the least coefficient of friction without slip."""

    normal_force: float
    needed_friction: float


@scalar
def _grip(force: Row) -> Grip:
    """Grip that a force of the ground needs, whose last entry is normal; infinite without it."""
    square, normal = 0.0, force[len(force) - 1]
    for k in range(len(force) - 1):
        square += force[k] * force[k]
    held = normal > 0.0
    return Grip(normal, select(held, sqrt(square) / select(held, normal, 1.0), np.inf))


@scalar
def _slips(grip: Grip, p: Any) -> bool:
    slips: bool = grip.needed_friction > p.mu
    return slips


@scalar
def _no_force(_y: Row, _u: Row, _p: Row) -> tuple[()]:
    return ()


@scalar
def _no_grip(_force: tuple[()]) -> tuple[()]:
    return ()


@scalar
def _never(_grip: tuple[()], _p: Row) -> bool:
    return False


class Contact(NamedTuple):
    """Compiled functions of a contact.

    Attributes:
        force: ``force(y, u, p)``, force of the ground [N], the normal force last.
        grip: ``grip(force)``, the `Grip` that it needs.
        slips: ``slips(grip, p)``, whether rolling needs more friction than there is.
        n_force: number of components of the force.
        names: those of the grip.
    """

    force: Function
    grip: Function
    slips: Function
    n_force: int
    names: tuple[str, ...]


NO_CONTACT = Contact(_no_force, _no_grip, _never, 0, ())
"""That of a system which touches nothing, or has no forces."""


def on_ground(force: Function, n_force: int) -> Contact:
    """Contact of a system that rolls; its parameters have mu, the coefficient of friction."""
    return Contact(force, _grip, _slips, n_force, Grip._fields)
