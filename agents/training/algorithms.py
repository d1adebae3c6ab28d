"""The algorithms of Stable-Baselines3 that this application drives."""

import math
from typing import Any, NamedTuple

import torch
from gymnasium import spaces
from gymnasium.vector import VectorEnv
from sb3_contrib import TQC
from stable_baselines3 import DQN, PPO, SAC, HerReplayBuffer
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.type_aliases import Schedule, TrainFreq, TrainFrequencyUnit
from stable_baselines3.common.vec_env import VecEnv
from torch.optim import Optimizer

from rigid_envs.base.settings import refusal
from rigid_envs.sb3.adapter import NonFiniteError
from rigid_envs.sb3.exporting import ACTIVATIONS, AttitudeExtractor, attitudes
from rigid_envs.scores.starts import row_seeds

from ..config.entries import Config, DAggerConfig, OffPolicyConfig, PPOConfig, TQCConfig
from ..environments import part_for
from .dagger import DAgger, teacher_of


class Algorithm(NamedTuple):
    """What the code for all algorithms has to know of one.

    Attributes:
        model: SB3's class.
        actions: Kinds of actions that it is for.
        columns: What it logs, under SB3's names.
        counters: Counters of the model, besides those of every model.
    """

    model: Any
    actions: tuple[type[spaces.Space[Any]], ...]
    columns: tuple[str, ...]
    counters: tuple[str, ...] = ()


_OF_SAC = (
    *("train/learning_rate", "train/n_updates", "train/actor_loss", "train/critic_loss"),
    *("train/ent_coef", "train/ent_coef_loss"),
)
_ALGORITHMS = {
    "ppo": Algorithm(
        PPO,
        (spaces.Box, spaces.Discrete),
        (
            *("train/learning_rate", "train/clip_range", "train/n_updates", "train/loss"),
            *("train/policy_gradient_loss", "train/value_loss", "train/entropy_loss"),
            *("train/approx_kl", "train/clip_fraction", "train/explained_variance", "train/std"),
        ),
    ),
    "sac": Algorithm(SAC, (spaces.Box,), _OF_SAC),
    "tqc": Algorithm(TQC, (spaces.Box,), _OF_SAC),
    "dqn": Algorithm(
        DQN,
        (spaces.Discrete,),
        (*("rollout/exploration_rate", "train/learning_rate", "train/n_updates", "train/loss"),),
        ("_n_calls", "exploration_rate"),
    ),
    "dagger": Algorithm(
        DAgger, (spaces.Box,), ("train/learning_rate", "train/n_updates", "train/loss")
    ),
}
_OF_ALL = (
    *("time/total_timesteps", "time/iterations"),
    *("rollout/ep_rew_mean", "rollout/ep_len_mean", "rollout/success_rate"),
    *("eval/success_rate", "eval/mean_reward", "eval/mean_ep_length", "eval/mean_cost"),
)


def counters_of(model: BaseAlgorithm) -> tuple[str, ...]:
    """Counters of a model, besides those of every model."""
    return next(each.counters for each in _ALGORITHMS.values() if isinstance(model, each.model))


def progress_columns(config: Config) -> tuple[str, ...]:
    """Columns of `progress.csv`, under SB3's names."""
    return _OF_ALL + _ALGORITHMS[config.algo].columns


# What an algorithm is not for.


def check_fit(config: Config, venv: VectorEnv[Any, Any, Any]) -> None:
    """Refuse an environment that the algorithm, or an entry of the config, is not for.

    Args:
        config: Config of the run.
        venv: Environment to train on.

    Raises:
        ConfigError: "config.<key>: ...".
    """
    space, seen = venv.single_action_space, venv.single_observation_space
    if config.goal_turn and not attitudes(getattr(venv.unwrapped, "task", None)):
        raise refusal("goal_turn", True, f"False: goals of {config.env_id} hold no attitude")
    if config.goal_turn and part_for(config.env_kwargs, seen) is not None:
        raise refusal("goal_turn", True, "False: networks read no goals in the reduced frame")
    if not isinstance(space, _ALGORITHMS[config.algo].actions):
        takes = "ppo takes Box and Discrete, sac and dagger Box, dqn Discrete"
        expected = f"an algorithm for {space}, the actions of {config.env_id}: {takes}"
        raise refusal("algo", config.algo, expected)
    if isinstance(config, DAggerConfig):
        if isinstance(seen, spaces.Dict) and part_for(config.env_kwargs, seen) is None:
            raise refusal("algo", config.algo, "another one, or env_kwargs: {frame: reduced}")
        teacher_of(config)
    elif isinstance(config, OffPolicyConfig):
        _check_memory(config, venv)
    elif isinstance(config, PPOConfig) and config.action_std and isinstance(space, spaces.Discrete):
        raise refusal("action_std", config.action_std, f"null: {config.env_id} has choices")


