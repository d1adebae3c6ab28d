"""Balance a top by moving its pivot."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.settings import Number, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, attitude, rotate, vertical
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma
from rigid_envs.engine.episode import Episode, clip_to_disk
from rigid_envs.systems.heavy_top.dynamics import HEAVY_TOP, Input, Parameters, State
from rigid_envs.systems.heavy_top.symmetry import PHASE, REFLECTION, TURN
from rigid_envs.systems.heavy_top.tasks import shared
from rigid_envs.tasks.fields import Entry, span
from rigid_envs.tasks.parts import Held, held_for, limited, limited_pair, tilted
from rigid_envs.tasks.reduction import Frame, Reduction, frame_along, polar_seen, turn

# Reduced coordinates of a symmetric top whose pivot is accelerated: `PivotTop`.

_REDUCED_FAST, _FAR = 4.0, 5.0
_RETURN = 0.35  # rate at which the pivot is to return, over that at which the top falls
_NEAR, _CLOSE = 0.2, 0.02  # rad/s, m, m/s
_LEAN = 0.1  # rad


class _Returning(NamedTuple):
    """Lean; what grows of it beyond what brings the pivot back; frame along that."""

    lean: shared.Lean
    grown: float
    frame: Frame


@scalar
def _returning(y: Any, c: Any) -> _Returning:
    """Frame along the growing part of the lean less that of a lean which brings the pivot back.

    The pivot X at the velocity V returns under the acceleration a = -(r^2 X + 2 r V), under which
    the top leans by a / g at rest. Of a lean e with e' = 0 the growing part is
    ``(growth - i kappa / 2) e``.
    """
    lean = shared.world_lean(attitude(y), (y.omega1, y.omega2, y.omega3), c.fall_square, c.gyration)
    back = _RETURN * math.sqrt(c.fall_square)
    lean_x = back * fma(back, y.X, 2.0 * y.VX) / c.gravity
    lean_y = back * fma(back, y.Y, 2.0 * y.VY) / c.gravity
    half = 0.5 * c.gyration * y.omega3
    x = fma(lean.growth, lean_x, fma(half, lean_y, lean.growing_x))
    z = fma(lean.growth, lean_y, fma(-half, lean_x, lean.growing_y))
    frame = frame_along(x, z, lean.growing_x, lean.growing_y, y.omega3 < 0.0)
    return _Returning(lean, shared.length(x, z), frame)


@scalar
def observe_reduced(y: Any, aux: Any, p: Any, c: Any) -> Row:
    """Lean, pivot, height and spin; the parameters may be hidden: those of the middle top."""
    lean, grown, frame = _returning(y, c)
    decaying = polar_seen(frame, lean.decaying_x, lean.decaying_y)
    tilt = polar_seen(frame, lean.x, lean.y)
    pivot = polar_seen(frame, y.X, y.Y)
    velocity = polar_seen(frame, y.VX, y.VY)
    close = 1.0 / (shared.length(pivot[0], pivot[1]) + _NEAR)
    free = 1.0 / math.sqrt(c.fall_square)
    spin = 0.5 * c.gyration * abs(y.omega3) * free
    return (
        min(3.0 * grown, 3.0),
        shared.share(grown, _NEAR),
        shared.share(grown, _CLOSE),
        *shared.shares(decaying[0], decaying[1], _NEAR),
        *shared.shares(tilt[0], tilt[1], _LEAN),
        *limited_pair(pivot, _FAR),
        close * pivot[0],
        close * pivot[1],
        *limited_pair(velocity, _FAR),
        *shared.shares(velocity[0], velocity[1], _NEAR),
        vertical(attitude(y))[2],
        min(spin, _REDUCED_FAST),
    )


@scalar
def frame_of(y: Any, aux: Any, p: Any, c: Any) -> Frame:
    """Frame along what grows beyond what brings the pivot back."""
    return _returning(y, c).frame


PIVOT_TOP = Reduction(
    group="O(2) x SO(2)",
    frame=(
        "$x$ along the growing part of the lean less that of a lean which brings the pivot back, "
        "mirrored so that the spin is not negative."
    ),
    symmetries=(TURN, PHASE, REFLECTION),
    features=(
        Entry("3 |w|", "rad/s", "growing part w less that of the return, limited", 0.0, 3.0),
        Entry("share w", "1", f"of |w| + {_NEAR}", 0.0, 1.0),
        Entry("share w", "1", f"of |w| + {_CLOSE}", 0.0, 1.0),
        *(Entry(f"share s_{k}", "1", f"reduced, of |s| + {_NEAR}", -1.0, 1.0) for k in "xy"),
        *(Entry(f"share e_{k}", "1", f"reduced, of |e| + {_LEAN}", -1.0, 1.0) for k in "xy"),
        *(Entry(k, "m", "reduced, limited", -_FAR, _FAR) for k in "XY"),
        *(Entry(f"share {k}", "1", f"reduced, of distance + {_NEAR}", -1.0, 1.0) for k in "XY"),
        *(Entry(f"V{k}", "m/s", "reduced, limited", -_FAR, _FAR) for k in "XY"),
        *(Entry(f"share V{k}", "1", f"reduced, of speed + {_NEAR}", -1.0, 1.0) for k in "XY"),
        Entry("R33", "1", "body to world", -1.0, 1.0),
        Entry("|omega3|", "1", "critical spins, limited", 0.0, _REDUCED_FAST),
    ),
    observe=observe_reduced,
    Frame=Frame,
    frame_of=frame_of,
    turn=turn,
    formulas="""
    With the symbols of `SleepingTop` and $k = 0.35 sqrt(fall)$, the pivot $X + i Y$ returns at the
    lean $l = k (k (X + i Y) + 2 (VX + i VY)) / g$; $w = u + (growth - i kappa / 2) l$. The $x$-axis
    of the frame is along $w$, along $u$ where $w$ is 0, and that of the world where both are 0; $y$
    is on the same side as there.

    Entries: $min(3 |w|, 3)$, the shares of $|w|$, $s$ and $e$ with their halves, the pivot, entry
    by entry up to 5, its share, its velocity likewise, $R33$ and $min(|kappa| / (2 sqrt(fall)),
    4)$.
    """,
)
"""Reduction of `PivotTop`: O(2), turns about the vertical and reflections, and the phase."""


# Balance a slowly spinning top by accelerating its pivot.

_FAST = 20.0  # rad/s and m/s; bounds of the observation


class Action(NamedTuple):
    """Horizontal acceleration of the pivot in world axes, as a fraction of the maximum."""

    aX: float
    aY: float


class Terms(NamedTuple):
    """Reward terms of `PivotTop`."""

    upright: float
    centre: float
    effort: float


class Constants(NamedTuple):
    """Largest acceleration [m/s^2], end, success and start: angles [rad], lengths [m], time [s].

    Last m g ell / I1 [1/s^2], I3 / I1 and g, for the reduced frame.
    """

    push: float
    arena: float
    fall: float
    tilt_tolerance: float
    centre_tolerance: float
    hold: float
    start_tilt: float
    start_spin: float
    fall_square: float
    gyration: float
    gravity: float


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Held]:
    """Slow spin, small tilt, pivot at rest in the centre."""
    tilt = c.start_tilt * fma(2.0 / 3.0, randoms.uniform(stream, 0), 1.0 / 3.0)
    q = tilted(stream, tilt, 1 << 20, 1 << 21)
    spin = shared.critical_spin(p) * c.start_spin * fma(0.7, randoms.uniform(stream, 1), 0.3)
    return State(*q, 0.0, 0.0, spin, *shared.ORIGIN), Held(0.0)


@scalar
def actuate(a: Action, y: State, aux: Held, p: Parameters, c: Constants) -> tuple[State, Input]:
    """Horizontal acceleration of the pivot in world axes."""
    return y, Input(*shared.NONE, *shared.NONE, c.push * a.aX, c.push * a.aY)


@scalar
def outcome(
    y: State, u: Input, aux: Held, p: Parameters, c: Constants, dt: float
) -> tuple[Held, Terms, float, bool, bool]:
    """Reward terms, integral of |a| as cost, success after the hold time, end at arena or fall."""
    tilt = shared.tilt_of(y)
    away = math.sqrt(y.X * y.X + y.Y * y.Y)
    size = math.sqrt(u.aX * u.aX + u.aY * u.aY)
    near = (tilt < c.tilt_tolerance) & (away < c.centre_tolerance)
    held, success = held_for(near, aux, c, dt)
    upright = 1.0 / (1.0 + 10.0 * tilt)
    terms = Terms(
        upright=upright,
        centre=upright / (1.0 + 10.0 * away / c.arena),
        effort=-(size * size) * (1.0 / (c.push * c.push)),
    )
    return Held(held), terms, dt * size, success, (away > c.arena) | (tilt > c.fall)


@scalar
def observe(y: State, aux: Held, p: Parameters, c: Constants) -> Row:
    """Angular velocity in world axes; pivot position / arena radius, and pivot velocity."""
    omega = rotate(attitude(y), (y.omega1, y.omega2, y.omega3))
    return (
        *limited(omega, _FAST),
        *limited_pair((y.X / c.arena, y.Y / c.arena), 2.0),
        *limited_pair((y.VX, y.VY), _FAST),
    )


@dataclass(frozen=True)
class PivotTop(shared.SymmetricTopTask):
    """Balance a slowly spinning top by moving its pivot: the spinning spherical cart-pole.

    A top below the sleeping threshold falls, more slowly the faster it spins, and it precesses as
    it falls. The only control is the acceleration of its pivot. The system is non-minimum phase: to
    return, the pivot must first move further away, by some metres. The arena has a radius of 5 m;
    the episode ends when the pivot leaves it or the top has fallen.

    Physics:
        The top is symmetric, $I1 = I2$ (`I_perp`), and its spin $omega3$ is conserved under any
        motion of the pivot.

        For a small tilt, with $e = e_x + i e_y$ the horizontal part of the axis of the top, $I1 e''
        - i I3 omega3 e' - m g ell e = -m ell a$. The sleeping threshold is the spin $2 sqrt(I1 m g
        ell) / I3$, here 4 rad/s; at a fraction $s$ of it the tilt grows at the rate $sqrt((1 - s^2)
        m g ell / I1)$. Without spin the top falls like a pendulum of length $I1 / (m ell)$, 9.8 m.
        Under a constant acceleration it has an unstable equilibrium, leaning forwards by $arctan(a
        / g)$, up to 0.30 rad.

    Rewards:
        `upright` = $1 / (1 + 10 theta)$ with the tilt $theta$, `centre` = $upright / (1 + 10 d /
        arena)$ with the distance $d$ of the pivot from the centre: the slopes of both are largest
        at the goal. `effort` = $-|a|^2 / push^2$. Near the goal the reward is positive, so an early
        end of the episode loses the rewards of the remaining steps.

        The factor `upright` in `centre` prevents a reward for a pivot in the centre under a fallen
        top.

    Starting State:
        The tilt is uniform from a third of `start_tilt` to all of it, so that every uncontrolled
        top falls before the end; the spin is uniform from 0.3 of `start_spin` to all of it, as a
        fraction of the critical spin. The direction of the tilt and the phase of the body are
        uniform. The pivot rests in the centre.

    Episode End:
        The episode terminates when the pivot is further than `arena` from the centre, or $theta$ is
        above `fall`: from there the acceleration cannot hold a top of little spin. Success
        (`info["is_success"]`): $theta$ has been below `tilt_tolerance` and $d$ below
        `centre_tolerance` throughout the last `hold` seconds.

    Reference:
        `lqr` is the linear-quadratic regulator of the upright top and its pivot, linear in $e$,
        $e'$, $X$ and $X'$ with a gain for every spin.

        Threshold: the critical spin, as for `SleepingTop`. To first order, and without the limit of
        the arena, a start is caught if $g theta sqrt(1 - s^2) < push$.

    Source:
        Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7, in the accelerated frame of
        the pivot.
    """

    push: float = setting(3.0, Number("largest acceleration of the pivot", "m/s^2", 1e-6, 1e6))
    arena: float = setting(5.0, Number("radius of the arena", "m", 1e-3, 1e6))
    fall: float = setting(0.5, Number("tilt of a top that has fallen", "rad", 1e-3, math.pi))
    start_tilt: float = setting(
        0.15, Number("largest tilt at the start; the least is a third", "rad", 0.0, math.pi)
    )
    start_spin: float = setting(
        0.95, Number("largest spin / critical spin; the least is 0.3 of it", "1", 0.0, 10.0)
    )
    tilt_tolerance: float = setting(0.05, Number("largest tilt of a success", "rad", 1e-6, math.pi))
    centre_tolerance: float = setting(
        0.1, Number("largest pivot offset of a success", "m", 1e-6, 1e6)
    )
    hold: float = setting(5.0, Number("time within tolerances at the end", "s", 0.0, 1e4))
    weight_upright: float = setting(1.0, Number("weight of the upright term", "1", -1e3, 1e3))
    weight_centre: float = setting(1.0, Number("weight of the centre term", "1", -1e3, 1e3))
    weight_effort: float = setting(0.1, Number("weight of the effort term", "1", -1e3, 1e3))

    episode: ClassVar = Episode(
        dynamics=HEAVY_TOP,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Held,
        derive=shared.derive_symmetric,
        start=start,
        clip=clip_to_disk,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = PIVOT_TOP
    cost_unit: ClassVar = "acceleration times time [m/s]"

    def actions(self) -> tuple[Entry, ...]:
        """Acceleration of the pivot, in a disk."""
        return tuple(Entry(f"a{k}", "m/s^2", "world, disk", -self.push, self.push) for k in "XY")

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity, position and velocity of the pivot."""
        return (
            *(Entry(f"omega_{k}", "rad/s", "world", -_FAST, _FAST) for k in "xyz"),
            *(Entry(f"{k} / arena", "1", "world", -2.0, 2.0) for k in "XY"),
            *(Entry(f"V{k}", "m/s", "world", -_FAST, _FAST) for k in "XY"),
        )

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates under gravity and full acceleration of the pivot."""
        spin = self.start_spin * self.largest_critical_spin
        impulse = span(self.m)[1] * span(self.ell)[1] * self.push * duration
        return shared.fastest_spinning(self.I_perp, self.I3, spin, 0.0, self.mgl, impulse)
