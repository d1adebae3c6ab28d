"""How best known costs are found: by what is known, and by a planner."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rigid_envs.base.checks import Array, Bools, ConfigError, Integers, Singles
from rigid_envs.base.files import DamagedFileError
from rigid_envs.control.planning.deadlines import hurried, shorten, sooner
from rigid_envs.control.planning.descent import Plans, improve
from rigid_envs.control.planning.model import Counts, Model
from rigid_envs.control.planning.tracking import follow
from rigid_envs.engine.provenance import provenance
from rigid_envs.envs.lookup import task_of
from rigid_envs.scores import best as best_costs
from rigid_envs.scores.best import FOLDER, PLANNER, PLANS_FOLDER, Best
from rigid_envs.scores.evaluation import evaluate, make_rows
from rigid_envs.scores.optima import searched
from rigid_envs.scores.policies import (
    PolicyFactory,
    policy_of,
    recorded,
    reference_controllers,
    resting,
    untrained_policies,
)
from rigid_envs.scores.result import Evaluation
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, metrics_of, row_seeds
from rigid_envs.scores.trained import CompiledPolicy, load, published
from rigid_envs.tasks import registry
from rigid_envs.tasks.registry import ENVIRONMENTS

# Search for best known costs: whoever finds is played, and counts where it succeeds.

BASELINES = ("zero", "random")
"""Policies that stand beside the reference controllers; from a lucky start they are the best."""


class Found(NamedTuple):
    """Best known costs of an id and what gives them.

    Attributes:
        best: The costs, and who found them.
        actions: In the frame of the task, shape (T, n, m), of choices (T, n, 1).
    """

    best: Best
    actions: Singles

    def and_of(self, found: Evaluation) -> Found:
        """What is best of these and of somebody's episodes from the first k starts.

        Args:
            found: The episodes.

        Raises:
            ConfigError: They are not proven to be those of the registered task.
        """
        if found.actions is None:
            raise ConfigError(f"{found.policy}: {found.unranked}")
        return self.and_plans(found.actions, (found.policy,) * found.n)

    def and_plans(self, actions: Singles, finders: Sequence[str]) -> Found:
        """What is best of these and of plans from the first k starts, played without feedback.

        Args:
            actions: In the frame of the task, shape (T, k, m).
            finders: Who found each.
        """
        found = evaluate(self.best.env_id, of_plans(actions), n=actions.shape[1])
        better = self.best.beaten(found)
        kept = replaced(self.actions, better, actions[:, better[: found.n]])
        return Found(self.best.improved(found, finders), kept)

    def told(self, untrained: Mapping[str, Evaluation]) -> Found:
        """The same with the figures of the untrained policies beside these costs, of now.

        Args:
            untrained: Their episodes, by name.
        """
        policies = {
            name: each.against(self.best.costs).summary() for name, each in untrained.items()
        }
        return Found(replace(self.best, policies=policies, provenance=provenance()), self.actions)


def replaced(actions: Singles, rows: Bools | Integers, plans: Singles) -> Singles:
    """Plans with others from some starts; all are as long as the longest, and rest after their end.

    Args:
        actions: Shape (T, n, m).
        rows: Which starts.
        plans: From these, shape (T', k, m).
    """
    (before, n, m) = actions.shape
    both = np.zeros((max(before, len(plans)), n, m), np.float32)
    both[:before] = actions
    both[:, rows] = 0.0
    both[: len(plans), rows] = plans
    return both


def nothing(env_id: str, n: int) -> Found:
    """Where nothing is known yet.

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.
    """
    cost = metrics_of(env_id)[0].name
    best = Best(env_id, cost, np.full(n, np.nan), ("",) * n)
    return Found(best, np.zeros((1, n, len(task_of(env_id).actions())), np.float32))


def stored(
    env_id: str, n: int = N_STARTS, folder: Path = FOLDER, plans: Path = PLANS_FOLDER
) -> Found:
    """What is stored of an id, played again; a cost that no plan gives is dropped.

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.
        folder: Where the costs are.
        plans: Where the plans are.

    Raises:
        DamagedFileError: A file is damaged, or its plans are not of the id.
    """
    file, found = best_costs.file_of(env_id, folder), nothing(env_id, n)
    if not (file.exists() and best_costs.file_of_plans(env_id, plans).exists()):
        return found
    known, actions = best_costs.read_best(file), stored_plans(env_id, n, plans)
    return found.and_plans(actions, known.finders[:n])


def replayed(env_id: str, n: int = N_STARTS, folder: Path = PLANS_FOLDER) -> Evaluation:
    """Evaluation of the stored plans of an id; arguments and errors as of `stored_plans`."""
    actions = stored_plans(env_id, n, folder)
    return evaluate(env_id, of_plans(actions), n=actions.shape[1])


def stored_plans(env_id: str, n: int, folder: Path) -> Singles:
    """The stored plans of an id, shape (T, k, m).

    Args:
        env_id: Gymnasium's id.
        n: Number of starts at most.
        folder: Where they are.

    Raises:
        DamagedFileError: The file is damaged, or its plans are not of the id.
    """
    file, task = best_costs.file_of_plans(env_id, folder), task_of(env_id)
    actions = best_costs.read_plans(file)[:, :n]
    low, high = (0, task.n_choices - 1) if task.n_choices else (-1, 1)
    if actions.shape[2] != len(task.actions()) or (actions < low).any() or (actions > high).any():
        raise DamagedFileError(
            f"{file}: {actions.shape[2]} entries from {actions.min()} to {actions.max()}; expected "
            f"{len(task.actions())} from {low} to {high}, for {env_id}: write it anew: rigid-envs "
            "best"
        )
    return actions


def of_plans(actions: Singles) -> PolicyFactory:
    """The policy that plays plans, and rests after them.

    Args:
        actions: Shape (T, n, m).
    """
    return recorded(np.concatenate([actions, np.zeros_like(actions[:1])]), PLANNER)


def played(env_id: str, n: int = N_STARTS) -> dict[str, Evaluation]:
    """Evaluations of the reference controllers, of the action 0 and of the random policy, by name.

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.
    """
    policies = untrained_policies(env_id)
    names = (*reference_controllers(env_id), *BASELINES)
    return {name: evaluate(env_id, policies[name], n=n) for name in names}


def trained(env_id: str, n: int = N_STARTS) -> list[Evaluation]:
    """Evaluation of the published policy of an id; nothing where there is none.

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.
    """
    return [evaluate(env_id, policy, n=n) for policy in _published(env_id)]


def _published(env_id: str) -> list[CompiledPolicy]:
    """The published policy of an id; nothing where there is none."""
    return [load(env_id)] if env_id.rpartition("/")[2] in published() else []


# Policies that rest for a time: where free motion does much by itself, less action is enough.

_N_TRIALS = 100  # of each policy
_WINDOW = 0.4  # longest time of the limit for which a policy acts before it rests
_VARIED = (-6.2, -1.2)  # log of the standard deviation of a change of these times, of the limit


def players(env_id: str) -> list[tuple[PolicyFactory, Mapping[str, Any]]]:
    """The reference controllers and the published policy of an id, and settings of each."""
    known = untrained_policies(env_id)
    trained = [(policy_of(env_id, each), each.env_kwargs) for each in _published(env_id)]
    return [*((known[name], {}) for name in reference_controllers(env_id)), *trained]


def rested(
    found: Found,
    policy: PolicyFactory,
    config: Mapping[str, Any],
    n_trials: int,
    seed: int = TEST_SEED,
) -> Found:
    """What is best of these and of a policy that acts in some time of an episode alone.

    It acts for a window of time, rests, and acts again until the end: three times, drawn at random
    for each start. From half of the trials on they are those of the best success, and changes of
    them at random.

    Args:
        found: What is known.
        policy: Who acts.
        config: Settings of the task that it knows.
        n_trials: How often episodes are played from all starts.
        seed: Of what is drawn.
    """
    env_id, n = found.best.env_id, len(found.best.costs)
    limit, rng = ENVIRONMENTS[env_id].max_episode_steps, np.random.default_rng(seed)
    times, costs = np.zeros((n, 3)), np.full(n, np.inf)
    for trial in range(n_trials):
        again = rng.random(n)
        drawn = np.stack([again * rng.random(n), _WINDOW * rng.random(n) ** 3, again], axis=1)
        size = np.exp(rng.uniform(*_VARIED, (n, 1)))
        near = np.abs(times + size * rng.normal(size=(n, 3)))
        new = np.where((np.isinf(costs) | (2 * trial < n_trials))[:, None], drawn, near)
        began, lasts, again = np.round(limit * new.T)
        t = np.arange(limit)[:, None]
        acts = ((t >= began) & (t < began + lasts)) | (t >= again)
        made = evaluate(env_id, resting(policy, acts), n=n, config=config)
        better = made.successes & (made.costs < costs)
        times[better], costs[better] = new[better], made.costs[better]
        found = found.and_of(made)
    return found


# Planner of the starts of the evaluation set: how each id is planned.

_BLOCK = 50  # starts that are planned together, and kept before the next ones
_COUNTS: Mapping[str, Counts] = {"time": "time", "error": "error"}  # by the metric; else costs
_SHAKE = (-3.5, -0.7)  # log of the standard deviation of a change of actions
_SWING = 8.0  # of the heading of a guess [rad]


class Recipe(NamedTuple):
    """How an id is planned.

    Attributes:
        n_rounds: Linearisations of a plan, or of one with a deadline.
        n_steps: Actions of a plan of a task that ends at success; None for the time limit.
        n_guesses: Curves that the force first turns along, where the cost is time.
        n_cuts: Deadlines of a plan whose cost is time and that must stay; 0 where it is not.
        n_hops: How often the best plan is changed at random, and improved again.
    """

    n_rounds: int = 200
    n_steps: int | None = None
    n_guesses: int = 0
    n_cuts: int = 0
    n_hops: int = 0


_ROLLED = Recipe(64, n_steps=96, n_hops=4)
RECIPES = {
    "BallPark": _ROLLED,
    "BallReorient": _ROLLED,
    "BallParkRandom": _ROLLED,
    "BallParkGoal": _ROLLED,
    "CoinPark": Recipe(64, n_steps=100, n_hops=8),
    "Reorient": Recipe(10, n_cuts=7),
    "WheelReorient": Recipe(10, n_cuts=7),
    "TwoWheels": Recipe(10, n_cuts=7),
    "DualSpin": Recipe(10, n_cuts=7),
    "MagneticDetumble": Recipe(10, n_cuts=7),
    "WheelTrack": Recipe(60),
    "BallSteer": Recipe(80),
    "DiskRoll": Recipe(60),
    "DiskRollRandom": Recipe(60),
    "BallParkDynamic": Recipe(24, n_steps=60, n_guesses=12),
}
"""How ids are planned that end at success or cost time, by the name in the id."""


def is_planned(env_id: str) -> bool:
    """Whether there is a recipe of an id, or a planner of its own."""
    return bool(ENVIRONMENTS[env_id].planner) or recipe_of(env_id) is not None


def recipe_of(env_id: str) -> Recipe | None:
    """How an id is planned from conditions of success; None where it says none."""
    if not ENVIRONMENTS[env_id].conditions:
        return None
    return RECIPES.get(env_id.rpartition("/")[2].rpartition("-")[0], Recipe())


def search(found: Found, firsts: Sequence[Singles], seed: int = TEST_SEED) -> Iterator[Found]:
    """Plan, and give what is best known after every few starts.

    Plans along extremals (`rigid_envs.scores.optima`) are improved too, where there are any, and
    the best episodes with rests, even where better ones are known: they lead to other plans.

    Args:
        found: What is known; its plans are improved.
        firsts: Further plans that are improved, each of shape (T, n, m).
        seed: Of what is drawn: with another one, other plans are found.

    Raises:
        ConfigError: The id is not planned.
    """
    env_id, n = found.best.env_id, len(found.best.costs)
    if metrics_of(env_id)[0].name == "effort":  # much happens by itself
        drawn = nothing(env_id, n)
        for policy, config in players(env_id):
            drawn = rested(drawn, policy, config, _N_TRIALS, seed)
            found = found.and_plans(drawn.actions, drawn.best.finders)
            yield found
        firsts = [*firsts, drawn.actions]
    if ENVIRONMENTS[env_id].optimum:
        firsts = [*firsts, searched(env_id, found.actions)[1].astype(np.float32)]
    for k in range(0, n, _BLOCK):
        rows = np.arange(k, min(k + _BLOCK, n))
        made = plan(env_id, (found.actions, *firsts), rows, seed)
        found = found.and_plans(replaced(found.actions, rows, made), (PLANNER,) * n)
        yield found


def plan(env_id: str, firsts: Sequence[Singles], rows: Integers, seed: int = TEST_SEED) -> Singles:
    """The best plans that are found from some starts, shape (T, len(rows), m).

    Args:
        env_id: Gymnasium's id.
        firsts: Plans from all starts that are improved, each of shape (T, n, m).
        rows: Numbers of the starts.
        seed: Of what is drawn.

    Raises:
        ConfigError: The id is not planned.
    """
    if not is_planned(env_id):
        known = [each for each in ENVIRONMENTS if is_planned(each)]
        raise ConfigError(f"ID = {env_id}; expected one that is planned: {known}")
    state = {key: part[rows] for key, part in _starts(env_id, int(rows.max()) + 1).items()}
    if name := ENVIRONMENTS[env_id].planner:
        own: Singles = registry.load(name)(task_of(env_id), state)
        return own
    recipe, limit = recipe_of(env_id) or Recipe(), ENVIRONMENTS[env_id].max_episode_steps
    counts = _COUNTS.get(metrics_of(env_id)[0].name, "cost")
    model = Model(task_of(env_id), state, recipe.n_steps or limit, counts)
    slowed = recipe.n_steps is not None and counts == "cost"
    given = [spread(first[:, rows], model.n_steps, slowed) for first in firsts]
    rng = np.random.default_rng([seed, int(rows[0])])
    if counts == "time" and recipe.n_steps:
        return _soonest(model, given, recipe, rng).actions
    if counts == "cost":  # much happens by itself
        given.append(np.zeros((model.n_steps, len(rows), model.n_actions)))
    made = [_improved(model, first, recipe) for first in given]
    best = functools.reduce(better_of, made)
    for _ in range(recipe.n_hops):
        best = better_of(best, _improved(model, _shaken(rng, best.actions), recipe))
    return best.actions


def _improved(model: Model, first: Array, recipe: Recipe) -> Plans:
    if model.counts == "time":
        return shorten(model, first, recipe.n_cuts, recipe.n_rounds)
    if model.counts == "error":
        return follow(model, first, recipe.n_rounds)
    return improve(model, first, recipe.n_rounds)


def _shaken(rng: np.random.Generator, actions: Singles) -> Array:
    """Plans with noise that is held for a sixteenth of them."""
    T, n, m = actions.shape
    size = np.exp(rng.uniform(*_SHAKE, (n, 1)))
    noise = size * rng.normal(size=(16, n, m))
    return np.asarray(actions + noise[np.arange(T) * 16 // T])


def better_of(one: Plans, other: Plans) -> Plans:
    """From each start the plan that costs less."""
    first = one.costs <= other.costs
    actions = np.where(first[:, None], one.actions, other.actions)
    return Plans(actions, np.where(first, one.costs, other.costs))


def _soonest(
    model: Model, given: Sequence[Array], recipe: Recipe, rng: np.random.Generator
) -> Plans:
    """Plans of a task that ends at success, each ended earlier and earlier."""
    n, rows = model.n_rows, np.arange(model.n_rows)
    plans = Plans(np.zeros((model.n_steps, n, model.n_actions), np.float32), np.full(n, np.inf))
    for first in given:
        plans.keep(rows, model.roll(first))
    hurried(model, plans, rows, recipe.n_rounds)
    for _ in range(recipe.n_guesses):
        met = sooner(model, plans, rows, lambda T, part: _curve(rng, T, len(part)), recipe.n_rounds)
        hurried(model, plans, met, recipe.n_rounds)
    return plans


def _curve(rng: np.random.Generator, n_steps: int, n: int) -> Array:
    """Directions whose angle is a random parabola, shape (T, n, 2)."""
    s = np.linspace(0.0, 1.0, n_steps)[:, None]
    start, turn, bend = rng.uniform(-1.0, 1.0, (3, n))
    heading = np.pi * start + _SWING * (turn * s + bend * (s * s - s))
    return np.stack([np.cos(heading), np.sin(heading)], axis=-1)


def _starts(env_id: str, n: int) -> dict[str, Array]:
    """States of the starts."""
    envs = make_rows(env_id, n)
    envs.reset(seed=row_seeds(TEST_SEED, n, "test"))
    state = envs.get_state()
    envs.close()
    return state


def spread(actions: Array | Singles, n_steps: int, slowed: bool) -> Array:
    """Plans of so many steps.

    Args:
        actions: Shape (T, n, m), zero after a row has arrived.
        n_steps: Steps of the result.
        slowed: Whether each step of a row is split into equal ones, so that all steps are used;
            else there are zeros after them.
    """
    out = np.zeros((n_steps, *actions.shape[1:]))
    moving = np.abs(actions).max(axis=-1) > 0.0
    lengths = np.maximum(len(actions) - moving[::-1].argmax(axis=0), 1)
    for row, length in enumerate(np.minimum(lengths, n_steps)):
        step = np.arange(n_steps) * length // n_steps if slowed else np.arange(length)
        out[: len(step), row] = actions[step, row] / np.bincount(step)[step, None]
    return out
