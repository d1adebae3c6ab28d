"""Which config an environment is trained with, where nobody says."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gymnasium import spaces

from .config import Config, config_from
from .environments import make
from .loading import read_yaml

__all__ = ["config_for"]

_CONFIGS = Path(__file__).resolve().parent.parent / "configs"


def config_for(env_id: str, entries: Mapping[str, Any]) -> Config:
    """The shipped config of an environment, `configs/<name>_<algo>.yaml`; where none is, defaults.

    Args:
        env_id: The environment.
        entries: Config entries that go over those of the file.

    Raises:
        ConfigError: No such environment, or an entry that cannot be.
    """
    algos = _suitable(env_id)
    name = re.sub(r"-v\d+$", "", re.split("[:/]", env_id)[-1])
    stem = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
    for algo in algos:
        path = _CONFIGS / f"{stem}_{algo}.yaml"
        if path.is_file():
            values = read_yaml(path)
            if values.get("env_id") == env_id:
                return config_from({**values, **entries})
    return config_from({"env_id": env_id, "algo": algos[0], **entries})


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
