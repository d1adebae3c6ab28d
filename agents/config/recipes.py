"""Shipped config of each environment."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gymnasium import spaces

from ..environments.factory import make
from .by_algorithm import Config, config_from
from .yaml_data import read_yaml

__all__ = ["config_for", "recipe_for"]

_CONFIGS = Path(__file__).resolve().parents[2] / "configs"


def config_for(env_id: str, entries: Mapping[str, Any]) -> Config:
    """The shipped config of an environment, with other entries over it.

    Args:
        env_id: A registered id.
        entries: Config entries that go over those of the file.

    Raises:
        ConfigError: No such environment, or an entry that cannot be.
    """
    return config_from({**recipe_for(env_id, entries.get("algo")), **entries})


def recipe_for(env_id: str, algo: str | None = None) -> dict[str, Any]:
    """Entries of the shipped config of an environment, `configs/<name>_<algo>.yaml`.

    Where none is shipped: the id and the algorithm, for which the defaults hold.

    Args:
        env_id: A registered id.
        algo: Name of the algorithm; None takes the most suitable one that has a config.

    Raises:
        ConfigError: No such environment.
    """
    algos = _suitable(env_id) if algo is None else (algo,)
    name = re.sub(r"-v\d+$", "", re.split("[:/]", env_id)[-1])
    stem = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
    for kind in algos:
        path = _CONFIGS / f"{stem}_{kind}.yaml"
        if path.is_file():
            values = read_yaml(path)
            if values.get("env_id") == env_id:
                return values
    return {"env_id": env_id, "algo": algos[0]}


def _suitable(env_id: str) -> tuple[str, ...]:
    """The algorithms that fit an environment, best first.

    PPO makes the most of many cheap steps. Rewards that are only paid at a goal are found in
    hindsight; values of a few choices are learnt as such.
    """
    venv = make(env_id, {}, 1)
    goals = isinstance(venv.single_observation_space, spaces.Dict)
    choices = isinstance(venv.single_action_space, spaces.Discrete)
    venv.close()
    if choices:
        return ("dqn", "ppo")
    return ("sac", "ppo") if goals else ("ppo", "sac")
