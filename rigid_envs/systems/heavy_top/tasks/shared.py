"""What tasks of a top share."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, cast

import numpy as np

from rigid_envs.engine.algebra import Quaternion, Row, Vector, attitude, rotate, vertical
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import atan2, fma, select, sincos
from rigid_envs.mechanics.system import fastest_turn
from rigid_envs.systems.heavy_top import dynamics as heavy_top
from rigid_envs.systems.heavy_top.dynamics import Parameters, State
from rigid_envs.systems.heavy_top.system import HeavyTop
from rigid_envs.tasks.fields import Entry, Range, physical, span
from rigid_envs.tasks.reduction import Frame, frame_along, polar_seen
from rigid_envs.tasks.task import Task

# Common functions of the heavy-top tasks: initial attitude and bounds on rates.

FAST = 30.0  # rad/s; bound of the rates of precession
NONE = (0.0, 0.0, 0.0)  # inputs that a task does not have
ORIGIN = (0.0, 0.0, 0.0, 0.0)  # a pivot at rest at the origin: its place and velocity


@dataclass(frozen=True)
class TopTask(Task):
    """A task of a heavy top: what its reduced frame knows, the top in the middle of the ranges."""

    system_type: ClassVar = HeavyTop

    def _middle(self) -> HeavyTop:
        return cast(HeavyTop, self.system())

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


@dataclass(frozen=True)
class SymmetricTopTask(TopTask):
    """A task of a top with I1 = I2 (`I_perp`)."""

    dt: float = 0.05
    I_perp: Range = physical(1.0, "moments I1 = I2 about the pivot", "kg m^2")
    I3: Range = physical(0.5, "moment about the axis of symmetry", "kg m^2")
    m: Range = physical(1.0, "mass", "kg")
    g: Range = physical(9.81, "gravitational acceleration", "m/s^2")
    ell: Range = physical(1.0 / 9.81, "distance from pivot to centre of mass", "m")

    counters: ClassVar = ("held",)
    aliases: ClassVar = {"I1": "I_perp", "I2": "I_perp"}

    @property
    def mgl(self) -> float:
        """Largest m g ell [N m] of the ranges."""
        return weight(self.m, self.g, self.ell)

    @property
    def largest_critical_spin(self) -> float:
        """Largest of the spins [rad/s] above which an upright top of the ranges sleeps."""
        return 2.0 * math.sqrt(span(self.I_perp)[1] * self.mgl) / span(self.I3)[0]


@scalar
def derive_symmetric(I1: float, I2: float, I3: float, m: float, g: float, ell: float) -> Parameters:
    """Parameters of a symmetric top: I2 is replaced by I1, as both are drawn independently."""
    return heavy_top.derive(I1, I1, I3, m, g, ell)


@scalar
def critical_spin(p: Parameters) -> float:
    """Spin from which on a symmetric top sleeps [rad/s]."""
    return 2.0 * math.sqrt(p.I1 * p.m * p.g * p.ell) / p.I3


@scalar
def tilt_of(y: State) -> float:
    """Angle from the vertical [rad]."""
    up = vertical(attitude(y))
    return atan2(math.sqrt(up[0] * up[0] + up[1] * up[1]), up[2])


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


# Lean of a top in its growing and its decaying part, and the frame along the growing one.

_NEAR, _CLOSE = 0.2, 0.01  # rad/s; parts of the lean that are shown as a half
_LEAN = 0.1  # rad; lean that is shown as a half
_FAST = 4.0  # critical spins; bound of the spin


class Lean(NamedTuple):
    """Growing and decaying part of a lean [rad/s], the lean itself [rad], growth rate [1/s]."""

    growing_x: float
    growing_y: float
    decaying_x: float
    decaying_y: float
    x: float
    y: float
    growth: float


@scalar
def parts(
    x: float, y: float, rate_x: float, rate_y: float, spin: float, fall: float, gyration: float
) -> Lean:
    """Parts of the lean e = x + i y of a symmetric top that grow and decay without control.

    ``e'' - i kappa e' - fall e = 0`` with kappa = gyration spin, fall = m g ell / I1 and gyration
    = I3 / I1 has the solutions exp(lambda t) of lambda = i kappa / 2 +- growth. With the rate
    b = e' - i kappa e / 2 the parts are ``b + growth e``, which grows, and ``b - growth e``.
    Above the sleeping threshold growth is 0 and both are b.
    """
    half = 0.5 * gyration * spin
    growth = math.sqrt(max(fma(-half, half, fall), 0.0))
    bx, by = fma(half, y, rate_x), fma(-half, x, rate_y)
    return Lean(
        growing_x=fma(growth, x, bx),
        growing_y=fma(growth, y, by),
        decaying_x=fma(-growth, x, bx),
        decaying_y=fma(-growth, y, by),
        x=x,
        y=y,
        growth=growth,
    )


@scalar
def world_lean(q: Quaternion, omega: Vector, fall: float, gyration: float) -> Lean:
    """Parts of the lean e, the horizontal part of the axis e3, in world axes."""
    w, x, y, z = q
    rate = rotate(q, (omega[1], -omega[0], 0.0))
    lean_x, lean_y = 2.0 * fma(x, z, w * y), 2.0 * fma(y, z, -w * x)
    return parts(lean_x, lean_y, rate[0], rate[1], omega[2], fall, gyration)


@scalar
def lean_frame(lean: Lean, spin: float) -> Frame:
    """x-axis along the growing part, mirrored so that the spin is not negative."""
    return frame_along(lean.growing_x, lean.growing_y, lean.decaying_x, lean.decaying_y, spin < 0.0)


@scalar
def lean_seen(frame: Frame, lean: Lean) -> Row:
    """The lean and its parts in a frame along the growing one; see `LEAN`."""
    growing = length(lean.growing_x, lean.growing_y)
    decaying = polar_seen(frame, lean.decaying_x, lean.decaying_y)
    return (
        min(3.0 * growing, 3.0),
        share(growing, _NEAR),
        share(growing, _CLOSE),
        *shares(*decaying, _NEAR),
        *shares(*decaying, _CLOSE),
        *shares(*polar_seen(frame, lean.x, lean.y), _LEAN),
    )


LEAN = (
    Entry("3 |u|", "rad/s", "growing part u, limited", 0.0, 3.0),
    Entry("share u", "1", f"of |u| + {_NEAR}", 0.0, 1.0),
    Entry("share u", "1", f"of |u| + {_CLOSE}", 0.0, 1.0),
    *(Entry(f"share s_{k}", "1", f"reduced, of |s| + {_NEAR}", -1.0, 1.0) for k in "xy"),
    *(Entry(f"share s_{k}", "1", f"reduced, of |s| + {_CLOSE}", -1.0, 1.0) for k in "xy"),
    *(Entry(f"share e_{k}", "1", f"reduced, of |e| + {_LEAN}", -1.0, 1.0) for k in "xy"),
)
"""Entries of `lean_seen`: growing part u, decaying part s, lean e."""


@scalar
def upright_seen(frame: Frame, lean: Lean, height: float, spin: float, c: Any) -> Row:
    """The lean, the height of the axis e3 and the spin [rad/s]; see `UPRIGHT`."""
    free = 1.0 / math.sqrt(c.fall_square)
    spins = 0.5 * c.gyration * abs(spin) * free
    return (*lean_seen(frame, lean), height, min(spins, _FAST), lean.growth * free)


UPRIGHT = (
    *LEAN,
    Entry("R33", "1", "body to world", -1.0, 1.0),
    Entry("|omega3|", "1", "critical spins, limited", 0.0, _FAST),
    Entry("growth", "1", "of u, over that without spin", 0.0, 1.0),
)
"""Entries of `upright_seen`."""


@scalar
def length(x: float, y: float) -> float:
    """Length of a vector in the plane."""
    return math.sqrt(fma(x, x, y * y))


@scalar
def share(size: float, half: float) -> float:
    """``size / (size + half)``: from 0 to 1, steepest at 0."""
    return size / (size + half)


@scalar
def shares(x: float, y: float, half: float) -> tuple[float, float]:
    """A vector whose length is replaced by its `share`."""
    factor = 1.0 / (length(x, y) + half)
    return factor * x, factor * y
