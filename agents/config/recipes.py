"""Shipped config of each environment."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gymnasium import spaces

from rigid_envs.catalogue import full_id

from ..environments.factory import make
from .by_algorithm import Config, config_from
from .yaml_data import read_yaml

__all__ = ["config_for", "frame_of", "recipe_for", "shipped_config"]

_OF_ANY_ALGORITHM = ("train_kwargs", "cost_price", "success_bonus")
_CONFIGS = Path(__file__).resolve().parents[2] / "configs"


def config_for(env_id: str, entries: Mapping[str, Any], frame: str | None = None) -> Config:
    """The shipped config of an environment, with other entries over it.

    Args:
        env_id: A registered id, or its short form: "BallPark".
        entries: Config entries that go over those of the file.
        frame: Frame of the recipe; None takes that of the entries, or any.

    Raises:
        ConfigError: No such environment, or an entry that cannot be.
    """
    recipe = recipe_for(env_id, entries.get("algo"), frame or frame_of(entries, {}))
    return config_from({**recipe, **entries})


def shipped_config(path: Path) -> Path:
    """File of a shipped config that is named without folder and ending: `ball_park_ppo`.

    Args:
        path: The name; any other path is given back as it is.
    """
    file = _CONFIGS / f"{path}.yaml"
    return file if len(path.parts) == 1 and file.is_file() else path


def frame_of(entries: Mapping[str, Any], keywords: Mapping[str, Any]) -> str | None:
    """The frame that a recipe has to be for; None where any will do.

    Args:
        entries: Config entries that go over those of the recipe.
        keywords: Hyperparameters of the task that go over its `env_kwargs`.
    """
    if "frame" in keywords:
        return str(keywords["frame"])
    if "env_kwargs" not in entries:
        return None
    given = entries["env_kwargs"]  # all of them, which leaves nothing of the recipe's
    return str(given.get("frame", "world")) if isinstance(given, Mapping) else "world"


def recipe_for(env_id: str, algo: str | None = None, frame: str | None = None) -> dict[str, Any]:
    """Entries of the shipped config of an environment.

    They are `configs/<name>_reduced_<algo>.yaml` in the reduced frame, `configs/<name>_<algo>.yaml`
    in that of the world. Where none is shipped: the id, the algorithm and the frame, and what the
    config of another algorithm in this frame says of rewards and period in training; for all else
    the defaults of the algorithm hold.

    Args:
        env_id: A registered id, or its short form: "BallPark".
        algo: Name of the algorithm; None takes the most suitable one that has a config.
        frame: Frame of observations and actions, "world" or "reduced"; None takes the reduced one
            where it has a config.

    Raises:
        ConfigError: No such environment.
    """
    env_id = full_id(env_id)
    plain: dict[str, Any] = {}
    for each in ("reduced", "world") if frame is None else (frame,):
        suitable = _suitable(env_id, each == "reduced")
        algos = suitable if algo is None else (algo,)
        for values in (_shipped(env_id, kind, each) for kind in algos):
            if values:
                return values
        plain = {"env_id": env_id, "algo": algos[0]}
        plain |= {"env_kwargs": {"frame": each}} if each == "reduced" else {}
        others = next(filter(None, (_shipped(env_id, kind, each) for kind in suitable)), {})
        plain |= {key: others[key] for key in _OF_ANY_ALGORITHM if key in others}
    return plain


def _shipped(env_id: str, algo: str, frame: str) -> dict[str, Any]:
    """Entries of the config of an environment, an algorithm and a frame; nothing without one."""
    name = re.sub(r"-v\d+$", "", re.split("[:/]", env_id)[-1])
    stem = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
    path = _CONFIGS / f"{stem}{'_reduced' if frame == 'reduced' else ''}_{algo}.yaml"
    values = read_yaml(path) if path.is_file() else {}
    return values if values.get("env_id") == env_id else {}


def _suitable(env_id: str, reduced: bool) -> tuple[str, ...]:
    """The algorithms that fit an environment, best first.

    PPO makes the most of many cheap steps. In the frame of the world, rewards that are only paid at
    a goal are found in hindsight, and values of a few choices are learnt as such; in the reduced
    frame goals and choices are simple enough for PPO.
    """
    venv = make(env_id, {}, 1)
    goals = isinstance(venv.single_observation_space, spaces.Dict)
    choices = isinstance(venv.single_action_space, spaces.Discrete)
    venv.close()
    if choices:
        return ("ppo", "dqn") if reduced else ("dqn", "ppo")
    return ("sac", "ppo") if goals and not reduced else ("ppo", "sac")
