"""What tasks share in which a ball rolls as it is told."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from rigid_envs.base.settings import Number, setting
from rigid_envs.engine.compiler import scalar
from rigid_envs.systems.rolling_ball.dynamics import Input, Parameters, State
from rigid_envs.systems.rolling_ball.system import RollingBall
from rigid_envs.tasks.fields import Entry, Range, physical, span
from rigid_envs.tasks.task import Task


class Action(NamedTuple):
    """Velocity of the centre, as a fraction of the maximum speed."""

    VX: float
    VY: float


@scalar
def actuate(a: Action, y: State, aux: Any, p: Parameters, c: Any) -> tuple[State, Input]:
    """Velocity of the centre; the ball does not spin about the vertical."""
    return y, Input(
        c.largest_roll_rate * p.radius * a.VX, c.largest_roll_rate * p.radius * a.VY, 0.0
    )


@dataclass(frozen=True)
class RollsAsTold(Task):
    """The velocity of the centre as action."""

    radius: Range = physical(1.0, "radius of the ball", "m")
    roll_per_step: float = setting(
        math.pi / 8, Number("largest roll per control period", "rad", 1e-3, math.pi / 2)
    )

    system_type: ClassVar = RollingBall
    cost_unit: ClassVar = "distance rolled [m]"

    @property
    def largest_roll_rate(self) -> float:
        """Rolling rate at full action [rad/s]."""
        return self.roll_per_step / self.dt

    def actions(self) -> tuple[Entry, ...]:
        """Velocity of the centre, in a disk."""
        speed = self.largest_roll_rate * span(self.radius)[1]
        return tuple(Entry(f"V{k}", "m/s", "world, disk", -speed, speed) for k in "XY")

    def largest_rate(self, duration: float) -> float:
        """Rolling rate at full speed."""
        return self.largest_roll_rate
