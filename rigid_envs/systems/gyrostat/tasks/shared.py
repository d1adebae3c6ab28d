"""What tasks of a gyrostat share: motors with a limit, wheels with a capacity."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from rigid_envs.base.settings import Number, setting
from rigid_envs.engine.compiler import scalar
from rigid_envs.engine.elementary import clamp
from rigid_envs.systems.gyrostat.system import Gyrostat
from rigid_envs.tasks.fields import Range, physical, span
from rigid_envs.tasks.task import Task


@scalar
def motor(a: float, l: float, c: Any) -> float:  # noqa: E741
    """Torque [N m] of a motor whose wheel has the spin momentum l [N m s].

    It is the commanded share of the largest, or what takes the wheel just to its capacity.
    """
    up, down = max((c.capacity - l) / c.dt, 0.0), min((-c.capacity - l) / c.dt, 0.0)
    return clamp(c.torque * a, down, up)


@dataclass(frozen=True)
class WheelTask(Task):
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

    # Middles of the ranges of the moments: what a policy knows of a satellite that is drawn.
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

    def turned_at_most(self, momentum: float) -> float:
        """Bound on the rates of motion and integrator [rad/s], of angular momentum |L| [N m s].

        ``norm(A omega) <= norm(L) + norm(l)``, as norm(l) is at most sqrt(3) capacities; the turns
        of a step are those of `rigid_envs.systems.gyrostat.dynamics.rate`.
        """
        wheels = [span(getattr(self, f"J{k}", 0.0))[1] for k in "123"]
        moments = [span(getattr(self, f"I{k}"))[0] - J for k, J in zip("123", wheels, strict=True)]
        return (momentum + math.sqrt(3.0) * self.capacity) / min(moments) + momentum / moments[1]
