"""What a training run is: one frozen object per algorithm, one flat YAML file per environment."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from .checks import ConfigError, choice, either, nothing, real, whole
from .entries import Config, entry

__all__ = [
    "ALGORITHMS",
    "Config",
    "DQNConfig",
    "OffPolicyConfig",
    "PPOConfig",
    "SACConfig",
    "config_from",
    "config_to_dict",
    "unknown_key",
]

_TAU = "part of a network that its target takes over at each update of the target"


@dataclass(frozen=True, kw_only=True)
class PPOConfig(Config):
    """Proximal policy optimisation. Source: Schulman et al. (2017), arXiv:1707.06347."""

    n_steps: int = entry(64, whole(1, 10**6), "steps of each row between updates")
    batch_size: int = entry(2048, whole(2, 10**7), "samples per gradient step")
    n_epochs: int = entry(4, whole(1, 1000), "passes over the samples of one update")
    gae_lambda: float = entry(0.95, real(0, 1), "trace decay of the advantage estimate")
    clip_range: float = entry(0.2, real(0, 1, "(]"), "largest change of a probability ratio")
    ent_coef: float = entry(0.0, real(0, 100), "weight of the entropy of the policy")
    vf_coef: float = entry(0.5, real(0, 100), "weight of the value loss")
    max_grad_norm: float = entry(0.5, real(0, 1e6, "(]"), "largest norm of a gradient")
    target_kl: float | None = entry(
        None,
        either(nothing(), real(0, 100, "(]")),
        "stop an update early once the policy moved 1.5 times this divergence; null: never",
    )
    log_std_init: float = entry(
        -0.5, real(-20, 2), "logarithm of the initial spread of the actions"
    )

    @property
    def steps_per_update(self) -> int:
        """See `Config`."""
        return self.n_envs * self.n_steps

    def __post_init__(self) -> None:
        """Check the entries, and that the batches divide the samples.

        Raises:
            ConfigError: "config.<key>: expected ..., got ...".
        """
        super().__post_init__()
        samples = self.steps_per_update
        if samples % self.batch_size:
            raise ConfigError(
                f"config.batch_size: expected a divisor of n_envs * n_steps = {samples} "
                f"in [2, {samples}], got {self.batch_size}"
            )


@dataclass(frozen=True, kw_only=True)
class OffPolicyConfig(Config):
    """What learns from a memory of steps. A round is a few steps of every row, then some learning.

    In a goal environment the memory also has goals of hindsight: those that an episode came to
    later on. Source: Andrychowicz et al. (2017), arXiv:1707.01495.
    """

    n_envs: int = entry(64, whole(1, 65536), "rows stepped together")
    buffer_size: int = entry(500_000, whole(1, 10**9), "steps remembered, of all rows together")
    learning_starts: int = entry(
        10_000, whole(0, 10**12), "steps before the first gradient step, made at random"
    )
    batch_size: int = entry(256, whole(2, 10**7), "samples per gradient step")
    train_freq: int = entry(1, whole(1, 10**6), "steps of each row in a round")
    gradient_steps: int = entry(4, whole(1, 10**6), "gradient steps in a round")
    tau: float = entry(0.005, real(0, 1, "(]"), _TAU)
    log_every: int = entry(
        2_000,
        whole(1, 10**12),
        "least steps between rows of the log, all rows together, in whole rounds",
    )
    n_sampled_goal: int = entry(
        4, whole(0, 100), "goals of hindsight for each real one, in goal environments; 0: none"
    )

    @property
    def rounds(self) -> int:
        """Rounds of an update."""
        return -(-self.log_every // (self.n_envs * self.train_freq))

    @property
    def steps_per_update(self) -> int:
        """See `Config`."""
        return self.rounds * self.n_envs * self.train_freq


@dataclass(frozen=True, kw_only=True)
class SACConfig(OffPolicyConfig):
    """Soft actor-critic, for continuous actions. Source: Haarnoja et al. (2018), arXiv:1812.05905.

    With goals in hindsight (HER) in goal environments.
    """

    ent_coef: str | float = entry(
        "auto", either(choice("auto"), real(0, 100)), "weight of the entropy; auto: learnt"
    )


@dataclass(frozen=True, kw_only=True)
class DQNConfig(OffPolicyConfig):
    """Deep Q-network, for discrete actions. Source: Mnih et al. (2015), doi:10.1038/nature14236."""

    tau: float = entry(1.0, real(0, 1, "(]"), _TAU)
    target_update_interval: int = entry(
        5_000, whole(1, 10**12), "steps between updates of the target network"
    )
    exploration_fraction: float = entry(
        0.3, real(0, 1, "(]"), "part of the run over which fewer and fewer actions are random"
    )
    exploration_initial_eps: float = entry(1.0, real(0, 1), "random part of actions, at first")
    exploration_final_eps: float = entry(0.05, real(0, 1), "random part of actions, later")
    max_grad_norm: float = entry(10.0, real(0, 1e6, "(]"), "largest norm of a gradient")

    def __post_init__(self) -> None:
        """Check the entries, and that the target is not to change within a step of all rows.

        Raises:
            ConfigError: "config.<key>: expected ..., got ...".
        """
        super().__post_init__()
        if self.target_update_interval < self.n_envs:
            raise ConfigError(
                f"config.target_update_interval: expected at least n_envs = {self.n_envs}, "
                f"got {self.target_update_interval}"
            )


ALGORITHMS: dict[str, type[Config]] = {"ppo": PPOConfig, "sac": SACConfig, "dqn": DQNConfig}
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
