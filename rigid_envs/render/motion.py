"""Motion between two successive moments, so that pictures move smoothly and paths are curves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.moment import Moment
from rigid_envs.systems import System

__all__ = ["Motion"]

Array = npt.NDArray[np.float64]


class Motion:
    """Motion of a step, for the eye: it is interpolated, not simulated.

    The attitude turns about one axis at a constant rate, all other numbers change linearly; input,
    action and results are those of the step. Rolling along a straight line, and a quarter roll on
    the grid, are met exactly.

    Args:
        system: the physical system, with its parameters.
        one: earlier moment.
        other: the next moment of the same episode.

    Attributes:
        turn: rotation vector of the step in world axes [rad], shape (3,). Of those that lead from
            one attitude to the other, the nearest to the angular velocity times the duration.
    """

    def __init__(self, system: System, one: Moment, other: Moment) -> None:
        """Find the turn."""
        self._one, self._other = one, other
        self._part = system.components.get("q")
        self.turn = np.zeros(3)
        if self._part is not None:
            self._q = rotations.normalize(one.y[self._part])
            end = rotations.normalize(other.y[self._part])
            short = rotations.log(rotations.multiply(end, rotations.conjugate(self._q)))
            self.turn = _nearest(short, _omega(system, other) * (other.time - one.time))

    def at(self, share: float) -> Moment:
        """The moment at a share of the time, from 0 to 1."""
        one, other = self._one, self._other
        if share <= 0.0 or share >= 1.0:
            return one if share <= 0.0 else other
        y = one.y + share * (other.y - one.y)
        if self._part is not None:
            y[self._part] = rotations.multiply(rotations.exp(share * self.turn), self._q)
        return replace(
            other,
            y=y,
            aux=_auxiliary(one.aux, other.aux, share),
            time=one.time + share * (other.time - one.time),
            success=one.success,
        )


def _nearest(short: Array, expected: Array) -> Array:
    """Of the rotation vectors of one rotation, the nearest to another vector."""
    angle, size = float(np.linalg.norm(short)), float(np.linalg.norm(expected))
    if angle <= 1e-9 and size == 0.0:
        return short
    along = short / angle if angle > 1e-9 else expected / size
    turns = np.round((expected @ along - angle) / (2.0 * np.pi))
    return np.asarray(short + 2.0 * np.pi * turns * along)


def _omega(system: System, moment: Moment) -> Array:
    """Angular velocity at the end of a step in world axes [rad/s]; zero where none is known."""
    accessor = system.accessors.get("omega_world")
    if accessor is not None:
        return accessor(moment.y)
    of_input = getattr(system, "omega_world", None)  # of kinematic rolling
    return np.zeros(3) if of_input is None else np.asarray(of_input(moment.u))


def _auxiliary(
    one: Mapping[str, float], other: Mapping[str, float], share: float
) -> dict[str, float]:
    """Auxiliary state between two; four entries ``name_w`` to ``name_z`` are an attitude."""
    mixed = {name: value + share * (other[name] - value) for name, value in one.items()}
    for name in one:
        names = [f"{name[:-1]}{letter}" for letter in "wxyz"]
        if name.endswith("_w") and all(entry in one for entry in names):
            p, q = ([each[entry] for entry in names] for each in (one, other))
            mixed.update(zip(names, rotations.slerp(p, q, share).tolist(), strict=True))
    return mixed
