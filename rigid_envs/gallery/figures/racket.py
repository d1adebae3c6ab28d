"""A racket and a book, thrown about each of their three axes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rigid_envs.analytic import free_body as theory
from rigid_envs.bodies import Body, book, tennis_racket
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.space import Camera, arrow, bare, circle
from rigid_envs.gallery.style import BLUE, INK, MUTED, RED
from rigid_envs.systems import FreeBody

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["RACKET"]

Array = npt.NDArray[np.float64]
_EYE = Camera(-62.0, 28.0)
_SPIN, _PART = 4.0 * math.pi, 0.02  # rad/s: two turns per second; part of it about the others
_AXES = ("least moment", "intermediate moment", "largest moment")


def draw(figure: Figure) -> tuple[Number, ...]:
    """Simulate six throws; compare the flips about the intermediate axis with theory."""
    panels = figure.subplots(2, 3, height_ratios=(1.0, 1.25), sharey="row")
    numbers = []
    for body, name, color in ((tennis_racket(), "racket", BLUE), (book(), "book", RED)):
        for k, axes in enumerate(panels[1]):
            error = _throw(axes, body, k, color, name)
            if k == 1:
                numbers.append(error)
    for k, (sketch, axes) in enumerate(panels.T):
        bare(sketch)
        sketch.set_title(f"e{k + 1}: {_AXES[k]}", loc="center")
        _draw_racket(sketch, k)
        _draw_book(sketch, k)
        sketch.set_xlim(-0.72, 0.72), sketch.set_ylim(-0.34, 0.36)
        axes.set_ylim(-1.12, 1.12), axes.set_xlim(0.0, 3.0)
        axes.set_xlabel("time [s]")
    panels[1, 0].set_ylabel("e . L / |L|")
    figure.legend(*panels[1, 0].get_legend_handles_labels(), ncols=2)
    return tuple(numbers)


def _throw(axes: Axes, body: Body, k: int, color: str, name: str) -> Number:
    """Spin about the axis k: cosine of the angle between it and L; the first flip."""
    moments = body.principal().moments
    system = FreeBody(*moments.tolist())
    omega0 = _SPIN * np.where(np.arange(3) == k, 1.0, _PART)
    t = np.linspace(0.0, 3.0, 601)
    motion = system.simulate(system.state(omega_body=omega0), t)
    L = motion["L_body"]
    axes.plot(t, L[:, k] / np.linalg.norm(L, axis=-1), color=color, label=name)
    path = theory.polhode(moments, omega0)
    times = np.linspace(0.0, path.period, 4001)
    turning = system.simulate(system.state(omega_body=omega0), times)["omega_body"][:, k]
    zeros = np.flatnonzero(turning[1:] * turning[:-1] < 0.0)
    found = math.nan
    if len(zeros) > 1:
        share = turning[zeros] / (turning[zeros] - turning[zeros + 1])
        first, second = (times[zeros] + share * (times[1] - times[0]))[:2]
        found = float(second - first)
    return Number(f"{name}: time between flips", found, path.flip_interval, 1e-9, "s")


def _draw_racket(axes: Axes, k: int) -> None:
    """Handle and hoop, and the axis of the spin; sizes in metres, moved to the left."""
    body, move = tennis_racket(), np.array([-0.38, 0.0, 0.0])
    shift = move - body.com
    handle = np.array([[0.0, 0.0, 0.0], [0.0, 0.395, 0.0]]) + shift
    axes.plot(*_EYE.project(handle).T, color=INK, lw=3.5, solid_capstyle="round")
    head = _EYE.project(circle([0.0, 0.0, 1.0], 0.145, [0.0, 0.54, 0.0]) + shift)
    axes.fill(*head.T, fc="#eef2f6", ec=INK, lw=2.2)
    _spin_axis(axes, move, body.principal().axes[:, k], 0.0, (0.42, 0.27, 0.27)[k], BLUE)


def _draw_book(axes: Axes, k: int) -> None:
    """A box, twice its size beside the racket."""
    half, move = np.array([0.16, 0.24, 0.03]), np.array([0.38, 0.0, 0.0])
    faces = (
        (np.array([[-1, -1, -1], [1, -1, -1], [1, -1, 1], [-1, -1, 1]]), "#fbfbf8"),
        (np.array([[1, -1, -1], [1, 1, -1], [1, 1, 1], [1, -1, 1]]), "#e9e4da"),
        (np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]), "#f3d9c8"),
    )
    for corners, color in faces:
        axes.fill(*_EYE.project(corners * half + move).T, fc=color, ec=MUTED, lw=0.9, zorder=2)
    axis = book().principal().axes[:, k]
    inside = float(half @ np.abs(axis))
    _spin_axis(axes, move, axis, inside, (0.42, 0.36, 0.27)[k], RED)


def _spin_axis(
    axes: Axes, centre: Array, axis: Array, inside: float, reach: float, color: str
) -> None:
    """Arrow through a body, towards the eye; what is inside the body is not drawn."""
    way = math.copysign(1.0, float(axis @ _EYE.axes[2])) * axis
    back = _EYE.project(np.array([centre - reach * way, centre - inside * way]))
    axes.plot(*back.T, color=color, lw=1.8, zorder=1.0)
    arrow(axes, _EYE, centre + inside * way, centre + reach * way, "", color, lw=1.8)


RACKET = Entry(
    name="racket",
    title="Racket and book, thrown about their three axes",
    caption="Two turns per second about one axis and 2 % of that about the others. About the "
    "axes of the least and the largest moment the throw is steady, about the intermediate axis "
    "racket and book turn over: the cosine of the angle between the axis and L goes from 1 to -1.",
    law="growth rate = omega sqrt((I2 - I1)(I3 - I2) / (I1 I3));  flip interval 2 K(m) / p",
    source="Goldstein, section 5.6; Ashbaugh, Chicone & Cushman 1991, doi:10.1007/BF01049489",
    draw=draw,
    size=(7.2, 4.6),
)
