"""The algorithms of Stable-Baselines3 that this application drives, step by step."""

from __future__ import annotations

from typing import Any, cast

from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.type_aliases import Schedule
from stable_baselines3.common.vec_env import VecEnv
from torch import nn

from .config import Config, PPOConfig
from .guards import guard_optimizer
from .policies import ACTIVATIONS, Policy
from .provenance import manifest
from .seeds import row_seeds

__all__ = ["PROGRESS_COLUMNS", "build_model", "collect", "export_policy", "update"]

PROGRESS_COLUMNS = (
    "time/total_timesteps",
    "time/iterations",
    "rollout/ep_rew_mean",
    "rollout/ep_len_mean",
    "rollout/success_rate",
    "eval/success_rate",
    "eval/mean_reward",
    "eval/mean_ep_length",
    "eval/mean_cost",
    "train/learning_rate",
    "train/clip_range",
    "train/n_updates",
    "train/loss",
    "train/policy_gradient_loss",
    "train/value_loss",
    "train/entropy_loss",
    "train/approx_kl",
    "train/clip_fraction",
    "train/explained_variance",
    "train/std",
)
"""What is logged once per update, under SB3's names."""

_WINDOW = 500  # episodes that the means of a rollout are over: two of each of 256 rows


def build_model(config: Config, env: VecEnv) -> PPO:
    """The untrained model.

    Args:
        config: What to build.
        env: What to train it on.
    """
    assert isinstance(config, PPOConfig)
    model = PPO(
        "MlpPolicy",
        env,
        learning_rate=_schedule(config.learning_rate),
        n_steps=config.n_steps,
        batch_size=config.batch_size,
        n_epochs=config.n_epochs,
        gamma=config.gamma,
        gae_lambda=config.gae_lambda,
        clip_range=config.clip_range,
        ent_coef=config.ent_coef,
        vf_coef=config.vf_coef,
        max_grad_norm=config.max_grad_norm,
        target_kl=config.target_kl,
        stats_window_size=_WINDOW,
        policy_kwargs={
            "net_arch": list(config.net_arch),
            "activation_fn": ACTIVATIONS[config.activation],
            "log_std_init": config.log_std_init,
        },
        # SB3 takes 32 bits: a hash of all 64 keeps seeds apart that agree in the lower half.
        seed=row_seeds(config.seed, 1, "learner")[0] % 2**32,
        device="cpu",
    )
    guard_optimizer(model.policy.optimizer)
    return model


def collect(model: PPO, callback: BaseCallback) -> None:
    """Play the steps that one update learns from.

    Args:
        model: The model.
        callback: SB3's hooks.
    """
    assert model.env is not None
    model.collect_rollouts(model.env, callback, model.rollout_buffer, model.n_steps)


def update(model: PPO, total_timesteps: int) -> None:
    """Learn from the collected steps.

    Args:
        model: The model.
        total_timesteps: Length of the run, for schedules.
    """
    model._update_current_progress_remaining(model.num_timesteps, total_timesteps)
    model.train()


def export_policy(model: PPO, config: Config) -> Policy:
    """The policy of a model as it is now, free of SB3.

    Args:
        model: The model.
        config: What it was built from.
    """
    arrays = _layers(model)
    box = isinstance(model.action_space, spaces.Box)
    if isinstance(model.action_space, spaces.Box):
        arrays["log_std"] = model.policy.log_std.detach().numpy()
        arrays["action.low"] = model.action_space.low
        arrays["action.high"] = model.action_space.high
    normalize: Any = model.get_vec_normalize_env()
    normalized = normalize is not None and normalize.norm_obs
    if normalized:
        arrays["observation.mean"] = normalize.obs_rms.mean
        arrays["observation.var"] = normalize.obs_rms.var
    network = {
        "activation": config.activation,
        "distribution": "gaussian" if box else "categorical",
        "normalized": normalized,
        "clip": normalize.clip_obs if normalized else None,
        "epsilon": normalize.epsilon if normalized else None,
    }
    document = {
        "algo": config.algo,
        "env_id": config.env_id,
        "env_kwargs": dict(config.env_kwargs),
        "seed": config.seed,
        "timesteps": model.num_timesteps,
        "network": network,
        "spaces": {
            name: str(getattr(model, f"{name}_space")) for name in ("observation", "action")
        },
        "versions": manifest()["versions"],
    }
    return Policy(document, arrays)


def _layers(model: PPO) -> dict[str, NDArray[Any]]:
    hidden: Any = model.policy.mlp_extractor.policy_net
    layers = [module for module in hidden if isinstance(module, nn.Linear)]
    layers.append(cast("nn.Linear", model.policy.action_net))
    arrays: dict[str, NDArray[Any]] = {}
    for k, layer in enumerate(layers):
        arrays[f"layers.{k}.weight"] = layer.weight.detach().numpy()
        arrays[f"layers.{k}.bias"] = layer.bias.detach().numpy()
    return arrays


def _schedule(rate: float | tuple[float, float]) -> float | Schedule:
    if not isinstance(rate, tuple):
        return rate
    start, end = rate
    # The last update can lie beyond the end of the run, where SB3's progress turns negative.
    return lambda remaining: end + (start - end) * max(remaining, 0.0)
