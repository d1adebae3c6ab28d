"""From motions of a slow symmetric top to the one that ends upright, by the least impulse."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, CheckedFields, positive
from rigid_envs.control.linear import clip_to_ball
from rigid_envs.mechanics import rotations
from rigid_envs.systems.heavy_top.controllers import Complex, axis_of, check_balanced
from rigid_envs.systems.heavy_top.system import HeavyTop

_HEIGHTS = np.cos((np.arange(64) + 0.5) * np.pi / 64)  # cosines of tilts, where a nutation is seen


@dataclass(frozen=True)
class SleepTransfer(CheckedFields):
    """Lets a slow symmetric top fall and rise again, onto the motion that comes to rest upright.

    Free motion keeps L3 about the axis of the top, L_z about the vertical, and the energy E. A top
    that comes to rest upright, or has left it, has

        L3 = L_z,   E = L_z^2 / (2 I3) + m g ell,                                        (1)

    and moves as ``1 - cos(tilt) = 2 (growth^2 / fall) sech(growth t)^2`` with ``fall = m g ell /
    I1``, ``kappa = I3 omega3 / I1`` and ``growth^2 = fall - kappa^2 / 4``. A horizontal impulse J
    keeps L_z; it changes L3 by e . J and E by omega . J, with the horizontal parts e of the axis
    and omega of the angular velocity. From a tilt both changes that (1) needs are of second order
    in the tilt, but to hold the top there takes an impulse of first order. So J is given where the
    top moves fast, if ``efficiency |J|`` is at most the least size of J on the whole nutation.

    Near the upright, with ``b = e' - i kappa e / 2`` in complex numbers, ``u = b + growth e`` grows
    and ``s = b - growth e`` decays. From there the fall and the rise to within `tolerance` take

        [log(8 growth^2 / (sqrt(fall) |u|)) + log(4 growth / (sqrt(fall) tolerance))] / growth.

    Where that is longer than `patience`, while ``|s| < near sqrt(fall)``, there are two ways. If
    u is above `share` of what is in time, it is made `margin` times that; else it is cancelled.
    Above the critical spin nothing is done: the top sleeps by itself.

    Attributes:
        top: symmetric top, I1 = I2.
        torque: largest torque [N m].
        dt: control period [s].
        patience: longest time that may pass until the top is upright [s].
        tolerance: largest tilt of an upright top [rad].
        efficiency: least part of the best place of the nutation where an impulse is given.
        near: size of s near the upright, over sqrt(fall).
        share: least part of what is in time from which u is made larger.
        margin: what u is made then, over what is in time.

    Certificate: `needed`, which free motion keeps, and which falls at every impulse to second order
    in its size.

    Region: measured with a patience of 9.9 s, all of 3,000 starts of `SleepingTop` (tilts up to 0.2
    rad at 0.3 to 0.95 of the critical spin, 0.3 N m) are upright within 10 s.

    Raises:
        ValueError: a top that is not symmetric or cannot fall, numbers that are not positive.

    Source: for the motion (1), Landau & Lifshitz, *Mechanics*, section 35, problem 1; for impulses
    where they do most, Lawden 1963, *Optimal Trajectories for Space Navigation*.
    """

    top: HeavyTop
    torque: Annotated[float, positive, "N m"]
    dt: Annotated[float, positive, "s"]
    patience: Annotated[float, positive, "s"]
    tolerance: Annotated[float, positive, "rad"]
    efficiency: Annotated[float, positive, "1"] = 0.98
    near: Annotated[float, positive, "1"] = 0.27
    share: Annotated[float, positive, "1"] = 0.54
    margin: Annotated[float, positive, "1"] = 1.02

    def __post_init__(self) -> None:
        """Check the symmetry of the top and the numbers."""
        super().__post_init__()
        check_balanced(self.top)

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, in the disk, shape (..., 2), of states y (..., 11)."""
        rows = HeavyTop.checked_state(y)
        exponent, u, s = self._lean(rows)
        growth = exponent.real
        root = np.sqrt(self._fall)
        in_time = 32.0 * growth**3 / (self._fall * self.tolerance) * np.exp(-self.patience * growth)
        waits = (np.abs(s) < self.near * root) & (np.abs(u) < in_time)
        wanted = np.where(np.abs(u) > self.share * in_time, self.margin * in_time, 0.0)
        tau = np.where(waits, self._towards(wanted, exponent, u), self._steer(rows) / self.dt)
        tau = np.where(growth > 0.0, tau, 0.0)
        return clip_to_ball(np.stack([tau.real, tau.imag], axis=-1) / self.torque)

    def needed(self, y: npt.ArrayLike) -> Array:
        """Changes of L3 [N m s] and E [J] that lead to (1), shape (..., 2); y (..., 11)."""
        rows, top = HeavyTop.checked_state(y), self.top
        omega, height = rows[..., 4:7], rotations.rotate(rows[..., :4], [0.0, 0.0, 1.0])[..., 2]
        L = np.array([top.I1, top.I1, top.I3]) * omega
        L_z = rotations.rotate(rows[..., :4], L)[..., 2]
        E = 0.5 * np.sum(L * omega, axis=-1) + self._weight * height
        return np.stack([L_z - L[..., 2], 0.5 * L_z**2 / top.I3 + self._weight - E], axis=-1)

    @property
    def _weight(self) -> float:
        return self.top.m * self.top.g * self.top.ell

    @property
    def _fall(self) -> float:
        return self._weight / self.top.I1

    def _lean(self, rows: Array) -> tuple[Complex, Complex, Complex]:
        """Exponent growth + i kappa / 2, growth 0 above the critical spin; u and s [1/s]."""
        e, rate = np.moveaxis(axis_of(rows)[..., :2], -1, 0)
        half = 0.5 * self.top.I3 * rows[..., 6] / self.top.I1
        growth = np.sqrt(np.maximum(self._fall - half**2, 0.0))
        b = rate - 1j * half * e
        return growth + 1j * half, b + growth * e, b - growth * e

    def _towards(self, size: Array, exponent: Complex, u: Complex) -> Complex:
        """Torques that give u a size within a period, in its direction, if no limit were."""
        grown = np.exp(exponent * self.dt)
        change = grown * (1.0 - size / np.maximum(np.abs(u), 1e-300)) * u
        return np.asarray(-1j * self.top.I1 * change * exponent / (grown - 1.0))

    def _steer(self, rows: Array) -> Complex:
        """Impulses that lead to (1) where they cost little, 0 elsewhere [N m s]."""
        e = axis_of(rows)[..., 0]
        omega = rotations.rotate(rows[..., :4], rows[..., 4:7])
        w = omega[..., 0] + 1j * omega[..., 1]
        L3, E = np.moveaxis(self.needed(rows), -1, 0)
        across = (np.conj(e) * w).imag
        moves = np.abs(across) > 1e-9
        J = 1j * (E * e - L3 * w) / np.where(moves, across, 1.0)
        worth = self.efficiency * np.abs(J) <= self._least(rows, L3, E)
        return np.where(moves & worth, J, 0.0)

    def _least(self, rows: Array, L3: Array, E: Array) -> Array:
        """Least size of the impulse that leads to (1) from anywhere on the nutation [N m s]."""
        top, z = self.top, _HEIGHTS
        now = (top.I3 * rows[..., 6])[..., None]
        L_z, sine = now + L3[..., None], np.sqrt(1.0 - z**2)
        energy = 0.5 * L_z**2 / top.I3 + self._weight - E[..., None] - 0.5 * now**2 / top.I3
        sideways = (L_z - now * z) / (top.I1 * sine)  # rate of the axis along the parallel
        square = 2.0 * (energy - self._weight * z) / top.I1 - sideways**2  # of the rate of tilt
        along = L3[..., None] / sine  # J along the lean, and J along the horizontal axis of tilting
        outward = (now / top.I3) * sine - sideways * z
        with np.errstate(divide="ignore", invalid="ignore"):
            other = (E[..., None] - outward * along) / np.sqrt(square)
        return np.asarray(np.where(square > 0.0, np.hypot(along, other), np.inf).min(axis=-1))
