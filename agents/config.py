"""What a training run is: one frozen object per algorithm, one flat YAML file per environment."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterable, Mapping
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

__all__ = ["ALGORITHMS", "Config", "PPOConfig", "config_from", "config_to_dict", "unknown_key"]


def _entry(default: Any, check: Check, help: str) -> Any:
    value = {"default_factory": dict} if default == {} else {"default": default}
    return dataclasses.field(**value, metadata={"check": check, "help": help})


@dataclass(frozen=True, kw_only=True)
class Config:
    """What every algorithm needs; each entry says of itself what it is and may be."""

    env_id: str = _entry(
        "RigidEnvs/BallPark-v0",
        matching("the id of a registered environment", str.strip),
        "environment to train on; `rigid-envs list` names them",
    )
    env_kwargs: Mapping[str, Any] = _entry(
        {}, keywords(), "hyperparameters of the task; `rigid-envs describe ID` names them"
    )
    algo: str = _entry("ppo", choice("ppo"), "learning algorithm")
    seed: int = _entry(
        0,
        whole(0, 2**63 - 1),
        "seed of weights, exploration and starts; evaluations have their own",
    )
    total_timesteps: int = _entry(
        1_000_000, whole(1, 10**12), "environment steps, all rows together"
    )
    n_envs: int = _entry(256, whole(1, 65536), "rows stepped together")
    gamma: float = _entry(0.99, real(0, 1), "discount of the reward per step")
    learning_rate: float | tuple[float, float] = _entry(
        3e-4,
        either(real(0, 1, "(]"), list_of(real(0, 1), 2, 2)),
        "step size of the optimiser; [start, end] is a straight line over the run",
    )
    net_arch: tuple[int, ...] = _entry(
        (64, 64),
        list_of(whole(1, 4096), 0, 8),
        "widths of the hidden layers, of the policy and of the value function each",
    )
    activation: str = _entry("tanh", choice("tanh", "relu", "elu", "silu"), "hidden activation")
    normalize_observation: bool = _entry(
        False, flag(), "shift and scale observations by their running mean and deviation"
    )
    normalize_reward: bool = _entry(
        False, flag(), "scale rewards by the running deviation of the discounted return"
    )
    eval_every: int = _entry(
        100_000, whole(1, 10**12), "steps between evaluations on fixed held-out starts"
    )
    eval_episodes: int = _entry(100, whole(1, 100_000), "episodes of one such evaluation")
    checkpoint_every: int | None = _entry(
        None,
        either(nothing(), whole(1, 10**9)),
        "updates between checkpoints; null: as often as costs at most 2 %% of the time",
    )
    torch_threads: int = _entry(1, whole(1, 1024), "threads of the networks; 1 is fastest here")
    log_dir: str = _entry("logs", matching("a path", str.strip), "folder of all runs")
    run_name: str | None = _entry(
        None,
        either(nothing(), matching("1 to 80 of A-Z a-z 0-9 . _ -", is_name)),
        "folder of this run in log_dir/algo; null: the environment's name and a number",
    )

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


@dataclass(frozen=True, kw_only=True)
class PPOConfig(Config):
    """Proximal policy optimisation. Source: Schulman et al. (2017), arXiv:1707.06347."""

    n_steps: int = _entry(64, whole(1, 10**6), "steps of each row between updates")
    batch_size: int = _entry(2048, whole(2, 10**7), "samples per gradient step")
    n_epochs: int = _entry(4, whole(1, 1000), "passes over the samples of one update")
    gae_lambda: float = _entry(0.95, real(0, 1), "trace decay of the advantage estimate")
    clip_range: float = _entry(0.2, real(0, 1, "(]"), "largest change of a probability ratio")
    ent_coef: float = _entry(0.0, real(0, 100), "weight of the entropy of the policy")
    vf_coef: float = _entry(0.5, real(0, 100), "weight of the value loss")
    max_grad_norm: float = _entry(0.5, real(0, 1e6, "(]"), "largest norm of a gradient")
    target_kl: float | None = _entry(
        None,
        either(nothing(), real(0, 100, "(]")),
        "stop an update early once the policy moved 1.5 times this divergence; null: never",
    )
    log_std_init: float = _entry(
        0.0, real(-20, 2), "logarithm of the initial spread of the actions"
    )

    def __post_init__(self) -> None:
        """Check the entries, and that the batches divide the samples.

        Raises:
            ConfigError: "config.<key>: expected ..., got ...".
        """
        super().__post_init__()
        samples = self.n_envs * self.n_steps
        if samples % self.batch_size:
            raise ConfigError(
                f"config.batch_size: expected a divisor of n_envs * n_steps = {samples} "
                f"in [2, {samples}], got {self.batch_size}"
            )


ALGORITHMS: dict[str, type[Config]] = {"ppo": PPOConfig}
"""The config of each algorithm."""


def config_from(values: Mapping[str, Any]) -> Config:
    """The config that some entries make, with defaults for the others.

    Args:
        values: Entries by key, as a YAML file gives them.

    Raises:
        ConfigError: An unknown key, or a value that its entry refuses: "config.<key>: ...".
    """
    kind = ALGORITHMS.get(str(values.get("algo", "ppo")), Config)
    keys = [field.name for field in dataclasses.fields(kind)]
    for key in values:
        if key not in keys:
            raise ConfigError(unknown_key(str(key), keys))
    return kind(**values)


def config_to_dict(config: Config) -> dict[str, Any]:
    """The entries of a config as JSON or YAML values; `config_from` takes them back."""
    return {
        key: list(value) if isinstance(value, tuple) else value
        for key, value in dataclasses.asdict(config).items()
    }


def unknown_key(key: str, keys: Iterable[str]) -> str:
    """The message for a key that does not exist.

    Args:
        key: The key.
        keys: Those that do.
    """
    known = sorted(keys)
    close = difflib.get_close_matches(key.replace("-", "_"), known, n=1)
    hint = f"did you mean {close[0]}?" if close else f"expected one of {', '.join(known)}"
    return f"config.{key}: unknown key; {hint}"
