"""Reduced coordinates of a tumbling body that impulses bring to rest: `Detumble`.

Impulses are given in the frame of the angular momentum: against L, along the direction in which L
moves in the body, and across both. The half turns of the body about its axes change the signs of L
in pairs; what they keep is seen. The moments are the middles of their ranges.
"""

import math
from typing import Any, NamedTuple

from rigid_envs.kernels.actions import single
from rigid_envs.kernels.algebra import Row, Vector, cross, dot, scaled
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma, log, select
from rigid_envs.symmetries.bodies import HALF_TURN_1, HALF_TURN_2, ROTATION
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.free_bodies import observed_rates
from rigid_envs.tasks.reduction import Reduction

__all__ = ["MOMENTUM"]

_FAR = 100.0  # bound of the momentum
_LARGE = 1e8  # bound of the momentum in tolerances
_LOG_LARGE = 18.5  # just above its logarithm
_SHORT = 1e-9  # a shorter vector has no direction


class Axes(NamedTuple):
    """Direction n of the angular momentum; cosine and sine of its motion in the plane across n."""

    n1: float
    n2: float
    n3: float
    cosine: float
    sine: float


@scalar
def momentum(omega: Vector, c: Any) -> tuple[Vector, float]:
    """Direction of the angular momentum in the body, e3 where it is zero, and its norm [N m s]."""
    L = (c.middle1 * omega[0], c.middle2 * omega[1], c.middle3 * omega[2])
    norm = math.sqrt(dot(L, L))
    none = norm < _SHORT * c.start_momentum
    n = scaled(1.0 / select(none, 1.0, norm), L)
    return (select(none, 0.0, n[0]), select(none, 0.0, n[1]), select(none, 1.0, n[2])), norm


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Norm of the angular momentum, and what the half turns keep of its direction."""
    n, norm = momentum(observed_rates(y, 1.0), c)
    steps, part = norm / c.impulse, norm / c.start_momentum
    return (
        min(part, _FAR),
        min(steps, 1.0),
        min(steps, _FAR),
        log(min(1.0 + part / c.tolerance, _LARGE)),
        abs(n[0]),
        abs(n[1]),
        abs(n[2]),
        3.0 * math.sqrt(3.0) * n[0] * n[1] * n[2],
    )


@scalar
def across(n: Vector) -> tuple[Vector, Vector]:
    """Two directions across n and each other, for every n."""
    side = select(n[2] < 0.0, -1.0, 1.0)
    g = -1.0 / (side + n[2])
    h = n[0] * n[1] * g
    b = (fma(side * n[0] * n[0], g, 1.0), side * h, -side * n[0])
    d = (h, fma(n[1] * n[1], g, side), -n[1])
    return b, d


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Axes:
    """Axes along L and along its change in the body, ``L' = L x omega``."""
    omega = (y.omega1, y.omega2, y.omega3)
    n, _ = momentum(omega, c)
    b, d = across(n)
    moving = cross(n, omega)
    x, z = dot(b, moving), dot(d, moving)
    length = math.sqrt(fma(x, x, z * z))
    still = length < _SHORT
    inverse = 1.0 / select(still, 1.0, length)
    cosine, sine = select(still, 1.0, x * inverse), select(still, 0.0, z * inverse)
    return Axes(n[0], n[1], n[2], cosine, sine)


@scalar
def turn(a: Any, frame: Any) -> tuple[float, float, float]:
    """Impulse about the axes of the body."""
    b, d = across((frame.n1, frame.n2, frame.n3))
    along = fma(frame.cosine, a[1], -frame.sine * a[2])
    aside = fma(frame.sine, a[1], frame.cosine * a[2])
    return (
        single(fma(along, b[0], fma(aside, d[0], -a[0] * frame.n1))),
        single(fma(along, b[1], fma(aside, d[1], -a[0] * frame.n2))),
        single(fma(along, b[2], fma(aside, d[2], -a[0] * frame.n3))),
    )


MOMENTUM = Reduction(
    group="SO(3) x V4",
    frame="first axis against the angular momentum, second along its change in the body.",
    symmetries=(ROTATION, HALF_TURN_1, HALF_TURN_2),
    features=(
        Entry("L / start_momentum", "1", "norm", 0.0, _FAR),
        Entry("L / impulse, up to 1", "1", "norm", 0.0, 1.0),
        Entry("L / impulse", "1", "norm", 0.0, _FAR),
        Entry("log L", "1", "log(1 + L / tolerance)", 0.0, _LOG_LARGE),
        *(Entry(f"abs L{k} / L", "1", "body", 0.0, 1.0) for k in (1, 2, 3)),
        Entry("L1 L2 L3 / L^3", "1", "body, over the largest", -1.0, 1.0),
    ),
    observe=observe,
    Frame=Axes,
    frame_of=frame_of,
    turn=turn,
    formulas="""
    With `L = I omega`, in the entries of omega limited to +-20, and n = L / |L|, e3 where |L| <
    1e-9 start_momentum. Entries: |L| / start_momentum, |L| / impulse up to 1 and up to 100, `log(1
    + |L| / (tolerance start_momentum))` with an argument up to 1e8, |n1|, |n2|, |n3|, and `3
    sqrt(3) n1 n2 n3`.

    The action a acts as `-a1 n + a2 b + a3 n x b` with b along `n x omega`. Where `|n x omega| <
    1e-9`, `b = (1 - S n1^2 / (S + n3), -S n1 n2 / (S + n3), -S n1)`, S = -1 where n3 < 0, else 1.
    """,
)
"""Reduction of `Detumble`: SO(3), turns in space, times the half turns about the three axes.

In the frame of L the norm of L does not depend on where L points: a step makes it ``|L + j|``.
"""
