"""Holding spin about the intermediate axis e2 by torques that keep a changed energy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import number, positive, require
from rigid_envs.control.saturation import clip_to_box
from rigid_envs.control.spin import SpinLaw

__all__ = ["EnergyCasimir", "SingleTorque"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class SingleTorque(SpinLaw):
    """Aligns the spin with e2 by one torque: tau3 = eps omega1 omega2 - k omega3.

    With ``a = eps - (I2 - I1)``, Euler's third equation becomes ``I3 omega3' = a omega1 omega2 - k
    omega3``. If a > 0 the gyroscopic term has changed its sign: e2 is stable, if a < 0 it is not.
    Under any torque about e3 ``C = I1 (I3 - I1) omega1^2 + I2 (I3 - I2) omega2^2`` is constant, so
    the rate at the end is sqrt(C / (I2 (I3 - I2))), whatever Omega is.

    Certificate: the Lyapunov function

        D = a I1 omega1^2 / 2 + (I3 - I2) I3 omega3^2 / 2,   D' = -(I3 - I2) k omega3^2.

    Where ``D < a C / (2 (I3 - I1))``, omega2 cannot change its sign, as all of C would have to be
    in omega1; so where omega2 > 0 too the spin is led to e2 (LaSalle), from as far away as that:
    `certified`. That is without limits. Measured for the body (1, 2, 3), Omega = 1 and 0.45 N m,
    perturbations up to 0.22 rad/s are brought back while omega2 stays positive; along the unstable
    direction (see `SpinRegulator`) d up to 0.46, where 0.45 can be held at constant omega2.

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega of the spin about e2 [rad/s].
        torque: largest torque about e3 [N m].
        strength: eps / (I2 - I1); above 1.
        damping: k / (I3 Omega).

    Raises:
        ValueError: moments in another order, or numbers that are not positive.

    Source: Bloch & Marsden 1990, doi:10.1016/0167-6911(90)90055-Y.
    """

    strength: float = 3.0
    damping: float = 5.0 / 3.0

    def __post_init__(self) -> None:
        """Check the gains too; a law that is too weak may be made, to see it fail."""
        super().__post_init__()
        positive(self.strength, "strength", "1")
        positive(self.damping, "damping", "1")

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, shape (..., 1), of states y, shape (..., 7)."""
        w1, w2, w3 = np.moveaxis(self.omega(y), -1, 0)
        torque = self.eps * w1 * w2 - self.k * w3
        return clip_to_box(np.asarray(torque / self.torque)[..., None])

    def inputs(self, action: npt.ArrayLike) -> Array:
        """Input u of `FreeBody` [N m], shape (..., 3), of actions (..., 1)."""
        return super().inputs(action) * [0.0, 0.0, 1.0]

    @property
    def threshold(self) -> float:
        """Stability threshold of eps, I2 - I1 [kg m^2]."""
        return self.body.I2 - self.body.I1

    @property
    def eps(self) -> float:
        """Strength of the first term [kg m^2]."""
        return self.strength * self.threshold

    @property
    def k(self) -> float:
        """Strength of the damping [N m s]."""
        return self.damping * self.body.I3 * self.rate

    def exponents(self) -> npt.NDArray[np.complex128]:
        """Characteristic exponents mu of small departures from e2 [1/s], shape (2,), complex.

        ``mu^2 + k mu / I3 + a (I3 - I2) Omega^2 / (I1 I3) = 0``.
        """
        I1, I2, I3 = self.body.moments
        stiffness = (self.eps - self.threshold) * (I3 - I2) * self.rate**2 / (I1 * I3)
        half = 0.5 * self.k / I3
        root = np.sqrt(complex(half**2 - stiffness))
        return np.array([-half + root, -half - root])

    def lyapunov(self, y: npt.ArrayLike) -> Array:
        """D of states y, shape (..., 7); of shape (...) [kg^2 m^4/s^2]."""
        I1, I2, I3 = self.body.moments
        w1, _, w3 = np.moveaxis(self.omega(y), -1, 0)
        return np.asarray(0.5 * ((self.eps - self.threshold) * I1 * w1**2 + (I3 - I2) * I3 * w3**2))

    def certified(self, y: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Whether states y, shape (..., 7), lead to e2 without limits; shape (...)."""
        I1, I2, I3 = self.body.moments
        w1, w2, _ = np.moveaxis(self.omega(y), -1, 0)
        level = (
            0.5 * (self.eps - self.threshold) * (I1 * w1**2 + I2 * (I3 - I2) / (I3 - I1) * w2**2)
        )
        return np.asarray((self.lyapunov(y) < level) & (w2 > 0.0))


@dataclass(frozen=True)
class EnergyCasimir(SpinLaw):
    """Holds the spin by `SingleTorque` about e3, and by damping about e1 and e2.

    ``tau = (-k1 omega1, -k2 (omega2 - Omega), eps omega1 omega2 - k3 omega3)``, each k_j = damping
    Omega I_j. Energy and Casimir function of the body that the eps-term makes of this one,

        V = ((a + s) I1 omega1^2 + s (I3 - I2) / (I3 - I1) I2 (omega2 - Omega)^2
             + (I3 - I2) I3 omega3^2) / 2,

    with a = eps - (I2 - I1) > 0 and any s > 0, change under these torques only through

        V' = -(a + s) k1 omega1^2 - s (I3 - I2) / (I3 - I1) k2 (omega2 - Omega)^2
             - (I3 - I2) (k3 omega3^2 + s Omega omega1 omega3).

    Certificate: with ``s = 2 damping^2 I1 I3 / (I3 - I2)`` V' is negative everywhere but at the
    spin: without limits it is reached from every state there is. Measured for the body (1, 2, 3),
    Omega = 1 and 0.2 N m, perturbations up to 0.26 rad/s are brought back while omega2 stays
    positive.

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega of the spin about e2 [rad/s].
        torque: largest torque about each axis [N m].
        strength: eps / (I2 - I1), above 1.
        damping: rate of the decay over Omega.

    Raises:
        ValueError: moments in another order, a strength up to 1, or numbers that are not positive.

    Source: Bloch & Marsden 1990, doi:10.1016/0167-6911(90)90055-Y; V' from Euler's equations.
    """

    strength: float = 3.0
    damping: float = 3.0

    def __post_init__(self) -> None:
        """Check the gains too."""
        super().__post_init__()
        positive(self.damping, "damping", "1")
        strong = number(self.strength, "strength", "1") > 1.0
        require(strong, self.strength, "strength", "more than 1, the threshold")

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, shape (..., 3), of states y, shape (..., 7)."""
        w1, w2, _ = np.moveaxis(self.omega(y), -1, 0)
        eps = self.strength * (self.body.I2 - self.body.I1)
        torque = -self.damping * self.rate * self.body.moments * self.error(y)
        torque[..., 2] += eps * w1 * w2
        return clip_to_box(torque / self.torque)

    def lyapunov(self, y: npt.ArrayLike) -> Array:
        """V of states y, shape (..., 7); of shape (...) [kg^2 m^4/s^2]."""
        return np.asarray(0.5 * np.sum(self._weights * self.body.moments * self.error(y) ** 2, -1))

    def lyapunov_rate(self, y: npt.ArrayLike) -> Array:
        """V' of states y, shape (..., 7), without limits; of shape (...) [kg^2 m^4/s^3]."""
        e1, e2, e3 = np.moveaxis(self.error(y), -1, 0)
        k = self.damping * self.rate * self.body.moments
        lost = np.sum(self._weights * k * np.stack([e1, e2, e3], axis=-1) ** 2, axis=-1)
        return np.asarray(-lost - self._share * (self.body.I3 - self.body.I2) * self.rate * e1 * e3)

    @property
    def _share(self) -> float:
        """Share s of the Casimir function, in the middle of those that V' allows."""
        return 2.0 * self.damping**2 * self.body.I1 * self.body.I3 / (self.body.I3 - self.body.I2)

    @property
    def _weights(self) -> Array:
        """Of I_j times the squares in 2 V."""
        I1, I2, I3 = self.body.moments
        s, a = self._share, (self.strength - 1.0) * (I2 - I1)
        return np.array([a + s, s * (I3 - I2) / (I3 - I1), I3 - I2])
