"""Whose behaviour a data set holds: the random policy, a reference, or a trained policy."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from rigid_envs.catalogue import full_id, task_of
from rigid_envs.envs.task_spaces import action_space
from rigid_envs.errors import ConfigError
from rigid_envs.policies import load
from rigid_envs.policies.loading import path_of
from rigid_envs.references import reference
from rigid_envs.registry import ENVIRONMENTS
from rigid_envs.scores import PolicyFactory, RandomPolicy, from_predict, reference_controllers
from rigid_envs.scores.starts import row_seeds

__all__ = ["Behaviour", "behaviour"]


class Behaviour(NamedTuple):
    """A policy, and where it acts.

    Attributes:
        policy: The policy, which acts on observations.
        settings: Of the environment.
        origin: Where the policy comes from, as JSON values: `kind` ("random", "reference",
            "trained"), `name`, and of a trained one the `sha256` of its file and its training.
    """

    policy: PolicyFactory
    settings: dict[str, Any]
    origin: dict[str, Any]


def behaviour(env_id: str, policy: str, settings: Mapping[str, Any], seed: int = 0) -> Behaviour:
    """The behaviour that a name stands for.

    Args:
        env_id: A registered id.
        policy: "random"; "reference" for the best reference controller, or the name of one; the
            name of a published policy, "BallPark"; or the path of a ``policy.safetensors``.
        settings: Of the environment; of a trained policy they go over those that it knows.
        seed: Of the random policy.

    Raises:
        ConfigError: None of these; says what there is. Or settings that cannot be.
    """
    if policy.endswith(".safetensors") or full_id(policy) in ENVIRONMENTS:
        return _trained(policy, settings)
    if policy == "random":
        stream = np.random.default_rng(row_seeds(seed, 1, "random policy"))
        draw = RandomPolicy(action_space(task_of(env_id, settings)), stream)
        return Behaviour(
            from_predict(draw, policy), dict(settings), {"kind": "random", "name": "random"}
        )
    known = ("reference", *reference_controllers(env_id))
    if policy not in known:
        raise ConfigError(
            f"policy = {policy!r}; expected 'random', {', '.join(map(repr, known))}, the name of a "
            "published policy, or a file (.safetensors)"
        )
    agent = reference(env_id, None if policy == "reference" else policy, **settings)
    origin = {"kind": "reference", "name": agent.name}
    return Behaviour(from_predict(agent, agent.name), dict(settings), origin)


def _trained(policy: str, settings: Mapping[str, Any]) -> Behaviour:
    file = path_of(policy)
    found = load(file)
    origin = {
        "kind": "trained",
        "name": found.name,
        "sha256": hashlib.sha256(file.read_bytes()).hexdigest(),
        **{key: found.document.get(key) for key in ("algo", "env_id", "seed", "timesteps")},
    }
    return Behaviour(from_predict(found, found.name), {**found.env_kwargs, **settings}, origin)
