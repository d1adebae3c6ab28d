"""Balancing a heavy top with three different moments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.checks import positive
from rigid_envs.control.linear import Regulator, lqr, scheduled, zero_order_hold
from rigid_envs.control.saturation import clip_to_box
from rigid_envs.systems import HeavyTop

__all__ = ["AsymmetricBalance", "vertical_of"]

Array = npt.NDArray[np.float64]
_E_Z = np.array([0.0, 0.0, 1.0])
_NODES = 25  # spins for which there are gains


def vertical_of(y: npt.ArrayLike) -> Array:
    """(G1, G2, omega1, omega2) of states y of `HeavyTop`, with the vertical G in body axes.

    Args:
        y: shape (..., 11).

    Returns:
        Shape (..., 4) [1, rad/s].
    """
    rows = HeavyTop.checked_state(y)
    vertical = rotations.rotate_inverse(rows[..., :4], _E_Z)
    return np.concatenate([vertical[..., :2], rows[..., 4:6]], axis=-1)


@dataclass(frozen=True)
class AsymmetricBalance:
    """Keeps a top of any three moments upright, at whatever rate it turns about e3.

    Near upright, with the vertical G = R^T e_z and x = (G1, G2, omega1, omega2),

        x1' = omega3 x2 - x4,   I1 x3' = (I2 - I3) omega3 x4 + m g ell x2 + tau1,
        x2' = x3 - omega3 x1,   I2 x4' = (I3 - I1) omega3 x3 - m g ell x1 + tau2,

    and omega3 changes only with the product of x3 and x4. The torque (tau1, tau2) = -K(omega3) x
    has the least sum of ``x1^2 + x2^2 + 0.1 (x3^2 + x4^2) + 0.03 |tau|^2`` over the control
    periods; there is none about e3. K is interpolated between 25 spins; faster ones are taken for
    the fastest.

    Certificate: the Riccati matrix P at every spin: ``value(y) = x P x`` is the sum from there on,
    and a Lyapunov function, for small x and no limits.

    Region: measured for the moments (0.925, 1.15, 0.55), m g ell = 1 N m and 0.3 N m, tilts at rest
    up to 0.3 rad in any direction are brought back at all spins up to 2 rad/s. The eigenvalues stay
    inside the unit circle if the moments are others of 0.85 .. 1, 1.05 .. 1.25 and 0.45 .. 0.65.

    Attributes:
        top: heavy top of any moments.
        torque: largest torque about each axis [N m].
        dt: control period [s].
        fastest: largest abs(omega3) for which there are gains [rad/s].

    Raises:
        ValueError: numbers that are not positive.

    Source: Goldstein, Poole & Safko, *Classical Mechanics*, sections 5.5 and 5.7.
    """

    top: HeavyTop
    torque: float
    dt: float
    fastest: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        positive(self.torque, "torque", "N m")
        positive(self.dt, "dt", "s")
        positive(self.fastest, "fastest", "rad/s")

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, in [-1, 1], shape (..., 3), of states (..., 11)."""
        torque = self._regulator(y).feedback(vertical_of(y))
        return clip_to_box(np.concatenate([torque, 0.0 * torque[..., :1]], axis=-1) / self.torque)

    def inputs(self, action: npt.ArrayLike) -> Array:
        """Input u of `HeavyTop` [N m], shape (..., 8), of actions (..., 3)."""
        given = np.asarray(action, dtype=np.float64)
        return np.concatenate([self.torque * given, np.zeros((*given.shape[:-1], 5))], axis=-1)

    def value(self, y: npt.ArrayLike) -> Array:
        """Cost to go of states y, shape (..., 11), for small x; of shape (...)."""
        return self._regulator(y).value(vertical_of(y))

    def model(self, spin: float) -> tuple[Array, Array]:
        """A and B for x = (G1, G2, omega1, omega2) and (tau1, tau2) at a spin omega3 [rad/s]."""
        I1, I2, I3 = self.top.moments
        mgl = self.top.m * self.top.g * self.top.ell
        A = np.array(
            [
                [0.0, spin, 0.0, -1.0],
                [-spin, 0.0, 1.0, 0.0],
                [0.0, mgl / I1, 0.0, (I2 - I3) * spin / I1],
                [-mgl / I2, 0.0, (I3 - I1) * spin / I2, 0.0],
            ]
        )
        return A, np.array([[0.0, 0.0], [0.0, 0.0], [1.0 / I1, 0.0], [0.0, 1.0 / I2]])

    def regulator(self, spin: float) -> Regulator:
        """K and P at a spin omega3 [rad/s]."""
        held = zero_order_hold(*self.model(spin), self.dt)
        return lqr(*held, [1.0, 1.0, 0.1, 0.1], [0.03, 0.03])

    @cached_property
    def _table(self) -> Callable[..., Regulator]:
        return scheduled(self.regulator, self.fastest * np.linspace(-1.0, 1.0, _NODES))

    def _regulator(self, y: npt.ArrayLike) -> Regulator:
        return self._table(HeavyTop.checked_state(y)[..., 6])
