"""Reduced coordinates of an upright coin relative to its goal."""

import math
from typing import Any, NamedTuple

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import atan2, fma, select
from rigid_envs.symmetries.coins import ACROSS, ALONG
from rigid_envs.tasks.coins import FAR, wrapped
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.reduction import Reduction

__all__ = ["COIN_POSE"]

_ROLL = 4.0  # rad; bound of the roll that is planned
_BEYOND = 10.0  # radii; bound of the missing length


class Signs(NamedTuple):
    """Signs by which roll rate and steer rate are multiplied."""

    roll: float
    steer: float


class Reach(NamedTuple):
    """Offset X, Y [radii], phase psi and mismatch ``X + psi`` [rad], and the signs of the frame.

    X is multiplied by the first sign and Y by the second, psi by that of X, phi by both.
    """

    X: float
    Y: float
    phase: float
    mismatch: float
    sign_x: float
    sign_y: float


@scalar
def reach(y: Any, p: Any) -> Reach:
    """What has to be rolled, and the signs with which the mismatch and Y are positive."""
    scale = 1.0 / p.radius
    X, Y = min(max(scale * y.X, -FAR), FAR), min(max(scale * y.Y, -FAR), FAR)
    phase = atan2(fma(y.x, y.z, -y.w * y.y), fma(y.w, y.x, y.y * y.z))
    mismatch = wrapped(X + phase)
    return Reach(
        X,
        Y,
        phase,
        mismatch,
        sign_x=select(mismatch < 0.0, -1.0, 1.0),
        sign_y=select(y.Y < 0.0, -1.0, 1.0),
    )


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Pose, and a plan of two straight rolls, the first of them along the present heading.

    Rolls by a and b, with the headings phi and phi_2, lead from the offset D to the goal with
    a + b = -psi = S if ``a = (S^2 - D^2) / (2 (S - D . u))``, u along the heading: the first point
    on the straight line from which the goal is -b away.
    """
    here = reach(y, p)
    turned = here.sign_x * here.sign_y
    X, Y = here.sign_x * here.X, abs(here.Y)
    phase, mismatch = here.sign_x * here.phase, abs(here.mismatch)
    cosine, sine = 2.0 * fma(y.w, y.x, -y.y * y.z), 2.0 * turned * fma(y.x, y.z, y.w * y.y)
    ahead, aside = fma(X, cosine, Y * sine), fma(Y, cosine, -X * sine)
    room, missing = -phase - ahead, fma(phase, phase, -fma(X, X, Y * Y))
    # a quotient that is bounded and changes its sign where S = D . u
    first = 0.5 * missing * room / max(room * room, 1e-4)
    root = min(math.sqrt(abs(missing)), _BEYOND)
    return (
        X,
        Y,
        math.sqrt(Y),
        cosine,
        sine,
        phase,
        mismatch,
        math.sqrt(mismatch),
        ahead,
        aside,
        min(max(room, -_BEYOND), _BEYOND),
        select(missing < 0.0, -root, root),
        min(max(first, -_ROLL), _ROLL),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Signs:
    """Signs of the mismatch, and of the mismatch times Y."""
    here = reach(y, p)
    return Signs(here.sign_x, here.sign_x * here.sign_y)


@scalar
def turn(a: Any, sign: Any) -> tuple[float, float]:
    """Roll rate and steer rate of the task."""
    return sign.roll * a[0], sign.steer * a[1]


_WIDE = 1.5 * FAR

COIN_POSE = Reduction(
    group="Z2 x Z2",
    frame="signs such that Y and the mismatch between rolled offset and phase are not negative.",
    symmetries=(ALONG, ACROSS),
    features=(
        Entry("X / radius", "1", "reduced", -FAR, FAR),
        Entry("Y / radius", "1", "reduced", 0.0, FAR),
        Entry("sqrt Y", "1", "radii", 0.0, math.sqrt(FAR)),
        Entry("cos phi", "1", "reduced", -1.0, 1.0),
        Entry("sin phi", "1", "reduced", -1.0, 1.0),
        Entry("psi", "rad", "reduced", -math.pi, math.pi),
        Entry("m", "rad", "mismatch", 0.0, math.pi),
        Entry("sqrt m", "1", "mismatch", 0.0, math.sqrt(math.pi)),
        Entry("ahead", "1", "offset along the heading, radii", -_WIDE, _WIDE),
        Entry("aside", "1", "offset across the heading, radii", -_WIDE, _WIDE),
        Entry("-psi - ahead", "1", "limited", -_BEYOND, _BEYOND),
        Entry("sqrt(psi^2 - D^2)", "1", "signed root, limited", -_BEYOND, _BEYOND),
        Entry("first roll", "rad", "of two", -_ROLL, _ROLL),
    ),
    observe=observe,
    Frame=Signs,
    frame_of=frame_of,
    turn=turn,
    formulas="""
        With x and y the offset in radii, limited to +-50, and m = x + psi within half a turn: a is
        -1 where m < 0, b where y < 0, else 1. x, psi, m and the roll rate are multiplied by a; y by
        b; phi and the steer rate by a b.

        Of what is multiplied: ahead is ``x cos phi + y sin phi``, aside ``y cos phi - x sin phi``,
        and ``D^2 = x^2 + y^2``. With ``h = -psi - ahead`` and ``e = psi^2 - D^2``, the signed root
        is ``sign(e) sqrt(|e|)`` and the first roll ``e h / (2 max(h^2, 0.0001))``, each within its
        bounds.
    """,
)
"""Reduction of `CoinPark`: reflections in the plane of the coin at the goal, and across it."""
