"""Tasks of spheroids on a plane."""

from rigid_envs.systems.spheroid.tasks.tippe_top import TippeTop

__all__ = ["TippeTop"]
