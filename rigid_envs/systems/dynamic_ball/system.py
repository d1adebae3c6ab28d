"""Ball with inertia that rolls without slipping on a plate: level, tilting or a turntable."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, non_negative, number, positive_fields
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.equations import CONTACT, RollingContact, instead
from rigid_envs.mechanics.system import AdaptiveStepSystem, ball_ratio
from rigid_envs.systems.dynamic_ball.dynamics import DYNAMIC_BALL


@dataclass(frozen=True)
class DynamicBall(RollingContact, AdaptiveStepSystem):
    """Ball that rolls without slipping on a plate, pushed by gravity, a force and the plate.

    The plate turns about the point $O$ of its surface: plate axes are $P = R_x(alpha_x)
    R_y(alpha_y)$ of the world's, with the normal $n$ third. Its surface may turn about $n$ besides,
    at the constant `turntable_rate` $Omega$; the plate axes do not follow that. With the contact
    force $C$, $m a = C + F + m g$, $beta m radius^2 omega' = -radius n x C$ in world axes, and no
    slip: $v = (omega - w) x radius n + Omega n x (X, Y)$ in plate axes, $w$ the rate of the plate.
    $C$ is eliminated exactly; of $omega$ only the component along $n$ is a state, so no slip can
    creep in.

    State $y = (w, x, y, z, X, Y, VX, VY, spin, alpha_x, alpha_y, rate_x, rate_y)$: attitude, body
    to world; centre [m] and its velocity [m/s] in plate axes; $n . omega$ [rad/s]; angles [rad] and
    rates [rad/s] of the plate. Positive $alpha_x$ makes $-Y$ downhill. Input $u = (FX, FY, a_x,
    a_y)$: force at the centre in plate axes [N], and the accelerations of $alpha_x$ and $alpha_y$
    [rad/s^2]. A plate that is shaken with acceleration $A$ pushes like $F = -m A$.

    The integrator is a symmetric splitting composed to fourth order. On a turntable it keeps the
    speed to rounding. The rate that limits its step is $|omega|$.

    Attributes:
        m: mass [kg].
        radius: radius of the ball [m].
        beta: inertia ratio I / (m radius^2): 2/5 for a solid, 2/3 for a hollow sphere.
        g: gravitational acceleration, along -z of the world [m/s^2].
        turntable_rate: Omega, rate of the surface about its normal [rad/s].
        mu: coefficient of static friction, by which `slips` judges; without effect on the motion.

    Raises:
        ValueError: parameters that no ball has.

    Source: Neimark & Fufaev, *Dynamics of Nonholonomic Systems*, chapter III; Weltner 1979,
    doi:10.1119/1.11602.
    """

    m: float = 1.0
    radius: float = 1.0
    beta: float = 0.4
    g: float = 9.81
    turntable_rate: float = 0.0
    mu: float = 1.0

    dynamics: ClassVar = DYNAMIC_BALL
    components: ClassVar[Mapping[str, slice]] = {
        "q": slice(0, 4),
        "position": slice(4, 6),
        "velocity": slice(6, 8),
        "spin": slice(8, 9),
        "tilt": slice(9, 11),
        "tilt_rate": slice(11, 13),
    }
    quantities: ClassVar = (
        "plate",
        "centre",
        "velocity_world",
        "omega_plate",
        "omega_world",
        *CONTACT,
        "energy",
    )

    def __post_init__(self) -> None:
        """Check the parameters."""
        positive_fields(self, m="kg", radius="m", g="m/s^2")
        ball_ratio(self.beta)
        number(self.turntable_rate, "turntable_rate", "rad/s")
        non_negative(self.mu, "mu", "1")
        super().__post_init__()

    @classmethod
    def state(
        cls, *, rotation_vector: npt.ArrayLike | None = None, **components: npt.ArrayLike
    ) -> Array:
        """State row of attitude and components; those left out are 0, the ball upright.

        Args:
            rotation_vector: axis times angle by which the ball is turned, world axes [rad], shape
                (..., 3).
            **components: position [m] and velocity [m/s] in plate axes, tilt [rad] and tilt_rate
                [rad/s] of the plate, each of shape (..., 2); spin about its normal [rad/s]; q in
                place of the rotation vector. All are broadcast together.

        Returns:
            y of shape (..., 13).

        Raises:
            ValueError: as `System.state`; a rotation vector beside q.
        """
        if rotation_vector is not None:
            instead(components, "q", {"rotation_vector": rotation_vector})
            components["q"] = rotations.exp(rotation_vector)
        return super().state(**components)

    def position(self, y: npt.ArrayLike) -> Array:
        """Centre (X, Y) in plate axes, from O [m], shape (..., 2)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 4:6])

    def velocity(self, y: npt.ArrayLike) -> Array:
        """Velocity (VX, VY) in plate axes [m/s], shape (..., 2)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 6:8])

    def spin(self, y: npt.ArrayLike) -> Array:
        """Component of the angular velocity along the normal of the plate [rad/s], shape (...)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 8])

    def tilt(self, y: npt.ArrayLike) -> Array:
        """Angles (alpha_x, alpha_y) of the plate [rad], shape (..., 2)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 9:11])

    def tilt_rate(self, y: npt.ArrayLike) -> Array:
        """Rates of the angles of the plate [rad/s], shape (..., 2)."""
        return np.array(np.asarray(y, dtype=np.float64)[..., 11:13])

    def plate(self, y: npt.ArrayLike) -> Array:
        """Matrix P of the plate, v_world = P v_plate, shape (..., 3, 3)."""
        return _plate(np.asarray(y, dtype=np.float64))

    def centre(self, y: npt.ArrayLike) -> Array:
        """Centre of the ball from O, in world axes [m], shape (..., 3)."""
        rows = np.asarray(y, dtype=np.float64)
        return _to_world(rows, self._centre(rows))

    def velocity_world(self, y: npt.ArrayLike) -> Array:
        """Velocity of the centre in world axes [m/s], shape (..., 3)."""
        rows = np.asarray(y, dtype=np.float64)
        relative = np.concatenate([rows[..., 6:8], np.zeros_like(rows[..., :1])], axis=-1)
        return _to_world(rows, relative + np.cross(_plate_rate(rows), self._centre(rows)))

    def omega_plate(self, y: npt.ArrayLike) -> Array:
        """Angular velocity of the ball in plate axes [rad/s], shape (..., 3)."""
        rows = np.asarray(y, dtype=np.float64)
        x, y_, vx, vy, spin = np.moveaxis(rows[..., 4:9], -1, 0)
        w, table = _plate_rate(rows), self.turntable_rate
        across = w[..., 0] - (vy - table * x) / self.radius
        along = w[..., 1] + (vx + table * y_) / self.radius
        return np.stack([across, along, spin], axis=-1)

    def omega_world(self, y: npt.ArrayLike) -> Array:
        """Angular velocity of the ball in world axes [rad/s], shape (..., 3)."""
        rows = np.asarray(y, dtype=np.float64)
        return _to_world(rows, self.omega_plate(rows))

    def energy(self, y: npt.ArrayLike) -> Array:
        """Kinetic energy of motion and rotation plus m g times the height of the centre [J]."""
        speed = np.sum(self.velocity_world(y) ** 2, axis=-1)
        turn = np.sum(self.omega_plate(y) ** 2, axis=-1)
        kinetic = 0.5 * self.m * (speed + self.beta * self.radius**2 * turn)
        return np.asarray(kinetic + self.m * self.g * self.centre(y)[..., 2])

    def rate_and_growth(self, y: Array, u: Array) -> tuple[float, float]:
        """Sum of the rates of ball and plate and sqrt(g / radius), and its growth."""
        rows, inputs = self._broadcast(y, u)
        fall = self.g / self.radius
        plate = np.linalg.norm(self.tilt_rate(rows), axis=-1) + abs(self.turntable_rate)
        rate = np.linalg.norm(self.omega_plate(rows), axis=-1) + plate
        pushed = np.linalg.norm(self._evaluate(rows, inputs, np.float64)[..., 6:8], axis=-1)
        gain = pushed / self.radius + np.linalg.norm(inputs[..., 2:], axis=-1)
        return (
            float(np.max(rate, initial=0.0)) + math.sqrt(fall),
            float(np.max(gain, initial=0.0)) + fall,
        )

    def _centre(self, y: Array) -> Array:
        """Centre in plate axes (X, Y, radius) [m]."""
        return np.concatenate([y[..., 4:6], np.full_like(y[..., :1], self.radius)], axis=-1)


def _plate(y: Array) -> Array:
    """P = Rx(alpha_x) Ry(alpha_y)."""
    (sx, sy), (cx, cy) = (np.moveaxis(f(y[..., 9:11]), -1, 0) for f in (np.sin, np.cos))
    zero = np.zeros_like(sx)
    rows = [[cy, zero, sy], [sx * sy, cx, -sx * cy], [-cx * sy, sx, cx * cy]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _plate_rate(y: Array) -> Array:
    """Angular velocity of the plate in its own axes [rad/s]."""
    rate_x, rate_y = y[..., 11], y[..., 12]
    return np.stack([rate_x * np.cos(y[..., 10]), rate_y, rate_x * np.sin(y[..., 10])], axis=-1)


def _to_world(y: Array, v: Array) -> Array:
    """World components of a vector in plate axes."""
    return np.asarray(np.einsum("...ij,...j->...i", _plate(y), v))
