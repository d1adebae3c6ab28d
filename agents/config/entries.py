"""Entries of a config with their rules, for each algorithm."""

import abc
import dataclasses
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rigid_envs.base import settings
from rigid_envs.base.settings import Choice, setting
from rigid_envs.envs.lookup import full_id

# Entries of the config of a training run that every algorithm has.

_NAME = re.compile(r"[A-Za-z0-9._-]{1,80}")
_NOT_OF_SB3 = {"action_std", "log_every", "log_std_init", "n_dropped", "n_quantiles",
               "n_sampled_goal", "teacher"}  # fmt: skip


class Count(settings.Integer):
    """An integer; also 3e6, which YAML reads as a float."""

    def check(self, value: Any) -> Any:
        """The value as int."""
        whole = isinstance(value, float) and value.is_integer()
        return super().check(int(value) if whole else value)


def is_folder_name(text: str) -> bool:
    """Whether a text is 1 to 80 letters, digits, dots, dashes, underscores, and no `.` or `..`."""
    return _NAME.fullmatch(text) is not None and text.strip(".") != ""


def _line(default: Any, text: str, start: settings.Number, end: settings.Number) -> Any:
    """A number, or both ends of a straight line over the run."""
    also = f"{text}; [start, end] is a straight line over the run"
    return settings.setting(default, settings.Either(also, (start, settings.List("", end, 2, 2))))


def _or_null(text: str, rule: settings.Rule) -> Any:
    """An entry that is null where it is not given."""
    return settings.setting(None, settings.Either(text, (settings.Null(), rule)))


def _count(default: int, text: str, low: int, high: int) -> Any:
    return settings.setting(default, Count(text, low, high))


def _number(default: float, text: str, low: float, high: float, above: bool = False) -> Any:
    return settings.setting(default, settings.Number(text, low=low, high=high, above=above))


def _flag(text: str) -> Any:
    """An entry that is False where it is not given."""
    return settings.setting(False, settings.Flag(text))


