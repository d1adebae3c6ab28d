"""Disk or hoop that rolls without slipping on a horizontal plane, with friction or without."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import (
    Array,
    all_non_negative,
    array,
    non_negative,
    positive_fields,
    require,
)
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.equations import CONTACT, RollingContact, TurningBody, gamma, quaternion
from rigid_envs.mechanics.system import AdaptiveStepSystem, axial_moment, principal_moments
from rigid_envs.systems.rolling_disk.dynamics import ROLLING_DISK
from rigid_envs.systems.rolling_disk.friction import EULER_DISK

_FLAT = 1e-6  # sin(theta) below which the point of contact is lost in rounding


@dataclass(frozen=True)
class RollingDisk(TurningBody, RollingContact, AdaptiveStepSystem):
    """Axisymmetric disk with a thin rim that rolls without slipping on the plane z = 0.

    Newton's and Euler's laws with the contact force $F$ at $-radius n$, $n$ the radius that points
    up: $m v' = F - m g e_z$, $L' = -radius n x F + tau$, and no slip: $v = omega x radius n$.
    $F$ is eliminated exactly, so the velocity of the centre is no state and cannot drift. No Euler
    angle is used: the upright disk is a state like any other. The disk that lies flat is none: it
    has no point of contact.

    State $y = (w, x, y, z, omega1, omega2, omega3, X, Y)$: attitude, body to world, $e3$ the axis;
    angular velocity in body axes [rad/s]; point of contact on the plane [m]. Input $u = (tau_steer,
    tau_lean, tau_drive)$: torque [N m] about $n$, about the horizontal direction of travel $l = e3
    x n$, and about the axis $e3$.

    The integrator is a symmetric splitting composed to fourth order: time-reversible, so that the
    energy error is bounded, and exact on the steady circles. The rate that limits its step is
    $|omega3| + |(omega1, omega2)| / sin(theta) + sqrt(g / radius)$, $theta$ from $e3$ to $e_z$.

    Attributes:
        m: mass [kg].
        radius: radius of the rim [m].
        I1: moment of inertia about a diameter, at the centre [kg m^2].
        I3: moment of inertia about the axis, at most m radius^2 [kg m^2].
        g: gravitational acceleration, along -z of the world [m/s^2].
        mu: coefficient of static friction, by which `slips` judges; without effect on the motion.

    Raises:
        ValueError: parameters that no body has.

    Source: Routh, *Advanced Rigid Dynamics*, section 244; Borisov, Mamaev & Kilin 2003,
    "Dynamics of rolling disk", Regular and Chaotic Dynamics 8:201.
    """

    m: float = 1.0
    radius: float = 1.0
    I1: float = 0.25
    I3: float = 0.5
    g: float = 9.81
    mu: float = 1.0

    dynamics: ClassVar = ROLLING_DISK
    components: ClassVar[Mapping[str, slice]] = {
        "q": slice(0, 4),
        "omega_body": slice(4, 7),
        "contact": slice(7, 9),
    }
    quantities: ClassVar[tuple[str, ...]] = (
        *("omega_world", "tilt", "centre", "velocity", *CONTACT, "energy"),
    )
    # a disk that rises from near flat turns within a few steps
    default_step_angle: ClassVar[float] = 1.0 / 128.0

    def __post_init__(self) -> None:
        """Check the parameters."""
        positive_fields(self, m="kg", radius="m", g="m/s^2")
        principal_moments(self.I1, self.I1, self.I3)
        axial_moment(self.I3, self.m, self.radius)
        non_negative(self.mu, "mu", "1")
        super().__post_init__()

    @classmethod
    def uniform(
        cls, m: float = 1.0, radius: float = 1.0, g: float = 9.81, **friction: float
    ) -> Self:
        """Uniform thin disk: I3 = m radius^2 / 2, I1 = I3 / 2; `friction`: mu and what follows."""
        rim = m * radius * radius
        return cls(m, radius, 0.25 * rim, 0.5 * rim, g, **friction)

    @classmethod
    def hoop(cls, m: float = 1.0, radius: float = 1.0, g: float = 9.81, **friction: float) -> Self:
        """Thin hoop: I3 = m radius^2, I1 = I3 / 2; `friction`: mu and what follows."""
        rim = m * radius * radius
        return cls(m, radius, 0.5 * rim, rim, g, **friction)

    @classmethod
    def state(
        cls,
        *,
        lean: npt.ArrayLike | None = None,
        tilt: npt.ArrayLike | None = None,
        azimuth: npt.ArrayLike | None = None,
        phase: npt.ArrayLike | None = None,
        precession: npt.ArrayLike | None = None,
        nutation: npt.ArrayLike | None = None,
        spin: npt.ArrayLike | None = None,
        **components: npt.ArrayLike,
    ) -> Array:
        """State row of lean, angles and rates, or of components; upright and at rest without them.

        Args:
            lean: of the disk from upright, tilt - pi / 2, between -pi / 2 and pi / 2 [rad].
            tilt: theta, of the axis e3 from the vertical, in place of the lean [rad].
            azimuth: phi, heading; upright it heads for (-cos phi, -sin phi) where spin > 0 [rad].
            phase: psi, of the disk about its axis [rad].
            precession: phi', rate at which the heading turns [rad/s].
            nutation: theta', rate of the lean [rad/s].
            spin: omega . e3, rate of rolling: the rim passes at radius spin [rad/s].
            **components: as of `TurningBody.state`; the contact [m], shape (..., 2).

        Returns:
            y of shape (..., 9).

        Raises:
            ValueError: as `TurningBody.state`; a lean beyond its range, or beside a tilt.
        """
        if lean is not None:
            require(tilt is None, tilt, "tilt", "none beside lean: one follows from the other")
            rows = array(lean, "lean")
            expected = "an angle between -pi/2 and pi/2 rad: np.radians converts degrees"
            require(np.abs(rows) < 0.5 * np.pi, rows, "lean", expected)
            tilt = 0.5 * np.pi + rows
        return super().state(
            tilt=tilt, azimuth=azimuth, phase=phase,
            precession=precession, nutation=nutation, spin=spin, **components,
        )  # fmt: skip

    @classmethod
    def checked_state(cls, y: npt.ArrayLike) -> Array:
        """The state y as float64 of shape (..., 9).

        Raises:
            ValueError: as `System.checked_state`; also a disk that lies flat.
        """
        rows = super().checked_state(y)
        _refuse_flat(_sine(rows))
        return rows

    @classmethod
    def checked_argument(cls, y: npt.ArrayLike) -> Array:
        """The argument y of `rhs`, shape (..., 9).

        Raises:
            ValueError: as `System.checked_argument`; also a disk that lies flat.
        """
        rows = super().checked_argument(y)
        _refuse_flat(_sine(rotations.normalize(rows[..., :4])))
        return rows

    @property
    def moments(self) -> Array:
        """Principal moments at the centre (I1, I1, I3) [kg m^2]."""
        return np.array([self.I1, self.I1, self.I3])

    def radius_up(self, y: npt.ArrayLike) -> Array:
        """Unit vector n from the contact to the centre, in world axes, shape (..., 3)."""
        vertical = gamma(y)
        up = vertical[..., :2] / _sine(y)[..., None]
        return rotations.rotate(quaternion(y), np.concatenate([up, 0.0 * up[..., :1]], axis=-1))

    def contact(self, y: npt.ArrayLike) -> Array:
        """Point of contact (X, Y) on the plane [m], shape (..., 2)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 7:9])

    def centre(self, y: npt.ArrayLike) -> Array:
        """Centre of the disk in world axes [m], shape (..., 3)."""
        foot = self.contact(y)
        below = np.concatenate([foot, 0.0 * foot[..., :1]], axis=-1)
        return below + self.radius * self.radius_up(y)

    def velocity(self, y: npt.ArrayLike) -> Array:
        """Velocity of the centre, omega x radius n, in world axes [m/s], shape (..., 3)."""
        return np.asarray(self.radius * np.cross(self.omega_world(y), self.radius_up(y)))

    def energy(self, y: npt.ArrayLike) -> Array:
        """Kinetic energy plus m g times the height of the centre [J], shape (...)."""
        omega = self.omega_body(y)
        spin = np.sum(self.moments * omega * omega, axis=-1)
        speed = np.sum(self.velocity(y) ** 2, axis=-1)
        height = self.centre(y)[..., 2]
        return np.asarray(0.5 * (spin + self.m * speed) + self.m * self.g * height)

    def rate_and_growth(self, y: Array, u: Array) -> tuple[float, float]:
        """The largest `rate`, and its growth."""
        rows, inputs = self._broadcast(y, u)
        vertical, omega = gamma(rows), rows[..., 4:7]
        s = np.hypot(vertical[..., 0], vertical[..., 1])
        across = np.linalg.norm(omega[..., :2], axis=-1)
        fall = np.abs(omega[..., 0] * vertical[..., 1] - omega[..., 1] * vertical[..., 0]) / s
        grown = np.linalg.norm(self._evaluate(rows, inputs, np.float64)[..., 4:7], axis=-1)
        gain = (grown + across * fall / s) / s
        natural = self.g / self.radius
        return (
            float(np.max(self._rates(rows), initial=math.sqrt(natural))),
            float(np.max(gain, initial=0.0)) + natural,
        )


