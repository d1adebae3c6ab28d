"""Upright coin: the rolling disk whose axis is held parallel to the plane."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, array, non_negative, number, positive_fields, require
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.equations import CONTACT, RollingContact, gamma, instead, quaternion
from rigid_envs.mechanics.system import AdaptiveStepSystem
from rigid_envs.systems.upright_coin.dynamics import UPRIGHT_COIN


@dataclass(frozen=True)
class UprightCoin(RollingContact, AdaptiveStepSystem):
    """Coin or knife edge that is held upright, rolls without slipping and is steered.

    $R = R_z(phi) R_x(pi/2) R_z(psi)$: heading $phi$, roll phase $psi$. $I1 phi'' = tau_steer$, $(I3
    + m radius^2) psi'' = tau_drive + m g sin(slope) radius l_x$, and the contact moves along $l =
    (-cos phi, -sin phi)$ at $radius psi'$: four dimensions of which two controls reach all. With
    $I3 = 0$ it is the knife edge (a skate).

    World $z$ is the normal of the plane, which descends along $x$ by the angle `slope`.

    State $y = (w, x, y, z, X, Y, steer_rate, roll_rate)$: attitude, body to world; point of contact
    [m]; $phi'$ and $psi'$ [rad/s]. Input $u = (tau_steer, tau_drive)$: torque about the normal and
    about the axis $e3$ [N m].

    Attributes:
        m: mass [kg].
        radius: radius of the rim [m].
        I1: moment of inertia about a diameter [kg m^2].
        I3: moment of inertia about the axis, may be 0 [kg m^2]. What rolls on its rim alone has
            m radius^2 at most; more is accepted, as of what turns with the coin on its holder.
        g: gravitational acceleration [m/s^2].
        slope: angle by which the plane descends along x [rad].
        mu: coefficient of static friction, by which `slips` judges; without effect on the motion.

    Raises:
        ValueError: parameters that no coin has.

    Source: Bloch, *Nonholonomic Mechanics and Control*, sections 1.4 (coin) and 1.6 (knife edge).
    """

    m: float = 1.0
    radius: float = 1.0
    I1: float = 0.25
    I3: float = 0.5
    g: float = 9.81
    slope: float = 0.0
    mu: float = 1.0

    dynamics: ClassVar = UPRIGHT_COIN
    components: ClassVar[Mapping[str, slice]] = {
        "q": slice(0, 4),
        "contact": slice(4, 6),
        "steer_rate": slice(6, 7),
        "roll_rate": slice(7, 8),
    }
    quantities: ClassVar = (
        "heading",
        "phase",
        "direction",
        "velocity",
        "omega_world",
        *CONTACT,
        "upright_torque",
        "energy",
    )

    def __post_init__(self) -> None:
        """Check the parameters."""
        positive_fields(self, m="kg", radius="m", I1="kg m^2", g="m/s^2")
        non_negative(self.I3, "I3", "kg m^2")
        number(self.slope, "slope", "rad")
        non_negative(self.mu, "mu", "1")
        rest = 2.0 * self.I1
        expected = f"I3 <= 2 I1 = {rest:.9g}: no rigid body has such principal moments"
        require(bool(self.I3 <= rest * (1.0 + 1e-9)), self.I3, "I3", expected)
        super().__post_init__()

    @classmethod
    def attitude(cls, heading: npt.ArrayLike, phase: npt.ArrayLike) -> Array:
        """Quaternion of heading phi and roll phase psi [rad], broadcast together; (..., 4)."""
        phi, psi = np.broadcast_arrays(heading, phase)
        tilt = np.full(phi.shape, 0.5 * np.pi)
        return rotations.quaternion_from_euler(np.stack([phi, tilt, psi], axis=-1))

    @classmethod
    def state(
        cls,
        *,
        heading: npt.ArrayLike | None = None,
        phase: npt.ArrayLike | None = None,
        **components: npt.ArrayLike,
    ) -> Array:
        """State row of heading, phase and components; those left out are 0.

        Args:
            heading: phi; where it rolls forwards, the coin heads for (-cos phi, -sin phi) [rad].
            phase: psi, of the coin about its axis [rad].
            **components: contact [m], shape (..., 2); steer_rate phi' and roll_rate psi' [rad/s];
                q in place of both angles. All are broadcast together.

        Returns:
            y of shape (..., 8).

        Raises:
            ValueError: as `System.state`; an angle beside q.
        """
        given = {"heading": heading, "phase": phase}
        if instead(components, "q", given):
            phi, psi = (array(0.0 if at is None else at, name) for name, at in given.items())
            components["q"] = cls.attitude(phi, psi)
        return super().state(**components)

    @classmethod
    def checked_state(cls, y: npt.ArrayLike) -> Array:
        """The state y as float64 of shape (..., 8).

        Raises:
            ValueError: as `System.checked_state`; also a coin that is not upright.
        """
        rows = super().checked_state(y)
        lean = gamma(rows)[..., 2]
        expected = (
            "a coin whose axis has the vertical component 0 within 1e-6: take q from "
            "UprightCoin.attitude(heading, phase)"
        )
        require(np.abs(lean) <= 1e-6, rows, "y", expected)
        return rows

    def heading(self, y: npt.ArrayLike) -> Array:
        """Angle phi [rad] in (-pi, pi], shape (...); the coin heads for (-cos phi, -sin phi)."""
        return np.array(rotations.euler_from_quaternion(quaternion(y))[..., 0])

    def phase(self, y: npt.ArrayLike) -> Array:
        """Roll phase psi [rad] in (-pi, pi], shape (...)."""
        return np.array(rotations.euler_from_quaternion(quaternion(y))[..., 2])

    def contact(self, y: npt.ArrayLike) -> Array:
        """Point of contact (X, Y) on the plane [m], shape (..., 2)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 4:6])

    def steer_rate(self, y: npt.ArrayLike) -> Array:
        """Rate phi' [rad/s], shape (...)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 6])

    def roll_rate(self, y: npt.ArrayLike) -> Array:
        """Rate psi' [rad/s], shape (...)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 7])

    def direction(self, y: npt.ArrayLike) -> Array:
        """Direction of travel l = e3 x e_z, shape (..., 2)."""
        axis = rotations.rotate(quaternion(y), np.array([0.0, 0.0, 1.0]))
        return np.stack([axis[..., 1], -axis[..., 0]], axis=-1)

    def velocity(self, y: npt.ArrayLike) -> Array:
        """Velocity of the centre, radius psi' l [m/s], shape (..., 2)."""
        return np.asarray(self.radius * self.roll_rate(y)[..., None] * self.direction(y))

    def omega_world(self, y: npt.ArrayLike) -> Array:
        """Angular velocity in world axes [rad/s], shape (..., 3)."""
        axis = rotations.rotate(quaternion(y), np.array([0.0, 0.0, 1.0]))
        steer = np.stack([0.0 * self.steer_rate(y)] * 2 + [self.steer_rate(y)], axis=-1)
        return np.asarray(steer + self.roll_rate(y)[..., None] * axis)

    def energy(self, y: npt.ArrayLike) -> Array:
        """Kinetic energy minus m g sin(slope) X [J], shape (...)."""
        turn = self.I1 * self.steer_rate(y) ** 2 + self.I3 * self.roll_rate(y) ** 2
        kinetic = 0.5 * (turn + self.m * np.sum(self.velocity(y) ** 2, axis=-1))
        pull = self.m * self.g * math.sin(self.slope)
        return np.asarray(kinetic - pull * self.contact(y)[..., 0])

    def upright_torque(self, y: npt.ArrayLike, u: npt.ArrayLike | None = None) -> Array:
        """Torque about l that holds the coin upright [N m], shape (...).

        ``-I3 phi' psi' - radius C_3`` in the notation of `RollingDisk`: the spin momentum turns
        with the axis, and the contact force C acts along the axis at the distance radius.
        """
        axis = rotations.rotate(quaternion(y), np.array([0.0, 0.0, 1.0]))
        side = np.sum(self.contact_force(y, u) * axis, axis=-1)
        return np.asarray(-self.I3 * self.steer_rate(y) * self.roll_rate(y) - self.radius * side)

    def rate_and_growth(self, y: Array, u: Array) -> tuple[float, float]:
        """The larger of phi' and psi' and its growth by torques and gravity, each at least 1."""
        steer, drive = np.max(np.abs(np.reshape(u, (-1, 2))), axis=0, initial=0.0)
        pull = self.m * self.g * abs(math.sin(self.slope)) * self.radius
        roll = (float(drive) + pull) / (self.I3 + self.m * self.radius**2)
        rate = float(np.max(np.abs(y[..., 6:8]), initial=1.0))
        return rate, max(float(steer) / self.I1, roll, 1.0)