@dataclass(frozen=True, kw_only=True)
class Config(settings.Settings, abc.ABC):
    """Config of a training run: the entries that every algorithm has."""

    env_id: str = settings.setting(
        "RigidEnvs/BallPark-v0",
        settings.Text(
            "environment to train on; `rigid-envs list` names them",
            "the id of a registered environment",
            str.strip,
        ),
    )
    env_kwargs: Mapping[str, Any] = settings.setting(
        {}, settings.Keywords("hyperparameters of the task; `rigid-envs describe ID` names them")
    )
    train_kwargs: Mapping[str, Any] = settings.setting(
        {},
        settings.Keywords(
            "hyperparameters that hold in training alone, over env_kwargs: a price on effort, a "
            "longer control period"
        ),
    )
    cost_price: float | tuple[float, float] = _line(
        0.0,
        "price of a unit of the cost of an episode, taken from the reward in training",
        *2 * [settings.Number(low=0, high=1e6)],
    )
    success_bonus: float = _number(
        0.0, "added to the reward of a step that counts as success, in training", low=0, high=1e6
    )
    algo: str = setting("ppo", Choice("learning algorithm", ("ppo", "sac", "tqc", "dqn", "dagger")))
    seed: int = _count(
        0, "seed of weights, exploration and starts; evaluations have their own", 0, 2**63 - 1
    )
    total_timesteps: int = _count(1_000_000, "environment steps, all rows together", 1, 10**12)
    n_envs: int = _count(256, "rows stepped together", 1, 65536)
    gamma: float = _number(0.99, "discount factor per step", low=0, high=1)
    learning_rate: float | tuple[float, float] = _line(
        (1e-3, 1e-4),
        "step size of the optimiser",
        settings.Number(low=0, high=1, above=True),
        settings.Number(low=0, high=1),
    )
    net_arch: tuple[int, ...] = settings.setting(
        (64, 64),
        settings.List(
            "widths of the hidden layers, of the policy and of the value function each",
            Count("", 1, 4096),
            0,
            8,
        ),
    )
    activation: str = settings.setting(
        "tanh", settings.Choice("activation of the hidden layers", ("tanh", "relu", "elu", "silu"))
    )
    normalize_observation: bool = _flag(
        "shift and scale observations by their running mean and standard deviation"
    )
    normalize_reward: bool = _flag(
        "scale rewards by the running standard deviation of the discounted return"
    )
    policy_gain: float = _number(
        1.0,
        "factor on the actions of the policy that is evaluated and saved (PPO, no choices): in "
        "a shorter control period than in training an action does less",
        low=0,
        high=100,
        above=True,
    )
    goal_turn: bool = _flag(
        "give networks the rotation from achieved to desired attitude (goal environments)"
    )
    eval_every: int = _count(
        100_000, "steps between evaluations on fixed held-out starts", 1, 10**12
    )
    eval_episodes: int = _count(100, "episodes of one such evaluation", 1, 100_000)
    checkpoint_every: int | None = _or_null(
        "updates between checkpoints; null: as often as costs at most 2 % of the time",
        Count("", 1, 10**9),
    )
    torch_threads: int = _count(1, "threads of torch; 1 is fastest for small networks", 1, 1024)
    log_dir: str = setting("logs", settings.Text("folder of all runs", "a path", str.strip))
    run_name: str | None = _or_null(
        "folder of this run in log_dir/algo; null: the environment's name and a number",
        settings.Text("", "1 to 80 of A-Z a-z 0-9 . _ -", is_folder_name),
    )

    @property
    def training_kwargs(self) -> dict[str, Any]:
        """Hyperparameters of the task in training."""
        return {**self.env_kwargs, **self.train_kwargs}

    @property
    def folder(self) -> Path:
        """Folder of a run that has a name."""
        return Path(self.log_dir) / self.algo / str(self.run_name)

    @property
    def frame(self) -> str:
        """Frame of its observations and actions."""
        return str(self.env_kwargs.get("frame", "world"))

    def of_sb3(self) -> dict[str, Any]:
        """Entries of the algorithm alone, which SB3's class takes under their names."""
        common = {field.name for field in dataclasses.fields(Config)} | _NOT_OF_SB3
        names = [field.name for field in dataclasses.fields(self)]
        return {name: getattr(self, name) for name in names if name not in common}

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

    @property
    def steps_in_all(self) -> int:
        """Steps of the whole run: the last update is made in full."""
        return -(-self.total_timesteps // self.steps_per_update) * self.steps_per_update

    def __post_init__(self) -> None:
        """Check and convert every entry.

        Raises:
            ConfigError: "config.<key>: <key> = ...; expected ...".
        """
        settings.check_fields(self)


# Config of a training run: one frozen dataclass for each algorithm.

_TAU = "fraction by which a target network moves to its network at each update"


@dataclass(frozen=True, kw_only=True)
class PPOConfig(Config):
    """Proximal policy optimisation. Source: Schulman et al. (2017), arXiv:1707.06347."""

    n_steps: int = _count(64, "steps of each row between updates", 1, 10**6)
    batch_size: int = _count(2048, "samples per gradient step", 2, 10**7)
    n_epochs: int = _count(4, "passes over the samples of one update", 1, 1000)
    gae_lambda: float = _number(0.95, "trace decay of the advantage estimate", low=0, high=1)
    clip_range: float = _number(
        0.2, "largest change of the probability ratio", low=0, high=1, above=True
    )
    ent_coef: float = _number(0.0, "weight of the entropy of the policy", low=0, high=100)
    vf_coef: float = _number(0.5, "weight of the value loss", low=0, high=100)
    max_grad_norm: float = _number(0.5, "largest norm of a gradient", low=0, high=1e6, above=True)
    target_kl: float | None = _or_null(
        "stop an update early at 1.5 times this KL divergence; null: never",
        settings.Number(low=0, high=100, above=True),
    )
    log_std_init: float = _number(
        -0.5, "logarithm of the initial standard deviation of the actions", low=-20, high=2
    )
    action_std: tuple[float, float] | None = _or_null(
        "standard deviation of the actions: [start, end] goes from one to the other over the "
        "run, by equal factors; null: learnt, from log_std_init on",
        settings.List("", settings.Number(low=1e-6, high=10), 2, 2),
    )

    @property
    def steps_per_update(self) -> int:
        """See `Config`."""
        return self.n_envs * self.n_steps

    def __post_init__(self) -> None:
        """Check the entries, and that the batch size divides the samples.

        Raises:
            ConfigError: "config.<key>: <key> = ...; expected ...".
        """
        super().__post_init__()
        samples = self.steps_per_update
        if samples % self.batch_size:
            expected = f"a divisor of n_envs * n_steps = {samples} in [2, {samples}]"
            raise settings.refusal("batch_size", self.batch_size, expected)


@dataclass(frozen=True, kw_only=True)
class OffPolicyConfig(Config):
    """Algorithms with a replay buffer. A round is a few steps of every row, then gradient steps.

    In a goal environment with hindsight experience replay (HER): goals are replaced by what the
    episode achieved later. Source: Andrychowicz et al. (2017), arXiv:1707.01495.
    """

    n_envs: int = _count(64, "rows stepped together", 1, 65536)
    buffer_size: int = _count(500_000, "steps in the replay buffer, of all rows together", 1, 10**9)
    learning_starts: int = _count(
        10_000, "steps of random actions before the first gradient step", 0, 10**12
    )
    batch_size: int = _count(256, "samples per gradient step", 2, 10**7)
    train_freq: int = _count(1, "steps of each row in a round", 1, 10**6)
    gradient_steps: int = _count(4, "gradient steps in a round", 1, 10**6)
    tau: float = _number(0.005, _TAU, low=0, high=1, above=True)
    log_every: int = _count(
        2_000, "least steps between rows of the log, all rows together, in whole rounds", 1, 10**12
    )
    n_sampled_goal: int = _count(
        4,
        "hindsight goals for each real one, in goal environments in the frame of the world; "
        "0: none",
        0,
        100,
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
    """Soft actor-critic, for Box actions. Source: Haarnoja et al. (2018), arXiv:1812.05905.

    The defaults are the recipe of every environment without a config of its own.
    """

    total_timesteps: int = 200_000
    gradient_steps: int = 8
    learning_rate: float | tuple[float, float] = (1e-3, 3e-4)
    activation: str = "relu"
    eval_every: int = 20_000
    ent_coef: str | float = settings.setting(
        "auto",
        settings.Either(
            "weight of the entropy of the policy; auto: learnt",
            (settings.Choice("", ("auto",)), settings.Number(low=0, high=100)),
        ),
    )


@dataclass(frozen=True, kw_only=True)
class TQCConfig(SACConfig):
    """Truncated quantile critics: SAC, whose critics are distributions without their upper tail.

    Source: Kuznetsov et al. (2020), arXiv:2005.04269.
    """

    n_quantiles: int = _count(25, "quantiles of each of the two critics", 1, 1000)
    n_dropped: int = _count(
        2, "of them, the largest that a target leaves out, for each critic", 0, 999
    )

    def __post_init__(self) -> None:
        """Check the entries, and that quantiles are left.

        Raises:
            ConfigError: "config.<key>: <key> = ...; expected ...".
        """
        super().__post_init__()
        if self.n_dropped >= self.n_quantiles:
            expected = f"less than n_quantiles = {self.n_quantiles}"
            raise settings.refusal("n_dropped", self.n_dropped, expected)


@dataclass(frozen=True, kw_only=True)
class DQNConfig(OffPolicyConfig):
    """Deep Q-network, for Discrete actions. Source: Mnih et al. (2015), doi:10.1038/nature14236."""

    tau: float = _number(1.0, _TAU, low=0, high=1, above=True)
    target_update_interval: int = _count(
        5_000, "steps between updates of the target network", 1, 10**12
    )
    exploration_fraction: float = _number(
        0.3, "fraction of the run over which the exploration rate falls", low=0, high=1, above=True
    )
    exploration_initial_eps: float = _number(1.0, "exploration rate at the start", low=0, high=1)
    exploration_final_eps: float = _number(0.05, "exploration rate at the end", low=0, high=1)
    max_grad_norm: float = _number(10.0, "largest norm of a gradient", low=0, high=1e6, above=True)

    def __post_init__(self) -> None:
        """Check the entries, and that the target network does not change within a step of all rows.

        Raises:
            ConfigError: "config.<key>: <key> = ...; expected ...".
        """
        super().__post_init__()
        if (interval := self.target_update_interval) < self.n_envs:
            expected = f"at least n_envs = {self.n_envs}"
            raise settings.refusal("target_update_interval", interval, expected)


@dataclass(frozen=True, kw_only=True)
class DAggerConfig(Config):
    """Dataset aggregation: a law is learnt. Source: Ross, Gordon & Bagnell (2011), arXiv:1011.0686.

    Rewards count only in the choice of the best policy: `cost_price` makes it the cheapest.
    """

    teacher: str = settings.setting(
        "reference",
        settings.Text(
            "reference controller that teaches, a function of the state; reference: the best",
            "its name",
            str.strip,
        ),
    )
    n_envs: int = _count(128, "rows stepped together", 1, 65536)
    n_steps: int = _count(300, "steps of each row between updates", 1, 10**6)
    buffer_size: int = _count(
        2_000_000, "steps that are learnt from, of all rows together", 1, 10**9
    )
    batch_size: int = _count(2048, "samples per gradient step", 2, 10**7)
    gradient_steps: int = _count(500, "gradient steps in an update", 1, 10**6)
    total_timesteps: int = 400_000
    learning_rate: float | tuple[float, float] = (2e-3, 1e-4)
    net_arch: tuple[int, ...] = (128, 128)
    activation: str = "relu"
    dead_band: float = _number(
        0.0,
        "size below which an action of the network becomes 0; the others are that much nearer "
        "to 0 (ReLU only)",
        low=0,
        high=10,
    )
    loss_width: float = _number(
        0.05, "error up to which the loss is quadratic, and then linear", 0, 100, above=True
    )

    @property
    def steps_per_update(self) -> int:
        """See `Config`."""
        return self.n_envs * self.n_steps

    def __post_init__(self) -> None:
        """Check the entries, and those that depend on one another.

        Raises:
            ConfigError: "config.<key>: <key> = ...; expected ...".
        """
        super().__post_init__()
        if self.buffer_size < self.n_envs:
            expected = f"at least n_envs = {self.n_envs}"
            raise settings.refusal("buffer_size", self.buffer_size, expected)
        if self.dead_band and self.activation != "relu":
            raise settings.refusal("dead_band", self.dead_band, "0, or activation: relu")
        if self.normalize_observation:
            raise settings.refusal("normalize_observation", True, "False: it changes what is kept")


ALGORITHMS: dict[str, type[Config]] = {
    "ppo": PPOConfig,
    "sac": SACConfig,
    "tqc": TQCConfig,
    "dqn": DQNConfig,
    "dagger": DAggerConfig,
}
"""Class of the config of each algorithm."""


def config_from(values: Mapping[str, Any]) -> Config:
    """The config of some entries, with defaults for the others.

    Args:
        values: Entries by key, as a YAML file gives them; `env_id` may be short: "BallPark".

    Raises:
        ConfigError: An unknown key or a value that is not allowed: "config.<key>: ...".
    """
    if isinstance(values.get("env_id"), str):
        values = {**values, "env_id": full_id(values["env_id"].strip())}
    kind = ALGORITHMS.get(str(values.get("algo", "ppo")), PPOConfig)  # refuses another `algo`
    return settings.from_config(kind, values)


PLACES = ("log_dir", "run_name")
"""Entries that say where a run is, not what."""


def config_to_dict(config: Config, without: Collection[str] = ()) -> dict[str, Any]:
    """The entries of a config as JSON or YAML values; `config_from` takes them back."""
    return {
        key: list(value) if isinstance(value, tuple) else value
        for key, value in dataclasses.asdict(config).items()
        if key not in without
    }
