"""Tasks of the gyrostat."""

from rigid_envs.systems.gyrostat.tasks.dual_spin import DualSpin
from rigid_envs.systems.gyrostat.tasks.wheel_reorient import TwoWheels, WheelReorient
from rigid_envs.systems.gyrostat.tasks.wheel_track import WheelTrack

__all__ = ["DualSpin", "TwoWheels", "WheelReorient", "WheelTrack"]
