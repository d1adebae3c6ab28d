"""Colours of the views: those of Okabe and Ito, which the colour-blind can tell apart, and greys.

Yellow is a little darker than theirs: in full light no colour may be brighter than white.

Source: Okabe & Ito 2008, "Color universal design", https://jfly.uni-koeln.de/color/.
"""

from rigid_envs.render.scene import Color, Floor

__all__ = [
    "BLUE",
    "CREAM",
    "DARK",
    "GHOST",
    "GREEN",
    "GREY",
    "INPUT",
    "LIGHT",
    "MOMENTUM",
    "OCTANTS",
    "OMEGA",
    "ORANGE",
    "PATH",
    "PURPLE",
    "RED",
    "SKY",
    "STEEL",
    "YELLOW",
    "level_floor",
]


def _rgb(red: int, green: int, blue: int) -> Color:
    return red / 255.0, green / 255.0, blue / 255.0


ORANGE, SKY, GREEN = _rgb(230, 159, 0), _rgb(86, 180, 233), _rgb(0, 158, 115)
YELLOW, BLUE, RED, PURPLE = (
    _rgb(224, 212, 60),
    _rgb(0, 114, 178),
    _rgb(213, 94, 0),
    _rgb(204, 121, 167),
)
DARK, STEEL, GREY = _rgb(45, 50, 60), _rgb(105, 115, 130), _rgb(160, 168, 180)
LIGHT, CREAM = _rgb(212, 217, 224), _rgb(226, 223, 215)

OCTANTS = (YELLOW, ORANGE, SKY, CREAM, RED, BLUE, GREEN, PURPLE)
"""Octants of a ball at (x < 0) + 2 (y < 0) + 4 (z < 0): the upper half is light."""

OMEGA, MOMENTUM, INPUT, PATH = RED, BLUE, PURPLE, DARK
"""Angular velocity, angular momentum, what is controlled, path of a point."""

GHOST = 0.45
"""Opacity of a goal."""


def level_floor(height: float, size: float, cell: float = 1.0) -> Floor:
    """Chequered floor.

    Args:
        height: z of the floor [m].
        size: side [m].
        cell: side of a cell [m].
    """
    return Floor(height, size, cell)
