"""What tasks share in which a ball rolls as it is told."""

from __future__ import annotations

from typing import Any, NamedTuple

from rigid_envs.engine.compiler import scalar
from rigid_envs.systems.rolling_ball.dynamics import Input, Parameters, State
from rigid_envs.tasks.fields import Entry, Range, span


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


class RollsAsTold:
    """The velocity of the centre as action."""

    radius: Range
    roll_per_step: float
    dt: float

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
