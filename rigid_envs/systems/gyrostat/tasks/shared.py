"""What tasks of a gyrostat share: motors with a limit, wheels with a capacity."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from rigid_envs.base.settings import Number, refusal, setting
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Vector
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import clamp
from rigid_envs.systems.free_body.tasks.shared import BodyTask
from rigid_envs.systems.gyrostat.system import Gyrostat
from rigid_envs.tasks.fields import Entry, Range, physical, span


@scalar
def motor(a: float, l: float, c: Any) -> float:  # noqa: E741
    """Torque [N m] of a motor whose wheel has the spin momentum l [N m s].

    It is the commanded share of the largest, or what takes the wheel just to its capacity.
    """
    up, down = max((c.capacity - l) / c.dt, 0.0), min((-c.capacity - l) / c.dt, 0.0)
    return clamp(c.torque * a, down, up)


@scalar
def biased(stream: randoms.Stream, p: Any, c: Any) -> Vector:
    """Rates of the wheels of a carrier at rest [rad/s], spin momenta uniform in a ball."""
    a, b, d = randoms.in_ball(stream, 0)
    return c.bias * a * p.per_J1, c.bias * b * p.per_J2, c.bias * d * p.per_J3


@dataclass(frozen=True)
class WheelTask(BodyTask):
    """A task of a carrier that is turned by wheels: a subclass has J1, J2, J3 of those it has."""

    dt: float = 1.0
    n_substeps: int = 2
    I1: Range = physical(2.0, "principal moment about e1, wheels locked", "kg m^2")
    I2: Range = physical(2.5, "principal moment about e2, wheels locked", "kg m^2")
    I3: Range = physical(3.0, "principal moment about e3, wheels locked", "kg m^2")
    torque: float = setting(0.02, Number("largest torque of each motor", "N m", 1e-9, 1e6))
    capacity: float = setting(
        0.4, Number("largest spin momentum of each wheel", "N m s", 1e-9, 1e6)
    )

    system_type: ClassVar = Gyrostat
    cost_unit: ClassVar[str] = "torque impulse of the motors [N m s]"

    def actions(self) -> tuple[Entry, ...]:
        """Torque of each motor on its wheel."""
        wheels = self.episode.Action._fields
        return tuple(Entry(name, "N m", "body", -self.torque, self.torque) for name in wheels)

    def turned_at_most(self, momentum: float, stored: float) -> float:
        """Bound on the rates of motion and integrator [rad/s].

        ``norm(A omega) <= norm(L) + norm(l)``; the turns of a step are those of
        `rigid_envs.systems.gyrostat.dynamics.rate`.

        Args:
            momentum: Largest |L| [N m s].
            stored: Largest norm of the spin momenta [N m s].
        """
        wheels = [span(getattr(self, f"J{k}", 0.0))[1] for k in "123"]
        moments = [span(getattr(self, f"I{k}"))[0] - J for k, J in zip("123", wheels, strict=True)]
        return (momentum + stored) / min(moments) + momentum / moments[1]


@dataclass(frozen=True)
class BiasedWheelTask(WheelTask):
    """A task of a carrier that begins at rest, while its three wheels may turn."""

    bias: float = setting(
        0.2, Number("radius of the ball of spin momenta at the start", "N m s", 0.0, 1e6)
    )

    def check_settings(self) -> None:
        """Also refuse wheels that begin beyond their capacity."""
        super().check_settings()
        if self.bias > self.capacity:
            raise refusal("bias", self.bias, f"at most capacity = {self.capacity}")

    def largest_rate(self, duration: float) -> float:
        """Bound on the rates at full wheels: the angular momentum is that of the start."""
        return self.turned_at_most(self.bias, math.sqrt(3.0) * self.capacity)
