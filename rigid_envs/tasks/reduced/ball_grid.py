"""Reduced coordinates of a ball on a grid: its cell in one eighth of the plane."""

import math
from typing import Any, NamedTuple

import numpy as np

from rigid_envs.kernels.algebra import Quaternion, Row, attitude, matrix
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma, select
from rigid_envs.symmetries.grids import QUARTER_TURN, REFLECTION
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.reduction import Reduction

__all__ = ["CELL"]

_FAR = 100.0  # cells; bound of the observed position
# Half the number of a pose: the entries of R are digits to the base 3, above them the coordinates.
_J = 0.5 * 3.0**9
_I = _J * (2.0 * _FAR + 1.0)


class Image(NamedTuple):
    """An element of D4: signs of x and y, then whether they are exchanged."""

    sign_x: float
    sign_y: float
    swapped: float


class Sides(NamedTuple):
    """Sides 0 (+x), 1 (+y), 2, 3 of an image: the first one in the world, and their sense there."""

    first: float
    sense: float


@scalar
def whole(x: float) -> float:
    """The nearest whole number: on the grid, what is seen then is exact."""
    return float(np.floor(x + 0.5))


@scalar
def cell(y: Any, p: Any) -> tuple[float, float]:
    """Position in cells."""
    scale = p.inverse_radius * (2.0 / math.pi)
    return scale * y.X, scale * y.Y


@scalar
def largest(one: float, x: float, y: float, xy: float) -> tuple[float, float, float]:
    """Largest ``one + sign_x x + sign_y y + sign_x sign_y xy``, and these signs."""
    with_x, without = y + xy, y - xy  # what sign_y multiplies
    here, there = x + abs(with_x), abs(without) - x
    flipped = there > here
    sign_y = select(select(flipped, without, with_x) < 0.0, -1.0, 1.0)
    return one + max(here, there), select(flipped, -1.0, 1.0), sign_y


@scalar
def image_of(i: float, j: float, q: Quaternion) -> Image:
    """The image with the largest number: i >= j >= 0, then that of R.

    R11 ... R33 have the weights 2187, 6561, 81; 1, 729, 9; 27, 3, 243. What no symmetry changes
    is left out: R33 and R11 + R22. On the grid numbers differ by 1 or more, so that roundings of
    the pose do not matter, except where a symmetry leaves the pose unchanged: then there are
    several such images, which look the same.
    """
    w, x, y, z = q
    xz, yz = 6.0 * fma(2.0 * x, z, w * y), 6.0 * fma(2.0 * y, z, -w * x)
    xy, wz, unlike = 6562.0 * x * y, 6560.0 * w * z, 729.0 * fma(x, x, -y * y)
    as_is, ax, ay = largest(unlike, fma(9.0, xz, _I * i), fma(_J, j, yz), xy - wz)
    # signs of the exchanged coordinates, those of y and x
    swapped, by, bx = largest(-unlike, fma(9.0, yz, _I * j), fma(_J, i, xz), xy + wz)
    better = swapped > as_is
    return Image(
        sign_x=select(better, bx, ax),
        sign_y=select(better, by, ay),
        swapped=select(better, 1.0, 0.0),
    )


@scalar
def turned(q: Quaternion, image: Image) -> Quaternion:
    """Attitude of the image, S R S^T: the axis turns as an axial vector."""
    w, x, y, z = q
    swap = image.swapped > 0.0
    # S times its determinant
    sx, sy = image.sign_x, select(swap, -image.sign_y, image.sign_y)
    x, y = sy * x, select(swap, -sx, sx) * y
    return w, select(swap, y, x), select(swap, x, y), sx * sy * z


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Cell and attitude of the image with 0 <= j <= i, in whole numbers."""
    (i, j), q = cell(y, p), attitude(y)
    r11, r12, r13, r21, r22, r23, r31, r32, r33 = matrix(turned(q, image_of(i, j, q)))
    i, j = whole(min(abs(i), _FAR)), whole(min(abs(j), _FAR))
    return (
        max(i, j),
        min(i, j),
        whole(r11),
        whole(r12),
        whole(r13),
        whole(r21),
        whole(r22),
        whole(r23),
        whole(r31),
        whole(r32),
        whole(r33),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Sides:
    """The sides of the image that is seen."""
    i, j = cell(y, p)
    image = image_of(i, j, attitude(y))
    swap = image.swapped > 0.0
    sense = image.sign_x * image.sign_y
    return Sides(
        first=select(swap, 2.0 - image.sign_y, 1.0 - image.sign_x),
        sense=select(swap, -sense, sense),
    )


@scalar
def turn(a: Any, frame: Any) -> tuple[float]:
    """The side of the world that a side of the image is."""
    side = fma(frame.sense, a[0], frame.first)
    return (fma(-4.0, float(np.floor(0.25 * side)), side),)


CELL = Reduction(
    group="D4",
    frame=(
        "the one of eight images in which the cell has 0 <= j <= i, and on its edges the one with "
        "the largest entries of R."
    ),
    symmetries=(QUARTER_TURN, REFLECTION),
    features=(
        Entry("i", "1", "cells, the larger", 0.0, _FAR),
        Entry("j", "1", "cells, the smaller", 0.0, _FAR),
        *(Entry(f"R{m}{n}", "1", "body to reduced", -1.0, 1.0) for m in "123" for n in "123"),
    ),
    observe=observe,
    Frame=Sides,
    frame_of=frame_of,
    turn=turn,
    formulas="""
        An image is that by a symmetry S of the square, one of ``diag(+-1, +-1)`` with or without
        exchange of x and y: the cell ``S (i, j)``, the attitude ``S R S^T`` with S on the first two
        axes, and a direction d of a roll becomes ``S d``. The image has the largest i, then the
        largest j, then of R the largest R12, R11, R22, R13, R31, R23, R32, R21, compared in this
        order. If several images are equal, any of them is taken. Cell and R are rounded to whole
        numbers.
    """,
)
"""Reduction of `BallGrid`: D4, quarter turns about the vertical through home and reflections."""
