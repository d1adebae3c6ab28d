"""Free rigid body under body torques: Euler's equations and the attitude."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.equations import TurningBody
from rigid_envs.mechanics.integration import Schedule
from rigid_envs.mechanics.system import System, fastest_turn, principal_moments
from rigid_envs.systems.free_body.dynamics import FREE_BODY


@dataclass(frozen=True)
class FreeBody(TurningBody, System):
    """Rigid body turning about its centre of mass.

    $I omega' = I omega x omega + tau$, $q' = q (0, omega) / 2$, all in body axes, which are the
    principal axes. Without torque the energy $T$ and the angular momentum $L$ in space are
    conserved.

    State $y = (w, x, y, z, omega1, omega2, omega3)$: attitude, body to world, and angular velocity
    in body axes [rad/s]. Input $u = (tau1, tau2, tau3)$: torque in body axes [N m].

    The integrator is a symmetric splitting into exact rotations, composed to fourth order: the size
    of $L$ and $L$ in space are kept to rounding, the energy error is bounded for ever. It splits
    off the turn about $L$ that a sphere of the middle moment would make: which axis has which
    moment does not matter. The rate that limits its step is the larger one of $|omega|$ and $|L| /
    I2$.

    Attributes:
        I1: principal moment about e1 [kg m^2].
        I2: principal moment about e2 [kg m^2].
        I3: principal moment about e3 [kg m^2].

    Raises:
        ValueError: moments that are not positive or break the triangle inequality.

    Source: Landau & Lifshitz, *Mechanics*, sections 36 and 37.
    """

    I1: float = 1.0
    I2: float = 2.0
    I3: float = 3.0

    dynamics: ClassVar = FREE_BODY
    components: ClassVar[Mapping[str, slice]] = {"q": slice(0, 4), "omega_body": slice(4, 7)}
    quantities: ClassVar[tuple[str, ...]] = ("omega_world", "L_body", "L_world", "kinetic_energy")

    def __post_init__(self) -> None:
        """Check the moments."""
        principal_moments(self.I1, self.I2, self.I3)
        super().__post_init__()

    @property
    def moments(self) -> Array:
        """Principal moments (I1, I2, I3) [kg m^2]."""
        return np.array([self.I1, self.I2, self.I3])

    def kinetic_energy(self, y: npt.ArrayLike) -> Array:
        """Kinetic energy omega . I omega / 2 of the rotation [J], shape (...)."""
        return np.asarray(0.5 * np.sum(self.L_body(y) * self.omega_body(y), axis=-1))

    def run(self, y0: Array, u: Array, plan: Schedule) -> Array:
        """All states of a schedule, with the axes renamed so that e2 has the middle moment.

        The compiled step splits off the turn about L at the rate norm(L) / I2, and turns about e1
        and e3 that are the slower the closer their moments are to I2.
        """
        middle = int(np.argsort(self.moments, kind="stable")[1])
        if self.moments[1] == self.moments[middle]:
            return super().run(y0, u, plan)
        order = [(middle + shift) % 3 for shift in (2, 0, 1)]  # axes that become e1, e2, e3
        sense = 1.0 if middle == 2 else -1.0
        turn = 0.5 * np.array([1.0, sense, sense, sense])  # that brings e1, e2, e3 to them
        begin, torques = y0.copy(), u.copy()
        begin[..., :4] = rotations.multiply(y0[..., :4], turn)
        begin[..., 4:7], torques[..., :3] = y0[..., 4:7][..., order], u[..., :3][..., order]
        moments = self.moments[order].tolist()
        twin = replace(self, **dict(zip(("I1", "I2", "I3"), moments, strict=True)))
        y = twin.run(begin, torques, plan)
        y[..., :4] = rotations.multiply(y[..., :4], rotations.conjugate(turn))
        y[..., 4:7] = y[..., 4:7][..., np.argsort(order)]
        y[0] = y0
        return y

    def rate_bound(self, y: Array, u: Array, duration: float) -> float:
        """Bound on the angular rate and on the rates of the turns that a step is made of [rad/s].

        With s = sqrt(2 T): s' <= norm(tau) / sqrt(I_min), and rates are `fastest_turn` s at most.
        """
        torque = float(np.max(np.linalg.norm(u[..., :3], axis=-1), initial=0.0))
        energy = float(np.max(self.kinetic_energy(y), initial=0.0))
        grown = torque * duration / math.sqrt(self.moments.min())
        return (math.sqrt(2.0 * energy) + grown) * fastest_turn(np.sort(self.moments))
