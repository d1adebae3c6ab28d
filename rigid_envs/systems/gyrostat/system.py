"""Gyrostat: a satellite with reaction wheels, torque-free or under torques."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, non_negative, require
from rigid_envs.mechanics.equations import TurningBody
from rigid_envs.mechanics.system import System, principal_moments
from rigid_envs.systems.gyrostat.dynamics import GYROSTAT


@dataclass(frozen=True)
class Gyrostat(TurningBody, System):
    """Rigid body, the carrier, with up to three symmetric wheels along its principal axes.

    $L = A omega + l$, $L' = L x omega + tau$, $l' = u$, $q' = q (0, omega) / 2$, all in body axes,
    with $A_k = I_k - J_k$ and the spin momenta $l_k = J_k (omega_k + wheel_k)$. The motors act
    between carrier and wheels, so they cannot change $L$ in space. Without torques the energy, $L$
    in space and every $l_k$ are conserved: a wheel whose motor is off turns freely.

    State $y = (w, x, y, z, omega1, omega2, omega3, wheel1, wheel2, wheel3)$: attitude, body to
    world, angular velocity of the carrier in body axes, rates of the wheels relative to the carrier
    [rad/s]. Input $u = (u1, u2, u3, tau1, tau2, tau3)$: torques of the motors on the wheels, which
    act on the carrier with the other sign, and torque on the carrier in body axes [N m].

    The integrator is a symmetric splitting into exact rotations, composed to fourth order: $l$, the
    size of $L$ and $L$ in space are kept to rounding, the energy error is bounded for ever. It
    splits off the turn about $L$ that a sphere of the moment $A2$ would make. The rates that limit
    its step are those of the carrier and of the two parts, $L / A2$ and $omega - L / A2$.

    Attributes:
        I1: principal moment about e1 of the carrier with locked wheels [kg m^2].
        I2: the same about e2 [kg m^2].
        I3: the same about e3 [kg m^2].
        J1: moment of the wheel along e1 about its axis [kg m^2]; 0, the default, is no wheel.
        J2: the same along e2 [kg m^2].
        J3: the same along e3 [kg m^2].

    Raises:
        ValueError: moments that no body has, a negative moment of a wheel or one that is not less
            than that of the whole.

    Source: Hughes, *Spacecraft Attitude Dynamics*, chapters 3 and 6; Volterra 1899, Acta
    Mathematica 22:201, doi:10.1007/BF02417877.
    """

    I1: float = 2.0
    I2: float = 2.5
    I3: float = 3.0
    J1: float = 0.0
    J2: float = 0.0
    J3: float = 0.0

    dynamics: ClassVar = GYROSTAT
    components: ClassVar[Mapping[str, slice]] = {
        "q": slice(0, 4),
        "omega_body": slice(4, 7),
        "wheel_rates": slice(7, 10),
    }
    quantities: ClassVar = (
        "omega_world",
        "L_body",
        "L_world",
        "spin_momenta",
        "kinetic_energy",
    )

    def __post_init__(self) -> None:
        """Check the moments."""
        principal_moments(self.I1, self.I2, self.I3)
        for k in "123":
            whole, wheel = getattr(self, f"I{k}"), getattr(self, f"J{k}")
            non_negative(wheel, f"J{k}", "kg m^2")
            expected = f"less than I{k} = {whole}, which counts the wheel"
            require(bool(wheel < whole), wheel, f"J{k}", expected)
        super().__post_init__()

    @property
    def moments(self) -> Array:
        """Principal moments with locked wheels (I1, I2, I3) [kg m^2]."""
        return np.array([self.I1, self.I2, self.I3])

    @property
    def wheel_moments(self) -> Array:
        """Moments of the wheels about their axes (J1, J2, J3) [kg m^2]."""
        return np.array([self.J1, self.J2, self.J3])

    @property
    def carrier_moments(self) -> Array:
        """Moments A = I - J that the carrier has about the axes of free wheels [kg m^2]."""
        return self.moments - self.wheel_moments

    def wheel_rates(self, y: npt.ArrayLike) -> Array:
        """Rates of the wheels relative to the carrier [rad/s], shape (..., 3)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 7:10])

    def spin_momenta(self, y: npt.ArrayLike) -> Array:
        """Angular momenta of the wheels along their axes, in space [N m s], shape (..., 3)."""
        return self.wheel_moments * (self.omega_body(y) + self.wheel_rates(y))

    def L_body(self, y: npt.ArrayLike) -> Array:
        """Angular momentum of carrier and wheels in body axes [N m s], shape (..., 3)."""
        return self.moments * self.omega_body(y) + self.wheel_moments * self.wheel_rates(y)

    def kinetic_energy(self, y: npt.ArrayLike) -> Array:
        """Kinetic energy of carrier and wheels [J], shape (...)."""
        turning = self.carrier_moments * self.omega_body(y) ** 2
        spinning = self.wheel_moments * (self.omega_body(y) + self.wheel_rates(y)) ** 2
        return np.asarray(0.5 * np.sum(turning + spinning, axis=-1))

    def rate_bound(self, y: Array, u: Array, duration: float) -> float:
        """Bound on the rates of the carrier and of the turns that a step is made of [rad/s].

        With s = sqrt(omega . A omega): s' <= norm(tau - u) / sqrt(A_min), norm(L)' <= norm(tau),
        and no rate is above norm(omega) + norm(L) / A2.
        """
        least, motor = (
            self.carrier_moments.min(),
            np.where(self.wheel_moments > 0.0, u[..., :3], 0.0),
        )
        push = float(np.max(np.linalg.norm(u[..., 3:] - motor, axis=-1), initial=0.0))
        torque = float(np.max(np.linalg.norm(u[..., 3:], axis=-1), initial=0.0))
        turning = np.sum(self.carrier_moments * self.omega_body(y) ** 2, axis=-1)
        s = math.sqrt(float(np.max(turning, initial=0.0))) + push * duration / math.sqrt(least)
        L = float(np.max(np.linalg.norm(self.L_body(y), axis=-1), initial=0.0)) + torque * duration
        return s / math.sqrt(least) + L / float(self.carrier_moments[1])
