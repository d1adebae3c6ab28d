"""How best known costs are found: by what is known, and by a planner."""

import functools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, ConfigError
from rigid_envs.base.files import DamagedFileError
from rigid_envs.control.planning.descent import Plans, improve, shorten
from rigid_envs.control.planning.model import Model
from rigid_envs.engine.provenance import provenance
from rigid_envs.envs.lookup import task_of
from rigid_envs.scores import best as best_costs
from rigid_envs.scores.best import PLANS_FOLDER, Best, StoredPlans
from rigid_envs.scores.evaluation import evaluate, make_rows
from rigid_envs.scores.policies import reference_controllers, untrained_policies
from rigid_envs.scores.result import Evaluation
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, metrics_of, rollout, row_seeds
from rigid_envs.scores.trained import load, published

# Planner of the starts of the evaluation set: how each id is planned.

_BLOCK = 100  # starts that are planned together: their data stay in the cache
_LONGEST_GUESS = (3.0, 9.0)  # radii
_SWING = 8.0  # of the heading of a guess [rad]


class Recipe(NamedTuple):
    """How an id is planned.

    Attributes:
        controller: Untrained policy whose actions are the first plan; empty for guesses.
        n_rounds: Linearisations of a plan, or of one with a deadline.
        hold: Control periods for which an action is held.
        n_steps: Actions of a plan of a task that ends at success; None for the time limit.
        n_guesses: Curves that a ball is first rolled along, beside the controller.
        n_cuts: Deadlines of a plan whose cost is time; 0 where it is not.
        waits: Control periods after which the controller begins, a first plan for each, none for
            guesses; a goal that is unstable is better reached late.
    """

    controller: str
    n_rounds: int
    hold: int = 1
    n_steps: int | None = None
    n_guesses: int = 0
    n_cuts: int = 0
    waits: tuple[int, ...] = (0,)


_ROLLED = Recipe("", 16, n_steps=48, n_guesses=16, waits=())
RECIPES = {
    "BallPark": _ROLLED,
    "BallReorient": _ROLLED,
    "BallParkRandom": _ROLLED,
    "BallParkGoal": _ROLLED,
    "CoinPark": Recipe("two_rolls", 64, n_steps=60),
    "SleepingTop": Recipe("lqr", 24, hold=4),
    "SleepingTopRandom": Recipe("lqr", 24, hold=4),
    "TopRandom": Recipe("lqr", 24, hold=4),
    "TopPrecession": Recipe("lqr", 24, hold=2),
    "PivotTop": Recipe("nmpc", 32),
    "IntermediateAxis": Recipe("nmpc", 32),
    "IntermediateAxisRandom": Recipe("nmpc", 32),
    "IntermediateAxisSingle": Recipe("energy_casimir", 32, hold=2),
    "AxisFlip": Recipe("timed", 32, hold=5),
    "SpinCapture": Recipe("separatrix", 12, hold=5, waits=(300, 350, 400)),
    "Reorient": Recipe("quaternion_pd", 10, hold=2, n_cuts=7),
    "BallParkDynamic": Recipe("three_rolls", 16, n_steps=60, n_cuts=8),
}
"""How ids are planned, by the name in the id."""


def plan(env_id: str, n: int = N_STARTS, stored: StoredPlans | None = None) -> StoredPlans:
    """Plan from the starts of the evaluation set.

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.
        stored: Plans that are improved; None, or plans of fewer starts, begins as the recipe says.

    Raises:
        ValueError: There is no recipe for the id.
    """
    recipe = recipe_of(env_id)
    if recipe is None:
        raise ValueError(f"ID = {env_id}; expected one that has a recipe: {sorted(RECIPES)}")
    state, parts = _starts(env_id, n), []
    if stored is not None and stored.actions.shape[1] < n:
        stored = None
    if stored is None:
        hold, firsts = recipe.hold, [_first(env_id, recipe, n, wait) for wait in recipe.waits]
    else:
        hold, firsts = stored.hold, [stored.actions[:, :n].astype(np.float64)]
    for k in range(0, n, _BLOCK):
        rows = np.arange(k, min(k + _BLOCK, n))
        block = {key: part[rows] for key, part in state.items()}
        if stored is None and recipe.n_guesses:
            parts.append(_best_of_guesses(task_of(env_id), recipe, block, k))
        else:
            found = [_improved(env_id, recipe, block, first[:, rows], hold) for first in firsts]
            parts.append(functools.reduce(better_of, found))
    return StoredPlans(np.concatenate([part.actions for part in parts], axis=1), hold)


