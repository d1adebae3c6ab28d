"""Tasks of the satellite."""

from rigid_envs.systems.satellite.tasks.magnetic_detumble import MagneticDetumble

__all__ = ["MagneticDetumble"]
