"""Common functions of the heavy-top tasks: initial attitude and bounds on rates."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rigid_envs.kernels import heavy_top, randoms
from rigid_envs.kernels.algebra import Quaternion, compose
from rigid_envs.kernels.compiler import scalar
from rigid_envs.kernels.elementary import sincos
from rigid_envs.kernels.heavy_top import Parameters
from rigid_envs.systems import HeavyTop
from rigid_envs.systems.free_body import fastest_turn
from rigid_envs.tasks.base import Task
from rigid_envs.tasks.fields import Range, span

__all__ = ["TopTask", "derive_symmetric", "fastest_spinning", "fastest_top", "tilted", "weight"]


@dataclass(frozen=True)
class TopTask(Task):
    """A task of a heavy top: what its reduced frame knows, the top in the middle of the ranges."""

    system_type: ClassVar = HeavyTop

    @property
    def fall_square(self) -> float:
        """Square of the growth rate of the tilt without spin, m g ell / I [1/s^2].

        I is the mean of I1 and I2.
        """
        top = self.system()
        return 2.0 * float(top.m * top.g * top.ell / (top.I1 + top.I2))

    @property
    def gyration(self) -> float:
        """I3 / I [1]."""
        top = self.system()
        return 2.0 * float(top.I3 / (top.I1 + top.I2))

    @property
    def gravity(self) -> float:
        """Gravitational acceleration [m/s^2]."""
        return float(self.system().g)


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
