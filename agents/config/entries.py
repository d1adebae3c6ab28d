"""Entries of the config of a training run that every algorithm has."""

from __future__ import annotations

import abc
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rigid_envs.rules import Choice, Either, Flag, Integer, Keywords, List, Null, Number, Text
from rigid_envs.settings import Settings, check_fields, setting

__all__ = ["Config", "Count", "is_folder_name"]

_NAME = re.compile(r"[A-Za-z0-9._-]{1,80}")


class Count(Integer):
    """An integer; also 3e6, which YAML reads as a float."""

    def check(self, value: Any) -> Any:
        """The value as int."""
        whole = isinstance(value, float) and value.is_integer()
        return super().check(int(value) if whole else value)


def is_folder_name(text: str) -> bool:
    """Whether a text is 1 to 80 letters, digits, dots, dashes, underscores, and no `.` or `..`."""
    return _NAME.fullmatch(text) is not None and text.strip(".") != ""


@dataclass(frozen=True, kw_only=True)
class Config(Settings, abc.ABC):
    """Config of a training run: the entries that every algorithm has."""

    env_id: str = setting(
        "RigidEnvs/BallPark-v0",
        Text(
            "environment to train on; `rigid-envs list` names them",
            "the id of a registered environment",
            str.strip,
        ),
    )
    env_kwargs: Mapping[str, Any] = setting(
        {}, Keywords("hyperparameters of the task; `rigid-envs describe ID` names them")
    )
    train_kwargs: Mapping[str, Any] = setting(
        {},
        Keywords(
            "hyperparameters that hold in training alone, over env_kwargs: a price on effort, a "
            "longer control period"
        ),
    )
    cost_price: float | tuple[float, float] = setting(
        0.0,
        Either(
            "price of a unit of the cost of an episode, taken from the reward in training; [start, "
            "end] is a straight line over the run",
            (Number(low=0, high=1e6), List("", Number(low=0, high=1e6), 2, 2)),
        ),
    )
    success_bonus: float = setting(
        0.0,
        Number(
            "added to the reward of a step that counts as success, in training", low=0, high=1e6
        ),
    )
    algo: str = setting("ppo", Choice("learning algorithm", ("ppo", "sac", "tqc", "dqn")))
    seed: int = setting(
        0,
        Count("seed of weights, exploration and starts; evaluations have their own", 0, 2**63 - 1),
    )
    total_timesteps: int = setting(
        1_000_000, Count("environment steps, all rows together", 1, 10**12)
    )
    n_envs: int = setting(256, Count("rows stepped together", 1, 65536))
    gamma: float = setting(0.99, Number("discount factor per step", low=0, high=1))
    learning_rate: float | tuple[float, float] = setting(
        (1e-3, 1e-4),
        Either(
            "step size of the optimiser; [start, end] is a straight line over the run",
            (
                Number(low=0, high=1, above=True),
                List("", Number(low=0, high=1), 2, 2),
            ),
        ),
    )
    net_arch: tuple[int, ...] = setting(
        (64, 64),
        List(
            "widths of the hidden layers, of the policy and of the value function each",
            Count("", 1, 4096),
            0,
            8,
        ),
    )
    activation: str = setting(
        "tanh", Choice("activation of the hidden layers", ("tanh", "relu", "elu", "silu"))
    )
    normalize_observation: bool = setting(
        False, Flag("shift and scale observations by their running mean and standard deviation")
    )
    normalize_reward: bool = setting(
        False, Flag("scale rewards by the running standard deviation of the discounted return")
    )
    policy_gain: float = setting(
        1.0,
        Number(
            "factor on the actions of the policy that is evaluated and saved (PPO, no choices): in "
            "a shorter control period than in training an action does less",
            low=0,
            high=100,
            above=True,
        ),
    )
    goal_turn: bool = setting(
        False,
        Flag("give networks the rotation from achieved to desired attitude (goal environments)"),
    )
    eval_every: int = setting(
        100_000, Count("steps between evaluations on fixed held-out starts", 1, 10**12)
    )
    eval_episodes: int = setting(100, Count("episodes of one such evaluation", 1, 100_000))
    checkpoint_every: int | None = setting(
        None,
        Either(
            "updates between checkpoints; null: as often as costs at most 2 % of the time",
            (Null(), Count("", 1, 10**9)),
        ),
    )
    torch_threads: int = setting(
        1, Count("threads of torch; 1 is fastest for small networks", 1, 1024)
    )
    log_dir: str = setting("logs", Text("folder of all runs", "a path", str.strip))
    run_name: str | None = setting(
        None,
        Either(
            "folder of this run in log_dir/algo; null: the environment's name and a number",
            (Null(), Text("", "1 to 80 of A-Z a-z 0-9 . _ -", is_folder_name)),
        ),
    )

    @property
    def training_kwargs(self) -> dict[str, Any]:
        """Hyperparameters of the task in training."""
        return {**self.env_kwargs, **self.train_kwargs}

    def price_at(self, timesteps: int) -> float:
        """Price of a unit of cost at an age of the run [steps]."""
        if not isinstance(self.cost_price, tuple):
            return self.cost_price
        start, end = self.cost_price
        return start + min(timesteps / self.total_timesteps, 1.0) * (end - start)

    @property
    @abc.abstractmethod
    def steps_per_update(self) -> int:
        """Environment steps of an update, all rows together: what comes between two log rows."""

    def __post_init__(self) -> None:
        """Check and convert every entry.

        Raises:
            ConfigError: "config.<key>: <key> = ...; expected ...".
        """
        check_fields(self)
