"""What a row is ranked by: the standard task, played by the rows that are scored."""

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.vector import SyncVectorEnv

from rigid_envs.base.checks import Array, ConfigError, Singles, require
from rigid_envs.engine.layout import FLAGS
from rigid_envs.envs.lookup import SEEN, task_of
from rigid_envs.envs.shells import RigidEnv, RigidVectorEnv
from rigid_envs.envs.spaces import info_numbers
from rigid_envs.scores import starts
from rigid_envs.scores.best import best_known, limit_of
from rigid_envs.scores.optima import stored_optima
from rigid_envs.scores.result import Evaluation
from rigid_envs.tasks.core import Core
from rigid_envs.tasks.registry import ENVIRONMENTS

# What an evaluation may stand beside: best known costs and bounds, of the registered task.

_ROUNDING = 1e-6  # of float32 actions, and what a finite horizon leaves: share of a bound


def other_task(env_id: str, config: Mapping[str, Any]) -> str | None:
    """The setting that makes a task another one than the registered one; None if none does.

    Free is what changes neither the task nor its cost: what is seen, and the weights of the reward
    unless the cost is made of it.

    Args:
        env_id: Gymnasium's id.
        config: Hyperparameters of the task.
    """
    task, registered = task_of(env_id, config), task_of(env_id)
    paid = starts.metrics_of(env_id)[0].name == "loss"
    for key in config:
        given, expected = getattr(task, key), getattr(registered, key)
        free = key in SEEN or (key.startswith("weight_") and not paid)
        if given != expected and not free:
            return f"{key} = {given!r}; expected {expected!r}, as registered"
    return None


def objection(env_id: str, config: Mapping[str, Any], seed: int, n: int) -> str | None:
    """Why episodes of a task are not ranked, whoever acts; None if nothing speaks against it.

    Args:
        env_id: Gymnasium's id.
        config: Hyperparameters of the task.
        seed: Seed that the starts are drawn from.
        n: Number of starts.
    """
    if env_id not in ENVIRONMENTS:
        return f"env_id = {env_id!r}; expected a registered one"
    if seed != starts.TEST_SEED:
        return f"seed = {seed}; expected {starts.TEST_SEED}, of the evaluation set"
    if n > starts.N_STARTS:
        return f"n = {n}; expected {starts.N_STARTS} at most, the evaluation set"
    return other_task(env_id, config)


def best_of(env_id: str, n: int) -> Array | None:
    """Best known costs from the first n starts; None where there are none, or not so many.

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.
    """
    known = best_known(env_id)
    return None if known is None or n > len(known.costs) else known.costs[:n]


def bounds_of(env_id: str, n: int, seed: int, config: Mapping[str, Any]) -> Array | None:
    """Least costs that theory allows, shape (n,); None where it says nothing.

    What is proven from each start of the evaluation set alone counts there.

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.
        seed: Seed that the starts are drawn from.
        config: Hyperparameters of the task.
    """
    limit = limit_of(env_id, starts.metrics_of(env_id)[0].name)
    if limit is None:
        return None
    envs = starts.registered_rows(env_id, n, config)
    envs.reset(seed=starts.row_seeds(seed, n, "test"))
    bounds, stored = limit.values(envs), stored_optima(env_id)
    if stored is None or objection(env_id, config, seed, n):
        return bounds
    return np.maximum(bounds, stored.proven[:n])


def up_to_date(found: Evaluation) -> Evaluation:
    """An evaluation beside what is best known and what theory says now, whatever it says itself.

    Args:
        found: The evaluation; one of an id that is not registered stays as it is.

    Raises:
        ValueError: Another cost than that of its id, or a success that costs less than theory
            allows.
    """
    env_id, config = found.env_id, found.config
    if env_id not in ENVIRONMENTS:
        return found
    cost = starts.cost_of(env_id, task_of(env_id, config))
    require(found.cost == cost, found.cost, "cost", f"{cost}")
    bounds = bounds_of(env_id, found.n, found.seed, config)
    if other_task(env_id, config) is None:
        refuse_impossible(cost, found.successes, found.costs, bounds)
    unranked = found.unranked or objection(env_id, config, found.seed, found.n)
    best = None if unranked else best_of(env_id, found.n)
    return replace(found, bounds=bounds, best=best, unranked=unranked)


def refuse_impossible(
    cost: starts.Cost, successes: npt.NDArray[np.bool_], costs: Array, bounds: Array | None
) -> None:
    """Refuse successes that cost less than theory allows.

    Args:
        cost: What an episode costs.
        successes: Whether each episode succeeded, shape (n,).
        costs: Cost of each episode, shape (n,).
        bounds: Least costs that theory allows, shape (n,); None where it says no more than 0.

    Raises:
        ConfigError: Names the first one.
    """
    least = np.zeros(len(costs)) if bounds is None else bounds
    impossible = successes & ~(costs >= least * (1.0 - _ROUNDING))  # NaN too
    if impossible.any():
        k = int(impossible.argmax())
        raise ConfigError(
            f"{cost.name} of start {k} = {costs[k]}; expected at least {least[k]}, the bound of "
            "theory for a success: what is told of the episode is not what the task gives"
        )


# Proof of an evaluation: what was done to its rows, done again in the registered task.
#
# Wrappers, policies and environments of others may write what they like into infos, set states or
# make the task easier. So success and cost are those that the rows themselves publish, and the
# actions that reach them are played again from the same starts, in rows that nobody else has. What
# comes out the same is of the registered task, whatever was done besides.

