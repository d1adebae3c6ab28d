"""Spheroid with friction on a horizontal plane."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, non_negative, number, positive_fields, require
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.equations import CONTACT, RollingContact, TurningBody, gamma, quaternion
from rigid_envs.mechanics.system import AdaptiveStepSystem, axial_moment, principal_moments
from rigid_envs.systems.spheroid.dynamics import SPHEROID


@dataclass(frozen=True)
class Spheroid(TurningBody, RollingContact, AdaptiveStepSystem):
    """Body of revolution with a spheroid's surface, which slides, spins and rolls on a plane.

    A tippe top is a sphere whose centre of mass is not its centre; a hard-boiled egg is a spheroid;
    with $offset = 0$ and equal semi-axes it is a ball. Newton's and Euler's laws with a normal
    force $N$ that keeps it on the plane z = 0, and friction at the contact, opposed to the slip $v$
    there:

    $F = -(mu / sqrt(v^2 + slip_speed^2) + drag) N v$

    Coulomb's law, made smooth below `slip_speed`, and a viscous one. The normal force may come out
    negative, where a real body would hop: `normal_force` says so, and there is no friction then.

    State $y = (w, x, y, z, omega1, omega2, omega3, X, Y, VX, VY)$: attitude, body to world, $e3$
    the axis; angular velocity in body axes [rad/s]; horizontal position [m] and velocity [m/s] of
    the centre of mass, which is at $-offset e3$ from the centre of the spheroid. Input $u =
    (tau_body, FX, FY)$: torque in body axes [N m], horizontal force at the centre of mass [N].

    The integrator is a symmetric splitting composed to fourth order: impulses of friction, then
    motion without friction, by RATTLE. Without friction and input the vertical and the spin
    momentum are kept to rounding, and the energy error is bounded. With friction, a sphere keeps
    Jellett's integral $L . (radius e_z - offset e3)$ to rounding. The rate that limits its step is
    $s sqrt(omega1^2 + omega2^2 + (max(1, I3 / I1) omega3)^2) + sqrt(m g (|offset| + |b^2 - c^2| /
    d) / I1) + g (mu / slip_speed + drag) (1 + m (D + |offset|)^2 / min(I1, I3))$ with the semi-axes
    $b$ across and $c$ along e3, the larger $D$ and the smaller $d$ of them, and $s = D / d$.

    Attributes:
        m: mass [kg].
        radius: semi-axis across e3 [m].
        half_height: semi-axis along e3 [m].
        offset: distance of the centre of mass from the centre of the spheroid, along -e3 [m].
        I1: moment of inertia across e3, about the centre of mass [kg m^2].
        I3: moment of inertia about e3 [kg m^2].
        g: gravitational acceleration, along -z of the world [m/s^2].
        mu: coefficient of sliding friction.
        slip_speed: slip below which friction falls [m/s].
        drag: coefficient of viscous friction [s/m].

    Raises:
        ValueError: parameters that no body has.

    Source: Cohen 1977, "The tippe top revisited", doi:10.1119/1.10926; Moffatt & Shimomura 2002,
    "Spinning eggs: a paradox resolved", doi:10.1038/416385a.
    """

    m: float = 1.0
    radius: float = 1.0
    half_height: float = 1.0
    offset: float = 0.3
    I1: float = 0.38
    I3: float = 0.4
    g: float = 9.81
    mu: float = 0.6
    slip_speed: float = 2.0
    drag: float = 0.0

    dynamics: ClassVar = SPHEROID
    components: ClassVar[Mapping[str, slice]] = {
        "q": slice(0, 4),
        "omega_body": slice(4, 7),
        "centre": slice(7, 9),
        "velocity": slice(9, 11),
    }
    quantities: ClassVar = (
        *("omega_world", "L_body", "L_world", "tilt", "height", "contact", "slip"),
        *(*CONTACT, "energy"),
    )

    def __post_init__(self) -> None:
        """Check the parameters."""
        units = {"m": "kg", "radius": "m", "half_height": "m", "g": "m/s^2", "slip_speed": "m/s"}
        positive_fields(self, **units)
        principal_moments(self.I1, self.I1, self.I3)
        axial_moment(self.I3, self.m, self.radius)
        number(self.offset, "offset", "m")
        inside = f"from {-self.half_height} to {self.half_height} m: the body holds its own centre"
        require(abs(self.offset) < self.half_height, self.offset, "offset", inside)
        non_negative(self.mu, "mu", "1")
        non_negative(self.drag, "drag", "s/m")
        super().__post_init__()

    @property
    def moments(self) -> Array:
        """Principal moments at the centre of mass (I1, I1, I3) [kg m^2]."""
        return np.array([self.I1, self.I1, self.I3])

    @property
    def conserves(self) -> bool:
        """Whether there is no friction."""
        return self.mu == self.drag == 0.0

    @property
    def rising_spin(self) -> float:
        """Upright spin [rad/s] above which friction makes the axis leave the vertical.

        With the radius of curvature R = b^2 / c at the contact and the height z of the centre of
        mass, ``n^2 R (I1 R - I3 z) = m g (R - z) z^2``. It is infinite where no spin is too fast,
        and 0 where the body does not stand without spin.

        Source: Cohen 1977, doi:10.1119/1.10926; Moffatt & Shimomura 2002, doi:10.1038/416385a.
        """
        R, z = self.radius**2 / self.half_height, self.half_height - self.offset
        if z >= R:
            return 0.0
        lever = self.I1 * R - self.I3 * z
        return z * math.sqrt(self.m * self.g * (R - z) / (R * lever)) if lever > 0.0 else math.inf

    @property
    def standing_spin(self) -> float:
        """Spin [rad/s] above which the body stands upside down, -e3 up, with friction.

        That of `rising_spin`, where the centre of mass is half_height + offset high. It is infinite
        where no spin is enough, and 0 where none is needed.
        """
        R, z = self.radius**2 / self.half_height, self.half_height + self.offset
        if z <= R:
            return 0.0
        lever = self.I3 * z - self.I1 * R
        return z * math.sqrt(self.m * self.g * (z - R) / (R * lever)) if lever > 0.0 else math.inf

    @property
    def standing_jellett(self) -> float:
        """Jellett's integral of a spin upside down at `standing_spin` [N m^2 s]."""
        return self.I3 * self.standing_spin * (self.half_height + self.offset)

    @property
    def slowest_rate(self) -> float:
        """The `rate` at rest: that of gravity and of friction [rad/s]."""
        return float(self.parameters[self.dynamics.Parameters._fields.index("natural")])

    def centre(self, y: npt.ArrayLike) -> Array:
        """Horizontal position of the centre of mass [m], shape (..., 2)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 7:9])

    def velocity(self, y: npt.ArrayLike) -> Array:
        """Horizontal velocity of the centre of mass [m/s], shape (..., 2)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 9:11])

    def arm(self, y: npt.ArrayLike) -> Array:
        """From the centre of mass to the contact, in world axes [m], shape (..., 3).

        The support function's gradient at -gamma, from the centre of the spheroid, and the offset.
        """
        vertical, axes = gamma(y), np.array([self.radius, self.radius, self.half_height])
        size = np.linalg.norm(axes * vertical, axis=-1, keepdims=True)
        below = np.array([0.0, 0.0, self.offset]) - axes * axes * vertical / size
        return rotations.rotate(quaternion(y), below)

    def height(self, y: npt.ArrayLike) -> Array:
        """Height of the centre of mass [m], shape (...)."""
        return -self.arm(y)[..., 2]

    def contact(self, y: npt.ArrayLike) -> Array:
        """Point of contact on the plane [m], shape (..., 2)."""
        return self.centre(y) + self.arm(y)[..., :2]

    def slip(self, y: npt.ArrayLike) -> Array:
        """Horizontal velocity of the body's point at the contact [m/s], shape (..., 2)."""
        return self.velocity(y) + np.cross(self.omega_world(y), self.arm(y))[..., :2]

    def energy(self, y: npt.ArrayLike) -> Array:
        """Kinetic energy plus m g times the height of the centre of mass [J], shape (...)."""
        omega, rise = self.omega_body(y), np.cross(self.omega_world(y), self.arm(y))[..., 2]
        spin = np.sum(self.moments * omega * omega, axis=-1)
        speed = np.sum(self.velocity(y) ** 2, axis=-1) + rise * rise
        return np.asarray(0.5 * (spin + self.m * speed) + self.m * self.g * self.height(y))

    def rate_and_growth(self, y: Array, u: Array) -> tuple[float, float]:
        """The largest `rate`, and its growth."""
        rows, inputs = self._broadcast(y, u)
        grown = np.linalg.norm(self._evaluate(rows, inputs, np.float64)[..., 4:7], axis=-1)
        unequal = max(self.radius, self.half_height) / min(self.radius, self.half_height)
        gain = unequal * max(1.0, self.I3 / self.I1) * float(np.max(grown, initial=0.0))
        fastest = float(np.max(self._rates(rows), initial=self.slowest_rate))
        return fastest, gain + self.g / self.radius
