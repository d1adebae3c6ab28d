"""Policies for the tasks of a heavy top."""

from rigid_envs.scores.policy import Builder

__all__ = ["REFERENCES"]

REFERENCES: dict[str, dict[str, Builder]] = {}
