"""Figures of the gallery: thrown bodies."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.bodies.named import american_football, frisbee
from rigid_envs.systems.thrown_body import closed_forms as theory
from rigid_envs.systems.thrown_body.system import ThrownBody
from rigid_envs.watch.figures import BLACK, BLUE, GREEN, MUTED, ORANGE, RED, Match, exhibit
from rigid_envs.watch.views import from_z

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# The twist of a racket in one turn of its handle; the wobble of what is thrown with a spin.

THE_RACKET = ThrownBody(0.0012, 0.0164, 0.0176, m=0.33)  # handle e1, normal of the face e3
_MOMENTUM = 0.15  # N m s
_LEANS = np.linspace(-2.0, 2.0, 160)  # degrees; not 0, where the racket never twists


@exhibit(
    title="The tennis-racket twist",
    caption="A racket of 0.33 kg turns over about the axis across its handle, once. It twists "
    "about its handle meanwhile, by nearly half a turn, so that it shows its other face: in the "
    "sense in which L leans towards the handle, over a wide range of leans. With L 10 degrees out "
    "of the plane of the face and a small lean it twists back instead. Right: a thin plate wobbles "
    "twice as fast as it spins, a frisbee nearly so, a football more slowly than it spins.",
    law="cos(theta)^2 = (e - a) / (1 / I1 - a),  a = sin(psi)^2 / I2 + cos(psi)^2 / I3;  "
    "wobble: I3 / (I3 - (I3 - I1) cos(tilt))",
    source="Ashbaugh, Chicone & Cushman 1991, doi:10.1007/BF01049489; Goldstein, section 5.6",
)
def twist(
    figure: Figure,
    *,
    racket: ThrownBody = THE_RACKET,
    angles: tuple[float, float] = (90.0, 80.0),
) -> tuple[Match, ...]:
    """Simulate throws of a racket until its handle has turned once, and wobbles of three bodies.

    Args:
        figure: empty.
        racket: with moments I1 < I2 < I3.
        angles: psi0, from the normal of the face to L as seen along the handle [degrees].
    """
    left, right = figure.subplots(1, 2, width_ratios=(1.4, 1.0))
    twists = [_twists(left, racket, *each) for each in zip(angles, (BLUE, RED), strict=True)]
    left.set_title("twist in one turn of the handle [half turns]"), left.set_xticks(range(-2, 3))
    left.set_xlabel("lean of L to the handle, 90\N{DEGREE SIGN} - theta0 [degrees]")
    left.set_xlim(-2.0, 2.0), left.set_ylim(-1.8, 1.8)
    disk, ball = (np.diag(body.inertia).tolist() for body in (frisbee(), american_football()))
    cases = ("plate", [1.0, 1.0, 2.0], GREEN), ("frisbee", disk, ORANGE), ("football", ball, MUTED)
    wobbles = [_wobbles(right, name, ThrownBody(*moments), color) for name, moments, color in cases]
    right.set_title("wobbles in a turn of a mark"), right.set_xlim(0.0, 90.0)
    right.set_xlabel("tilt of the axis from L [degrees]")
    right.plot([], [], "o", color=BLACK, ms=3.5, label="simulated")
    figure.legend(ncols=6, columnspacing=1.2)
    return (
        Match("largest error of turn and twist of the handle", max(twists), 0.0, 1e-8, "rad"),
        Match("largest error of the wobbles in a turn", max(wobbles), 0.0, 1e-9),
    )


def _twists(axes: Axes, racket: ThrownBody, angle: float, color: str) -> float:
    """Twist by lean for one psi0, and the largest error of simulated throws [rad]."""
    errors, psi0 = [], math.radians(angle)
    starts = np.pi / 2.0 - np.radians(_LEANS)
    exact = [theory.racket_twist(1.0, racket.moments, _MOMENTUM, each, psi0) for each in starts]
    half_turns = np.array([each.psi for each in exact]) / np.pi
    axes.plot(_LEANS, half_turns, color=color, label=f"psi0 = {angle:g}\N{DEGREE SIGN}")
    for k in range(4, len(_LEANS), 8):
        across = math.sin(starts[k])
        L = [math.cos(starts[k]), across * math.sin(psi0), across * math.cos(psi0)]
        R = _flown(racket, _MOMENTUM * np.array(L), exact[k].time)
        turn, psi = _grown(R[:, 0, 0], R[:, 1, 0]), _grown(R[:, 2, 2], R[:, 2, 1])
        axes.plot(_LEANS[k], psi / np.pi, "o", color=BLACK, ms=3.5, zorder=3)
        errors += [abs(turn - 2.0 * np.pi), abs(psi - exact[k].psi)]
    return max(errors)


def _wobbles(axes: Axes, name: str, body: ThrownBody, color: str) -> float:
    """Turns of the axis about L in a turn of a mark, and the largest error of simulated ones."""
    tilts, shape, errors = np.linspace(0.0, 89.0, 179), {"i_perp": body.I1, "i3": body.I3}, []
    axes.plot(tilts, theory.wobble_ratio(np.radians(tilts), **shape), color=color, label=name)
    for tilt in range(5, 90, 10):
        angle = math.radians(tilt)
        L = body.I1 * np.array([math.sin(angle), 0.0, math.cos(angle)])
        R = _flown(body, L, 10.0)
        wobble, spin = _grown(R[:, 0, 2], R[:, 1, 2]), _grown(-R[:, 2, 0], R[:, 2, 1])
        found = wobble / (wobble + spin)  # a mark shows both turns
        axes.plot(tilt, found, "o", color=BLACK, ms=3.5, zorder=3)
        errors.append(abs(found - float(theory.wobble_ratio(angle, **shape))))
    return max(errors)


def _flown(body: ThrownBody, L: Array, time: float) -> Array:
    """Attitudes of a body that begins with L, in body axes, upright in the world: (201, 3, 3)."""
    q = rotations.conjugate(from_z(L / np.linalg.norm(L)))
    start = body.state(q=q, omega_body=L / body.moments)
    return body.simulate(start, np.linspace(0.0, time, 201))["R"]


def _grown(x: Array, y: Array) -> float:
    """By how much the angle of (x, y) grows along a motion [rad]."""
    angle = np.unwrap(np.arctan2(y, x))
    return float(angle[-1] - angle[0])
