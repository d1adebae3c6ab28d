"""Damp the nutation of a top until it precesses steadily at a commanded tilt."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from rigid_envs.kernels import randoms
from rigid_envs.kernels.actions import clip_to_square
from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import fma, select
from rigid_envs.kernels.episode import Episode
from rigid_envs.kernels.heavy_top import HEAVY_TOP, Input, Parameters, State
from rigid_envs.tasks.base import Array, AuxiliaryRanges, Entry
from rigid_envs.tasks.fields import Choice, Integer, Number, Range, physical, setting, span
from rigid_envs.tasks.reduced.top_precession import TOP_PRECESSION
from rigid_envs.tasks.tops import (
    FAST,
    TopTask,
    derive_symmetric,
    fastest_spinning,
    precession,
    steady,
    tilted,
    weight,
)

__all__ = ["TopPrecession"]

_SLOW = 1e-9  # rad/s; a goal below it, as of a top without spin, counts as this in its error


class Action(NamedTuple):
    """Torque about e1 and e2, as fractions of the maximum."""

    tau1: float
    tau2: float


class Terms(NamedTuple):
    """Reward terms of `TopPrecession`."""

    tilt: float
    rate: float
    effort: float


class Constants(NamedTuple):
    """Torque [N m], success (relative errors, time [s]), branch, tilts [rad], rate [rad/s], spins.

    Spins are fractions of the critical spin. Last m g ell / I1 [1/s^2] and I3 / I1, for the reduced
    frame.
    """

    torque: float
    tolerance: float
    hold: float
    fast_branch: float
    goal_tilt: float
    goal_spread: float
    start_tilt: float
    start_rate: float
    start_spin: float
    start_spread: float
    fall_square: float
    gyration: float


class Auxiliary(NamedTuple):
    """Control periods for which the errors have been small; commanded tilt [rad]."""

    held: float = 0.0
    goal_tilt: float = 0.0


@scalar
def start(stream: randoms.Stream, p: Parameters, c: Constants) -> tuple[State, Auxiliary]:
    """Random tilt, transverse rates and goal; spin above the critical one."""
    q = tilted(stream, c.start_tilt * randoms.uniform(stream, 0))
    critical = 2.0 * math.sqrt(p.I1 * p.m * p.g * p.ell) / p.I3
    spin = critical * fma(c.start_spread, randoms.uniform(stream, 1), c.start_spin)
    goal = fma(c.goal_spread, randoms.uniform(stream, 2), c.goal_tilt)
    across = randoms.in_disk(stream, 1 << 22)
    omega = (c.start_rate * across[0], c.start_rate * across[1], spin)
    pivot, velocity = (0.0, 0.0), (0.0, 0.0)
    return State(*q, *omega, *pivot, *velocity), Auxiliary(held=0.0, goal_tilt=goal)


@scalar
def actuate(
    a: Action, y: State, aux: Auxiliary, p: Parameters, c: Constants
) -> tuple[State, Input]:
    """Torque about e1 and e2."""
    return y, Input(
        tau_body1=c.torque * a.tau1,
        tau_body2=c.torque * a.tau2,
        tau_body3=0.0,
        tau_world_x=0.0,
        tau_world_y=0.0,
        tau_world_z=0.0,
        aX=0.0,
        aY=0.0,
    )


@scalar
def outcome(
    y: State, u: Input, aux: Auxiliary, p: Parameters, c: Constants, dt: float
) -> tuple[Auxiliary, Terms, float, bool, bool]:
    """Reward terms, torque impulse as cost, success after the hold time."""
    goal = steady(aux.goal_tilt, y.omega3, p, c.fast_branch)
    tilt, rate = precession(y)
    off = abs(tilt - aux.goal_tilt)
    wrong = abs(rate - goal) / max(abs(goal), _SLOW)
    square = u.tau_body1 * u.tau_body1 + u.tau_body2 * u.tau_body2
    near = (off <= c.tolerance * aux.goal_tilt) & (wrong <= c.tolerance)
    held = select(near, aux.held + 1.0, 0.0)
    terms = Terms(
        tilt=1.0 / (1.0 + 10.0 * off),
        rate=1.0 / (1.0 + 10.0 * wrong),
        effort=-square * (1.0 / (2.0 * c.torque * c.torque)),
    )
    success = held * dt >= c.hold * (1.0 - 1e-9)
    return Auxiliary(held, aux.goal_tilt), terms, dt * math.sqrt(square), success, False


@scalar
def observe(y: State, aux: Auxiliary, p: Parameters, c: Constants) -> Row:
    """Angular velocity in body axes, tilt and rate of precession, and their goals."""
    tilt, rate = precession(y)
    return (
        min(max(y.omega1, -FAST), FAST),
        min(max(y.omega2, -FAST), FAST),
        min(max(y.omega3, -FAST), FAST),
        tilt,
        rate,
        aux.goal_tilt,
        steady(aux.goal_tilt, y.omega3, p, c.fast_branch),
    )


@dataclass(frozen=True)
class TopPrecession(TopTask):
    """Bring a nutating top to steady precession at a commanded tilt.

    A top from a general start nutates between two tilts while it precesses. At every tilt there are
    two rates of steady precession, without nutation: a slow one, due to gravity, and a fast one,
    close to that of the free body. The commanded tilt and its rate on the chosen `branch` are
    observed.

    The steady motion needs no torque, but the transition does, and the response is gyroscopic: a
    tilting torque makes the top precess, and a torque about the vertical makes it rise or fall. The
    torque acts about e1 and e2, axes that turn with the spin, which is constant.

    Physics:
        ``I omega' = I omega x omega + (tau1, tau2, 0) + ell e3 x R^T (0, 0, -m g)`` about the
        pivot, in body axes. The top is symmetric, I1 = I2 (`I_perp`), and omega3 is conserved under
        any action. Without torque the energy and the vertical momentum are conserved too.

        Steady precession at the tilt theta has one of the two rates that are the roots of
        ``I1 cos(theta) phi'^2 - I3 omega3 phi' + m g ell = 0``. Spins are above the critical one,
        ``2 sqrt(I1 m g ell) / I3``, so that both roots exist at every tilt. By default the slow
        rates are 0.26 to 0.53 rad/s and the fast ones 1.98 to 6.17 rad/s.

        The energy that gravity and full torque can give the top before the time limit bounds its
        rates.

    Rewards:
        ``tilt`` = ``1 / (1 + 10 |theta - goal|)`` and ``rate`` = ``1 / (1 + 10 e)`` with the
        relative error e of the precession rate phi': their slopes are largest at the goal and
        nowhere zero. ``effort`` = ``-|tau|^2 / (2 torque^2)`` has a small weight.

        ``e = |phi' - goal| / max(|goal|, 1e-9)`` with ``phi' = (omega1 R31 + omega2 R32) /
        max(R31^2 + R32^2, 1e-12)``; both rates are limited to +-30 rad/s. With the present omega3,
        ``a = I1 cos(theta)`` at the goal, ``b = I3 omega3``, ``c = m g ell`` and ``n = b +-
        sqrt(max(b^2 - 4 a c, 0))``, the sign that of b, the goal is ``2 c / n`` (slow) or ``n / (2
        a)`` (fast), also where a given spin is too slow for a root; |n| below 1e-9 counts as 1e-9
        in ``2 c / n``.

    Starting State:
        The commanded tilt is uniform from `goal_tilt` up to `goal_spread` above it. The tilt is
        uniform up to `start_tilt`; the spin, as a fraction of the critical one, uniform from
        `start_spin` up to `start_spread` above it; the rates across e3 are uniform in a disk of
        radius `start_rate`. The direction of the tilt and the phase of the body are uniform.

    Episode End:
        The episode ends only at its time limit. Success (`info["is_success"]`): tilt and precession
        rate have been at most `tolerance` off their goals, relatively, throughout the last `hold`
        seconds: ``|theta - goal| <= tolerance goal`` and ``e <= tolerance``.

    Reference:
        `lqr` is the linear-quadratic regulator of the steady precession, linear in (theta - goal,
        theta', phi' - rate) with a gain for every tilt and spin, on the branch of the task.

        Exact: the roots. From steady precession on either branch, zero actions succeed at zero
        cost.

    Version History:
        v0: first version.

    Source:
        Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7.
    """

    dt: float = setting(0.05, Number("control period", "s", 1e-4, 1.0))
    n_substeps: int = setting(2, Integer("integrator steps per control period", 1, 1000))
    I_perp: Range = physical(1.0, "moments I1 = I2 about the pivot", "kg m^2")
    I3: Range = physical(0.5, "moment about the axis of symmetry", "kg m^2")
    m: Range = physical(1.0, "mass", "kg")
    g: Range = physical(9.81, "gravitational acceleration", "m/s^2")
    ell: Range = physical(1.0 / 9.81, "distance from pivot to centre of mass", "m")
    branch: str = setting("slow", Choice("root of steady precession", ("slow", "fast")))
    torque: float = setting(0.5, Number("largest torque about each axis", "N m", 1e-6, 1e6))
    goal_tilt: float = setting(0.3, Number("least commanded tilt", "rad", 0.05, 0.9))
    goal_spread: float = setting(
        0.6, Number("width of the range of commanded tilts", "rad", 0.0, 0.6)
    )
    start_tilt: float = setting(1.2, Number("largest tilt at the start", "rad", 0.0, math.pi))
    start_rate: float = setting(1.0, Number("largest rate across e3 at first", "rad/s", 0.0, 1e3))
    start_spin: float = setting(1.2, Number("least spin / critical spin", "1", 1.0, 10.0))
    start_spread: float = setting(
        0.8, Number("width of the range of spins / critical spin", "1", 0.0, 10.0)
    )
    tolerance: float = setting(0.02, Number("largest relative errors of a success", "1", 1e-6, 1.0))
    hold: float = setting(5.0, Number("time within tolerance at the end", "s", 0.0, 1e4))
    weight_tilt: float = setting(0.5, Number("weight of the tilt term", "1", -1e3, 1e3))
    weight_rate: float = setting(0.5, Number("weight of the rate term", "1", -1e3, 1e3))
    weight_effort: float = setting(0.1, Number("weight of the effort term", "1", -1e3, 1e3))

    episode: ClassVar = Episode(
        dynamics=HEAVY_TOP,
        Action=Action,
        Terms=Terms,
        Constants=Constants,
        Auxiliary=Auxiliary,
        derive=derive_symmetric,
        start=start,
        clip=clip_to_square,
        actuate=actuate,
        outcome=outcome,
        observe=observe,
    )
    reduction: ClassVar = TOP_PRECESSION
    counters: ClassVar = ("held",)
    cost_unit: ClassVar = "torque impulse [N m s]"
    aliases: ClassVar = {"I1": "I_perp", "I2": "I_perp"}

    @property
    def fast_branch(self) -> float:
        """1 where the goal is the fast root of steady precession, 0 where it is the slow one."""
        return float(self.branch == "fast")

    def actions(self) -> tuple[Entry, ...]:
        """Torques about e1 and e2."""
        return tuple(Entry(f"tau{k}", "N m", "body", -self.torque, self.torque) for k in (1, 2))

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity, tilt and rate of precession, and their goals."""
        return (
            *(Entry(f"omega{k}", "rad/s", "body", -FAST, FAST) for k in (1, 2, 3)),
            Entry("theta", "rad", "world", 0.0, math.pi),
            Entry("phi'", "rad/s", "world", -FAST, FAST),
            Entry("goal theta", "rad", "world", 0.0, math.pi),
            Entry("goal phi'", "rad/s", "world", -FAST, FAST),
        )

    def auxiliary_ranges(self, p: Mapping[str, Array], elapsed: Array) -> AuxiliaryRanges:
        """Commanded tilts of a start."""
        tilts = (self.goal_tilt, self.goal_tilt + self.goal_spread)
        return {**super().auxiliary_ranges(p, elapsed), "goal_tilt": tilts}

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates from the fastest start under gravity and full torque."""
        mgl = weight(self.m, self.g, self.ell)
        critical = 2.0 * math.sqrt(span(self.I_perp)[1] * mgl) / span(self.I3)[0]
        spin = (self.start_spin + self.start_spread) * critical
        impulse = math.sqrt(2.0) * self.torque * duration
        return fastest_spinning(self.I_perp, self.I3, spin, self.start_rate, mgl, impulse)
