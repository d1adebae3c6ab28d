"""The trainings of the ablations: recipes in the reduced frame, with each of their parts alone.

=========  =========================================================================================
none       the world frame, as every user of Gymnasium gets it
schedule   the world frame; the spread of actions decreases by a schedule and is not learnt
features   the world's observation and actions, and beside it the features of the reduction
frame      actions of the reduced frame, and plain coordinates in it
all        frame and features, and the schedule where the recipe has one
=========  =========================================================================================

All else is that of the recipe, such as network and learning rate; but 1.5 M steps, and neither a
price nor a bonus: where little succeeds, a price teaches to do nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..config.entries import Config, config_from
from ..config.reading import recipe_for

__all__ = ["NAMES", "PARTS", "ablation", "variant_id"]

NAMES = ("BallPark", "AxisFlip", "TopPrecession")
"""Names of the ids."""

PARTS = ("none", "schedule", "features", "frame", "all")
"""Names of the variants."""

_STEPS = 1_500_000  # enough for the recipes to succeed, if not for their last per cent of cost
_SCHEDULE = (0.6, 0.1)  # standard deviation of the actions at the start and at the end


def ablation(name: str, part: str, seed: int, **entries: Any) -> Config:
    """The config of a training; `registration` has the environments.

    Args:
        name: One of `NAMES`.
        part: One of `PARTS`.
        seed: Seed of the training.
        **entries: Other entries of the config.
    """
    recipe = recipe_for(f"RigidEnvs/{name}-v0", "ppo", "reduced")
    ours = {"total_timesteps": _STEPS, "cost_price": 0, "success_bonus": 0, "seed": seed}
    ours |= _entries(name, part)
    return config_from({**recipe, **ours, **entries})


def _entries(name: str, part: str) -> Mapping[str, Any]:
    """What a variant has for entries of the recipe."""
    if part == "all":
        return {}
    world: dict[str, Any] = {"env_id": f"RigidEnvs/{name}-v0", "env_kwargs": {}, "action_std": None}
    if part == "none":
        return world
    if part == "schedule":
        return {**world, "action_std": _SCHEDULE}
    frame = "reduced" if part == "frame" else "world"
    return {**world, "env_id": variant_id(name, part), "env_kwargs": {"frame": frame}}


def variant_id(name: str, part: str) -> str:
    """Id of the task of `tasks` with one half of a reduction.

    Args:
        name: One of `NAMES`.
        part: "features" or "frame".
    """
    return f"Ablations/{name}{part.capitalize()}-v0"