Published = tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]
"""Results and success of the rows of a core, of one step."""

_Pair = tuple[Singles, Singles]  # actions as given, and as applied

_COMPARED = {
    "success": "successes",
    "cost": "costs",
    "length": "lengths",
    "first step of success": "since",
    "error": "errors",
}


class Witness:
    """Sees what is done to the rows of an environment, below all wrappers.

    Attributes:
        cores: The rows; none if they are not of this package or in another process.
    """

    def __init__(self, envs: Any) -> None:
        """Find the rows.

        Args:
            envs: A vector environment.
        """
        rows = envs.unwrapped
        each = [env.unwrapped for env in rows.envs] if isinstance(rows, SyncVectorEnv) else [rows]
        ours = all(isinstance(env, RigidEnv | RigidVectorEnv) for env in each)
        self._envs: list[Any] = each if ours else []
        self.cores: list[Core] = [env._core for env in self._envs]
        self._actions: list[list[_Pair]] = []
        self._published: list[list[Published]] = [[] for _ in self.cores]

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Keep the actions of all steps that are made meanwhile, and what they publish."""
        steps = [core.step_into for core in self.cores]
        try:
            for core, published in zip(self.cores, self._published, strict=True):
                self._actions.append([])
                core.step_into = _kept(core, self._actions[-1], published)
            self._forget()
            yield
        finally:
            for core, step in zip(self.cores, steps, strict=True):
                core.step_into = step
            self._forget()

    def _forget(self) -> None:
        """A single environment holds the step of its core; it looks for it again."""
        for env in self._envs:
            env.__dict__.pop("_used_by_step", None)

    def told(
        self, infos: Mapping[str, Any], keys: Iterable[str], ended: npt.NDArray[np.bool_]
    ) -> dict[str, npt.NDArray[Any]]:
        """What the rows published since the last call, whatever infos say; see `entries_of`."""
        if not self.cores:
            return starts.entries_of(infos, keys, ended)
        pairs = [*zip(self.cores, self._published, strict=True)]
        values = {key: np.concatenate([_entry(*pair, key) for pair in pairs]) for key in keys}
        for published in self._published:
            published.clear()
        return values

    def actions(self, n: int) -> Singles:
        """The actions that reached the rows of the first n starts, and as they were applied.

        What is done in a row after its episode is among them.

        Args:
            n: Number of starts.

        Returns:
            As given and as of `Core.applied`, shape (2, T, n, m).
        """
        first, n_action = self.cores[0].actions.shape
        longest = max(map(len, self._actions))
        actions = np.zeros((2, longest, len(self._actions) * first, n_action), np.float32)
        for k, made in enumerate(self._actions):
            actions[:, : len(made), k * first : (k + 1) * first] = np.stack(made, axis=1)
        return actions[:, :, :n]


def play_again(
    env_id: str, actions: Singles, seed: int, config: Mapping[str, Any]
) -> starts.Episodes:
    """What comes of actions in the registered task; rows get the action 0 after the last one.

    Args:
        env_id: Gymnasium's id.
        actions: Shape (T, n, m), of choices (T, n, 1).
        seed: Seed that the starts are drawn from.
        config: Hyperparameters that are free.
    """
    record, n = ENVIRONMENTS[env_id], actions.shape[1]
    rows = starts.registered_rows(env_id, n, config)
    given = actions[..., 0].astype(np.int64) if rows.task.n_choices else actions
    steps = itertools.chain(given, itertools.repeat(np.zeros_like(given[0])))
    seeds = starts.row_seeds(seed, n, "test")
    again = starts.play(lambda _: next(steps), rows, seeds, record.error)
    return replace(again, limit=record.max_episode_steps)


def _kept(core: Core, actions: list[_Pair], published: list[Published]) -> Any:
    """The step of a core, which keeps its actions, and what it publishes."""
    advance = core.step_into

    def step_into(*outputs: Any) -> int:
        given = core.actions.copy()
        raised = advance(*outputs)
        actions.append((given, core.applied))
        results, _, flags = outputs
        published.append((results.copy(), flags[FLAGS.is_success].copy()))
        return raised

    return step_into


def _entry(core: Core, published: Sequence[Published], key: str) -> npt.NDArray[Any]:
    """An info entry of the rows of a core, from the steps that were made; costs are added."""
    if not published:  # a row that is reset in place of a step
        return np.ones(core.n_rows)
    if key == "is_success":
        return published[-1][1]
    values = np.stack([results[info_numbers(core.task).index(key)] for results, _ in published])
    return np.asarray(values.sum(axis=0) if key == "cost" else values[-1])


def difference(told: starts.Episodes, again: starts.Episodes) -> str | None:
    """Where episodes are not what was told of them, in words; None if all are, to the bit.

    Args:
        told: What the rows told of their steps.
        again: What came of their actions in the registered task.
    """
    for name, attribute in _COMPARED.items():
        one, other = getattr(told, attribute), getattr(again, attribute)
        if one is not None and (wrong := np.flatnonzero(one != other)).size:
            k = wrong[0]
            return (
                f"{name} of start {k} = {one[k]}; expected {other[k]}, which its actions give in "
                "the registered task"
            )
    return None
