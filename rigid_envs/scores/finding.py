"""Search for best known costs: whoever finds is played, and counts where it succeeds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rigid_envs.catalogue import task_of
from rigid_envs.errors import ConfigError
from rigid_envs.files import DamagedFileError
from rigid_envs.policies import load, published
from rigid_envs.provenance import provenance
from rigid_envs.scores.best import Best, nobody
from rigid_envs.scores.controllers import reference_controllers
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.metrics import metrics_of
from rigid_envs.scores.plans import FOLDER, file_of_plans, read_plans
from rigid_envs.scores.policies import PolicyFactory, untrained_policies
from rigid_envs.scores.result import Evaluation
from rigid_envs.scores.starts import N_STARTS

__all__ = ["BASELINES", "find", "played", "replayed", "trained"]

_Rows = npt.NDArray[np.generic]

BASELINES = ("zero", "random")
"""Policies that stand beside the reference controllers; from a lucky start they are the best."""


def find(
    env_id: str,
    known: Best | None = None,
    finders: Iterable[PolicyFactory | Evaluation] = (),
    untrained: Mapping[str, Evaluation] | None = None,
    n: int = N_STARTS,
) -> Best:
    """Play the untrained policies and other finders, and keep the best from each start.

    Args:
        env_id: Gymnasium's id.
        known: What is known already. What it has of untrained policies is not taken over, for they
            are played now. What a finder of the same name once found stays where it is better: a
            policy is trained anew, and its predecessor becomes `NAME, earlier`.
        finders: Other policies, or what came of them.
        untrained: What came of the untrained policies; None plays them.
        n: Number of starts.

    Raises:
        ConfigError: A finder whose episodes are not proven to be those of the registered task.
    """
    policies = played(env_id, n) if untrained is None else untrained
    others = [
        each if isinstance(each, Evaluation) else evaluate(env_id, each, n=n) for each in finders
    ]
    for each in (*policies.values(), *others):
        if each.unranked is not None:
            raise ConfigError(f"{each.policy}: {each.unranked}")
    best = nobody(env_id, metrics_of(env_id)[0].name, n)
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


def replayed(env_id: str, n: int = N_STARTS, folder: Path = FOLDER) -> list[Evaluation]:
    """Evaluation of the stored plans of an id; nothing where there are none.

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.
        folder: Where they are.
    """
    file = file_of_plans(env_id, folder)
    if not file.exists():
        return []
    plans = read_plans(file)
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
