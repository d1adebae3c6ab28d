"""Reduced coordinates of a ball on a grid: its cell in one eighth of the plane."""

import math
from typing import Any, NamedTuple

import numpy as np

from rigid_envs.kernels.algebra import Row, attitude, matrix
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma, select
from rigid_envs.symmetries.grids import QUARTER_TURN, REFLECTION
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.reduction import Reduction

__all__ = ["CELL"]

_FAR = 100.0  # cells; bound of the observed position
# Number of a pose: the entries of R are digits to the base 3, above them the two coordinates.
_J = 3.0**9
_I = _J * (2.0 * _FAR + 1.0)


class Image(NamedTuple):
    """An element of D4: signs of x and y, then whether they are exchanged."""

    sign_x: float
    sign_y: float
    swapped: float


@scalar
def whole(x: float) -> float:
    """The nearest whole number, as exact as on the grid."""
    return float(np.floor(x + 0.5))


@scalar
def pose(y: Any, p: Any) -> tuple[float, float, Row]:
    """Cell and rotation matrix in whole numbers."""
    scale = p.inverse_radius * (2.0 / math.pi)
    i = whole(min(max(scale * y.X, -_FAR), _FAR))
    j = whole(min(max(scale * y.Y, -_FAR), _FAR))
    a, b, c, d, e, f, g, h, k = matrix(attitude(y))
    R = (whole(a), whole(b), whole(c), whole(d), whole(e), whole(f), whole(g), whole(h), whole(k))
    return i, j, R


@scalar
def exchanged(R: Row) -> Row:
    """S R S^-1 with S the exchange of x and y."""
    a, b, c, d, e, f, g, h, k = R
    return e, d, f, b, a, c, h, g, k


@scalar
def number(i: float, j: float, R: Row) -> tuple[float, float, float, float]:
    """Parts of the number of a pose: as it is; times the signs of x, of y and of x y."""
    a, b, c, d, e, f, g, h, k = R
    return (
        fma(2187.0, a, fma(729.0, e, 243.0 * k)),
        fma(_I, i, fma(81.0, c, 27.0 * g)),
        fma(_J, j, fma(9.0, f, 3.0 * h)),
        fma(6561.0, b, d),
    )


@scalar
def largest(parts: tuple[float, float, float, float]) -> tuple[float, float, float]:
    """Largest number of the poses with the signs of x and y changed, and these signs."""
    one, x, y, xy = parts
    best, sign_x, sign_y = one + x + y + xy, 1.0, 1.0
    other = one - x + y - xy
    sign_x = select(other > best, -1.0, sign_x)
    best = max(best, other)
    other = one + x - y - xy
    sign_x, sign_y = select(other > best, 1.0, sign_x), select(other > best, -1.0, sign_y)
    best = max(best, other)
    other = one - x - y + xy
    sign_x, sign_y = select(other > best, -1.0, sign_x), select(other > best, -1.0, sign_y)
    return max(best, other), sign_x, sign_y


@scalar
def image_of(i: float, j: float, R: Row) -> Image:
    """The image with the largest number, exact in float64: i >= j >= 0, then that of R.

    Poses that a symmetry leaves unchanged have several such images, which look the same.
    """
    as_is, ax, ay = largest(number(i, j, R))
    # signs of the exchanged coordinates: those of y and x
    swapped, by, bx = largest(number(j, i, exchanged(R)))
    better = swapped > as_is
    return Image(
        sign_x=select(better, bx, ax),
        sign_y=select(better, by, ay),
        swapped=select(better, 1.0, 0.0),
    )


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Cell and attitude of the image with 0 <= j <= i, in whole numbers."""
    i, j, R = pose(y, p)
    image = image_of(i, j, R)
    sx, sy = image.sign_x, image.sign_y
    a, b, c_, d, e, f, g, h, k = R
    seen = (a, sx * sy * b, sx * c_, sx * sy * d, e, sy * f, sx * g, sy * h, k)
    other = exchanged(seen)
    swap = image.swapped > 0.0
    i, j = abs(i), abs(j)
    i, j = max(i, j), min(i, j)
    return (
        i + 0.0,
        j + 0.0,
        min(i, 1.0),
        min(j, 1.0),
        min(i - j, 1.0),
        select(swap, other[0], seen[0]) + 0.0,
        select(swap, other[1], seen[1]) + 0.0,
        select(swap, other[2], seen[2]) + 0.0,
        select(swap, other[3], seen[3]) + 0.0,
        select(swap, other[4], seen[4]) + 0.0,
        select(swap, other[5], seen[5]) + 0.0,
        select(swap, other[6], seen[6]) + 0.0,
        select(swap, other[7], seen[7]) + 0.0,
        select(swap, other[8], seen[8]) + 0.0,
    )


@scalar
def turn(a: Any, y: Any, aux: Any, p: Any, c: Any) -> tuple[float]:
    """The side of the world that a side of the image is."""
    i, j, R = pose(y, p)
    image = image_of(i, j, R)
    back = a[0] > 1.5
    along_y = a[0] - select(back, 2.0, 0.0)
    along_y = abs(along_y - image.swapped)
    sign = select(back, -1.0, 1.0) * select(along_y > 0.5, image.sign_y, image.sign_x)
    return (along_y + select(sign < 0.0, 2.0, 0.0),)


CELL = Reduction(
    symmetries=(QUARTER_TURN, REFLECTION),
    features=(
        Entry("i", "1", "cells, the larger", 0.0, _FAR),
        Entry("j", "1", "cells, the smaller", 0.0, _FAR),
        Entry("i > 0", "1", "", 0.0, 1.0),
        Entry("j > 0", "1", "", 0.0, 1.0),
        Entry("i > j", "1", "", 0.0, 1.0),
        *(Entry(f"R{m}{n}", "1", "body to reduced", -1.0, 1.0) for m in "123" for n in "123"),
    ),
    observe=observe,
    turn=turn,
)
"""Reduction of `BallGrid`: D4, quarter turns about the vertical through home and reflections."""
