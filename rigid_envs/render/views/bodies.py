"""Meshes of bodies in free space, about 2 m long, nominal: e1 is their long axis, e3 the short one.

Each is made once in a process.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from rigid_envs.render.meshes import (
    box,
    cylinder,
    frustum,
    join,
    lathe,
    loop,
    moved,
    tube,
)
from rigid_envs.render.scene import Color, Mesh
from rigid_envs.render.views import palette as look

__all__ = ["book", "brick", "graticule", "satellite", "spin_arrow", "t_handle", "tennis_racket"]

TO_X = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # rotation of z to x
TO_Y = TO_X @ TO_X  # of z to y
HALF_TURN = np.diag([-1.0, -1.0, 1.0])  # about z


@functools.cache
def brick() -> Mesh:
    """Cube of side 1 with six colours."""
    return box(
        (1.0, 1.0, 1.0),
        (look.ORANGE, look.YELLOW, look.SKY, look.BLUE, look.GREEN, look.PURPLE),
    )


@functools.cache
def book() -> Mesh:
    """Book, its spine at -y, the title on +z."""
    cover = [look.BLUE] * 4
    boards = [
        moved(box((1.7, 1.16, 0.05), [*cover, color, color]), (0.0, 0.0, z))
        for z, color in ((0.15, look.BLUE), (-0.15, look.ORANGE))
    ]
    pages = moved(box((1.6, 1.08, 0.25), [look.CREAM]), (0.0, -0.01, 0.0))
    spine = moved(box((1.7, 0.05, 0.25), [look.BLUE]), (0.0, -0.555, 0.0))
    title = moved(box((0.9, 0.22, 0.02), [look.YELLOW]), (0.0, 0.25, 0.18))
    author = moved(box((0.5, 0.1, 0.02), [look.CREAM]), (0.0, -0.2, 0.18))
    back = moved(box((0.4, 0.4, 0.02), [look.CREAM]), (-0.5, -0.25, -0.18))
    return join(*boards, pages, spine, title, author, back)


@functools.cache
def t_handle() -> Mesh:
    """T-handle: crossbar along x, stem along y, its ends of different colours."""
    red = moved(_rod(0.85, 0.13, look.RED), rotation=TO_X)
    blue = moved(_rod(0.85, 0.13, look.SKY), rotation=HALF_TURN @ TO_X)
    stem = moved(_rod(1.0, 0.13, look.GREY), rotation=TO_Y)
    band = moved(cylinder(0.145, 0.16, look.YELLOW, 24), (0.0, 0.72, 0.0), TO_Y)
    return moved(join(red, blue, stem, band), (0.0, -0.2, 0.0))


@functools.cache
def tennis_racket() -> Mesh:
    """Tennis racket: handle towards -x, face across z, the sides of its head in two colours."""
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 25)
    half = np.stack([0.5 * np.sin(angle) + 0.45, 0.4 * np.cos(angle), 0.0 * angle], axis=-1)
    right = tube(half, 0.045, look.RED, 10)
    left = tube(half * (1.0, -1.0, 1.0), 0.045, look.BLUE, 10)
    shaft = moved(frustum(0.04, 0.05, 0.35, look.DARK, 12), (-0.35, 0.0, 0.0), TO_X)
    throat = [
        tube([(-0.06, 0.0, 0.0), (0.12, 0.3 * side, 0.0)], 0.035, look.DARK, 8) for side in (-1, 1)
    ]
    grip = moved(cylinder(0.075, 0.62, look.YELLOW, 16), (-0.62, 0.0, 0.0), TO_X)
    return join(right, left, shaft, *throat, grip, *_strings())


@functools.cache
def satellite() -> Mesh:
    """Satellite: golden body, panels along x, a dish at +z, a nozzle at -z, a red lamp at +y."""
    body = box((0.5, 0.6, 0.5), [look.ORANGE, look.ORANGE, look.YELLOW, look.YELLOW, *_ENDS])
    wings = []
    for side in (-1.0, 1.0):
        arm = moved(cylinder(0.03, 0.2, look.GREY, 10), (0.34 * side, 0.0, 0.0), TO_X)
        cells = [
            moved(box((0.2, 0.62, 0.03), [look.BLUE]), (side * (0.53 + 0.22 * k), 0.0, 0.0))
            for k in range(3)
        ]
        frame = moved(box((0.68, 0.66, 0.02), [look.LIGHT]), (side * 0.75, 0.0, 0.0))
        wings += [arm, frame, *cells]
    dish = moved(lathe(_DISH, look.CREAM, 24), (0.0, 0.0, 0.25))
    nozzle = moved(frustum(0.14, 0.07, 0.15, look.DARK, 20), (0.0, 0.0, -0.39))
    lamp = moved(cylinder(0.07, 0.06, look.RED, 16), (0.0, 0.33, 0.0), TO_Y)
    return join(body, *wings, dish, nozzle, lamp)


@functools.cache
def graticule() -> Mesh:
    """Equator and two meridians of the unit sphere, thin."""
    angle = np.linspace(0.0, 2.0 * math.pi, 60, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
    hoop = loop(circle, 0.004, look.LIGHT, 3)
    return join(hoop, moved(hoop, rotation=TO_X), moved(hoop, rotation=TO_Y))


@functools.cache
def spin_arrow() -> Mesh:
    """Arrow of length 1 along z: an angular velocity that is to be reached."""
    profile = [(0.0, 0.0), (0.035, 0.0), (0.035, 0.84), (0.085, 0.84), (0.0, 1.0)]
    return lathe(profile, look.GREEN, 20)


_ENDS = [look.LIGHT, look.STEEL]
_DISH = [(0.0, 0.0), (0.03, 0.0), (0.05, 0.08), (0.22, 0.18), (0.21, 0.19), (0.0, 0.09)]


def _rod(length: float, radius: float, color: Color) -> Mesh:
    """Round bar from the origin along z, its end rounded."""
    edge = 0.25 * radius
    profile = [(0.0, 0.0), (radius, 0.0), (radius, length - edge), (radius - edge, length)]
    return lathe([*profile, (0.0, length)], color, 24)


def _strings() -> list[Mesh]:
    """Strings of the racket, in the ellipse of its head."""
    strings = []
    for k in range(-4, 5):
        x = 0.1 * k
        y = 0.4 * math.sqrt(1.0 - (x / 0.5) ** 2)
        strings.append(tube([(0.45 + x, -y, 0.0), (0.45 + x, y, 0.0)], 0.008, look.STEEL, 3))
    for k in range(-3, 4):
        y = 0.1 * k
        x = 0.5 * math.sqrt(1.0 - (y / 0.4) ** 2)
        strings.append(tube([(0.45 - x, y, 0.0), (0.45 + x, y, 0.0)], 0.008, look.STEEL, 3))
    return strings
