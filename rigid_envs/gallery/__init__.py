"""Figures of rigid-body rotation: simulation against closed form, each with the number it shows.

A figure is an `Entry`: caption, law, source, and a function that draws it and computes its numbers.
`rigid-envs gallery` writes them as PNG and SVG. matplotlib, of the extra `render`, is imported
when a figure is drawn.
"""

import difflib

from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.figures.brackets import BRACKETS
from rigid_envs.gallery.figures.chandler import CHANDLER
from rigid_envs.gallery.figures.coin import COIN
from rigid_envs.gallery.figures.cones import CONES
from rigid_envs.gallery.figures.disk import DISK
from rigid_envs.gallery.figures.flip import FLIP
from rigid_envs.gallery.figures.herpolhode import HERPOLHODE
from rigid_envs.gallery.figures.holonomy import HOLONOMY
from rigid_envs.gallery.figures.nutation import NUTATION
from rigid_envs.gallery.figures.polhodes import POLHODES
from rigid_envs.gallery.figures.potential import POTENTIAL
from rigid_envs.gallery.figures.precession import PRECESSION
from rigid_envs.gallery.figures.pump import PUMP
from rigid_envs.gallery.figures.race import RACE
from rigid_envs.gallery.figures.racket import RACKET
from rigid_envs.gallery.figures.shortest import SHORTEST
from rigid_envs.gallery.figures.sleeping import SLEEPING
from rigid_envs.gallery.figures.slipping import SLIPPING
from rigid_envs.gallery.figures.steady_circles import STEADY_CIRCLES
from rigid_envs.gallery.figures.turntable import TURNTABLE

__all__ = ["FIGURES", "Entry", "Number", "UnknownFigureError", "checked_name"]

FIGURES: dict[str, Entry] = {
    entry.name: entry
    for entry in (
        POLHODES,
        HERPOLHODE,
        CONES,
        CHANDLER,
        FLIP,
        RACKET,
        POTENTIAL,
        NUTATION,
        PRECESSION,
        SLEEPING,
        RACE,
        SLIPPING,
        COIN,
        DISK,
        STEADY_CIRCLES,
        HOLONOMY,
        SHORTEST,
        BRACKETS,
        TURNTABLE,
        PUMP,
    )
}
"""All figures by name, in the order of the page."""


class UnknownFigureError(ValueError):
    """No figure has that name."""


def checked_name(name: str) -> str:
    """The name itself, if it is one of `FIGURES`.

    Raises:
        UnknownFigureError: names the nearest figure and lists all.
    """
    if name in FIGURES:
        return name
    (near,) = difflib.get_close_matches(name.lower(), FIGURES, n=1, cutoff=0.0)
    raise UnknownFigureError(
        f"figure = {name!r}; expected one of {', '.join(FIGURES)}: did you mean {near!r}?"
    )
