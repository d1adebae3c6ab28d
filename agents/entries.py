"""What every training run has, whatever the algorithm: one frozen object of checked entries."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .checks import (
    Check,
    ConfigError,
    choice,
    either,
    flag,
    keywords,
    list_of,
    matching,
    nothing,
    real,
    whole,
)
from .names import is_name

__all__ = ["Config", "entry"]


def entry(default: Any, check: Check, help: str) -> Any:
    """A field of a config that says of itself what it is and may be.

    Args:
        default: Its value where none is given.
        check: What it may be.
        help: What it is.
    """
    value = {"default_factory": dict} if default == {} else {"default": default}
    return dataclasses.field(**value, metadata={"check": check, "help": help})


@dataclass(frozen=True, kw_only=True)
class Config:
    """What every algorithm needs; each entry says of itself what it is and may be."""

    env_id: str = entry(
        "RigidEnvs/BallPark-v0",
        matching("the id of a registered environment", str.strip),
        "environment to train on; `rigid-envs list` names them",
    )
    env_kwargs: Mapping[str, Any] = entry(
        {}, keywords(), "hyperparameters of the task; `rigid-envs describe ID` names them"
    )
    algo: str = entry("ppo", choice("ppo", "sac", "dqn"), "learning algorithm")
    seed: int = entry(
        0,
        whole(0, 2**63 - 1),
        "seed of weights, exploration and starts; evaluations have their own",
    )
    total_timesteps: int = entry(
        1_000_000, whole(1, 10**12), "environment steps, all rows together"
    )
    n_envs: int = entry(256, whole(1, 65536), "rows stepped together")
    gamma: float = entry(0.99, real(0, 1), "discount of the reward per step")
    learning_rate: float | tuple[float, float] = entry(
        (1e-3, 1e-4),
        either(real(0, 1, "(]"), list_of(real(0, 1), 2, 2)),
        "step size of the optimiser; [start, end] is a straight line over the run",
    )
    net_arch: tuple[int, ...] = entry(
        (64, 64),
        list_of(whole(1, 4096), 0, 8),
        "widths of the hidden layers, of the policy and of the value function each",
    )
    activation: str = entry("tanh", choice("tanh", "relu", "elu", "silu"), "hidden activation")
    normalize_observation: bool = entry(
        False, flag(), "shift and scale observations by their running mean and deviation"
    )
    normalize_reward: bool = entry(
        False, flag(), "scale rewards by the running deviation of the discounted return"
    )
    goal_turn: bool = entry(
        False,
        flag(),
        "tell networks the turn from the achieved to the desired attitude, in goal environments",
    )
    eval_every: int = entry(
        100_000, whole(1, 10**12), "steps between evaluations on fixed held-out starts"
    )
    eval_episodes: int = entry(100, whole(1, 100_000), "episodes of one such evaluation")
    checkpoint_every: int | None = entry(
        None,
        either(nothing(), whole(1, 10**9)),
        "updates between checkpoints; null: as often as costs at most 2 %% of the time",
    )
    torch_threads: int = entry(1, whole(1, 1024), "threads of the networks; 1 is fastest here")
    log_dir: str = entry("logs", matching("a path", str.strip), "folder of all runs")
    run_name: str | None = entry(
        None,
        either(nothing(), matching("1 to 80 of A-Z a-z 0-9 . _ -", is_name)),
        "folder of this run in log_dir/algo; null: the environment's name and a number",
    )

    @property
    def steps_per_update(self) -> int:
        """Environment steps of an update, all rows together: what comes between two log rows."""
        raise NotImplementedError

    def __post_init__(self) -> None:
        """Check and convert every entry.

        Raises:
            ConfigError: "config.<key>: expected ..., got ...".
        """
        for field in dataclasses.fields(self):
            value, check = getattr(self, field.name), field.metadata["check"]
            try:
                object.__setattr__(self, field.name, check.convert(value))
            except (TypeError, ValueError, RecursionError):
                raise ConfigError(
                    f"config.{field.name}: expected {check.expected}, got {value!r:.100}"
                ) from None
