"""Balancing slow symmetric tops: by horizontal torque, and by moving the pivot."""

from __future__ import annotations

import abc
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.checks import positive, require
from rigid_envs.control.linear import Regulator, lqr, scheduled, zero_order_hold
from rigid_envs.control.saturation import clip_to_ball
from rigid_envs.systems import HeavyTop

__all__ = ["PivotBalance", "TopBalance", "UprightBalance", "axis_of"]

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
_E_Z = np.array([0.0, 0.0, 1.0])
_SPINS = np.linspace(-1.5, 1.5, 31)  # in parts of the critical spin, for which there are gains


def axis_of(y: npt.ArrayLike) -> Complex:
    """Horizontal part of a top's axis, and of its pivot's position, in complex numbers.

    Args:
        y: states of `HeavyTop`, shape (..., 11).

    Returns:
        x = (e, e', X, X') with e = e_x + i e_y of the axis e3 in the world, X = X + i Y of the
        pivot [1, 1/s, m, m/s], shape (..., 4).
    """
    rows = HeavyTop.checked_state(y)
    e = rotations.rotate(rows[..., :4], _E_Z)
    rate = np.cross(rotations.rotate(rows[..., :4], rows[..., 4:7]), e)
    plane = np.stack([e[..., :2], rate[..., :2], rows[..., 7:9], rows[..., 9:11]], axis=-2)
    return np.asarray(plane[..., 0] + 1j * plane[..., 1])


