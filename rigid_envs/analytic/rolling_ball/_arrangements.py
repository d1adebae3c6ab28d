"""Drives of a rolling ball: its centre, a plate on top of it, or the plane under it."""

from types import MappingProxyType
from typing import NamedTuple

__all__ = ["ARRANGEMENTS", "Arrangement"]


class Arrangement(NamedTuple):
    """Velocities per unit of the commanded velocity.

    Attributes:
        centre: of the centre in the world.
        roll: of the centre relative to the plane it rolls on: this is what turns the ball.
    """

    centre: float
    roll: float


ARRANGEMENTS = MappingProxyType(
    {
        "fixed_plane": Arrangement(centre=1.0, roll=1.0),
        "top_plate": Arrangement(centre=0.5, roll=0.5),
        "plane_under_fixed_centre": Arrangement(centre=0.0, roll=-1.0),
    }
)
"""The commanded velocity is that of the centre over a plane at rest (`fixed_plane`), of a plate
that lies on the ball while the plane under it is at rest (`top_plate`: the centre lags by half), or
of the plane while the centre is held (`plane_under_fixed_centre`). Source: Jurdjevic (1993)."""
