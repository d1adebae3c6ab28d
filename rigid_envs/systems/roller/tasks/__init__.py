"""Tasks of rollers."""

from rigid_envs.systems.roller.tasks.roll_pump import RollPump

__all__ = ["RollPump"]
