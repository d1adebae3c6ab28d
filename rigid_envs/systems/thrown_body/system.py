"""Thrown rigid body: free rotation in flight, under gravity."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, positive_fields
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.thrown_body.dynamics import THROWN_BODY


@dataclass(frozen=True)
class ThrownBody(FreeBody):
    """Rigid body in flight: a book, a racket, a plate, a ball that is thrown.

    $I omega' = I omega x omega + tau$ in body axes, $q' = q (0, omega) / 2$, $m x'' = F - m g z$
    in the world: rotation and flight do not know each other, as there is no air. In flight without
    torque and force the energy, the angular momentum $L$ about the centre of mass, and the
    horizontal velocity are conserved.

    State $y = (w, x, y, z, omega1, omega2, omega3, X, Y, Z, VX, VY, VZ)$: attitude, body to world,
    angular velocity in body axes [rad/s], position [m] and velocity [m/s] of the centre of mass.
    Input $u = (tau1, tau2, tau3, FX, FY, FZ)$: torque in body axes [N m]; force in world axes that
    acts at the centre of mass [N].

    The rotation is that of `FreeBody`, to the bit, with what it keeps to rounding. The centre of
    mass flies along the exact parabola of each interval.

    Attributes:
        I1: principal moment about e1 [kg m^2].
        I2: principal moment about e2 [kg m^2].
        I3: principal moment about e3 [kg m^2].
        m: mass [kg].
        g: gravitational acceleration, along -z of the world [m/s^2].

    Raises:
        ValueError: a mass or g that is not positive, or moments that no body has.

    Source: Ashbaugh, Chicone & Cushman 1991, "The twisting tennis racket", Journal of Dynamics and
    Differential Equations 3:67, doi:10.1007/BF01049489.
    """

    m: float = 1.0
    g: float = 9.81

    dynamics: ClassVar = THROWN_BODY
    components: ClassVar[Mapping[str, slice]] = {
        "q": slice(0, 4),
        "omega_body": slice(4, 7),
        "position": slice(7, 10),
        "velocity": slice(10, 13),
    }
    quantities: ClassVar = (*FreeBody.quantities, "energy")

    def __post_init__(self) -> None:
        """Check the parameters."""
        positive_fields(self, m="kg", g="m/s^2")
        super().__post_init__()

    def position(self, y: npt.ArrayLike) -> Array:
        """Position of the centre of mass [m], shape (..., 3)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 7:10])

    def velocity(self, y: npt.ArrayLike) -> Array:
        """Velocity of the centre of mass [m/s], shape (..., 3)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 10:13])

    def energy(self, y: npt.ArrayLike) -> Array:
        """Energy of rotation and flight, plus m g Z [J], shape (...)."""
        flight = 0.5 * np.sum(self.velocity(y) ** 2, axis=-1) + self.g * self.position(y)[..., 2]
        return np.asarray(self.kinetic_energy(y) + self.m * flight)
