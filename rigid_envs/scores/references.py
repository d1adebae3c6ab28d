"""The reference controllers of every environment."""

from rigid_envs.scores.bindings import free_body, heavy_top
from rigid_envs.scores.policy import Builder

__all__ = ["REFERENCES"]

REFERENCES: dict[str, dict[str, Builder]] = {
    **free_body.REFERENCES,
    **heavy_top.REFERENCES,
}
"""Builders of policies by environment id and name of the controller, the best first."""