@dataclass(frozen=True)
class TopBalance(abc.ABC):
    """Keeps a symmetric top upright by linear feedback of `axis_of`, scheduled on its spin.

    Attributes:
        top: symmetric top, I1 = I2.
        limit: largest input [N m or m/s^2].
        dt: control period [s].

    Raises:
        ValueError: a top that is not symmetric or cannot fall, numbers that are not positive.
    """

    top: HeavyTop
    limit: float
    dt: float

    _n: ClassVar[int]
    """How many entries of `axis_of` are fed back."""
    _inputs: ClassVar[slice]
    """Where the two components of the input stand in u of `HeavyTop`."""
    _weights: ClassVar[tuple[list[float], list[float]]]
    """Weights of the states and of the input."""

    def __post_init__(self) -> None:
        """Check the symmetry of the top and the numbers."""
        require(self.top.I1 == self.top.I2, self.top, "top", "a symmetric top, I1 = I2")
        weighs = self.top.critical_spin > 0.0
        require(weighs, self.top, "top", "a top that can fall, g and ell above 0")
        positive(self.limit, "limit", "N m or m/s^2")
        positive(self.dt, "dt", "s")

    @abc.abstractmethod
    def model(self, spin: float) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        """A and B of the linear equation x' = A x + B u at a spin omega3 [rad/s]."""

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, inputs over the largest, in the disk, shape (..., 2), of states y (..., 11)."""
        u = self._regulator(y).feedback(axis_of(y)[..., : self._n])[..., 0]
        return clip_to_ball(np.stack([u.real, u.imag], axis=-1) / self.limit)

    def inputs(self, action: npt.ArrayLike) -> Array:
        """Input u of `HeavyTop`, shape (..., 8), of actions (..., 2)."""
        given = np.asarray(action, dtype=np.float64)
        u = np.zeros((*given.shape[:-1], 8))
        u[..., self._inputs] = self.limit * given
        return u

    def value(self, y: npt.ArrayLike) -> Array:
        """Cost to go x* P x of states y, shape (..., 11), for small tilts and no limits; (...)."""
        return self._regulator(y).value(axis_of(y)[..., : self._n])

    def regulator(self, spin: float) -> Regulator:
        """K and P, complex, at a spin omega3 [rad/s]."""
        return lqr(*zero_order_hold(*self.model(spin), self.dt), *self._weights)

    @cached_property
    def _table(self) -> Callable[..., Regulator]:
        return scheduled(self.regulator, self.top.critical_spin * _SPINS)

    def _regulator(self, y: npt.ArrayLike) -> Regulator:
        return self._table(HeavyTop.checked_state(y)[..., 6])


@dataclass(frozen=True)
class UprightBalance(TopBalance):
    """Keeps a slow top upright by a horizontal torque, given in world axes.

    In complex numbers, with e = e_x + i e_y of the axis and tau = tau_x + i tau_y,

        I1 e'' - i I3 omega3 e' - m g ell e = -i tau,

    exactly linear but for terms of third order in the tilt. The torque tau = -K(omega3) (e, e') has
    the least sum of ``|e|^2 + 0.1 |e'|^2 + 0.03 |tau|^2`` over the control periods.

    Certificate: the Riccati matrix, 2 x 2 and Hermitian, at every spin: ``value(y) = x* P x`` is
    the sum from there on, and decreases. (It is interpolated between 31 spins up to 1.5 of the
    critical one, in either sense; faster ones are taken for that.)

    Region: in the linear equation no torque of size M brings back a tilt beyond ``M / (m g ell
    sqrt(1 - share^2))`` [rad] that is released with e' = 0, where share is the spin over the
    critical one. This law brings back 0.95 of that (measured, up to 0.65 rad). Its eigenvalues stay
    inside the unit circle if moments, mass and length are each up to 15 % off (measured).

    Attributes:
        top: symmetric top, I1 = I2.
        limit: largest torque [N m].
        dt: control period [s].

    Raises:
        ValueError: a top that is not symmetric or cannot fall, numbers that are not positive.

    Source: Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7; Anderson & Moore, *Optimal
    Control: Linear Quadratic Methods*, section 3.3.
    """

    _n: ClassVar[int] = 2
    _inputs: ClassVar[slice] = slice(3, 5)
    _weights: ClassVar[tuple[list[float], list[float]]] = ([1.0, 0.1], [0.03])

    def model(self, spin: float) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        """A and B for x = (e, e') and the torque at a spin omega3 [rad/s]."""
        top = self.top
        fall, turn = top.m * top.g * top.ell / top.I1, 1j * top.I3 * spin / top.I1
        return np.array([[0.0, 1.0], [fall, turn]]), np.array([[0.0], [-1j / top.I1]])


@dataclass(frozen=True)
class PivotBalance(TopBalance):
    """Keeps a slow top upright by accelerating its pivot, and brings the pivot to the origin.

    In complex numbers, with e = e_x + i e_y of the axis and X = X + i Y of the pivot,

        I1 e'' - i I3 omega3 e' - m g ell e = -m ell a,   X'' = a.

    The acceleration a = -K(omega3) (e, e', X, X') has the least sum of ``|e|^2 + |e'|^2 + 0.05
    |X|^2 + 0.2 |X'|^2 + 0.03 |a|^2`` over the control periods.

    Certificate: the Riccati matrix, 4 x 4 and Hermitian, as of `UprightBalance`.

    Region: measured for the default top and 3 m/s^2, tilts up to 0.16 rad are brought back within 5
    m of the origin at 0.3 of the critical spin. Moments, mass and length may each be 5 % off.

    Attributes:
        top: symmetric top, I1 = I2.
        limit: largest acceleration [m/s^2].
        dt: control period [s].

    Raises:
        ValueError: a top that is not symmetric or cannot fall, numbers that are not positive.

    Source: Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7, in the accelerated frame
    of the pivot.
    """

    _n: ClassVar[int] = 4
    _inputs: ClassVar[slice] = slice(6, 8)
    _weights: ClassVar[tuple[list[float], list[float]]] = ([1.0, 1.0, 0.05, 0.2], [0.03])

    def model(self, spin: float) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        """A and B for x = (e, e', X, X') and the acceleration at a spin omega3 [rad/s]."""
        top = self.top
        fall, turn = top.m * top.g * top.ell / top.I1, 1j * top.I3 * spin / top.I1
        A = np.zeros((4, 4), dtype=np.complex128)
        A[0, 1] = A[2, 3] = 1.0
        A[1, :2] = fall, turn
        return A, np.array([[0.0], [-top.m * top.ell / top.I1], [0.0], [1.0]])
