"""The reference controllers of every environment."""

from rigid_envs.scores.bindings import ball, coin_and_wheel, free_body, heavy_top
from rigid_envs.scores.policy import Builder

__all__ = ["REFERENCES"]

REFERENCES: dict[str, dict[str, Builder]] = {
    **free_body.REFERENCES,
    **heavy_top.REFERENCES,
    **ball.REFERENCES,
    **coin_and_wheel.REFERENCES,
}
"""Builders of policies by environment id and name of the controller, the best first."""
