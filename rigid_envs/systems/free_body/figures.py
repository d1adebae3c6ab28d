"""Figures of the gallery: free motion."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, cast

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.bodies.body import Body
from rigid_envs.mechanics.bodies.named import american_football, book, earth, frisbee, tennis_racket
from rigid_envs.mechanics.integration import Trajectory
from rigid_envs.systems.free_body import closed_forms as theory
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.watch.figures import (
    BLACK,
    BLUE,
    GREEN,
    GRID,
    INK,
    MUTED,
    RED,
    SURFACE,
    Eye,
    Match,
    arrow,
    bare,
    circle,
    curve,
    exhibit,
    solid,
    surface_grid,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# A racket and a book, thrown about each of their three axes.

_RACKET_EYE = Eye(-62.0, 28.0)
_RACKET_SPIN = 4.0 * math.pi  # rad/s: two turns per second
_PART = 0.02  # of it, about the others
_AXES = ("least moment", "intermediate moment", "largest moment")


@exhibit(
    title="Racket and book, thrown about their three axes",
    caption="Two turns per second about one axis and 2 % of that about the others. About the "
    "axes of the least and the largest moment the throw is steady, about the intermediate axis "
    "racket and book turn over: the cosine of the angle between the axis and L goes from 1 to -1.",
    law="growth rate = omega sqrt((I2 - I1)(I3 - I2) / (I1 I3));  flip interval 2 K(m) / p",
    source="Goldstein, section 5.6; Ashbaugh, Chicone & Cushman 1991, doi:10.1007/BF01049489",
    size=(7.2, 4.6),
)
def racket(
    figure: Figure, *, spin: float = _RACKET_SPIN, part: float = _PART, duration: float = 3.0
) -> tuple[Match, ...]:
    """Simulate six throws; compare the flips about the intermediate axis with theory.

    Args:
        figure: empty.
        spin: about one axis [rad/s].
        part: of it, about the two others.
        duration: of a throw [s].
    """
    panels = figure.subplots(2, 3, height_ratios=(1.0, 1.25), sharey="row")
    numbers = []
    for body, name, color in ((tennis_racket(), "racket", BLUE), (book(), "book", RED)):
        for k, axes in enumerate(panels[1]):
            omega0 = spin * np.where(np.arange(3) == k, 1.0, part)
            error = _throw(axes, body, k, omega0, duration, name, color)
            if k == 1:
                numbers.append(error)
    for k, (sketch, axes) in enumerate(panels.T):
        bare(sketch)
        sketch.set_title(f"e{k + 1}: {_AXES[k]}", loc="center")
        _draw_racket(sketch, k)
        _draw_book(sketch, k)
        sketch.set_xlim(-0.72, 0.72), sketch.set_ylim(-0.34, 0.36)
        axes.set_ylim(-1.12, 1.12), axes.set_xlim(0.0, duration)
        axes.set_xlabel("time [s]")
    panels[1, 0].set_ylabel("e . L / |L|")
    figure.legend(*panels[1, 0].get_legend_handles_labels(), ncols=2)
    return tuple(numbers)


def _throw(
    axes: Axes, body: Body, k: int, omega0: Array, duration: float, name: str, color: str
) -> Match:
    """Spin about the axis k: cosine of the angle between it and L; the first flip."""
    moments = body.principal().moments
    system = FreeBody(*moments.tolist())
    t = np.linspace(0.0, duration, 601)
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
    return Match(f"{name}: time between flips", found, path.flip_interval, 1e-9, "s")


def _draw_racket(axes: Axes, k: int) -> None:
    """Handle and hoop, and the axis of the spin; sizes in metres, moved to the left."""
    body, move = tennis_racket(), np.array([-0.38, 0.0, 0.0])
    shift = move - body.com
    handle = np.array([[0.0, 0.0, 0.0], [0.0, 0.395, 0.0]]) + shift
    axes.plot(*_RACKET_EYE.project(handle).T, color=INK, lw=3.5, solid_capstyle="round")
    head = _RACKET_EYE.project(circle([0.0, 0.0, 1.0], 0.145, [0.0, 0.54, 0.0]) + shift)
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
        axes.fill(
            *_RACKET_EYE.project(corners * half + move).T, fc=color, ec=MUTED, lw=0.9, zorder=2
        )
    axis = book().principal().axes[:, k]
    inside = float(half @ np.abs(axis))
    _spin_axis(axes, move, axis, inside, (0.42, 0.36, 0.27)[k], RED)


def _spin_axis(
    axes: Axes, centre: Array, axis: Array, inside: float, reach: float, color: str
) -> None:
    """Arrow through a body, towards the eye; what is inside the body is not drawn."""
    way = math.copysign(1.0, float(axis @ _RACKET_EYE.axes[2])) * axis
    back = _RACKET_EYE.project(np.array([centre - reach * way, centre - inside * way]))
    axes.plot(*back.T, color=color, lw=1.8, zorder=1.0)
    arrow(axes, _RACKET_EYE, centre + inside * way, centre + reach * way, "", color, lw=1.8)


# The Dzhanibekov flip: sixty seconds beside the intermediate axis.

_MOMENTS = (1.0, 2.0, 3.0)


@exhibit(
    title="The Dzhanibekov flip",
    caption="Spun about its intermediate axis with a push of 0.01 rad/s on the other two, a body "
    "of the moments 1, 2, 3 turns over again and again, at equal intervals. L^2 is kept to "
    "rounding; the energy error of the integrator stays bounded.",
    law="I omega' = I omega x omega;  flip interval 2 K(m) / p",
    source="Landau & Lifshitz, Mechanics, section 37",
    size=(7.2, 5.0),
)
def flip(
    figure: Figure,
    *,
    moments: tuple[float, float, float] = _MOMENTS,
    omega: npt.ArrayLike = (0.01, 1.0, 0.01),
    duration: float = 60.0,
) -> tuple[Match, ...]:
    """Simulate a minute, compare with Jacobi's functions; spreads of both integrals.

    Args:
        figure: empty.
        moments: principal moments, shape (3,) [kg m^2].
        omega: angular velocity in the body at first, shape (3,) [rad/s].
        duration: of the motion [s].
    """
    t = np.linspace(0.0, duration, 1201)
    body = FreeBody(*moments)
    motion = body.simulate(body.state(omega_body=omega), t)
    simulated, exact = motion["omega_body"], theory.omega(t, moments, omega)
    squares = np.sum(motion["L_body"] ** 2, axis=-1)
    twice = 2.0 * motion["kinetic_energy"]
    top, middle, bottom = figure.subplots(3, 1, sharex=True, height_ratios=(2.6, 1.0, 1.0))
    for k, color in enumerate((BLUE, RED, GREEN)):
        top.plot(t, simulated[:, k], color=color, label=f"omega{k + 1}", zorder=3)
        top.plot(t[::24], exact[::24, k], ".", ms=3.5, color=BLACK, zorder=5)
    top.plot([], [], ".", ms=5, color=BLACK, label="closed form")
    path = theory.polhode(moments, omega)
    first = -path.start / path.rate % path.flip_interval
    for time in np.arange(first, duration, path.flip_interval):
        top.axvline(time, color=MUTED, lw=0.9, ls=":")
    top.set_title("angular velocity in the body [rad/s]; dotted: flips, by the closed form")
    top.set_xlim(0.0, duration)
    figure.legend(ncols=4)
    for axes, values, unit, name in (
        (middle, squares, 1e-15, "L$^2$"),
        (bottom, twice, 1e-12, "2 T"),
    ):
        axes.plot(t, (values / values[0] - 1.0) / unit, color=MUTED, lw=1.0)
        axes.set_title(f"relative change of {name}, in units of {unit:.0e}")
    bottom.set_xlabel("time [s]")
    error = float(np.max(np.abs(simulated - exact)))
    return (
        Match("largest error of omega against Jacobi's functions", error, 0.0, 1e-9, "rad/s"),
        Match("relative spread of L^2", float(np.ptp(squares) / squares[0]), 0.0, 1e-13),
        Match("relative spread of 2 T", float(np.ptp(twice) / twice[0]), 0.0, 1e-9),
    )


# Polhodes on the inertia ellipsoid, with the separatrices.

_POLHODES_EYE = Eye(55.0, 20.0)
_SHARES = ((0.06, 0.22, 0.45, 0.72, 0.93), (0.06, 0.2, 0.42, 0.66, 0.88))
"""Of L^2 between two moments, where 2 T = 1: about e1 and about e3."""


def rates(moments: Array, L_squared: float, side: tuple[float, float]) -> Array:
    """Angular velocity without component along e2, of the energy 2 T = 1 and a given L^2.

    Args:
        moments: principal moments, ascending, shape (3,) [kg m^2].
        L_squared: between the first and the last of them [kg^2 m^4/s^2].
        side: signs of the components along e1 and e3.
    """
    outer = moments[[0, 2]]
    squares = np.linalg.solve(np.stack([outer, outer**2]), [1.0, L_squared])
    first, third = np.asarray(side) * np.sqrt(squares)
    return np.array([first, 0.0, third])


@exhibit(
    title="Polhodes on the inertia ellipsoid",
    caption="Where the angular velocity can go at one energy in a body of the moments 1, 2, 3: "
    "each polhode is the cut of the ellipsoid with a sphere of constant |L|. They circle the axes "
    "of the least and of the largest moment; the two separatrices cross on the intermediate axis "
    "e2. Thin lines are on the far side.",
    law="omega . I omega = 2 T,  |I omega|^2 = L^2;  omega = (a1 cn u, a2 sn u, a3 dn u)",
    source="Landau & Lifshitz, Mechanics, section 37; Goldstein, section 5.6",
    size=(7.2, 5.4),
)
def polhodes(
    figure: Figure, *, moments: tuple[float, float, float] = _MOMENTS
) -> tuple[Match, ...]:
    """Simulate twenty polhodes, compare them with Jacobi's functions.

    Args:
        figure: empty.
        moments: principal moments, ascending, shape (3,) [kg m^2].
    """
    axes = figure.subplots()
    bare(axes)
    I = np.asarray(moments, dtype=np.float64)  # noqa: E741
    semi_axes = 1.0 / np.sqrt(I)
    solid(axes, _POLHODES_EYE, semi_axes)
    surface_grid(axes, _POLHODES_EYE, semi_axes)
    errors = []
    families = ((BLUE, (1.0, 0.1)), (GREEN, (0.1, 1.0)))
    for k, (color, axis) in enumerate(families):
        for level in I[k] + (I[k + 1] - I[k]) * np.array(_SHARES[k]):
            for side in (1.0, -1.0):
                signs = tuple(np.sign(side * np.array(axis)))
                errors.append(_polhode(axes, I, rates(I, level, signs), color))
    _separatrices(axes, I)
    _axes_of_body(axes, semi_axes)
    for color, text in (
        (BLUE, "polhodes about e1, least moment: stable"),
        (GREEN, "polhodes about e3, largest moment: stable"),
        (RED, "separatrices through e2: unstable"),
    ):
        axes.plot([], [], color=color, label=text)
    figure.legend(ncols=1)
    error = max(errors)
    return (Match("largest error of omega against Jacobi's functions", error, 0.0, 1e-9, "rad/s"),)


def _polhode(axes: Axes, moments: Array, omega0: Array, color: str) -> float:
    t, body = np.linspace(0.0, theory.polhode(moments, omega0).period, 241), FreeBody(*moments)
    omega = body.simulate(body.state(omega_body=omega0), t)["omega_body"]
    curve(
        axes,
        _POLHODES_EYE,
        omega,
        _POLHODES_EYE.faces(omega, np.diag(moments)),
        color=color,
        faint=0.13,
    )
    return float(np.max(np.abs(omega - theory.omega(t, moments, omega0))))


def _separatrices(axes: Axes, moments: Array) -> None:
    t = np.linspace(-40.0, 40.0, 801)
    for signs in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
        start = rates(moments, float(moments[1]), signs)
        omega = theory.omega(t, moments, start)
        seen = _POLHODES_EYE.faces(omega, np.diag(moments))
        curve(axes, _POLHODES_EYE, omega, seen, color=RED, lw=2.2, faint=0.2)


def _axes_of_body(axes: Axes, semi_axes: Array) -> None:
    for k, size in enumerate(semi_axes):
        end = np.eye(3)[k]
        arrow(axes, _POLHODES_EYE, size * end, (size + 0.3) * end, f"e{k + 1}", color=INK)


# The herpolhode: the inertia ellipsoid rolls on the invariable plane.

_PLANE_EYE = Eye(-40.0, 11.0)


@exhibit(
    title="Herpolhode: the ellipsoid of inertia rolls without slipping",
    caption="Poinsot's construction for the moments 1, 2, 3: the ellipsoid, its centre at rest, "
    "rolls on a plane across the constant L. The contact draws the polhode on the ellipsoid "
    "and the herpolhode on the plane, between two circles (dotted), and never turns back.",
    law="omega . L / |L| = 2 T / |L|;  contact = omega / sqrt(2 T)",
    source="Goldstein, section 5.6; Landau & Lifshitz, Mechanics, section 37",
    size=(7.2, 4.3),
)
def herpolhode(
    figure: Figure,
    *,
    moments: tuple[float, float, float] = _MOMENTS,
    omega: npt.ArrayLike = (0.75, 0.1, 0.56),
    periods: float = 4.0,
) -> tuple[Match, ...]:
    """Simulate the contact point and compare it with the elliptic integral of its angle.

    Args:
        figure: empty.
        moments: principal moments, shape (3,) [kg m^2].
        omega: angular velocity in the body at first, shape (3,) [rad/s].
        periods: rounds of the polhode.
    """
    measures = theory.poinsot(moments, omega)
    t = np.linspace(0.0, periods * measures.period, 1801)
    body = FreeBody(*moments)
    motion = body.simulate(body.state(omega_body=omega), t)
    frame = _plane_axes(motion)
    in_plane = motion["omega_world"] @ frame.T  # third entry: minus the distance of the plane
    radius, angle = theory.herpolhode(t, moments, omega)
    # the picture has L pointing down, so that angles about L run the other way round
    closed = radius[:, None] * np.stack([np.cos(angle), -np.sin(angle)], axis=-1)
    left, right = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    _draw_rolling(left, motion, frame, measures)
    _draw_plane(right, in_plane, closed, measures)
    figure.legend(ncols=5, columnspacing=1.2)
    error = float(np.max(np.abs(in_plane[:, :2] - closed)))
    distance = float(np.max(np.abs(-in_plane[:, 2] - measures.distance)))
    return (
        Match("largest error of the contact against the closed form", error, 0.0, 1e-8, "rad/s"),
        Match("change of the distance of the plane, 2 T / |L|", distance, 0.0, 1e-9, "rad/s"),
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
    moments = cast(FreeBody, motion.system).moments
    tensor = turn @ np.diag(moments) @ turn.T
    plane = -measures.ellipsoid_distance
    corners = 0.98 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    axes.fill(
        *_PLANE_EYE.project(np.insert(corners, 2, plane, axis=1)).T, fc="#f7f3ec", ec="#d8cdb8"
    )
    _draw_ellipsoid(axes, 1.0 / np.sqrt(moments), turn, tensor)
    polhode = motion["omega_body"] / scale @ turn.T
    curve(
        axes,
        _PLANE_EYE,
        polhode,
        _PLANE_EYE.faces(polhode, tensor),
        faint=0.6,
        color=BLUE,
        label="polhode",
    )
    herpolhode = motion["omega_world"] / scale @ frame.T
    seen = ~_PLANE_EYE.behind(herpolhode, tensor)
    curve(axes, _PLANE_EYE, herpolhode, seen, faint=0.6, color=RED, lw=1.2, label="herpolhode")
    axes.plot(
        *_PLANE_EYE.project(herpolhode[0]), "o", color="black", ms=5, zorder=6, label="contact"
    )
    arrow(axes, _PLANE_EYE, [0.0, 0.0, plane], [0.0, 0.0, 1.35 * plane], "L", color=MUTED)


def _draw_ellipsoid(axes: Axes, semi_axes: Array, turn: Array, tensor: Array) -> None:
    rim = circle(_PLANE_EYE.axes[2] @ turn / semi_axes, 1.0, np.zeros(3)) * semi_axes @ turn.T
    axes.fill(*_PLANE_EYE.project(rim).T, fc=SURFACE, ec=MUTED, lw=0.9, alpha=0.6, zorder=2)
    for axis in np.eye(3):
        ring = circle(axis, 1.0, np.zeros(3)) * semi_axes @ turn.T
        page = np.where(_PLANE_EYE.faces(ring, tensor)[:, None], _PLANE_EYE.project(ring), np.nan)
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


# Body and space cones of a frisbee and a football.

_CONES_EYE = Eye(-90.0, 16.0)
_TURNS = 20.0  # simulated turns about the axis of symmetry
_UP = np.array([0.0, 0.0, 1.0])


@exhibit(
    title="Body and space cones of a frisbee and a football",
    caption="The body cone, fixed to the body, rolls without slipping on the space cone about the "
    "constant L; they touch along omega. A frisbee (oblate) wobbles about twice as fast as it "
    "spins, a football (prolate) more slowly.",
    law="wobble of e3 about L: |L| / I1;  of omega in the body: (I3 - I1) / I1 omega3",
    source="Goldstein, section 5.6; Landau & Lifshitz, Mechanics, sections 33 and 35; moments: "
    "Hummel 2003 (frisbee), rules of the NFL (football)",
    size=(7.2, 4.1),
)
def cones(figure: Figure, *, spin: float = 2.0 * math.pi, part: float = 0.45) -> tuple[Match, ...]:
    """Draw both pairs of cones at the first moment; measure how fast the axis circles L.

    Args:
        figure: empty.
        spin: about the axis of symmetry [rad/s].
        part: of it, across the axis.
    """
    left, right = figure.subplots(1, 2)
    omega0 = spin * np.array([part, 0.0, 1.0])
    numbers = (
        _thrown(left, "frisbee", frisbee(), omega0, _draw_disk),
        _thrown(right, "football", american_football(), omega0, _draw_spheroid),
    )
    left.set_title("frisbee: I3 > I1, space cone inside")
    right.set_title("football: I3 < I1, space cone outside")
    for color, text in ((BLUE, "body cone, rolls"), (RED, "space cone, at rest")):
        figure.axes[0].plot([], [], color=color, lw=5, alpha=0.5, label=text)
    figure.legend(ncols=2)
    return numbers


def _thrown(axes: Axes, name: str, body: Body, omega0: Array, sketch: object) -> Match:
    """Cones of a body with the axis e3."""
    moments = np.diag(body.inertia)
    system = FreeBody(*moments.tolist())
    cones = theory.symmetric_cones(moments, omega0)
    t = np.linspace(0.0, _TURNS * 2.0 * math.pi / float(omega0[2]), 2001)
    motion = system.simulate(system.state(omega_body=omega0), t)
    L = motion["L_world"][0] / np.linalg.norm(motion["L_world"][0])
    axis = motion["R"][:, :, 2]
    across, beside = axis - np.outer(axis @ L, L), np.cross(L, axis[0])
    angle = np.unwrap(np.arctan2(across @ beside, across @ np.cross(beside, L)))
    rate = (angle[-1] - angle[0]) / (t[-1] * omega0[2])
    _draw_cones(axes, cones, sketch)
    exact = cones.space_rate / float(omega0[2])
    return Match(f"{name}: wobbles of the axis per turn of omega3", float(rate), exact, 1e-9)


def _draw_cones(axes: Axes, cones: theory.Cones, sketch: object) -> None:
    """L upwards; e3 and omega in the plane of the page."""
    bare(axes)
    e3 = _lean(cones.tilt)
    omega = _lean(cones.tilt - cones.body_angle)
    sketch(axes, e3)  # type: ignore[operator]
    _cone(axes, e3, cones.body_angle, BLUE)
    _cone(axes, _UP, cones.space_angle, RED)
    arrow(axes, _CONES_EYE, np.zeros(3), 1.3 * _UP, "L", MUTED)
    arrow(axes, _CONES_EYE, np.zeros(3), 1.3 * e3, "e3", INK)
    arrow(axes, _CONES_EYE, np.zeros(3), 1.3 * omega, "omega", GREEN)
    axes.margins(y=0.12)


def _lean(angle: float) -> Array:
    return np.array([math.sin(angle), 0.0, math.cos(angle)])


def _cone(axes: Axes, axis: Array, half_angle: float, color: str) -> None:
    """Rim and mantle of a cone with its tip in the origin."""
    rim = circle(axis, math.sin(half_angle), math.cos(half_angle) * axis)
    page = _CONES_EYE.project(rim)
    angle = np.unwrap(np.arctan2(page[:, 0], page[:, 1]))
    ends = page[[int(np.argmin(angle)), int(np.argmax(angle))]]
    axes.fill(*np.array([ends[0], [0.0, 0.0], ends[1]]).T, color=color, alpha=0.22, lw=0, zorder=2)
    axes.fill(*page.T, fc=color, ec="none", alpha=0.18, zorder=2)
    axes.plot(*np.array([ends[0], [0.0, 0.0], ends[1]]).T, color=color, lw=1.2, zorder=3)
    axes.plot(*page.T, color=color, lw=1.2, zorder=3)


def _draw_disk(axes: Axes, e3: Array) -> None:
    for height, color in ((-0.10, "#c9d1db"), (0.0, "#dfe5ec")):
        rim = circle(e3, 0.8, height * e3)
        axes.fill(*_CONES_EYE.project(rim).T, fc=color, ec="#9aa5b3", lw=0.8, zorder=1)


def _draw_spheroid(axes: Axes, e3: Array) -> None:
    a, b = 0.85, 0.5  # half length and half width
    t = np.linspace(0.0, 2.0 * math.pi, 181)
    side = np.array([e3[2], 0.0, -e3[0]])
    outline = a * np.cos(t)[:, None] * e3 + b * np.sin(t)[:, None] * side
    axes.fill(*_CONES_EYE.project(outline).T, fc="#ecd9c6", ec="#b39272", lw=0.9, zorder=1)
    for height in (-0.45, 0.0, 0.45):
        ring = circle(e3, b * math.sqrt(1.0 - height**2), a * height * e3)
        near = np.where(
            (ring @ _CONES_EYE.axes[2] <= 0.0)[:, None], np.nan, _CONES_EYE.project(ring)
        )
        axes.plot(*near.T, color="#cdb196", lw=0.7, zorder=1.2)


# The free wobble of the Earth's pole: Euler's period, and Chandler's.

_DAY, _SIDEREAL_DAY = 86400.0, 86164.0905  # s
_ARCSECOND = math.pi / 648000.0


@exhibit(
    title="The Earth's body cone: Euler's 304 days and Chandler's 433",
    caption="The body cone of the Earth is 0.2 arcseconds wide: the pole of rotation circles the "
    "axis of figure at a distance of 6 m, once in I1 / (I3 - I1) = 304.5 turns. (The space cone is "
    "300 times narrower.) Chandler found 433 days: the Earth yields. The dashed line has the "
    "observed period, no theory.",
    law="period = 2 pi I1 / ((I3 - I1) omega3)",
    source="Goldstein, section 5.6; moments: IERS Conventions (2010), table 1.1",
    size=(7.2, 3.6),
)
def chandler(figure: Figure, *, wobble: float = 0.2, observed: float = 433.0) -> tuple[Match, ...]:
    """Simulate 500 days of the pole, compare its period with that of the cones.

    Args:
        figure: empty.
        wobble: angle between omega and the axis, as is observed [arcseconds].
        observed: period of the elastic Earth [days].
    """
    moments = np.diag(earth().inertia)
    moments = moments / moments[2]  # only ratios count for motion without torque
    body = FreeBody(*moments.tolist())
    rate = 2.0 * math.pi / _SIDEREAL_DAY
    omega0 = rate * _lean(wobble * _ARCSECOND)
    days = np.linspace(0.0, 500.0, 251)
    motion = body.simulate(body.state(omega_body=omega0), days * _DAY)
    pole = motion["omega_body"][:, :2] / rate / _ARCSECOND
    turned = np.unwrap(np.arctan2(pole[:, 1], pole[:, 0]))
    period = 2.0 * math.pi * days[-1] / (turned[-1] - turned[0])
    exact = theory.chandler_period(omega0[2], i_perp=moments[0], i3=moments[2]) / _DAY
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.35))
    left.set_title("pole of rotation [arcsec]")
    left.set_aspect("equal")
    once = days <= exact
    left.plot(*pole[once].T, color=BLUE)
    for day in range(0, 300, 50):
        place = pole[day // 2]
        left.plot(*place, "o", color=BLUE, ms=4.5)
        left.annotate(f"{day} d", 0.72 * place, ha="center", va="center", fontsize=8, color=MUTED)
    left.plot(0, 0, "+", color=BLACK)
    left.annotate("e3", (0, 0), (6, 5), textcoords="offset points", fontsize=8.5)
    left.set_xticks([-wobble, 0.0, wobble]), left.set_yticks([-wobble, 0.0, wobble])
    right.set_title("component along e1 [arcsec]")
    right.plot(days, pole[:, 0], color=BLUE, label=f"simulated, rigid: {period:.1f} days")
    cosine = wobble * np.cos(2.0 * math.pi * days[::10] / exact)
    right.plot(days[::10], cosine, "o", ms=3, color=BLACK, label="closed form")
    slow = wobble * np.cos(2.0 * math.pi * days / observed)
    right.plot(days, slow, color=RED, ls="--", lw=1.3, label=f"observed: {observed:.0f} days")
    right.set_xlabel("days"), right.set_ylim(-1.15 * wobble, 1.15 * wobble), right.set_xlim(0, 500)
    figure.legend(ncols=3)
    return (Match("period of the rigid Earth's pole", float(period), exact, 1e-8, "days"),)
