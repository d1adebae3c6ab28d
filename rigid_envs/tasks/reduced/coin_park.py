"""Reduced coordinates of an upright coin relative to its goal."""

import math
from typing import Any, NamedTuple

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import cbrt, fma, select
from rigid_envs.symmetries.coins import ACROSS, ALONG
from rigid_envs.tasks.coins import FAR, Pose, pose
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.reduction import Reduction

__all__ = ["COIN_POSE"]

_ROLL = 4.0  # rad; bound of the roll that is planned
_BEYOND = 10.0  # radii; bound of the missing length


class Signs(NamedTuple):
    """Signs by which X and Y are multiplied; phi is by both, psi by that of X."""

    x: float
    y: float


@scalar
def signs_of(here: Pose) -> Signs:
    """Signs with which the mismatch and Y are positive."""
    return Signs(
        x=select(here.mismatch < 0.0, -1.0, 1.0),
        y=select(here.Y < 0.0, -1.0, 1.0),
    )


@scalar
def signed_root(x: float) -> float:
    """Square root of abs(x) with the sign of x."""
    root = math.sqrt(abs(x))
    return select(x < 0.0, -root, root)


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Pose, and a plan of two straight rolls, the first of them along the present heading.

    Rolls by a and b, with the headings phi and phi_2, lead from the offset D to the goal with
    a + b = -psi = S if ``a = (S^2 - D^2) / (2 (S - D . u))``, u along the heading: the first point
    on the straight line from which the goal is -b away.
    """
    here = pose(y, p)
    sign = signs_of(here)
    turned = sign.x * sign.y
    X, Y = sign.x * min(max(here.X, -FAR), FAR), min(abs(here.Y), FAR)
    heading, phase = turned * here.heading, sign.x * here.phase
    cosine, sine = 2.0 * fma(y.w, y.x, -y.y * y.z), 2.0 * turned * fma(y.x, y.z, y.w * y.y)
    mismatch = abs(here.mismatch)
    square = fma(X, X, Y * Y)
    ahead, aside = fma(X, cosine, Y * sine), fma(Y, cosine, -X * sine)
    room = -phase - ahead
    missing = fma(phase, phase, -square)
    # a quotient that is bounded and changes its sign where S = D . u
    first = 0.5 * missing * room / max(room * room, 1e-4)
    first = min(max(first, -_ROLL), _ROLL)
    return (
        X,
        Y,
        math.sqrt(square),
        heading,
        cosine,
        sine,
        phase,
        2.0 * fma(y.w, y.x, y.y * y.z),
        2.0 * sign.x * fma(y.x, y.z, -y.w * y.y),
        mismatch,
        cbrt(max(mismatch, 1e-30)),
        math.sqrt(Y),
        ahead,
        aside,
        signed_root(aside),
        min(max(room, -_BEYOND), _BEYOND),
        min(max(signed_root(missing), -_BEYOND), _BEYOND),
        first,
    )


@scalar
def turn(a: Any, y: Any, aux: Any, p: Any, c: Any) -> tuple[float, float]:
    """Roll rate and steer rate of the task."""
    sign = signs_of(pose(y, p))
    return sign.x * a[0], sign.x * sign.y * a[1]


_PI, _WIDE = math.pi, 1.5 * FAR

COIN_POSE = Reduction(
    symmetries=(ALONG, ACROSS),
    features=(
        Entry("X / radius", "1", "reduced", -FAR, FAR),
        Entry("Y / radius", "1", "reduced", 0.0, FAR),
        Entry("D", "1", "distance, radii", 0.0, _WIDE),
        Entry("phi", "rad", "reduced", -_PI, _PI),
        Entry("cos phi", "1", "reduced", -1.0, 1.0),
        Entry("sin phi", "1", "reduced", -1.0, 1.0),
        Entry("psi", "rad", "reduced", -_PI, _PI),
        Entry("cos psi", "1", "reduced", -1.0, 1.0),
        Entry("sin psi", "1", "reduced", -1.0, 1.0),
        Entry("m", "rad", "mismatch", 0.0, _PI),
        Entry("cbrt m", "1", "mismatch", 0.0, 1.5),
        Entry("sqrt Y", "1", "radii", 0.0, math.sqrt(FAR)),
        Entry("ahead", "1", "offset along the heading, radii", -_WIDE, _WIDE),
        Entry("aside", "1", "offset across the heading, radii", -_WIDE, _WIDE),
        Entry("sqrt aside", "1", "signed root", -math.sqrt(_WIDE), math.sqrt(_WIDE)),
        Entry("-psi - ahead", "1", "limited", -_BEYOND, _BEYOND),
        Entry("sqrt(psi^2 - D^2)", "1", "signed root, limited", -_BEYOND, _BEYOND),
        Entry("first roll", "rad", "of two", -_ROLL, _ROLL),
    ),
    observe=observe,
    turn=turn,
)
"""Reduction of `CoinPark`: reflections in the plane of the coin at the goal, and across it."""
