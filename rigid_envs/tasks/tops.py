"""Common functions of the heavy-top tasks: initial attitude and bounds on rates."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rigid_envs.kernels import heavy_top, randoms
from rigid_envs.kernels.algebra import Quaternion, attitude, compose, vertical
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import atan2, select, sincos
from rigid_envs.kernels.heavy_top import Parameters, State
from rigid_envs.systems import HeavyTop
from rigid_envs.systems.free_body import fastest_turn
from rigid_envs.tasks.base import Task
from rigid_envs.tasks.fields import Range, span

__all__ = [
    "FAST",
    "TopTask",
    "derive_symmetric",
    "fastest_spinning",
    "fastest_top",
    "precession",
    "steady",
    "tilted",
    "weight",
]

FAST = 30.0  # rad/s; bound of the rates of precession


@dataclass(frozen=True)
class TopTask(Task):
    """A task of a heavy top: what its reduced frame knows, the top in the middle of the ranges."""

    system_type: ClassVar = HeavyTop

    def _middle(self) -> HeavyTop:
        top = self.system()
        assert isinstance(top, HeavyTop)
        return top

    @property
    def fall_square(self) -> float:
        """Square of the growth rate of the tilt without spin, m g ell / I [1/s^2].

        I is the mean of I1 and I2.
        """
        top = self._middle()
        return 2.0 * float(top.m * top.g * top.ell / (top.I1 + top.I2))

    @property
    def gyration(self) -> float:
        """I3 / I [1]."""
        top = self._middle()
        return 2.0 * float(top.I3 / (top.I1 + top.I2))

    @property
    def gravity(self) -> float:
        """Gravitational acceleration [m/s^2]."""
        return float(self._middle().g)


@scalar
def derive_symmetric(I1: float, I2: float, I3: float, m: float, g: float, ell: float) -> Parameters:
    """Parameters of a symmetric top: I2 is replaced by I1, as both are drawn independently."""
    return heavy_top.derive(I1, I1, I3, m, g, ell)


@scalar
def tilted(stream: randoms.Stream, tilt: float) -> Quaternion:
    """Attitude with the given tilt [rad], azimuth and phase uniform."""
    azimuth = randoms.direction(stream, 1 << 20)
    phase = randoms.direction(stream, 1 << 21)
    sine, cosine = sincos(0.5 * tilt)
    axis = (cosine, sine * azimuth[0], sine * azimuth[1], 0.0)
    return compose(axis, (phase[0], 0.0, 0.0, phase[1]))


@scalar
def precession(y: State) -> tuple[float, float]:
    """Tilt [rad] and rate of precession phi' = (omega1 G1 + omega2 G2) / (G1^2 + G2^2) [rad/s].

    G is the vertical in body axes. At tilt 0 the rate is undefined, and 0 is returned.
    """
    G = vertical(attitude(y))
    square = G[0] * G[0] + G[1] * G[1]
    rate = (y.omega1 * G[0] + y.omega2 * G[1]) / max(square, 1e-12)
    return atan2(math.sqrt(square), G[2]), min(max(rate, -FAST), FAST)


@scalar
def steady(tilt: float, spin: float, p: Parameters, fast_branch: float) -> float:
    """Rate of steady precession: a root of I1 cos(theta) x^2 - I3 omega3 x + m g ell = 0.

    Without a real root (a slow spin, given from outside) the discriminant counts as 0.
    """
    _, cosine = sincos(tilt)
    L, mgl, level = p.I3 * spin, p.m * p.g * p.ell, p.I1 * cosine
    root = math.sqrt(max(L * L - 4.0 * level * mgl, 0.0))
    total = L + select(L < 0.0, -root, root)
    slow = 2.0 * mgl / select(abs(total) < 1e-9, 1e-9, total)
    fast = 0.5 * total / select(abs(level) < 1e-9, 1e-9, level)
    rate = select(fast_branch > 0.5, fast, slow)
    return min(max(rate, -FAST), FAST)


def weight(m: Range, g: Range, ell: Range) -> float:
    """Largest m g ell [N m] of the ranges."""
    return span(m)[1] * span(g)[1] * span(ell)[1]


def fastest_top(
    moments: tuple[Range, Range, Range], spin: float, across: float, mgl: float, growth: float
) -> float:
    """Bound on the rate [rad/s] of a top and of its integrator steps during an episode.

    With the energy E, ``sqrt(2 (E + m g ell)) >= sqrt(2 T)``, by which `fastest_turn` bounds the
    rates, and gravity does not change it.

    Args:
        moments: I1, I2, I3 about the pivot [kg m^2].
        spin: largest omega3 at the start [rad/s].
        across: largest rate across e3 at the start [rad/s].
        mgl: largest m g ell [N m].
        growth: largest increase of sqrt(2 (E + m g ell)) by torques during the episode.
    """
    low, high = ([span(moment)[k] for moment in moments] for k in (0, 1))
    start = high[2] * spin**2 + max(high[0], high[1]) * across**2 + 4.0 * mgl
    worst = np.array([min(low), low[1], max(high)])
    return (math.sqrt(start) + growth) * fastest_turn(worst)


def fastest_spinning(
    I_perp: Range, I3: Range, spin: float, across: float, mgl: float, impulse: float
) -> float:
    """Bound as `fastest_top`, for a symmetric top whose spin is conserved.

    Then W = I_perp omega_perp^2 / 2 + m g ell (1 + cos theta) grows by at most ``sqrt(2 W)' <= tau
    / sqrt(I_perp)``. Integrator steps turn the top about L at the rate norm(L) / I_perp.

    Args:
        I_perp: moments about the axes across e3 [kg m^2].
        I3: moment about e3 [kg m^2].
        spin: largest omega3 [rad/s].
        across: largest rate across e3 at the start [rad/s].
        mgl: largest m g ell [N m].
        impulse: largest torque times the length of an episode [N m s].
    """
    low, high = span(I_perp)
    root = math.sqrt(high * across**2 + 4.0 * mgl) + impulse / math.sqrt(low)
    turn = spin * max(1.0, span(I3)[1] / low)
    return math.sqrt(root**2 / low + turn**2)
