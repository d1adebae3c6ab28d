"""Damping the nutation of a top: into steady precession at a commanded tilt."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.analytic.heavy_top import steady_precession
from rigid_envs.checks import positive, positive_array, require
from rigid_envs.control.linear import Regulator, lqr, scheduled, zero_order_hold
from rigid_envs.control.saturation import clip_to_box
from rigid_envs.systems import HeavyTop

__all__ = ["PrecessionRegulator", "nutation_of"]

Array = npt.NDArray[np.float64]
_E_Z = np.array([0.0, 0.0, 1.0])
_NODES = 6  # of tilts and of spins, for which there are gains
_BRANCHES = ("slow", "fast")


def nutation_of(y: npt.ArrayLike) -> Array:
    """Tilt and rates (theta, theta', phi') of states y of `HeavyTop`, shape (..., 11).

    Returns:
        Shape (..., 3) [rad, rad/s]; phi' is far off within some 1e-6 rad of the vertical, where it
        is not defined.
    """
    rows = HeavyTop.checked_state(y)
    n, sine, cosine = _upward(rows)
    w1, w2 = rows[..., 4], rows[..., 5]
    rate = (w1 * n[..., 0] + w2 * n[..., 1]) / sine
    fall = w1 * n[..., 1] - w2 * n[..., 0]
    return np.stack([np.arctan2(sine, cosine), fall, rate], axis=-1)


@dataclass(frozen=True)
class PrecessionRegulator:
    """Leads a symmetric top into steady precession at a tilt, by torque about e1 and e2.

    Steady precession at the tilt theta and the rate f, a root of ``I1 cos(theta) f^2 - I3 omega3 f
    + m g ell = 0``, needs no torque. With x = (theta - goal, theta', phi' - f), s = sin(goal) and
    kappa = I3 omega3 / I1 - 2 f cos(goal), the top near it moves by

        x1' = x2,   x2' = -f^2 s^2 x1 - s kappa x3 - u_l / I1,   x3' = kappa x2 / s + u_n / (I1 s),

    where n is the direction across e3 that points up and l = e3 x n. The torque u = -K x has the
    least sum of ``100 x1^2 + 10 x2^2 + 10 x3^2 + 3 |u|^2`` over the control periods; it is held in
    body axes, which turn from n and l at psi'. K is interpolated between 6 tilts and 6 spins.

    Certificate: the Riccati matrix P: ``value(y, goal) = x P x`` is the sum from there on, and a
    Lyapunov function, for small x and no limits.

    Region: measured for the default top and 0.5 N m, from all tilts up to 1.2 rad with rates across
    e3 up to 1 rad/s, to goals of 0.3 to 0.9 rad within 15 s, at 1.2 to 2 times the critical spin.

    Attributes:
        top: symmetric top, I1 = I2.
        torque: largest torque about each of the two axes [N m].
        dt: control period [s].
        tilts: range of the goals, within (0, pi) [rad].
        spins: range of omega3, fast enough for both roots at all goals [rad/s].
        branch: "slow" or "fast", which of the two roots.

    Raises:
        ValueError: a top that is not symmetric, numbers that are not positive, ranges that are none
            or that hold a tilt and a spin without steady precession.

    Source: Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7.
    """

    top: HeavyTop
    torque: float
    dt: float
    tilts: tuple[float, float]
    spins: tuple[float, float]
    branch: str = "slow"

    def __post_init__(self) -> None:
        """Check everything, and that there is a steady precession at the slowest spin."""
        require(self.top.I1 == self.top.I2, self.top, "top", "a symmetric top, I1 = I2")
        positive(self.torque, "torque", "N m")
        positive(self.dt, "dt", "s")
        require(self.branch in _BRANCHES, self.branch, "branch", f"one of {_BRANCHES}")
        low, high = positive_array(self.tilts, "tilts", "rad", 2)
        require(low < high < np.pi, self.tilts, "tilts", "0 < least < largest < pi [rad]")
        slow, fast = positive_array(self.spins, "spins", "rad/s", 2)
        require(slow < fast, self.spins, "spins", "0 < least < largest [rad/s]")
        expected = (
            f"rates at which the top precesses steadily at a tilt of {low} rad [rad/s]: take "
            "faster ones"
        )
        steady = bool(np.isfinite(self.steady_rate(self.tilts[0], self.spins[0])))
        require(steady, self.spins, "spins", expected)

    def __call__(self, y: npt.ArrayLike, goal: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, each in [-1, 1], shape (..., 2).

        Args:
            y: states, shape (..., 11).
            goal: commanded tilts [rad], shape (...).
        """
        x, regulator = self._deviation(y, goal)
        u = regulator.feedback(x)
        n, _, _ = _upward(HeavyTop.checked_state(y))
        ahead = np.stack([-n[..., 1], n[..., 0]], axis=-1)
        return clip_to_box((u[..., :1] * n + u[..., 1:] * ahead) / self.torque)

    def inputs(self, action: npt.ArrayLike) -> Array:
        """Input u of `HeavyTop` [N m], shape (..., 8), of actions (..., 2)."""
        given = np.asarray(action, dtype=np.float64)
        return np.concatenate([self.torque * given, np.zeros((*given.shape[:-1], 6))], axis=-1)

    def value(self, y: npt.ArrayLike, goal: npt.ArrayLike) -> Array:
        """Cost to go of states (..., 11) and goals (...), for small x; of shape (...)."""
        x, regulator = self._deviation(y, goal)
        return regulator.value(x)

    def steady_rate(self, tilt: npt.ArrayLike, spin: npt.ArrayLike) -> Array:
        """The root f of this branch at tilts [rad] and spins [rad/s], shape (...) [rad/s]."""
        mgl = self.top.m * self.top.g * self.top.ell
        roots = steady_precession(tilt, spin, i_perp=self.top.I1, i3=self.top.I3, mgl=mgl)
        return roots[_BRANCHES.index(self.branch)]

    def regulator(self, tilt: float, spin: float) -> Regulator:
        """K and P in x = (theta - goal, theta', phi' - f), for u along n and l."""
        I1, s, c = self.top.I1, np.sin(tilt), np.cos(tilt)
        f = float(self.steady_rate(tilt, spin))
        kappa = self.top.I3 * spin / I1 - 2.0 * f * c
        A = np.array([[0.0, 1.0, 0.0], [-((f * s) ** 2), 0.0, -s * kappa], [0.0, kappa / s, 0.0]])
        B = np.array([[0.0, 0.0], [0.0, -1.0], [1.0 / s, 0.0]]) / I1
        turn = (spin - f * c) * np.array([[0.0, -1.0], [1.0, 0.0]])
        F, G = zero_order_hold(A, B, self.dt, turn)
        return lqr(F, G, [100.0, 10.0, 10.0], [3.0, 3.0])

    @cached_property
    def _table(self) -> Callable[..., Regulator]:
        return scheduled(
            self.regulator, np.linspace(*self.tilts, _NODES), np.linspace(*self.spins, _NODES)
        )

    def _deviation(self, y: npt.ArrayLike, goal: npt.ArrayLike) -> tuple[Array, Regulator]:
        """The deviation x, and the regulator there."""
        spin, tilt = HeavyTop.checked_state(y)[..., 6], np.asarray(goal, dtype=np.float64)
        steady = self.steady_rate(tilt, spin)
        x = nutation_of(y) - np.stack(np.broadcast_arrays(tilt, 0.0, steady), axis=-1)
        return x, self._table(tilt, spin)


def _upward(y: Array) -> tuple[Array, Array, Array]:
    """Direction of the vertical across e3, (n1, n2) in body axes, and sin and cos of theta."""
    vertical = rotations.rotate_inverse(y[..., :4], _E_Z)
    sine = np.maximum(np.hypot(vertical[..., 0], vertical[..., 1]), 1e-9)
    return vertical[..., :2] / sine[..., None], sine, vertical[..., 2]