def recipe_of(env_id: str) -> Recipe | None:
    """How an id is planned; None where it is not planned."""
    return RECIPES.get(env_id.rpartition("/")[2].rpartition("-")[0])


def _improved(
    env_id: str, recipe: Recipe, state: dict[str, Array], first: Array, hold: int
) -> Plans:
    timed = recipe.n_cuts > 0
    model = Model(task_of(env_id), state, len(first), hold, timed)
    if timed:
        return shorten(model, first, recipe.n_cuts, recipe.n_rounds)
    return improve(model, first, recipe.n_rounds)


def _best_of_guesses(task: Any, recipe: Recipe, state: dict[str, Array], seed: int) -> Plans:
    """The best of coarse plans from random guesses, refined."""
    assert recipe.n_steps is not None
    rng, n = np.random.default_rng([TEST_SEED, seed]), len(state["y"])
    coarse = Model(task, state, recipe.n_steps // 2)
    best = Plans(np.zeros((recipe.n_steps // 2, n, 2), np.float32), np.full(n, np.inf))
    for _ in range(recipe.n_guesses):
        guess = _guess(rng, recipe.n_steps // 2, n, task)
        best = better_of(best, improve(coarse, guess, recipe.n_rounds))
    fine = Model(task, state, recipe.n_steps)
    return improve(fine, best.actions.repeat(2, axis=0) / 2.0, recipe.n_rounds)


def better_of(one: Plans, other: Plans) -> Plans:
    """From each start the plan that costs less."""
    first = one.costs <= other.costs
    actions = np.where(first[:, None], one.actions, other.actions)
    return Plans(actions, np.where(first, one.costs, other.costs))


def _guess(rng: np.random.Generator, n_steps: int, n: int, task: Any) -> Array:
    """Paths of random length whose heading is a random parabola, as actions (T, n, 2)."""
    s = np.linspace(0.0, 1.0, n_steps)[:, None]
    start, turn, bend = rng.uniform(-1.0, 1.0, (3, n))
    heading = np.pi * start + _SWING * (turn * s + bend * (s * s - s))
    length = rng.uniform(*_LONGEST_GUESS, n) / (n_steps * task.roll_per_step)
    return np.asarray(np.stack([np.cos(heading), np.sin(heading)], axis=-1) * length[:, None])


def _starts(env_id: str, n: int) -> dict[str, Array]:
    """States of the starts."""
    envs = make_rows(env_id, n)
    envs.reset(seed=row_seeds(TEST_SEED, n, "test"))
    state = envs.get_state()
    envs.close()
    return state


def _first(env_id: str, recipe: Recipe, n: int, wait: int) -> Array:
    """The first plans, shape (T, n, m): an untrained policy whose actions are held."""
    envs, made = make_rows(env_id, n), [np.zeros((n, len(task_of(env_id).actions())), np.float32)]
    act = untrained_policies(env_id)[recipe.controller](envs)

    def held(seen: Any) -> npt.NDArray[Any]:
        k = len(made) - 1
        made.append(act(seen) if k >= wait and k % recipe.hold == 0 else made[-1])
        return made[-1]

    steps = rollout(held, envs, row_seeds(TEST_SEED, n, "test"), ())
    running = np.array([step.running for step in steps])
    envs.close()
    found = np.where(running[..., None], made[1:], 0.0)[:: recipe.hold]
    if recipe.n_steps is None:
        return found
    return spread(found, recipe.n_steps, slowed=recipe.n_cuts == 0)


def spread(actions: Array, n_steps: int, slowed: bool) -> Array:
    """Plans of so many steps: each step of a row split into as many equal ones as there is room.

    Args:
        actions: Shape (T, n, m), zero after a row has arrived.
        n_steps: Steps of the result.
        slowed: Whether steps are split; else there are zeros after them.
    """
    out = np.zeros((n_steps, *actions.shape[1:]))
    moving = np.abs(actions).max(axis=-1) > 0.0
    lengths = np.maximum(len(actions) - moving[::-1].argmax(axis=0), 1)
    for row, length in enumerate(lengths):
        parts = max(1, n_steps // length) if slowed else 1
        whole = np.repeat(actions[:length, row] / parts, parts, axis=0)[:n_steps]
        out[: len(whole), row] = whole
    return out


# Search for best known costs: whoever finds is played, and counts where it succeeds.

_Rows = npt.NDArray[np.generic]

BASELINES = ("zero", "random")
"""Policies that stand beside the reference controllers; from a lucky start they are the best."""


def find(
    env_id: str,
    known: Best | None = None,
    others: Sequence[Evaluation] = (),
    untrained: Mapping[str, Evaluation] | None = None,
    n: int = N_STARTS,
) -> Best:
    """Play the untrained policies, and keep the best of them and of others from each start.

    Args:
        env_id: Gymnasium's id.
        known: What is known already. What it has of untrained policies is not taken over, for they
            are played now. What a finder of the same name once found stays where it is better: a
            policy is trained anew, and its predecessor becomes `NAME, earlier`.
        others: What came of other policies.
        untrained: What came of the untrained policies; None plays them.
        n: Number of starts.

    Raises:
        ConfigError: A finder whose episodes are not proven to be those of the registered task.
    """
    policies = played(env_id, n) if untrained is None else untrained
    for each in (*policies.values(), *others):
        if each.unranked is not None:
            raise ConfigError(f"{each.policy}: {each.unranked}")
    best = best_costs.nobody(env_id, metrics_of(env_id)[0].name, n)
    again = {each.policy for each in others}
    of_others = {} if known is None else _found_by(known, n, known.shares.keys() - policies.keys())
    for name in of_others.keys() - again:
        best = best.improved(name, *of_others[name])
    for found in (*policies.values(), *others):
        best = best.improved(found.policy, found.successes, found.costs)
    for name in sorted(of_others.keys() & again):
        best = best.improved(f"{name}, earlier", *of_others[name])
    summaries = {name: each.against(best.costs).summary() for name, each in policies.items()}
    return replace(best, policies=summaries, provenance=provenance())


def _found_by(known: Best, n: int, names: Iterable[str]) -> dict[str, tuple[_Rows, _Rows]]:
    """Where some finders are the best from the first n starts, and the costs there, by name."""
    finders = np.array(known.finders[:n])
    return {name: (finders == name, known.costs[:n]) for name in names}


def played(env_id: str, n: int = N_STARTS) -> dict[str, Evaluation]:
    """Evaluations of the reference controllers, of the action 0 and of the random policy, by name.

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.
    """
    policies = untrained_policies(env_id)
    names = (*reference_controllers(env_id), *BASELINES)
    return {name: evaluate(env_id, policies[name], n=n) for name in names}


def replayed(env_id: str, n: int = N_STARTS, folder: Path = PLANS_FOLDER) -> list[Evaluation]:
    """Evaluation of the stored plans of an id; nothing where there are none.

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.
        folder: Where they are.
    """
    file = best_costs.file_of_plans(env_id, folder)
    if not file.exists():
        return []
    plans = best_costs.read_plans(file)
    (_, starts, entries), needed = plans.actions.shape, len(task_of(env_id).actions())
    if starts < n or entries != needed:
        raise DamagedFileError(
            f"{file}: actions of {entries} entries from {starts} starts; expected {needed} from at "
            f"least {n}, for {env_id}: write it anew: rigid-envs best --plan"
        )
    return [evaluate(env_id, plans.policy(n), n=n)]


def trained(env_id: str, n: int = N_STARTS) -> list[Evaluation]:
    """Evaluation of the published policy of an id; nothing where there is none.

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.
    """
    own = env_id.rpartition("/")[2] in published()
    return [evaluate(env_id, load(env_id), n=n)] if own else []
