"""What tasks of a free body share."""

import abc
import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from rigid_envs.base.settings import Number, refusal, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Quaternion, Row, Vector, attitude
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import fma
from rigid_envs.engine.episode import single
from rigid_envs.mechanics.system import System, fastest_turn
from rigid_envs.systems.free_body.dynamics import Input, State
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.tasks.fields import Entry, Range, physical, span
from rigid_envs.tasks.parts import Held, limited, single_matrix
from rigid_envs.tasks.task import Task

Moments = tuple[Range, Range, Range]

FASTEST = 20.0  # bound of observed rates
REDUCED_RATES = tuple(
    Entry(f"omega{k} / Omega", "1", "reduced", -FASTEST, FASTEST) for k in (1, 2, 3)
)
_REST = (0.0, 0.0, 0.0)


class BodyTorque(NamedTuple):
    """Torque about the body axes, as fractions of the maximum."""

    tau1: float
    tau2: float
    tau3: float


class HalfTurn(NamedTuple):
    """A half turn of the body about one of its axes, or none: the signs of its coordinates."""

    sign1: float
    sign2: float
    sign3: float


@scalar
def turn(a: Any, frame: Any) -> tuple[float, float, float]:
    """Torque about the axes of the body."""
    return frame.sign1 * a[0], frame.sign2 * a[1], frame.sign3 * a[2]


@dataclass(frozen=True)
class BodyTask(Task):
    """A task of a body of any moments."""

    I1: Range = physical(1.0, "principal moment about e1", "kg m^2")
    I2: Range = physical(2.0, "principal moment about e2", "kg m^2")
    I3: Range = physical(3.0, "principal moment about e3", "kg m^2")

    system_type: ClassVar[type[System]] = FreeBody

    # Middles of the ranges of the moments: what a policy knows of a body that is drawn.
    @property
    def middle1(self) -> float:
        """Middle of the range of I1 [kg m^2]."""
        return 0.5 * sum(span(self.I1))

    @property
    def middle2(self) -> float:
        """Middle of the range of I2 [kg m^2]."""
        return 0.5 * sum(span(self.I2))

    @property
    def middle3(self) -> float:
        """Middle of the range of I3 [kg m^2]."""
        return 0.5 * sum(span(self.I3))


class TorqueTask(BodyTask):
    """A task of a body with actuators about its axes."""

    cost_unit: ClassVar = "torque impulse [N m s]"

    @abc.abstractmethod
    def torques(self) -> tuple[float, float, float]:
        """Largest torque about each body axis [N m]; 0 where there is no actuator."""

    def actions(self) -> tuple[Entry, ...]:
        """Torques about the body axes."""
        torques = enumerate(self.torques(), start=1)
        return tuple(Entry(f"tau{k}", "N m", "body", -torque, torque) for k, torque in torques)

    def spun_up_from(self, rate: float, duration: float) -> float:
        """Bound on the rates after full torque for a time [s] from a rate on [rad/s].

        ``(sqrt(2 T))' = omega . tau / sqrt(2 T) <= sqrt(sum tau_k^2 / I_k)``, by the Cauchy-Schwarz
        inequality.
        """
        moments = (self.I1, self.I2, self.I3)
        pairs = zip(self.torques(), moments, strict=True)
        gain = math.sqrt(sum(tau * tau / span(moment)[0] for tau, moment in pairs))
        heaviest = max(span(moment)[1] for moment in moments)
        return fastest(moments, rate * math.sqrt(heaviest) + duration * gain)


class OrderedBodyTask(TorqueTask):
    """A task of a body whose intermediate axis is e2."""

    def check_settings(self) -> None:
        """Also refuse moments in another order."""
        super().check_settings()
        if not span(self.I1)[1] < span(self.I2)[0]:
            raise refusal("I1", self.I1, f"less than I2 = {self.I2}")
        if not span(self.I2)[1] < span(self.I3)[0]:
            raise refusal("I3", self.I3, f"more than I2 = {self.I2}")


