"""Evaluation of a policy of any kind on the evaluation set of an id."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from rigid_envs.catalogue import SEEN, changed, checked_id, full_id, task_of
from rigid_envs.checks import integer, printable
from rigid_envs.envs import RigidVectorEnv
from rigid_envs.errors import ConfigError
from rigid_envs.provenance import provenance
from rigid_envs.registry import ENVIRONMENTS, ErrorTerm
from rigid_envs.scores.best import best_known
from rigid_envs.scores.efficiency import cost_of
from rigid_envs.scores.episodes import Episodes, joined
from rigid_envs.scores.metrics import metrics_of
from rigid_envs.scores.playing import play
from rigid_envs.scores.policies import PolicyFactory, policy_of
from rigid_envs.scores.result import Evaluation
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, row_seeds
from rigid_envs.scores.theory import limit_of
from rigid_envs.tasks import Task

__all__ = ["bounds_of", "evaluate", "make_rows"]

Array = npt.NDArray[np.float64]


def evaluate(
    env_id: str,
    policy: Any,
    *,
    n: int = N_STARTS,
    seed: int = TEST_SEED,
    config: Mapping[str, Any] | None = None,
    env: Any = None,
    name: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Evaluation:
    """Play one episode from each of the first n starts, and measure success and efficiency.

    Args:
        env_id: Gymnasium's id.
        policy: A model with `predict`, as Stable-Baselines3 has it; a function from the
            observations of all rows to their actions; the name of a reference controller, or
            "reference", "sampling", "zero", "random"; a controller, as `from_controller(factory)`.
        n: Number of starts.
        seed: Seed that the starts are drawn from; that of the evaluation set by default.
        config: Hyperparameters of the task; None takes the `env_kwargs` of a policy that has some,
            as published policies do.
        env: Environment to play in, single or vector, with its wrappers; None makes native rows.
            It stays open.
        name: Who acts, for tables; None for the name that the policy has.
        progress: Called with a few words in every step.

    Raises:
        ValueError: An id, policy, environment or number that cannot be; names what can.
    """
    n = integer(n, "n", 1)
    if env is None or full_id(env_id.rpartition(":")[2]) in ENVIRONMENTS:
        env_id = checked_id(env_id)
    chosen = policy_of(env_id, policy)
    name = printable(chosen.name if name is None else name, "name")
    if config is None and env is None:
        config = getattr(policy, "env_kwargs", None)
    envs = _own_rows(env_id, n, config) if env is None else _rows_of(env_id, env, config)
    settings = dict(config or {}) if env is None else _settings(env_id, envs)
    try:
        _refuse_others(policy, env_id, envs)
        episodes = _play(chosen, envs, n, seed, env_id, progress)
    finally:
        if env is None:
            envs.close()
    values = {
        "success": episodes.successes.astype(np.float64),
        "return": episodes.returns,
        "length": episodes.lengths.astype(np.float64),
        "cost": episodes.costs,
    }
    cost, best, bounds = None, None, None
    if env_id in ENVIRONMENTS:
        task = task_of(env_id, settings)
        cost = cost_of(env_id, task)
        values |= {metric.name: metric.values(episodes, task) for metric in metrics_of(env_id)}
        same = seed == TEST_SEED and episodes.limit == ENVIRONMENTS[env_id].max_episode_steps
        best = _best(env_id, n) if same and _comparable(env_id, task) else None
        bounds = bounds_of(env_id, n, seed, settings)
    return Evaluation(
        env_id=env_id,
        policy=name,
        config=settings,
        seed=seed,
        cost=cost,
        values=values,
        best=best,
        bounds=bounds,
        provenance=provenance(),
    )


def make_rows(env_id: str, n: int, config: Mapping[str, Any] | None = None) -> RigidVectorEnv:
    """N rows of an id that reset in the step that ends their episode.

    Args:
        env_id: Gymnasium's id.
        n: Number of rows.
        config: Hyperparameters of the task.
    """
    envs = gym.make_vec(
        env_id,
        num_envs=n,
        vectorization_mode="vector_entry_point",
        autoreset_mode="SameStep",
        **(config or {}),
    )
    assert isinstance(envs, RigidVectorEnv)
    return envs


def _own_rows(env_id: str, n: int, config: Mapping[str, Any] | None) -> RigidVectorEnv:
    """Native rows; settings that cannot be are refused here, before anything is played."""
    task_of(env_id, config)
    return make_rows(env_id, n, config)


def _rows_of(env_id: str, env: Any, config: Mapping[str, Any] | None) -> Any:
    """A given environment as a vector environment whose rows start anew by themselves."""
    if config:
        raise ConfigError(f"config = {dict(config)}; expected none beside env, which has its own")
    if not isinstance(env, gym.Env | gym.vector.VectorEnv):
        raise ConfigError(f"env = {env!r:.100}; expected an environment of Gymnasium")
    envs = gym.vector.SyncVectorEnv([lambda: env]) if isinstance(env, gym.Env) else env
    spec, name = _spec(envs), env_id.rpartition(":")[2]
    if spec is not None and spec.id != name:
        raise ConfigError(f"env = {spec.id}; expected one of {env_id}")
    if envs.metadata.get("autoreset_mode") == gym.vector.AutoresetMode.DISABLED:
        raise ConfigError("env: autoreset_mode = Disabled; expected rows that start anew: SameStep")
    return envs


def _refuse_others(policy: Any, env_id: str, envs: Any) -> None:
    """Refuse a policy that says that it takes other observations than those of the environment."""
    takes, gives = getattr(policy, "observation_space", None), envs.single_observation_space
    shapes = [getattr(space, "shape", None) for space in (takes, gives)]
    if None not in shapes and shapes[0] != shapes[1]:
        raise ConfigError(
            f"policy: its observations have shape {shapes[0]}, those of {env_id} {shapes[1]}; "
            "expected the settings that it was trained with: config={'frame': 'reduced'} or others"
        )


def _spec(envs: Any) -> Any:
    """Of a vector environment, or of the environments that it is made of; None if there is none."""
    rows = getattr(envs.unwrapped, "envs", [envs])
    return envs.spec or rows[0].spec


def _settings(env_id: str, envs: Any) -> dict[str, Any]:
    """Hyperparameters that an environment was made with."""
    spec = _spec(envs)
    if env_id not in ENVIRONMENTS or spec is None:
        return {}
    known = asdict(task_of(env_id))
    return {key: value for key, value in spec.kwargs.items() if key in known}


def _play(
    policy: PolicyFactory,
    envs: Any,
    n: int,
    seed: int,
    env_id: str,
    progress: Callable[[str], None],
) -> Episodes:
    """One episode from each of n starts, as many at a time as there are rows."""
    record = ENVIRONMENTS.get(env_id)
    error: ErrorTerm | None = None if record is None else record.error
    rows = envs.num_envs
    seeds = row_seeds(seed, -(-n // rows) * rows, "test")
    parts = [
        play(policy(envs), envs, seeds[k : k + rows], error, progress)
        for k in range(0, len(seeds), rows)
    ]
    spec = _spec(envs)
    limit = getattr(spec, "max_episode_steps", None) or max(part.limit for part in parts)
    return joined(parts, n, limit)


def _comparable(env_id: str, task: Task) -> bool:
    """Whether a task differs from the registered one in what is seen and paid alone."""
    free = SEEN if cost_of(env_id, task).name == "loss" else (*SEEN, "weight_")
    return all(key.startswith(free) for key in changed(env_id, task))


def _best(env_id: str, n: int) -> Array | None:
    """Best known costs from the first n starts; None where there are none, or not so many."""
    known = best_known(env_id)
    return None if known is None or n > len(known.costs) else known.costs[:n]


def bounds_of(env_id: str, n: int, seed: int, config: Mapping[str, Any]) -> Array | None:
    """Least costs that theory allows, shape (n,); None where it says nothing.

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.
        seed: Seed that the starts are drawn from.
        config: Hyperparameters of the task.
    """
    limit = limit_of(env_id, metrics_of(env_id)[0].name)
    if limit is None:
        return None
    envs = make_rows(env_id, n, config)
    envs.reset(seed=row_seeds(seed, n, "test"))
    bounds = limit.values(envs)
    envs.close()
    return bounds