def _check_memory(config: OffPolicyConfig, venv: VectorEnv[Any, Any, Any]) -> None:
    """Refuse too small a replay buffer, and pay where goals are seen in hindsight.

    The buffer holds a step of each row, or an episode of each with hindsight. The reward of another
    goal is computed without price and bonus.
    """
    seen = venv.single_observation_space
    looks_back = part_for(config.env_kwargs, seen) is None and _has_hindsight(config, seen)
    limit = 0 if venv.spec is None else venv.spec.max_episode_steps or 0
    least = config.n_envs * (limit + 1 if looks_back else 1)
    if config.buffer_size < least:
        of_each = f"{least // config.n_envs} steps of each of {config.n_envs} rows"
        raise refusal("buffer_size", config.buffer_size, f"at least {least}: {of_each}")
    for key in ("cost_price", "success_bonus") if looks_back else ():
        if value := getattr(config, key):
            raise refusal(key, value, "0, or n_sampled_goal: 0")


def _has_hindsight(config: OffPolicyConfig, space: spaces.Space[Any]) -> bool:
    goals = {"observation", "achieved_goal", "desired_goal"}
    return config.n_sampled_goal > 0 and isinstance(space, spaces.Dict) and goals <= set(space)


# The untrained model of a config.

_WINDOW = 500  # episodes that the means of a rollout are over: two of each of 256 rows
_HINDSIGHT = {"goal_selection_strategy": "future"}


def build_model(config: Config, env: VecEnv) -> Any:
    """The untrained model, whose optimisers refuse gradients that are not finite.

    Args:
        config: Config of the run.
        env: Environment to train on.
    """
    several, more = isinstance(env.observation_space, spaces.Dict), config.of_sb3()
    if isinstance(config, OffPolicyConfig) and _has_hindsight(config, env.observation_space):
        told = {**_HINDSIGHT, "n_sampled_goal": config.n_sampled_goal}
        more |= {"replay_buffer_class": HerReplayBuffer, "replay_buffer_kwargs": told}
    if isinstance(config, TQCConfig):
        more["top_quantiles_to_drop_per_net"] = config.n_dropped
    if isinstance(config, DAggerConfig):
        more["teacher"] = teacher_of(config)
    model = _ALGORITHMS[config.algo].model(
        policy="MultiInputPolicy" if several else "MlpPolicy",
        env=env,
        learning_rate=_schedule(config.learning_rate),
        gamma=config.gamma,
        stats_window_size=_WINDOW,
        # SB3 takes 32 bits: a hash of all 64 keeps seeds apart that agree in the lower half.
        seed=row_seeds(config.seed, 1, "learner")[0] % 2**32,
        device="cpu",
        policy_kwargs=_policy(config, env),
        **more,
    )
    if isinstance(config, PPOConfig) and config.action_std is not None:
        model.policy.log_std.requires_grad_(False)
    for optimizer in parts_of(model).optimizers.values():
        # A loss that is NaN has gradients that are NaN, and so has one that is infinite after the
        # clipping of the norm; so this is the one place to look, whatever the algorithm.
        optimizer.register_step_pre_hook(refuse_bad_gradients)
    return model


def _policy(config: Config, env: VecEnv) -> dict[str, Any]:
    """SB3's `policy_kwargs`."""
    eps = 1e-5 if isinstance(config, PPOConfig) else 1e-8  # as SB3 has it for the algorithm
    told: dict[str, Any] = {
        "net_arch": list(config.net_arch),
        "activation_fn": ACTIVATIONS[config.activation],
        # one pass over small tensors, where the default takes a dozen for each
        "optimizer_kwargs": {"fused": True, "eps": eps},
    }
    if isinstance(config, PPOConfig):
        told["log_std_init"] = config.log_std_init
    if isinstance(config, TQCConfig):
        told["n_quantiles"] = config.n_quantiles
    if config.goal_turn:
        told["features_extractor_class"] = AttitudeExtractor
        told["features_extractor_kwargs"] = attitudes(env.get_attr("task", [0])[0])
    return told


