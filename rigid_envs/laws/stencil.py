"""Time derivatives of a simulated motion by central differences of order eight.

Source: Fornberg 1988, doi:10.1090/S0025-5718-1988-0935077-0.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs.systems import System

__all__ = ["Stencil", "stencil"]

Array = npt.NDArray[np.float64]

_H = 0.01  # [s] see `stencil`
_FIRST = np.array([3, -32, 168, -672, 0, 672, -168, 32, -3]) / 840.0
_SECOND = np.array([-9, 128, -1008, 8064, -14350, 8064, -1008, 128, -9]) / 5040.0
_MIDDLE = 4


@dataclass(frozen=True)
class Stencil:
    """States at nine times, 0.01 s apart, under a constant input; derivatives at the middle one.

    Attributes:
        system: what is simulated.
        y: states, shape (9, ..., n_state).
        u: input, shape (..., n_input).
    """

    system: System
    y: Array
    u: Array

    @property
    def middle(self) -> Array:
        """The state at the middle time, shape (..., n_state)."""
        return np.array(self.y[_MIDDLE])

    def rate(self, values: Array) -> Array:
        """First time derivative of values at all nine times, shape (9, ...) to (...)."""
        return np.asarray(np.tensordot(_FIRST, values, 1) / _H)

    def acceleration(self, values: Array) -> Array:
        """Second time derivative of values at all nine times, shape (9, ...) to (...)."""
        return np.asarray(np.tensordot(_SECOND, values, 1) / _H**2)

    def omega(self) -> Array:
        """Angular velocity in world axes [rad/s] from R' R^T, shape (..., 3)."""
        R = self.system.accessors["R"](self.y)
        spin = self.rate(R) @ np.swapaxes(R[_MIDDLE], -1, -2)
        return np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)


def stencil(system: System, y: Array, u: Array) -> Stencil:
    """The motion through a state, from 0.04 s before to 0.04 s after.

    Derivatives of what changes at a rate w have truncation errors h^8 w^9 / 630 and h^8 w^10 / 3150
    and rounding errors of some eps / h and 10 eps / h^2: 2e-12 and 2e-11 at 6 rad/s. `simulate`
    adds 1e-11 per radian, times w and w^2.
    """
    inputs = np.broadcast_to(u, (4, *u.shape))
    ahead = system.simulate(y, _H * np.arange(5), inputs).y
    behind = system.simulate(y, -_H * np.arange(5), inputs).y
    return Stencil(system, np.concatenate([behind[:0:-1], ahead]), u)
