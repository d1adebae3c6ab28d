"""Importing it registers the tasks of `tasks`: here, and in each process that trains them."""

from __future__ import annotations

from rigid_envs import register
from rigid_envs.tasks.registry import ENVIRONMENTS

from .plan import NAMES, variant_id

__all__: list[str] = []


def _register(name: str, part: str) -> None:
    """Register a task, with the metrics of the id that it is a variant of."""
    record = ENVIRONMENTS[f"RigidEnvs/{name}-v0"]
    register(
        variant_id(name, part),
        f"{__package__}.tasks:{name}{part.capitalize()}",
        record.max_episode_steps,
        family=record.family,
        metrics=record.metrics,
        error=record.error,
    )


for _name in NAMES:
    for _part in ("features", "frame"):
        _register(_name, _part)
