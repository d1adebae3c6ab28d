"""Satellite on a circular orbit, with gravity gradient and magnetic coils."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, non_negative, number, require
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.equations import TurningBody, gamma, quaternion
from rigid_envs.mechanics.system import System, fastest_turn, principal_moments
from rigid_envs.systems.satellite.dynamics import SATELLITE


@dataclass(frozen=True)
class Satellite(TurningBody, System):
    """Rigid body on a circular orbit, turned by the gravity gradient and by its magnetic dipole.

    $I omega' = I omega x omega + 3 n^2 r x I r + m x B$, $q' = q (0, omega) / 2$ in body axes;
    $alpha' = n$ for the argument of latitude. The world's axes are fixed in space: z is along the
    orbit's normal, x points to the ascending node. There $r = (cos alpha, sin alpha, 0)$ points
    away from the Earth's centre, and $e = (0, sin i, cos i)$ is the Earth's axis. The Earth is a
    magnetic dipole along $-e$, $B = b (e - 3 (e . r) r)$: untilted, so that its field does not turn
    with it. The satellite is small beside its orbit, and its rotation does not change the orbit.

    Without dipole the energy in the frame of the orbit, $omega . I omega / 2 + 3 n^2 r . I r / 2 -
    n L_z$, is conserved, with $I1 = I2$ also the spin $omega3$. Without orbit, $n = 0$, the
    satellite stays at its place in a field that does not change, and without field it is then a
    `FreeBody`.

    State $y = (w, x, y, z, omega1, omega2, omega3, latitude)$: attitude, body to world; angular
    velocity in space, in body axes [rad/s]; argument of latitude, which grows without limit [rad].
    Input $u = (m1, m2, m3)$: magnetic dipole in body axes [A m^2].

    The integrator is a symmetric splitting into free rotation and kicks, composed to fourth order:
    the energy error is bounded for ever. The rate that limits its step is the largest one of
    $|omega|$, $|I omega| / I2$ and $2 n$.

    Attributes:
        I1: principal moment about e1 [kg m^2].
        I2: principal moment about e2 [kg m^2].
        I3: principal moment about e3 [kg m^2].
        n: mean motion, the rate along the orbit, or 0 [rad/s].
        b: magnetic field on the magnetic equator, at the radius of the orbit, or 0 [T].
        inclination: i, of the orbit to the Earth's equator, from -pi to pi [rad]; where it is
            negative, x points to the descending node.

    Raises:
        ValueError: moments that no body has, a negative n or b, or an inclination beyond its range.

    Source: Hughes, *Spacecraft Attitude Dynamics*, chapters 8 and 9.
    """

    I1: float = 0.05
    I2: float = 0.06
    I3: float = 0.02
    n: float = 0.0011
    b: float = 2.4e-5
    inclination: float = 1.7

    dynamics: ClassVar = SATELLITE
    components: ClassVar[Mapping[str, slice]] = {
        "q": slice(0, 4),
        "omega_body": slice(4, 7),
        "latitude": slice(7, 8),
    }
    quantities: ClassVar = (
        "omega_world",
        "L_body",
        "L_world",
        "radial_body",
        "field_body",
        "kinetic_energy",
        "energy",
    )

    def __post_init__(self) -> None:
        """Check the parameters."""
        principal_moments(self.I1, self.I2, self.I3)
        non_negative(self.n, "n", "rad/s")
        non_negative(self.b, "b", "T")
        tilt = number(self.inclination, "inclination")
        expected = "an angle from -pi to pi rad: np.radians converts degrees"
        require(abs(tilt) <= math.pi, tilt, "inclination", expected)
        super().__post_init__()

    @property
    def moments(self) -> Array:
        """Principal moments (I1, I2, I3) [kg m^2]."""
        return np.array([self.I1, self.I2, self.I3])

    def latitude(self, y: npt.ArrayLike) -> Array:
        """Argument of latitude, the angle in the orbit from the ascending node [rad], (...)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 7])

    def radial_body(self, y: npt.ArrayLike) -> Array:
        """Unit vector away from the Earth's centre, in body axes, shape (..., 3)."""
        alpha = self.latitude(y)
        outward = np.stack([np.cos(alpha), np.sin(alpha), np.zeros_like(alpha)], axis=-1)
        return rotations.rotate_inverse(quaternion(y), outward)

    def field_body(self, y: npt.ArrayLike) -> Array:
        """Magnetic field of the Earth in body axes [T], shape (..., 3)."""
        axis = np.array([0.0, math.sin(self.inclination), math.cos(self.inclination)])
        e, r = rotations.rotate_inverse(quaternion(y), axis), self.radial_body(y)
        return np.asarray(self.b * (e - 3.0 * np.sum(e * r, axis=-1, keepdims=True) * r))

    def kinetic_energy(self, y: npt.ArrayLike) -> Array:
        """Kinetic energy omega . I omega / 2 of the rotation in space [J], shape (...)."""
        return np.asarray(0.5 * np.sum(self.L_body(y) * self.omega_body(y), axis=-1))

    def energy(self, y: npt.ArrayLike) -> Array:
        """Energy in the frame of the orbit, Jacobi's integral without dipole [J], shape (...)."""
        pull = np.sum(self.moments * self.radial_body(y) ** 2, axis=-1)
        along = np.sum(gamma(y) * self.L_body(y), axis=-1)
        return np.asarray(self.kinetic_energy(y) + 1.5 * self.n**2 * pull - self.n * along)

    def rate_bound(self, y: Array, u: Array, duration: float) -> float:
        """Bound on the rates of the body, of the turns of a step and of librations [rad/s].

        With the rate omega - n e_z in the orbit's frame, T = (omega - n e_z) . I (omega - n e_z) /
        2 there, and s = sqrt(2 (T + 2 n^2 (I_max - I_min))): gravity and the turning of the frame
        have a potential that changes by 2 n^2 (I_max - I_min) at most, so s bounds sqrt(2 T) for
        ever, and s' <= norm(m x B) / sqrt(I_min) with norm(B) <= 2 b. Rates are `fastest_turn` s at
        most, and those of a body that turns with the orbit. However slowly it moves, gravity
        changes it at sqrt(3) n, the dipole at sqrt(norm(m x B) / I_min).
        """
        least, largest = float(self.moments.min()), float(self.moments.max())
        relative = self.omega_body(y) - self.n * gamma(y)
        kinetic = float(np.max(np.sum(self.moments * relative**2, axis=-1), initial=0.0))
        torque = 2.0 * self.b * float(np.max(np.linalg.norm(u, axis=-1), initial=0.0))
        s = math.sqrt(kinetic + 4.0 * self.n**2 * (largest - least))
        s += torque * duration / math.sqrt(least)
        turn = s * fastest_turn(self.moments) + self.n * max(1.0, largest / self.I2)
        return max(turn, 2.0 * self.n, math.sqrt(3.0 * self.n**2 + torque / least))
