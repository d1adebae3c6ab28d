"""What can play an id without any training, by name."""

from __future__ import annotations

from rigid_envs.scores.evaluation import Player, at_random, controller
from rigid_envs.scores.references import REFERENCES
from rigid_envs.scores.sampling import sampling

__all__ = ["player_of", "players_of"]


def players_of(env_id: str) -> dict[str, Player]:
    """Players of an id by name: its reference controllers, "sampling" and "random".

    Args:
        env_id: The id.
    """
    references = {name: controller(build) for name, build in REFERENCES.get(env_id, {}).items()}
    return {**references, "sampling": controller(sampling), "random": at_random()}


def player_of(env_id: str, name: str) -> tuple[str, Player]:
    """A player of an id, and its own name.

    Args:
        env_id: The id.
        name: One of `players_of`, or "reference" for the best reference controller.

    Raises:
        ValueError: none of the name; names those that there are.
    """
    players = players_of(env_id)
    known = list(players)
    if name == "reference" and env_id in REFERENCES:
        name = known[0]
    if name not in players:
        raise ValueError(f"{env_id} has no controller {name!r}; expected one of {known}")
    return name, players[name]
