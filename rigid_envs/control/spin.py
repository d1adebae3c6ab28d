"""Holding spin about the intermediate axis e2 by linear feedback."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import positive, require
from rigid_envs.control.linear import Regulator, lqr, zero_order_hold
from rigid_envs.control.saturation import clip_to_box
from rigid_envs.systems import FreeBody

__all__ = ["SpinLaw", "SpinRegulator"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class SpinLaw:
    """Base of the control laws for a spin about the intermediate axis.

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega of the spin about e2 [rad/s].
        torque: largest torque about each axis [N m].

    Raises:
        ValueError: moments in another order, a rate or a torque that is not positive.
    """

    body: FreeBody
    rate: float
    torque: float

    def __post_init__(self) -> None:
        """Check the order of the moments, the rate and the torque."""
        ordered = self.body.I1 < self.body.I2 < self.body.I3
        require(ordered, self.body, "body", "I1 < I2 < I3: e2 is the intermediate axis")
        positive(self.rate, "rate", "rad/s")
        positive(self.torque, "torque", "N m")

    def inputs(self, action: npt.ArrayLike) -> Array:
        """Input u of `FreeBody` [N m], shape (..., 3), of actions."""
        return self.torque * np.asarray(action, dtype=np.float64)

    def omega(self, y: npt.ArrayLike) -> Array:
        """Angular velocity of states y, shape (..., 7), which are checked; body axes [rad/s]."""
        return self.body.checked_state(y)[..., 4:7]

    def error(self, y: npt.ArrayLike) -> Array:
        """Error omega - Omega e2 of states y, shape (..., 7); body axes [rad/s]."""
        return self.omega(y) - [0.0, self.rate, 0.0]


@dataclass(frozen=True)
class SpinRegulator(SpinLaw):
    """Holds the spin by linear feedback, optimal near it: tau = -K (omega - Omega e2).

    K minimises the sum of ``|omega - Omega e2|^2 + input_weight |tau|^2`` over the control periods
    for Euler's equations linearised about the spin, ``I1 x1' = -(I3 - I2) Omega x3 + tau1``,
    ``I2 x2' = tau2`` and ``I3 x3' = -(I2 - I1) Omega x1 + tau3``, under torques that are held.

    Certificate: the Riccati matrix P, ``value(y) = x P x`` with x = omega - Omega e2, the sum from
    there on and a Lyapunov function.

    Region: measured for the body (1, 2, 3), Omega = 1 and 0.2 N m, perturbations up to 0.26 rad/s
    are brought back while omega2 stays positive. Along the unstable direction, d = omega1 - r
    omega3 with r = sqrt(I3 (I3 - I2) / (I1 (I2 - I1))), that is d up to 0.55, and at constant
    omega2 no law holds more than ``torque (1 / I1 + r / I3) / growth``, 0.546 here. From further
    away the body flips first, and is caught later.

    Attributes:
        body: rigid body with I1 < I2 < I3.
        rate: Omega of the spin about e2 [rad/s].
        torque: largest torque about each axis [N m].
        dt: control period [s].
        input_weight: weight of the torque [rad^2/s^2 / (N m)^2].

    Raises:
        ValueError: moments in another order, or numbers that are not positive.

    Source: Anderson & Moore, *Optimal Control: Linear Quadratic Methods*, section 3.3.
    """

    dt: float
    input_weight: float = 0.03

    def __post_init__(self) -> None:
        """Check the control period and the weight too."""
        super().__post_init__()
        positive(self.dt, "dt", "s")
        positive(self.input_weight, "input_weight", "rad^2/s^2 / (N m)^2")

    def __call__(self, y: npt.ArrayLike) -> Array:
        """Actions, torques over the largest, shape (..., 3), of states y, shape (..., 7)."""
        return clip_to_box(self.regulator.feedback(self.error(y)) / self.torque)

    def value(self, y: npt.ArrayLike) -> Array:
        """Cost to go of states y, shape (..., 7), without limits; shape (...) [rad^2/s^2]."""
        return self.regulator.value(self.error(y))

    @cached_property
    def regulator(self) -> Regulator:
        """K and P in x = omega - Omega e2."""
        A, B = self.body.linearize(self.body.state(omega_body=[0.0, self.rate, 0.0]))
        F, G = zero_order_hold(A[4:, 4:], B[4:], self.dt)
        return lqr(F, G, np.ones(3), np.full(3, self.input_weight))
