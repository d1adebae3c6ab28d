"""Figures of the gallery: rest in the orbit under the gravity gradient."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.systems.satellite import closed_forms as theory
from rigid_envs.systems.satellite.system import Satellite
from rigid_envs.watch.figures import BLACK, BLUE, GREEN, ORANGE, RED, Match, exhibit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Pair = tuple[float, float]

# Bodies at rest in the orbit, with roll, pitch and yaw about e1, e2 and e3: e1 along the velocity,
# e2 along the orbit's normal, e3 along the vertical.

_REST = np.array([0.5, 0.5, 0.5, 0.5])  # attitude at latitude 0
_ORBITS = 6
_BODIES: tuple[Pair, Pair, Pair] = ((0.7, 0.25), (-0.05, -0.5), (0.45, -0.4))
_DEPARTURE = 1e-4  # rad


@exhibit(
    title="Rest in the orbit",
    caption="A body on a circular orbit can rest with axes along velocity, normal and vertical. "
    "Left: the shapes for which this is stable, by the ratios of the moments about roll, pitch and "
    "yaw. Green: the moment about the normal is the largest, that about the vertical the least. "
    "Blue: the region of DeBra and Delp, at a maximum of the energy, where damping destroys it. "
    "Right: pitch, which librates and tumbles, and small departures of the three bodies marked on "
    "the left.",
    law="pitch: theta'' = -(3/2) n^2 ((I1 - I3) / I2) sin 2 theta;  roll and yaw: "
    "x^2 + (1 + 3 k1 + k1 k3) x + 4 k1 k3 = 0, x = (lambda / n)^2",
    source="DeBra & Delp 1961, Journal of the Astronautical Sciences 8:14; Hughes, Spacecraft "
    "Attitude Dynamics, ch. 9",
    size=(7.2, 4.6),
)
def gravity_gradient(
    figure: Figure, *, shapes: tuple[Pair, Pair, Pair] = _BODIES, n: float = 1.0
) -> tuple[Match, ...]:
    """Draw the stable shapes, simulate pitch, and departures from rest of three bodies.

    Args:
        figure: empty.
        shapes: k1 = (I2 - I3) / I1 and k3 = (I2 - I1) / I3 of each; the first is that of the pitch
            motions, the last one unstable.
        n: mean motion [rad/s].
    """
    panels = figure.add_gridspec(2, 2, width_ratios=(1.25, 1.0))
    _draw_map(figure.add_subplot(panels[:, 0]), shapes)
    bodies = [_body(*shape, n) for shape in shapes]
    pitch_error = _draw_pitch(figure.add_subplot(panels[0, 1]), bodies[0])
    growth, exponent = _draw_departures(figure.add_subplot(panels[1, 1]), bodies)
    return (
        Match("largest error of pitch against Jacobi functions", pitch_error, 0.0, 1e-9, "rad"),
        # of departures up to 0.05 rad, whose squares are left out
        Match("growth of the unstable departure", growth, exponent, 0.02 * exponent, "1/s"),
    )


def _body(k1: float, k3: float, n: float) -> Satellite:
    """The body of two ratios with I1 = 1 kg m^2."""
    I3 = (1.0 - k1) / (1.0 - k3)
    return Satellite(1.0, I3 + k1, I3, n=n, b=0.0)


def _draw_map(axes: Axes, shapes: tuple[Pair, ...]) -> None:
    """Regions of stability in the plane of both ratios, and the bodies."""
    axes.fill([0.0, 1.0, 1.0], [0.0, 0.0, 1.0], color=GREEN, alpha=0.35, lw=0.0)
    k1, k3 = np.linspace(-0.2, 0.0, 81)[:-1], np.linspace(-1.0, 0.0, 102)[1:-1]
    regions = [[theory.librations(_body(x, z, 1.0).moments, 1.0).region for x in k1] for z in k3]
    stable = np.array(regions) == "DeBra-Delp"
    axes.contourf(k1, k3, stable, levels=(0.5, 1.5), colors=(BLUE,), alpha=0.35)
    axes.plot([-1.0, 1.0], [-1.0, 1.0], color=BLACK, lw=0.8, ls=":")
    axes.text(-0.62, 0.3, "pitch unstable", ha="center")
    axes.text(0.45, -0.72, "roll and yaw\nunstable", ha="center", va="center")
    for shape, color in zip(shapes, (GREEN, BLUE, RED), strict=True):
        axes.plot(*shape, "o", color=color, ms=7.0, mec="white")
    axes.axhline(0.0, color=BLACK, lw=0.5), axes.axvline(0.0, color=BLACK, lw=0.5)
    axes.set_aspect("equal")
    axes.set_xlim(-1.0, 1.0), axes.set_ylim(-1.0, 1.0)
    axes.set_xticks([-1.0, -0.5, 0.0, 0.5, 1.0]), axes.set_yticks([-1.0, -0.5, 0.0, 0.5, 1.0])
    axes.set_xlabel("k1 = (I2 - I3) / I1"), axes.set_ylabel("k3 = (I2 - I1) / I3")
    axes.set_title("shapes that can rest")


def _draw_pitch(axes: Axes, body: Satellite) -> float:
    """Pitch motions from the stable orientation, and the separatrix; the largest error [rad]."""
    p = math.sqrt(-theory.librations(body.moments, body.n).pitch_squared)
    t, errors = np.linspace(0.0, 2.0 * np.pi / body.n, 241), []
    for share in (0.35, 0.7, 0.95, 1.15, 1.5):
        for rate in (share * p, -share * p):
            start = body.state(q=_REST, omega_body=[0.0, body.n + rate, 0.0])
            motion = body.simulate(start, t)
            turned = 2.0 * np.unwrap(np.arctan2(*_about_normal(motion.y, body.n * t)))
            angle, speed = turned - turned[0], motion["omega_body"][:, 1] - body.n
            exact, _ = theory.pitch(t, 0.0, rate, moments=body.moments, n=body.n)
            errors.append(np.max(np.abs(angle - exact)))
            color = GREEN if share < 1.0 else ORANGE
            for shift in (-np.pi, 0.0, np.pi):
                axes.plot(np.degrees(angle + shift), speed / body.n, color=color, lw=1.1)
    theta = np.linspace(-2.0 * np.pi, 2.0 * np.pi, 401)
    for sense in (1.0, -1.0):
        edge = sense * p / body.n * np.abs(np.cos(theta))
        axes.plot(np.degrees(theta), edge, color=RED, lw=1.6)
    axes.set_xlim(-180.0, 180.0)
    axes.set_xticks(range(-180, 181, 90))
    axes.set_title("pitch [deg] and its rate over n")
    return float(max(errors))


def _about_normal(y: Array, orbit: Array) -> tuple[Array, Array]:
    """Sine and cosine of half of the turn about the normal, beyond that of the orbit."""
    w, _, _, z = rotations.multiply(y[:, :4], rotations.conjugate(_at_rest(orbit))).T
    return z, w


def _at_rest(orbit: Array) -> Array:
    """Attitude at rest by the angle in the orbit [rad], shape (..., 4)."""
    return rotations.multiply(rotations.exp(np.multiply.outer(orbit, [0.0, 0.0, 1.0])), _REST)


def _draw_departures(axes: Axes, bodies: list[Satellite]) -> Pair:
    """Angle from rest of each body; growth of the last one, found and of the theory [1/s]."""
    orbit = np.linspace(0.0, _ORBITS * 2.0 * np.pi, 1201)
    found = [_departure(body, orbit) for body in bodies]
    for angle, color in zip(found, (GREEN, BLUE, RED), strict=True):
        axes.semilogy(orbit / (2.0 * np.pi), angle, color=color, lw=1.1)
    axes.set_title("departure [rad], by orbits")
    grown = (found[-1] > 100.0 * _DEPARTURE) & (found[-1] < 0.05)
    n, last = bodies[-1].n, theory.librations(bodies[-1].moments, bodies[-1].n)
    growth = n * float(np.polyfit(orbit[grown], np.log(found[-1][grown]), 1)[0])
    return growth, max(float(np.sqrt(complex(x)).real) for x in last.roll_yaw_squared)


def _departure(body: Satellite, orbit: Array) -> Array:
    """Angle from rest of a body that starts beside it [rad], by the angle in the orbit."""
    tilt = rotations.exp(_DEPARTURE * np.array([1.0, 0.0, 1.0]) / math.sqrt(2.0))
    start = body.state(q=rotations.multiply(_REST, tilt), omega_body=[0.0, body.n, 0.0])
    q = body.simulate(start, orbit / body.n).y[:, :4]
    off = rotations.multiply(rotations.conjugate(_at_rest(orbit)), q)
    return np.asarray(np.linalg.norm(rotations.log(off), axis=-1))
