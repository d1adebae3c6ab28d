"""Reduced coordinates of a symmetric top led into steady precession: `TopPrecession`."""

import math
from typing import Any

from rigid_envs.kernels.actions import clip_to_disk, single
from rigid_envs.kernels.algebra import Row, attitude, vertical
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma, sincos
from rigid_envs.symmetries.tops import PHASE, REFLECTION, TURN
from rigid_envs.tasks.entries import Entry
from rigid_envs.tasks.reduced.planar import Frame, axial_seen, frame_along, turned_back
from rigid_envs.tasks.reduced.tops import FRAME_FORMULAS, shares
from rigid_envs.tasks.reduction import Reduction
from rigid_envs.tasks.tops import FAST, precession, steady

__all__ = ["TOP_PRECESSION"]

_NEAR, _CLOSE = 0.3, 0.02  # rad, rad/s


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Frame:
    """x-axis across e3 towards the vertical, in body axes, mirrored so that the spin is positive.

    Of the upright top it is against the direction in which e3 moves.
    """
    G = vertical(attitude(y))
    return frame_along(G[0], G[1], -y.omega2, y.omega1, y.omega3 < 0.0)


@scalar
def observe(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Tilt and rates, their deviations from the goal, momentum and nutation.

    With s, c of the tilt and s*, c* of the goal: the momentum about the vertical is off by
    ``d = s^2 phi' - s*^2 f + gyration omega3 (c - c*)``, which gravity does not change. The tilt
    nutates about its steady value, at the rate Omega near the goal; theta'' is that without torque.
    The parameters may be hidden: those of the middle top are used.
    """
    frame = frame_of(y, aux, p, c)
    G = vertical(attitude(y))
    across, falling, spin = axial_seen(frame, (y.omega1, y.omega2, y.omega3))
    falling = -falling
    tilt, rate = precession(y)
    rate, goal_rate = (
        frame.side * rate,
        frame.side * steady(aux.goal_tilt, y.omega3, p, c.fast_branch),
    )
    goal_sine, goal_cosine = sincos(aux.goal_tilt)
    sine = math.sqrt(fma(G[0], G[0], G[1] * G[1]))
    momentum = c.gyration * spin
    moment = fma(sine, across, -goal_sine * goal_sine * goal_rate)
    moment = fma(momentum, G[2] - goal_cosine, moment)
    bend = fma(across, fma(rate, G[2], -momentum), c.fall_square * sine)
    turn_rate = fma(-2.0 * goal_rate, goal_cosine, momentum)
    wave = math.sqrt(fma(turn_rate, turn_rate, (goal_rate * goal_sine) ** 2))
    bend = bend / max(wave, 1e-3)
    off, late = tilt - aux.goal_tilt, fma(-goal_rate, sine, across)
    return (
        tilt,
        aux.goal_tilt,
        min(spin, FAST) * 0.2,
        goal_rate,
        min(max(across, -2.0), 2.0),
        min(max(falling, -2.0), 2.0),
        *shares(off, late, _NEAR),
        *shares(off, late, _CLOSE),
        *shares(falling, bend, _NEAR),
        *shares(falling, bend, _CLOSE),
        moment / (abs(moment) + _NEAR),
        moment / (abs(moment) + _CLOSE),
    )


@scalar
def turn(a: Any, frame: Any) -> tuple[float, float]:
    """Torque about e1 and e2 of one along the axes of the frame, limited to a disk."""
    (along, left), _ = clip_to_disk((a[0], a[1]))
    x, z = turned_back(frame, along, left)
    return single(frame.side * x), single(frame.side * z)


TOP_PRECESSION = Reduction(
    group="O(2) x SO(2)",
    frame=(
        "across e3 towards the vertical, which turns with the line of nodes, mirrored so that the "
        "spin is not negative. The action is clipped to the disk in the square."
    ),
    symmetries=(TURN, PHASE, REFLECTION),
    features=(
        Entry("theta", "rad", "world", 0.0, math.pi),
        Entry("goal theta", "rad", "world", 0.0, math.pi),
        Entry("|omega3| / 5", "rad/s", "limited", 0.0, 0.2 * FAST),
        Entry("goal phi'", "rad/s", "reduced", -FAST, FAST),
        Entry("phi' sin theta", "rad/s", "reduced, limited", -2.0, 2.0),
        Entry("theta'", "rad/s", "reduced, limited", -2.0, 2.0),
        *(
            Entry(f"share {name}", "1", f"of size of both + {half}", -1.0, 1.0)
            for half in (_NEAR, _CLOSE)
            for name in ("theta - goal", "(phi' - goal) sin theta")
        ),
        *(
            Entry(f"share {name}", "1", f"of size of both + {half}", -1.0, 1.0)
            for half in (_NEAR, _CLOSE)
            for name in ("theta'", "theta'' / Omega")
        ),
        *(
            Entry("share d", "1", f"momentum d about the vertical, of |d| + {half}", -1.0, 1.0)
            for half in (_NEAR, _CLOSE)
        ),
    ),
    observe=observe,
    Frame=Frame,
    frame_of=frame_of,
    turn=turn,
    formulas=f"""
    The x-axis of the frame, in the plane of e1 and e2, is along (R31, R32), along (-omega2, omega1)
    where that is 0, and along e1 where both are 0; {FRAME_FORMULAS} S is -1 where omega3 < 0, else
    1; (c, s) is the x-axis, theta* the goal.

    Rates: `phi' sin(theta)` stands for `v = S (c omega1 + s omega2)`, `theta' = s omega1 - c
    omega2`, phi' is that of *Rewards* times S, as is its goal f, with the drawn parameters. With
    `fall = m g ell / I1` and `M = I3 |omega3| / I1`: `d = sin(theta) v - sin(theta*)^2 f + M
    (cos(theta) - cos(theta*))`, `theta'' = v (phi' cos(theta) - M) + fall sin(theta)`, `Omega^2 =
    (M - 2 f cos(theta*))^2 + (f sin(theta*))^2`, Omega at least 1e-3. The third entry is
    `min(|omega3|, 30) / 5`; the shares are those of the vectors (theta - theta*, v - f sin(theta)),
    (theta', theta'' / Omega) and of d.

    The action, clipped to the disk and then as p along e1 and e2, acts as S p, rounded to float32.
    """,
)
"""Reduction of `TopPrecession`: turns about the vertical, phase and reflections.

The frame turns in the body, so the action is limited to the disk in the square of the torques.
"""
