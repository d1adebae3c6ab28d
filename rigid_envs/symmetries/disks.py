"""Symmetries of a disk that rolls on a plane to a commanded curvature."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.symmetries.symmetry import Point, Symmetry, angles, signs

__all__ = ["EXCHANGE", "PHASE", "REFLECTION", "TRANSLATION", "TURN"]

Array = npt.NDArray[np.float64]


def _product(p: tuple[Array, ...], q: tuple[Array, ...]) -> dict[str, Array]:
    """Quaternion p q by the names of a state."""
    a, b, c, d = p
    w, x, y, z = q
    return {
        "w": a * w - b * x - c * y - d * z,
        "x": a * x + b * w + c * z - d * y,
        "y": a * y - b * z + c * w + d * x,
        "z": a * z + b * y - c * x + d * w,
    }


def _about_z(angle: Array) -> tuple[Array, ...]:
    zero = np.zeros_like(angle)
    return np.cos(0.5 * angle), zero, zero, np.sin(0.5 * angle)


def _attitude(y: Any) -> tuple[Array, ...]:
    return y.w, y.x, y.y, y.z


def _translate(point: Point, length: Array) -> Point:
    return point._replace(y=point.y._replace(X=point.y.X + length))


def _turn(point: Point, angle: Array) -> Point:
    y, c, s = point.y, np.cos(angle), np.sin(angle)
    place = {"X": c * y.X - s * y.Y, "Y": s * y.X + c * y.Y}
    return point._replace(y=y._replace(**_product(_about_z(angle), _attitude(y)), **place))


def _turn_in_itself(point: Point, angle: Array) -> Point:
    # R -> R Rz(angle): omega in body axes turns back
    y, c, s = point.y, np.cos(angle), np.sin(angle)
    omega = {"omega1": c * y.omega1 + s * y.omega2, "omega2": c * y.omega2 - s * y.omega1}
    return point._replace(y=y._replace(**_product(_attitude(y), _about_z(angle)), **omega))


def _reflect(point: Point, sign: Array) -> Point:
    # R -> S R B with S the reflection y -> -y and B that of the disk in its own plane; omega is
    # axial, so that its components along e1 and e2 are reversed. S R S has the quaternion
    # (w, -x, y, -z), and S B is half a turn about x.
    y, zero = point.y, np.zeros_like(sign)
    q = _product((y.w, -y.x, y.y, -y.z), (zero, zero + 1.0, zero, zero))
    new = {**q, "omega1": -y.omega1, "omega2": -y.omega2, "Y": -y.Y}
    return _lean_reversed(point, new, sign)


def _exchange(point: Point, sign: Array) -> Point:
    # R -> R Rx(pi); the direction of travel is defined by e3, and so is the sign of the curvature
    y, zero = point.y, np.zeros_like(sign)
    q = _product(_attitude(y), (zero, zero + 1.0, zero, zero))
    return _lean_reversed(point, {**q, "omega2": -y.omega2, "omega3": -y.omega3}, sign)


def _lean_reversed(point: Point, new: dict[str, Array], sign: Array) -> Point:
    """The new components, commanded curvature and torque reversed, where the sign is negative."""
    y, aux, action = point.y, point.aux, point.action
    y = y._replace(**{k: np.where(sign < 0.0, v, getattr(y, k)) for k, v in new.items()})
    aux = aux._replace(goal_curvature=sign * aux.goal_curvature)
    return point._replace(y=y, aux=aux, action=action._replace(tau_lean=sign * action.tau_lean))


TRANSLATION = Symmetry("translation along x", _translate, angles)  # by up to pi m
TURN = Symmetry("turn about the vertical", _turn, angles)
PHASE = Symmetry("turn of the marks on the disk about its axis", _turn_in_itself, angles)
REFLECTION = Symmetry("reflection in a vertical plane", _reflect, signs)
EXCHANGE = Symmetry("exchange of the two faces of the disk", _exchange, signs)
