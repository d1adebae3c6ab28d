"""Tasks of the disk."""

from rigid_envs.systems.rolling_disk.tasks.disk_roll import DiskRoll, DiskRollRandom

__all__ = ["DiskRoll", "DiskRollRandom"]
