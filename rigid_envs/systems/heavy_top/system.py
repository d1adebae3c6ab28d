"""Heavy top with torque inputs and a pivot that may move."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, non_negative, positive
from rigid_envs.mechanics.equations import TurningBody, gamma
from rigid_envs.mechanics.system import System, fastest_turn, pivot_distance, principal_moments
from rigid_envs.systems.heavy_top.dynamics import HEAVY_TOP


@dataclass(frozen=True)
class HeavyTop(TurningBody, System):
    """Rigid body turning about a pivot on its axis e3, in gravity; the pivot may be accelerated.

    $I omega' = I omega x omega + tau_body + R^T tau_world + ell e3 x R^T m (-aX, -aY, -g)$, $q' = q
    (0, omega) / 2$, $X' = V$, $V' = a$. No Euler angle is used: the upright top is a state like any
    other. Without torque the energy and the vertical momentum are conserved, with $I1 = I2$ also
    the spin $omega3$.

    State $y = (w, x, y, z, omega1, omega2, omega3, X, Y, VX, VY)$: attitude, body to world; angular
    velocity in body axes [rad/s]; horizontal position [m] and velocity [m/s] of the pivot. Input $u
    = (tau_body, tau_world, aX, aY)$: torques about the pivot in body and in world axes [N m],
    horizontal acceleration of the pivot [m/s^2].

    The integrator is a symmetric splitting composed to fourth order: the vertical momentum and ($I1
    = I2$) the spin momentum are kept to rounding, the energy error is bounded for ever. The rate
    that limits its step is the larger one of $|omega|$ and $|I omega| / I2$.

    Without weight, $g = 0$, it is a `FreeBody` that is held at the pivot; with $ell = 0$, held at
    its centre of mass, also the acceleration of the pivot has no effect on the rotation.

    Attributes:
        I1: principal moment about e1, at the pivot [kg m^2].
        I2: principal moment about e2, at the pivot [kg m^2].
        I3: principal moment about e3 [kg m^2].
        m: mass [kg].
        g: gravitational acceleration, along -z of the world, or 0 [m/s^2].
        ell: distance from the pivot to the centre of mass, along e3, or 0 [m].

    Raises:
        ValueError: parameters that no body has: about the centre of mass the moments are
            I1 - m ell^2, I2 - m ell^2 and I3.

    Source: Goldstein, Poole & Safko, *Classical Mechanics*, section 5.7.
    """

    I1: float = 1.0
    I2: float = 1.0
    I3: float = 0.5
    m: float = 1.0
    g: float = 9.81
    ell: float = 1.0 / 9.81

    dynamics: ClassVar = HEAVY_TOP
    components: ClassVar[Mapping[str, slice]] = {
        "q": slice(0, 4),
        "omega_body": slice(4, 7),
        "pivot": slice(7, 9),
        "pivot_velocity": slice(9, 11),
    }
    quantities: ClassVar = ("omega_world", "L_body", "L_world", "tilt", "energy")

    def __post_init__(self) -> None:
        """Check the parameters."""
        principal_moments(self.I1, self.I2, self.I3)
        positive(self.m, "m", "kg")
        non_negative(self.g, "g", "m/s^2")
        non_negative(self.ell, "ell", "m")
        pivot_distance(self.I1, self.I2, self.I3, self.m, self.ell)
        super().__post_init__()

    @property
    def moments(self) -> Array:
        """Principal moments at the pivot (I1, I2, I3) [kg m^2]."""
        return np.array([self.I1, self.I2, self.I3])

    @property
    def critical_spin(self) -> float:
        """Spin of the sleeping threshold, 2 sqrt(I1 m g ell) / I3 [rad/s] (symmetric top).

        It is 0 without weight.

        Source: Goldstein, Poole & Safko, section 5.7, equation (5.80).
        """
        return 2.0 * math.sqrt(self.I1 * self.m * self.g * self.ell) / self.I3

    def pivot(self, y: npt.ArrayLike) -> Array:
        """Horizontal position of the pivot [m], shape (..., 2)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 7:9])

    def pivot_velocity(self, y: npt.ArrayLike) -> Array:
        """Horizontal velocity of the pivot [m/s], shape (..., 2)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 9:11])

    def energy(self, y: npt.ArrayLike) -> Array:
        """Kinetic energy about the pivot plus m g ell cos(theta) [J], shape (...)."""
        kinetic = 0.5 * np.sum(self.L_body(y) * self.omega_body(y), axis=-1)
        return np.asarray(kinetic + self.m * self.g * self.ell * gamma(y)[..., 2])

    def rate_bound(self, y: Array, u: Array, duration: float) -> float:
        """Bound on the rates of the body, of the turns of a step and of the pendulum [rad/s].

        With s = sqrt(2 (E + m g ell)) >= sqrt(2 T): s' <= norm(tau) / sqrt(I_min), where tau is
        all torque except that of gravity, and rates are `fastest_turn` s at most. However slowly
        it moves, weight and inertial force change it at sqrt(m ell norm(g, a) / min(I1, I2)).
        """
        size = np.linalg.norm(u[..., 0:3], axis=-1) + np.linalg.norm(u[..., 3:6], axis=-1)
        push = np.linalg.norm(u[..., 6:8], axis=-1)
        size = size + self.m * self.ell * push
        torque = float(np.max(size, initial=0.0))
        weight = self.m * self.g * self.ell
        energy = float(np.max(self.energy(y), initial=-weight)) + weight
        fall = math.sqrt(2.0 * max(energy, 0.0))
        pull = float(np.max(np.hypot(self.g, push), initial=self.g))
        pendulum = math.sqrt(self.m * self.ell * pull / min(self.I1, self.I2))
        grown = torque * duration / math.sqrt(self.moments.min())
        return max((fall + grown) * fastest_turn(self.moments), pendulum)