def _schedule(rate: float | tuple[float, float]) -> float | Schedule:
    if not isinstance(rate, tuple):
        return rate
    start, end = rate
    # The last update can lie beyond the end of the run, where SB3's progress turns negative.
    return lambda remaining: end + (start - end) * max(remaining, 0.0)


# Trainable parts, and a check of gradients before a weight follows them.


class Parts(NamedTuple):
    """Trainable parts of a model.

    Attributes:
        weights: Tensors by name, the live ones.
        optimizers: Optimisers by name.
    """

    weights: dict[str, torch.Tensor]
    optimizers: dict[str, Optimizer]


def parts_of(model: Any) -> Parts:
    """The trainable parts of a model.

    Args:
        model: SB3 model.
    """
    weights = dict(model.policy.state_dict())
    if not isinstance(model, SAC | TQC):
        return Parts(weights, {"policy": model.policy.optimizer})
    optimizers = {"actor": model.actor.optimizer, "critic": model.critic.optimizer}
    if model.ent_coef_optimizer is not None:
        assert model.log_ent_coef is not None
        weights["log_ent_coef"] = model.log_ent_coef.detach()
        optimizers["ent_coef"] = model.ent_coef_optimizer
    return Parts(weights, optimizers)


def refuse_bad_gradients(optimizer: Optimizer, *_: Any) -> None:
    """Refuse gradients that are not finite, before a weight follows them."""
    gradients = [p.grad for group in optimizer.param_groups for p in group["params"]]
    present = [gradient for gradient in gradients if gradient is not None]
    if not math.isfinite(torch.nn.utils.get_total_norm(present).item()):
        raise NonFiniteError(
            "the gradient of the loss is not finite; no weight has followed it. "
            "Try a lower learning_rate, or max_grad_norm"
        )


# One update.


def iterate(model: Any, config: Config, callback: BaseCallback) -> None:
    """Collect steps, then make gradient steps.

    Args:
        model: SB3 model.
        config: Config of the run.
        callback: Hooks of SB3.
    """
    if isinstance(config, PPOConfig):
        _iterate_on_policy(model, config, callback)
    elif isinstance(config, OffPolicyConfig):
        _iterate_off_policy(model, config, callback)
    elif isinstance(config, DAggerConfig):
        _iterate_taught(model, config)


def _learn(model: PPO, config: Config) -> None:
    """The gradient steps of an update, at the learning rate of now."""
    model._update_current_progress_remaining(model.num_timesteps, config.total_timesteps)
    model.train()


def _iterate_taught(model: DAgger, config: DAggerConfig) -> None:
    """`n_steps` of every row, then `gradient_steps` of the regression."""
    rows: Any = model.env
    model.collect(rows.unwrapped.venv.unwrapped)
    _learn(model, config)


def _iterate_on_policy(model: PPO, config: PPOConfig, callback: BaseCallback) -> None:
    """`n_steps` of every row, then `n_epochs` of gradient steps."""
    assert model.env is not None
    if config.action_std is not None:
        share = model.num_timesteps / config.total_timesteps
        start, end = (math.log(std) for std in config.action_std)
        with torch.no_grad():
            model.policy.log_std.fill_(start + share * (end - start))
    model.collect_rollouts(model.env, callback, model.rollout_buffer, model.n_steps)
    _learn(model, config)


def _iterate_off_policy(
    model: SAC | TQC | DQN, config: OffPolicyConfig, callback: BaseCallback
) -> None:
    """Rounds of a few steps of every row, then gradient steps."""
    buffer = model.replay_buffer
    assert model.env is not None and buffer is not None
    steps = TrainFreq(config.train_freq, TrainFrequencyUnit.STEP)
    for _ in range(config.rounds):
        model.collect_rollouts(
            model.env, callback, steps, buffer, learning_starts=config.learning_starts
        )
        # the first, random steps are made, and in hindsight there is a complete episode
        ready = not isinstance(buffer, HerReplayBuffer) or bool(buffer.ep_length.any())
        if ready and model.num_timesteps >= config.learning_starts:
            model.train(config.gradient_steps, config.batch_size)
