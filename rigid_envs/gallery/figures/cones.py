"""Body and space cones of a frisbee and a football."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from rigid_envs.analytic import free_body as theory
from rigid_envs.bodies import Body, american_football, frisbee
from rigid_envs.gallery.entry import Entry, Number
from rigid_envs.gallery.space import Camera, arrow, bare, circle
from rigid_envs.gallery.style import BLUE, GREEN, INK, MUTED, RED
from rigid_envs.systems import FreeBody

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["CONES"]

Array = npt.NDArray[np.float64]
_EYE = Camera(-90.0, 16.0)
_SPIN, _TURNS = 2.0 * math.pi, 20.0  # rad/s about the axis of symmetry; turns that are simulated
_UP = np.array([0.0, 0.0, 1.0])


def draw(figure: Figure) -> tuple[Number, ...]:
    """Draw both pairs of cones at the first moment; measure how fast the axis circles L."""
    left, right = figure.subplots(1, 2)
    numbers = (
        _thrown(left, "frisbee", frisbee(), 0.45, _draw_disk),
        _thrown(right, "football", american_football(), 0.45, _draw_spheroid),
    )
    left.set_title("frisbee: I3 > I1, space cone inside")
    right.set_title("football: I3 < I1, space cone outside")
    for color, text in ((BLUE, "body cone, rolls"), (RED, "space cone, at rest")):
        figure.axes[0].plot([], [], color=color, lw=5, alpha=0.5, label=text)
    figure.legend(ncols=2)
    return numbers


def _thrown(axes: Axes, name: str, body: Body, part: float, sketch: object) -> Number:
    """Cones of a body with the axis e3, with a rate `part` of its spin across it."""
    moments = np.diag(body.inertia)
    system = FreeBody(*moments.tolist())
    omega0 = _SPIN * np.array([part, 0.0, 1.0])
    cones = theory.symmetric_cones(moments, omega0)
    t = np.linspace(0.0, _TURNS * 2.0 * math.pi / _SPIN, 2001)
    motion = system.simulate(system.state(omega_body=omega0), t)
    L = motion["L_world"][0] / np.linalg.norm(motion["L_world"][0])
    axis = motion["R"][:, :, 2]
    across, beside = axis - np.outer(axis @ L, L), np.cross(L, axis[0])
    angle = np.unwrap(np.arctan2(across @ beside, across @ np.cross(beside, L)))
    rate = (angle[-1] - angle[0]) / (t[-1] * _SPIN)
    _draw_cones(axes, cones, sketch)
    exact = cones.space_rate / _SPIN
    return Number(f"{name}: wobbles of the axis per turn of omega3", float(rate), exact, 1e-9)


def _draw_cones(axes: Axes, cones: theory.Cones, sketch: object) -> None:
    """L upwards; e3 and omega in the plane of the page."""
    bare(axes)
    e3 = _lean(cones.tilt)
    omega = _lean(cones.tilt - cones.body_angle)
    sketch(axes, e3)  # type: ignore[operator]
    _cone(axes, e3, cones.body_angle, BLUE)
    _cone(axes, _UP, cones.space_angle, RED)
    arrow(axes, _EYE, np.zeros(3), 1.3 * _UP, "L", MUTED)
    arrow(axes, _EYE, np.zeros(3), 1.3 * e3, "e3", INK)
    arrow(axes, _EYE, np.zeros(3), 1.3 * omega, "omega", GREEN)
    axes.margins(y=0.12)


def _lean(angle: float) -> Array:
    return np.array([math.sin(angle), 0.0, math.cos(angle)])


def _cone(axes: Axes, axis: Array, half_angle: float, color: str) -> None:
    """Rim and mantle of a cone with its tip in the origin."""
    rim = circle(axis, math.sin(half_angle), math.cos(half_angle) * axis)
    page = _EYE.project(rim)
    angle = np.unwrap(np.arctan2(page[:, 0], page[:, 1]))
    ends = page[[int(np.argmin(angle)), int(np.argmax(angle))]]
    axes.fill(*np.array([ends[0], [0.0, 0.0], ends[1]]).T, color=color, alpha=0.22, lw=0, zorder=2)
    axes.fill(*page.T, fc=color, ec="none", alpha=0.18, zorder=2)
    axes.plot(*np.array([ends[0], [0.0, 0.0], ends[1]]).T, color=color, lw=1.2, zorder=3)
    axes.plot(*page.T, color=color, lw=1.2, zorder=3)


def _draw_disk(axes: Axes, e3: Array) -> None:
    for height, color in ((-0.10, "#c9d1db"), (0.0, "#dfe5ec")):
        rim = circle(e3, 0.8, height * e3)
        axes.fill(*_EYE.project(rim).T, fc=color, ec="#9aa5b3", lw=0.8, zorder=1)


def _draw_spheroid(axes: Axes, e3: Array) -> None:
    a, b = 0.85, 0.5  # half length and half width
    t = np.linspace(0.0, 2.0 * math.pi, 181)
    side = np.array([e3[2], 0.0, -e3[0]])
    outline = a * np.cos(t)[:, None] * e3 + b * np.sin(t)[:, None] * side
    axes.fill(*_EYE.project(outline).T, fc="#ecd9c6", ec="#b39272", lw=0.9, zorder=1)
    for height in (-0.45, 0.0, 0.45):
        ring = circle(e3, b * math.sqrt(1.0 - height**2), a * height * e3)
        near = np.where((ring @ _EYE.axes[2] <= 0.0)[:, None], np.nan, _EYE.project(ring))
        axes.plot(*near.T, color="#cdb196", lw=0.7, zorder=1.2)


CONES = Entry(
    name="cones",
    title="Body and space cones of a frisbee and a football",
    caption="The body cone, fixed to the body, rolls without slipping on the space cone about the "
    "constant L; they touch along omega. A frisbee (oblate) wobbles about twice as fast as it "
    "spins, a football (prolate) more slowly.",
    law="wobble of e3 about L: |L| / I1;  of omega in the body: (I3 - I1) / I1 omega3",
    source="Goldstein, section 5.6; Landau & Lifshitz, Mechanics, sections 33 and 35; moments: "
    "Hummel 2003 (frisbee), rules of the NFL (football)",
    draw=draw,
    size=(7.2, 4.1),
)
