"""The motion of any system around an instant, and states at which to look at it."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from rigid_envs.systems import System

__all__ = [
    "EPS",
    "Window",
    "examples",
    "largest",
    "matrices",
    "window",
]

Array = npt.NDArray[np.float64]
EPS = float(np.finfo(np.float64).eps)

_H = 0.01  # [s] see `window`
# Central differences of order 8 (Fornberg 1988, doi:10.1090/S0025-5718-1988-0935077-0).
_FIRST = np.array([3, -32, 168, -672, 0, 672, -168, 32, -3]) / 840.0
_SECOND = np.array([-9, 128, -1008, 8064, -14350, 8064, -1008, 128, -9]) / 5040.0


def largest(*values: npt.ArrayLike) -> float:
    """Largest absolute value; NaN if there is one among them."""
    return float(np.max([np.max(np.abs(value)) for value in values]))


def matrices(q: npt.ArrayLike) -> Array:
    """Rotation matrices of quaternions (w, x, y, z), shape (..., 4) to (..., 3, 3), by SciPy."""
    rows = np.asarray(q, dtype=np.float64)
    found = Rotation.from_quat(rows.reshape(-1, 4), scalar_first=True).as_matrix()
    return np.asarray(found.reshape(*rows.shape[:-1], 3, 3))


@dataclass(frozen=True)
class Window:
    """States at nine instants around one, _H apart, under a held input.

    Attributes:
        system: what moves.
        y: states, shape (9, ..., n_state); the instant is ``y[4]``.
        u: the input, shape (..., n_input).
    """

    system: System
    y: Array
    u: Array

    @property
    def now(self) -> Array:
        """The state at the instant, shape (..., n_state)."""
        return np.array(self.y[4])

    def rate(self, values: Array) -> Array:
        """Time derivative, at the instant, of values at all nine: shape (9, ...) to (...)."""
        return np.asarray(np.tensordot(_FIRST, values, 1) / _H)

    def acceleration(self, values: Array) -> Array:
        """Second time derivative at the instant."""
        return np.asarray(np.tensordot(_SECOND, values, 1) / _H**2)

    def omega(self) -> Array:
        """Angular velocity in world axes from R' R^T of the attitude alone, shape (..., 3)."""
        R = self.system.accessors["R"](self.y)
        spin = self.rate(R) @ np.swapaxes(R[4], -1, -2)
        return np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)


def window(system: System, y: Array, u: Array) -> Window:
    """The motion through a state, 0.04 s to both sides.

    Derivatives of what changes at a rate w have errors of h^8 w^9 / 630 and h^8 w^10 / 3150 from
    truncation and some eps / h and 10 eps / h^2 from roundings: for 6 rad/s 2e-12, and 2e-11 for
    second derivatives. `simulate` adds 1e-11 per radian, w and w^2 times that to derivatives.
    """
    inputs = np.broadcast_to(u, (4, *u.shape))
    ahead = system.simulate(y, _H * np.arange(5), inputs).y
    behind = system.simulate(y, -_H * np.arange(5), inputs).y
    return Window(system, np.concatenate([behind[:0:-1], ahead]), u)


def examples(system: System, n: int, size: float = 1.0) -> tuple[Array, Array]:
    """States and inputs of no symmetry, shapes (n, n_state) and (n, n_input).

    Attitudes all over the sphere; every other number is normal of the given size, the inputs are
    uniform up to it.
    """
    rng = np.random.default_rng(n)
    y = size * rng.normal(size=(n, len(system.state_entries)))
    if "q" in system.components:
        y[:, :4] /= np.linalg.norm(y[:, :4], axis=-1, keepdims=True)
    return y, size * rng.uniform(-1.0, 1.0, (n, len(system.input_entries)))
