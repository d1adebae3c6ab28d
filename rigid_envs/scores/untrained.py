"""Policies that need no training, by name."""

from __future__ import annotations

from rigid_envs.scores.controllers import reference_controllers
from rigid_envs.scores.evaluation import PolicyFactory, constant_zero, from_controller, uniform
from rigid_envs.scores.sampling import sampling

__all__ = ["untrained_policies", "untrained_policy"]


def untrained_policies(env_id: str) -> dict[str, PolicyFactory]:
    """Policies of an id by name: its reference controllers, "sampling", "zero" and "random"."""
    references = {
        name: from_controller(factory) for name, factory in reference_controllers(env_id).items()
    }
    return {
        **references,
        "sampling": from_controller(sampling),
        "zero": constant_zero,
        "random": uniform(),
    }


def untrained_policy(env_id: str, name: str) -> tuple[str, PolicyFactory]:
    """An untrained policy of an id, and its own name.

    Args:
        env_id: Gymnasium's id.
        name: One of `untrained_policies`, or "reference" for the best reference controller.

    Raises:
        ValueError: none of the name; names those that there are.
    """
    policies = untrained_policies(env_id)
    chosen = next(iter(reference_controllers(env_id)), name) if name == "reference" else name
    if chosen not in policies:
        raise ValueError(f"{env_id}: controller = {name!r}; expected one of {list(policies)}")
    return chosen, policies[chosen]
