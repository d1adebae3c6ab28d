"""The herpolhode: the inertia ellipsoid rolls on the invariable plane."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.analytic import free_body as theory
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.space import Camera, arrow, bare, circle, curve
from rigid_envs.gallery.style import BLUE, GRID, MUTED, RED, SURFACE
from rigid_envs.systems import FreeBody, Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["HERPOLHODE"]

Array = npt.NDArray[np.float64]
_BODY, _OMEGA = FreeBody(1.0, 2.0, 3.0), np.array([0.75, 0.1, 0.56])
_PERIODS = 4.0
_EYE = Camera(-40.0, 11.0)


def draw(figure: Figure) -> tuple[Number, ...]:
    """Simulate the contact point and compare it with the elliptic integral of its angle."""
    measures = theory.poinsot(_BODY.moments, _OMEGA)
    t = np.linspace(0.0, _PERIODS * measures.period, 1801)
    motion = _BODY.simulate(_BODY.state(omega_body=_OMEGA), t)
    frame = _plane_axes(motion)
    in_plane = motion["omega_world"] @ frame.T  # third entry: minus the distance of the plane
    radius, angle = theory.herpolhode(t, _BODY.moments, _OMEGA)
    # the picture has L pointing down, so that angles about L run the other way round
    closed = radius[:, None] * np.stack([np.cos(angle), -np.sin(angle)], axis=-1)
    left, right = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    _draw_rolling(left, motion, frame, measures)
    _draw_plane(right, in_plane, closed, measures)
    figure.legend(ncols=5, columnspacing=1.2)
    error = float(np.max(np.abs(in_plane[:, :2] - closed)))
    distance = float(np.max(np.abs(-in_plane[:, 2] - measures.distance)))
    return (
        Number("largest error of the contact against the closed form", error, 0.0, 1e-8, "rad/s"),
        Number("change of the distance of the plane, 2 T / |L|", distance, 0.0, 1e-9, "rad/s"),
    )


def _plane_axes(motion: Trajectory) -> Array:
    """Axes of the picture, rows: along the first contact, across it, and against L."""
    L = motion["L_world"][0]
    up = -L / np.linalg.norm(L)
    omega = motion["omega_world"][0]
    first = omega - (omega @ up) * up
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(up, first), up])


def _draw_rolling(axes: Axes, motion: Trajectory, frame: Array, measures: theory.Poinsot) -> None:
    """The ellipsoid of inertia at the start, on its plane."""
    bare(axes)
    axes.set_title("the ellipsoid rolls on the invariable plane")
    scale = np.sqrt(2.0 * measures.energy)
    turn = frame @ rotations.matrix_from_quaternion(motion["q"][0])
    tensor = turn @ np.diag(_BODY.moments) @ turn.T
    plane = -measures.ellipsoid_distance
    corners = 0.98 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    axes.fill(*_EYE.project(np.insert(corners, 2, plane, axis=1)).T, fc="#f7f3ec", ec="#d8cdb8")
    _draw_ellipsoid(axes, turn, tensor)
    polhode = motion["omega_body"] / scale @ turn.T
    curve(axes, _EYE, polhode, _EYE.faces(polhode, tensor), faint=0.6, color=BLUE, label="polhode")
    herpolhode = motion["omega_world"] / scale @ frame.T
    seen = ~_EYE.behind(herpolhode, tensor)
    curve(axes, _EYE, herpolhode, seen, faint=0.6, color=RED, lw=1.2, label="herpolhode")
    axes.plot(*_EYE.project(herpolhode[0]), "o", color="black", ms=5, zorder=6, label="contact")
    arrow(axes, _EYE, [0.0, 0.0, plane], [0.0, 0.0, 1.35 * plane], "L", color=MUTED)


def _draw_ellipsoid(axes: Axes, turn: Array, tensor: Array) -> None:
    semi_axes = 1.0 / np.sqrt(_BODY.moments)
    rim = circle(_EYE.axes[2] @ turn / semi_axes, 1.0, np.zeros(3)) * semi_axes @ turn.T
    axes.fill(*_EYE.project(rim).T, fc=SURFACE, ec=MUTED, lw=0.9, alpha=0.6, zorder=2)
    for axis in np.eye(3):
        ring = circle(axis, 1.0, np.zeros(3)) * semi_axes @ turn.T
        page = np.where(_EYE.faces(ring, tensor)[:, None], _EYE.project(ring), np.nan)
        axes.plot(*page.T, color="#c3cbd6", lw=0.8, zorder=2.2)


def _draw_plane(axes: Axes, simulated: Array, closed: Array, measures: theory.Poinsot) -> None:
    axes.set_aspect("equal")
    axes.set_anchor("N")
    axes.set_title("herpolhode, seen along L [rad/s]")
    for size in (measures.radius_min, measures.radius_max):
        axes.plot(*circle([0.0, 0.0, 1.0], size, np.zeros(3))[:, :2].T, color=MUTED, lw=0.9, ls=":")
    axes.plot(*simulated[:, :2].T, color=RED, lw=1.2)
    axes.plot(*closed[::40].T, "o", ms=2.6, color="black", label="closed form", zorder=4)
    axes.plot(0.0, 0.0, "+", color=MUTED)
    axes.grid(color=GRID)


HERPOLHODE = Entry(
    name="herpolhode",
    title="Herpolhode: the ellipsoid of inertia rolls without slipping",
    caption="Poinsot's construction for the moments 1, 2, 3: the ellipsoid, its centre at rest, "
    "rolls on a plane across the constant L. The contact draws the polhode on the ellipsoid "
    "and the herpolhode on the plane, between two circles (dotted), and never turns back.",
    law="omega . L / |L| = 2 T / |L|;  contact = omega / sqrt(2 T)",
    source="Goldstein, section 5.6; Landau & Lifshitz, Mechanics, section 37",
    draw=draw,
    size=(7.2, 4.3),
)