@dataclass(frozen=True)
class SpinTask(OrderedBodyTask):
    """A task of the spin of a body at the rate Omega about the intermediate axis."""

    rotation: str = "none"
    I1: Range = physical(1.0, "least principal moment", "kg m^2")
    I2: Range = physical(2.0, "middle principal moment", "kg m^2")
    I3: Range = physical(3.0, "largest principal moment", "kg m^2")
    spin_rate: float = setting(1.0, Number("target rate Omega", "rad/s", 1e-3, 1e3))
    torque: float = setting(0.1, Number("largest torque about each axis", "N m", 1e-6, 1e6))

    counters: ClassVar = ("held",)

    def torques(self) -> tuple[float, float, float]:
        """Largest torque about each body axis [N m]; 0 where there is no actuator."""
        return (self.torque,) * 3

    def features(self) -> tuple[Entry, ...]:
        """Angular velocity divided by Omega."""
        return tuple(Entry(f"omega{k} / Omega", "1", "body", -FASTEST, FASTEST) for k in (1, 2, 3))


@dataclass(frozen=True)
class PerturbedSpinTask(SpinTask):
    """A task that starts beside a spin about the intermediate axis.

    The perturbation lies in a ball of angular velocities.
    """

    start_spread: float = setting(
        0.1, Number("radius of the ball of perturbations at the start", "rad/s", 0.0, 1e3)
    )

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates after full torque during the whole episode."""
        return self.spun_up_from(self.spin_rate + self.start_spread, duration)


class DrawnRate:
    """Part of a task whose rate at the start may be drawn."""

    start_rate: Range

    @property
    def least_start_rate(self) -> float:
        """Least rate at the start [rad/s]."""
        return span(self.start_rate)[0]

    @property
    def largest_start_rate(self) -> float:
        """Largest rate at the start [rad/s]."""
        return span(self.start_rate)[1]


@scalar
def drawn_rate(stream: randoms.Stream, index: int, c: Any) -> float:
    """Rate at the start [rad/s], uniform between its ends."""
    low = c.least_start_rate
    return fma(c.largest_start_rate - low, randoms.uniform(stream, index), low)


@scalar
def perturbed_spin(stream: randoms.Stream, rate: float, spread: float) -> State:
    """Spin about e2, perturbed uniformly in a ball [rad/s]; attitude uniform on SO(3)."""
    a, b, d = randoms.in_ball(stream, 0)
    q = randoms.quaternion(stream, 1 << 20)
    return State(*q, spread * a, spread * b + rate, spread * d)


@scalar
def start(stream: randoms.Stream, p: Any, c: Any) -> tuple[State, Held]:
    """Spin Omega about e2, perturbed uniformly in a ball; attitude uniform on SO(3)."""
    return perturbed_spin(stream, c.spin_rate, c.start_spread), Held(0.0)


@scalar
def actuate(a: BodyTorque, y: State, aux: Any, p: Any, c: Any) -> tuple[State, Input]:
    """Torque about the three body axes."""
    return y, Input(c.torque * a.tau1, c.torque * a.tau2, c.torque * a.tau3)


@scalar
def observed_rates(y: Any, scale: float) -> Vector:
    """Angular velocity times a scale, clipped to the bounds of the observation."""
    return limited((scale * y.omega1, scale * y.omega2, scale * y.omega3), FASTEST)


@scalar
def observe(y: State, aux: Any, p: Any, c: Any) -> tuple[float, float, float]:
    """Angular velocity divided by Omega."""
    return observed_rates(y, 1.0 / c.spin_rate)


@scalar
def _pose(q: Quaternion, omega: Vector) -> Row:
    """The nine entries of R and omega [rad/s], rounded to float32 as in the observation."""
    a, b, c = limited(omega, FASTEST)
    return (*single_matrix(q), single(a), single(b), single(c))


@scalar
def both_poses(y: Any, aux: Any) -> tuple[Row, Row]:
    """Achieved goal of the body, and desired goal, which is at rest."""
    achieved = _pose(attitude(y), (y.omega1, y.omega2, y.omega3))
    return achieved, _pose((aux.goal_w, aux.goal_x, aux.goal_y, aux.goal_z), _REST)


def fastest(moments: Moments, root: float) -> float:
    """Bound on the rates of motion and integrator steps [rad/s], at sqrt(2 T) = root.

    For the worst body of the ranges; see `rigid_envs.mechanics.system.fastest_turn`.
    """
    low = [span(moment)[0] for moment in moments]
    high = max(span(moment)[1] for moment in moments)
    return root * fastest_turn(np.array([min(low), low[1], high]))
