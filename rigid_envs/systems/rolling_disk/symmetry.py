"""Symmetries of a disk that rolls on a plane to a commanded curvature."""

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.tasks import symmetry

_NAMES = ("w", "x", "y", "z")


def _reflect(point: symmetry.Point, sign: Array) -> symmetry.Point:
    # R -> S R B with S the reflection y -> -y and B that of the disk in its own plane; omega is
    # axial, so that its components along e1 and e2 are reversed. S R S has the quaternion
    # (w, -x, y, -z), and S B is half a turn about x.
    y, zero = point.y, np.zeros_like(sign)
    q = symmetry.product((y.w, -y.x, y.y, -y.z), (zero, zero + 1.0, zero, zero))
    new = {**dict(zip(_NAMES, q, strict=True)), "omega1": -y.omega1, "omega2": -y.omega2, "Y": -y.Y}
    return _lean_reversed(point, new, sign)


def _exchange(point: symmetry.Point, sign: Array) -> symmetry.Point:
    # R -> R Rx(pi); the direction of travel is defined by e3, and so is the sign of the curvature
    y, zero = point.y, np.zeros_like(sign)
    q = symmetry.product(symmetry.attitude(y), (zero, zero + 1.0, zero, zero))
    new = {**dict(zip(_NAMES, q, strict=True)), "omega2": -y.omega2, "omega3": -y.omega3}
    return _lean_reversed(point, new, sign)


def _lean_reversed(point: symmetry.Point, new: dict[str, Array], sign: Array) -> symmetry.Point:
    """The new components, commanded curvature and torque reversed, where the sign is negative."""
    y, aux, action = point.y, point.aux, point.action
    y = y._replace(**{k: np.where(sign < 0.0, v, getattr(y, k)) for k, v in new.items()})
    aux = aux._replace(goal_curvature=sign * aux.goal_curvature)
    return point._replace(y=y, aux=aux, action=action._replace(tau_lean=sign * action.tau_lean))


TURN = symmetry.Symmetry(
    "turn about the vertical", symmetry.turn_of_space([("X", "Y")]), symmetry.angles
)
PHASE = symmetry.Symmetry(
    "turn of the marks on the disk about its axis",
    symmetry.turn_of_body([("omega1", "omega2")]),
    symmetry.angles,
)
REFLECTION = symmetry.Symmetry("reflection in a vertical plane", _reflect, symmetry.signs)
EXCHANGE = symmetry.Symmetry("exchange of the two faces of the disk", _exchange, symmetry.signs)
