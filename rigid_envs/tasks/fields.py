"""Fields of a task, and entries of what it observes."""

import math
from dataclasses import dataclass
from typing import Any

from rigid_envs.base.settings import Choice, Number, setting
from rigid_envs.engine import publication as attitude

# Entries of actions and observations, and the ways in which an attitude can be observed.

ROTATIONS = {
    "none": attitude.HIDDEN,
    "matrix": attitude.MATRIX,
    "rot6d": attitude.ROT6D,
    "quat": attitude.QUATERNION,
    "euler": attitude.EULER,
}


ROTATION = Choice("observed attitude", tuple(ROTATIONS))


@dataclass(frozen=True)
class Entry:
    """One entry of an action or observation: symbol, unit, frame and bounds."""

    symbol: str
    unit: str
    frame: str
    low: float
    high: float


def attitude_entries(rotation: str) -> tuple[Entry, ...]:
    """Entries of the attitude as it is observed with a value of the setting `rotation`."""
    unit = {
        "none": (),
        "matrix": tuple(f"R{i}{j}" for i in "123" for j in "123"),
        "rot6d": tuple(f"R{i}{j}" for j in "12" for i in "123"),
        "quat": ("w", "x", "y", "z"),
    }
    if rotation == "euler":
        pi = math.pi
        angles = (("phi", -pi, pi), ("theta", 0.0, pi), ("psi", -pi, pi))
        return tuple(Entry(name, "rad", "z-x-z", low, high) for name, low, high in angles)
    entries = (Entry(name, "1", "body to world", -1.0, 1.0) for name in unit[rotation])
    if rotation == "quat":
        return (Entry("w", "1", "body to world", 0.0, 1.0), *tuple(entries)[1:])
    return tuple(entries)


# Fields of a task: hyperparameters, each with the rule that checks its value.

Range = float | tuple[float, float]


def physical(default: Range, text: str, unit: str) -> Any:
    """A positive physical parameter: a number, or a range from which it is drawn at reset.

    Within the bounds 1e-9 and 1e6 no product or quotient of parameters overflows.
    """
    return setting(default, Number(text, unit, 1e-9, 1e6, drawn=True))


def span(value: Range) -> tuple[float, float]:
    """Lower and upper end of a number or range."""
    return value if isinstance(value, tuple) else (value, value)
