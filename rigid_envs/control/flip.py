"""Reversing a spin in the body: by the free flip, timed, and by brute force."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import array, number, positive, require
from rigid_envs.control.saddle import saddle
from rigid_envs.control.saturation import clip_to_box
from rigid_envs.control.spin import SpinLaw

__all__ = ["ForcedFlip", "TimedFlip"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class ForcedFlip(SpinLaw):
    """Turns the spin to -e2 by brute force: tau = -gain Omega I (omega + Omega e2).

    Certificate: the kinetic energy of the error e = omega + Omega e2, ``V = e . I e / 2``. With
    tau, Euler's equations give ``V' = Omega (I3 - I1) e1 e3 - 2 gain Omega V <= -(2 gain - (I3 -
    I1) / sqrt(I1 I3)) Omega V``: without limits -e2 is reached from everywhere. From e2 it costs
    the torque impulse 2 I2 Omega, twice the angular momentum.

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega [rad/s].
        torque: largest torque about each axis [N m].
        gain: rate of the approach over Omega.

    Raises:
        ValueError: moments in another order, numbers that are not positive, or a gain that does not
            make V decrease.

    Source: Landau & Lifshitz, *Mechanics*, section 36, for Euler's equations.
    """

    gain: float = 4.0

    def __post_init__(self) -> None:
        """Check the gain too."""
        super().__post_init__()
        I1, _, I3 = self.body.moments
        _check_gain(self.gain, 0.5 * (I3 - I1) / math.sqrt(I1 * I3))

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, shape (..., 3), of states y, shape (..., 7)."""
        torque = -self.gain * self.rate * self.body.moments * self._error(y)
        return clip_to_box(torque / self.torque)

    def lyapunov(self, y: npt.ArrayLike) -> Array:
        """V of states y, shape (..., 7); of shape (...) [J]."""
        return np.asarray(0.5 * np.sum(self.body.moments * self._error(y) ** 2, axis=-1))

    def _error(self, y: npt.ArrayLike) -> Array:
        return self.omega(y) - [0.0, -self.rate, 0.0]


@dataclass(frozen=True)
class TimedFlip(SpinLaw):
    """Lets the spin flip from e2 to -e2 by itself, in time: tau = -gain Omega I (omega - f).

    f is a free motion. On the separatrix with s = 0 (see `Saddle`), with t the time after the half
    flip and D = 1 / sqrt(share),

        f2 = -Omega tanh(growth Omega t),   d = +- Omega D / cosh(growth Omega t),

    the one of these that is `margin` away from -e2 when no time is left, with the sign of d that
    omega has. Afterwards d decreases by itself, and only s and the rate are held. The only effort
    is that of joining f, and that falls like exp(-growth Omega T) with the time T that is given.

    Certificate: the kinetic energy of the difference e = omega - f, ``V = e . I e / 2``. With tau,
    until the commanded time,

        V' = f . (e x I e) - 2 gain Omega V <= -(2 gain - c) Omega V,
        c = sqrt(I2 / I1) (I3 - I1) / sqrt(I1 I3),

    as ``|f| <= sqrt(I2 / I1) Omega`` by its energy, and ``|e x I e| <= (I3 - I1) / sqrt(I1 I3) V``
    by Kantorovich's inequality: without limits f is joined from everywhere. (The sign of d decides
    between two f, of which the nearer one is taken.)

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega [rad/s].
        torque: largest torque about each axis [N m].
        margin: norm(omega + Omega e2) / Omega that is left at the commanded time.
        gain: rate at which f is joined over Omega.

    Raises:
        ValueError: moments in another order, numbers that are not positive, or a gain that does not
            make V decrease.

    Source: Landau & Lifshitz, *Mechanics*, section 37; Van Damme, Mardesic & Sugny 2017,
    arXiv:1606.08237.
    """

    margin: float = 0.03
    gain: float = 1.5

    def __post_init__(self) -> None:
        """Check the margin and the gain too."""
        super().__post_init__()
        positive(self.margin, "margin", "1")
        I1, I2, I3 = self.body.moments
        _check_gain(self.gain, 0.5 * math.sqrt(I2 / I1) * (I3 - I1) / math.sqrt(I1 * I3))

    def __call__(self, y: npt.ArrayLike, time_left: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, shape (..., 3).

        Args:
            y: states, shape (..., 7).
            time_left: until the commanded time [s], shape (...); 0 or less afterwards.
        """
        error = self.omega(y) - self.reference(y, time_left)
        return clip_to_box(-self.gain * self.rate * self.body.moments * error / self.torque)

    def lyapunov(self, y: npt.ArrayLike, time_left: npt.ArrayLike) -> Array:
        """V of states y, shape (..., 7); of shape (...) [J]."""
        error = self.omega(y) - self.reference(y, time_left)
        return np.asarray(0.5 * np.sum(self.body.moments * error**2, axis=-1))

    def reference(self, y: npt.ArrayLike, time_left: npt.ArrayLike) -> Array:
        """The free motion f to join [rad/s], shape (..., 3); arguments as of the law itself."""
        r, growth, share = shape = saddle(self.body.moments)
        d, _ = shape.coordinates(self.omega(y) / self.rate)
        most = 1.0 / math.sqrt(share)
        last = 2.0 * self.margin / math.hypot(1.0, 1.0 / r)  # d there: omega1 = d / 2 = -r omega3
        left = array(time_left, "time_left")
        phase = growth * self.rate * np.maximum(left, 0.0) - math.acosh(most / last)
        before = left > 0.0
        d_free = np.where(before, np.copysign(most / np.cosh(phase), d), d)
        late = -np.sqrt(np.maximum(1.0 - (d / most) ** 2, 0.0))
        w2_free = np.where(before, np.tanh(phase), late)
        return self.rate * np.stack([0.5 * d_free, w2_free, -0.5 * d_free / r], axis=-1)


def _check_gain(gain: float, least: float) -> None:
    expected = f"more than {least:.4g}, for the error of this body to decrease"
    require(number(gain, "gain") > least, gain, "gain", expected)
