"""Moments between two control periods, for pictures that move smoothly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.moment import Moment
from rigid_envs.systems import System

__all__ = ["between"]

Array = npt.NDArray[np.float64]


def between(one: Moment, other: Moment, share: float, system: type[System]) -> Moment:
    """Moment between two successive ones, for the eye: it is interpolated, not simulated.

    Attitudes turn about one axis at a constant rate, all other numbers change linearly; input,
    action and results are those of the step in between. Rolling along a straight line, and a
    quarter roll on the grid, are met exactly.

    Args:
        one: earlier moment.
        other: the next moment, of the same episode.
        share: of the time between them, from 0 to 1.
        system: class of the physical system.
    """
    if share <= 0.0 or share >= 1.0:
        return one if share <= 0.0 else other
    y = one.y + share * (other.y - one.y)
    part = system.components.get("q")
    if part is not None:
        y[part] = rotations.slerp(one.y[part], other.y[part], share)
    time = one.time + share * (other.time - one.time)
    return replace(other, y=y, aux=_auxiliary(one.aux, other.aux, share), time=time)


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
