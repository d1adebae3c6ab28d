"""Policies for the tasks of a free body."""

from rigid_envs.scores.policy import Builder

__all__ = ["REFERENCES"]

REFERENCES: dict[str, dict[str, Builder]] = {}
