"""Wheel, sphere or hoop that rolls down an incline or through a valley."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, non_negative, number, positive_fields, require
from rigid_envs.mechanics.equations import CONTACT, RollingContact
from rigid_envs.mechanics.system import System
from rigid_envs.systems.roller.dynamics import ROLLER

_DIFFERENCE = 1e-4  # by which differences and optimisers step below the least inertia ratio


@dataclass(frozen=True)
class Roller(RollingContact, System):
    """Round body that rolls without slipping along a path in a vertical plane.

    The path of its centre descends by the angle $slope - curvature s$ after an arc length $s$: an
    incline where the curvature is 0, else a circle of radius 1 / curvature: a valley ($curvature >
    0$, its bottom at $s = slope / curvature$) or a hill. $(1 + beta + beta_change) m s'' = m g
    sin(slope - curvature s) + force$.

    State $y = (s, v)$: arc length along the path [m], velocity [m/s]. Input $u = (force,
    beta_change)$: along the path, at the centre [N]; and what is added to the inertia ratio, by
    masses moved outwards along spokes. It is held or changes while $v$ goes on steadily; where
    masses move at once, it is $(1 + beta + beta_change) v$ that is kept, the momentum about the
    contact: then $v$ is the caller's to change.

    Rolling needs friction. `contact_force` says how much, `needed_friction` which coefficient, and
    `slips` whether that exceeds `mu`; the motion itself is that without slip.

    The integrator is symplectic, composed to fourth order, and exact on an incline. The rate that
    limits its step is $|v curvature|$.

    Attributes:
        m: mass [kg].
        radius: rolling radius [m].
        beta: inertia ratio I / (m radius^2): 2/5 solid sphere, 1/2 cylinder, 1 hoop,
            0 a block without friction; above 1 what rolls on an axle.
        g: gravitational acceleration [m/s^2].
        slope: angle of descent at s = 0 [rad].
        curvature: of the path of the centre, positive in a valley [1/m].
        mu: coefficient of static friction.

    Raises:
        ValueError: parameters that no roller has.

    Source: Goldstein, Poole & Safko, *Classical Mechanics*, section 2.4.
    """

    m: float = 1.0
    radius: float = 1.0
    beta: float = 0.4
    g: float = 9.81
    slope: float = 0.0
    curvature: float = 0.0
    mu: float = 1.0

    dynamics: ClassVar = ROLLER
    components: ClassVar[Mapping[str, slice]] = {"arc_length": slice(0, 1), "velocity": slice(1, 2)}
    quantities: ClassVar = ("turn", "descent", "place", "energy", *CONTACT)

    def __post_init__(self) -> None:
        """Check the parameters."""
        positive_fields(self, m="kg", radius="m", g="m/s^2")
        non_negative(self.beta, "beta", "1")
        number(self.slope, "slope", "rad")
        number(self.curvature, "curvature", "1/m")
        non_negative(self.mu, "mu", "1")
        super().__post_init__()

    @classmethod
    def checked_input(cls, u: npt.ArrayLike | None) -> Array:
        """The input u as float64 of shape (..., 2); zeros for None.

        Raises:
            ValueError: as `System.checked_input`; also a ratio made smaller than beta.
        """
        rows = super().checked_input(u)
        change = rows[..., 1]
        expected = "at least 0: let beta be the least inertia ratio, and add to it"
        require(change >= -_DIFFERENCE, change, "beta_change", expected)
        return rows

    def arc_length(self, y: npt.ArrayLike) -> Array:
        """Arc length s along the path [m], shape (...)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 0])

    def velocity(self, y: npt.ArrayLike) -> Array:
        """Velocity v along the path [m/s], shape (...)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 1])

    def turn(self, y: npt.ArrayLike) -> Array:
        """Angle by which the body has turned since s = 0, s / radius [rad], shape (...)."""
        return np.asarray(self.arc_length(y) / self.radius)

    def descent(self, y: npt.ArrayLike) -> Array:
        """Angle of descent slope - curvature s [rad], shape (...)."""
        return np.asarray(self.slope - self.curvature * self.arc_length(y))

    def place(self, y: npt.ArrayLike) -> Array:
        """Centre (x, z) relative to s = 0: x horizontal, z vertical [m], shape (..., 2)."""
        s, half = self.arc_length(y), 0.5 * self.curvature * self.arc_length(y)
        chord = s * np.sinc(half / np.pi)
        mean = self.slope - half
        return np.stack([chord * np.cos(mean), -chord * np.sin(mean)], axis=-1)

    def energy(self, y: npt.ArrayLike) -> Array:
        """Kinetic energy of motion and rotation plus m g z [J], shape (...)."""
        kinetic = 0.5 * (1.0 + self.beta) * self.m * self.velocity(y) ** 2
        return np.asarray(kinetic + self.m * self.g * self.place(y)[..., 1])

    def rate_bound(self, y: Array, u: Array, duration: float) -> float:
        """Rate at which the descent can change, v curvature, or of small oscillations [rad/s].

        On a straight incline every step is exact and nothing limits it. A ratio that changes works
        like a force, of the size of weight and force at most; it counts until the `horizon`.
        """
        rows, inertia = np.abs(u), 1.0 + self.beta
        push = float(np.max(rows[..., 0], initial=0.0)) / self.m
        change = float(np.max(rows[..., 1], initial=0.0))
        speed = float(np.max(np.abs(y[..., 1]), initial=0.0))
        swing = math.sqrt((self.g + push) / inertia * abs(self.curvature))
        # in a valley or on a hill gravity gives back what it takes: 4 g / curvature at most
        fall = (2.0 + change / (inertia + change)) * swing
        fall += push / inertia * duration * abs(self.curvature)
        return max(speed * abs(self.curvature) + fall, swing)

    def horizon(self, y: Array, u: Array) -> float:
        """One radian of small oscillations [s] where the ratio may change, else for ever."""
        push, change = np.max(np.abs(np.reshape(u, (-1, 2))), axis=0, initial=0.0)
        if change == 0.0 or self.curvature == 0.0:
            return math.inf
        gain = (self.g + float(push) / self.m) / (1.0 + self.beta)
        return 1.0 / math.sqrt(gain * abs(self.curvature))