@dataclass(frozen=True)
class EulerDisk(RollingDisk):
    """Euler's disk: a coin that spins to rest. A `RollingDisk` with friction at its contact.

    The contact runs along the rim at the rate $psi' = omega3 - phi' cos(theta)$. Friction opposes
    it with the generalised torque $Q = -contour sign(psi') - drag psi'^3$ of the angle $psi$, the
    couple $Q (e3 - cos(theta) e_z) / sin(theta)^2$. It does not work on precession and fall: the
    energy falls at the rate $Q psi'$. The disk rolls without slipping all the while.

    A disk whose centre is nearly at rest sinks as it loses energy, turns the faster the flatter it
    is, and lies flat after a finite time $t0$: towards the end $theta$ is proportional to $(t0 -
    t)^(2/3)$ with dry friction alone, and to $(t0 - t)^(1/3)$ with drag alone, which is Moffatt's
    law of a disk over a film of air; `air_drag` of the closed forms is its size. Measured exponents
    differ from his. No disk follows any to the end: when the time left is no longer than a nod it
    just falls, and dry friction holds its contact. Near flat the rates grow without bound:
    `simulate` says when a motion reaches $sin(theta) = 1e-6$, and the event `flat` ends it earlier.

    State and input are those of `RollingDisk`. Each step is one of the rolling disk between two
    exact kicks of friction, composed to fourth order; energy never grows. While dry friction holds
    $psi'$ at 0, and where it turns its sense, the order is one. The rate that limits the step is
    that of the rolling disk and what drag takes from $psi'$ per time, relative to it.

    Attributes:
        m: mass [kg].
        radius: radius of the rim [m].
        I1: moment of inertia about a diameter, at the centre [kg m^2].
        I3: moment of inertia about the axis, at most m radius^2 [kg m^2].
        g: gravitational acceleration, along -z of the world [m/s^2].
        mu: coefficient of static friction, by which `slips` judges; without effect on the motion.
        contour: torque of dry friction along the rim [N m].
        drag: torque of the drag over the cube of psi' [N m s^3].

    Raises:
        ValueError: parameters that no body has.

    Source: Moffatt 2000, Nature 404:833, doi:10.1038/35009017; Leine 2009, Archive of Applied
    Mechanics 79:1063, doi:10.1007/s00419-008-0278-6.
    """

    contour: float = 0.0
    drag: float = 0.0

    dynamics: ClassVar = EULER_DISK
    quantities: ClassVar = (*RollingDisk.quantities, "contact_rate")

    def __post_init__(self) -> None:
        """Check the parameters."""
        all_non_negative(contour=self.contour, drag=self.drag)
        super().__post_init__()

    @property
    def conserves(self) -> bool:
        """Whether there is no friction."""
        return self.contour == self.drag == 0.0

    def contact_rate(self, y: npt.ArrayLike) -> Array:
        """Rate psi' at which the contact runs along the rim, backwards [rad/s], shape (...)."""
        omega, vertical = self.omega_body(y), gamma(y)
        across = np.sum(omega[..., :2] * vertical[..., :2], axis=-1)
        return np.asarray(omega[..., 2] - across * vertical[..., 2] / _sine(y) ** 2)


def _sine(y: npt.ArrayLike) -> Array:
    """sin(theta) of the angle between axis and vertical, shape (...)."""
    vertical = gamma(y)
    return np.asarray(np.hypot(vertical[..., 0], vertical[..., 1]))


def _refuse_flat(s: Array) -> None:
    """Refuse disks that lie flat.

    Raises:
        ValueError: sin(theta), s, is too small in one of them.
    """
    expected = f"at least {_FLAT:g}: a disk that lies flat has no point of contact"
    require(s >= _FLAT, s, "sin(theta)", expected)
