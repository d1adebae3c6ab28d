"""Entries of actions and observations, and the ways in which an attitude can be observed."""

import math
from dataclasses import dataclass

from rigid_envs.kernels import attitude
from rigid_envs.tasks.fields import Choice

__all__ = ["ROTATION", "ROTATIONS", "Entry", "attitude_entries"]

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
