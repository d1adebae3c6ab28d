"""Options of tasks whose body rolls with inertia: friction, and an end where it would slip."""

from __future__ import annotations

from dataclasses import dataclass

from rigid_envs.tasks.base import Task
from rigid_envs.tasks.fields import Flag, Number, Range, physical, setting

__all__ = ["Rolling"]


@dataclass(frozen=True)
class Rolling(Task):
    """Task of a body that rolls without slipping, whatever friction that needs.

    Attributes:
        mu: coefficient of static friction.
        end_on_slip: end the episode, without success, in a step after which rolling needs more
            friction than mu gives.
        slip_penalty: what that takes off the reward of the step.
    """

    mu: Range = physical(1.0, "coefficient of static friction", "1")
    end_on_slip: bool = setting(False, Flag("end the episode when rolling needs more than mu"))
    slip_penalty: float = setting(
        20.0, Number("taken off the reward of the step that ends so", "1", 0.0, 1e6)
    )

    @property
    def slip_rule(self) -> tuple[bool, float]:
        """Whether slip ends an episode, and what it takes off the reward."""
        return self.end_on_slip, self.slip_penalty
