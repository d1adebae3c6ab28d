"""Evaluation and best known costs: `rigid-envs evaluate`, `best` and `verify --scores`."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rigid_envs import ENVIRONMENTS, catalogue
from rigid_envs.cli.progress import tell
from rigid_envs.cli.words import config_of, refuse, refuse_missing_folder
from rigid_envs.pages.tables import table
from rigid_envs.provenance import heading, provenance

if TYPE_CHECKING:
    from rigid_envs.scores.best import Best

__all__ = ["add_best", "add_evaluate", "verify_scores"]

_TOLERANCE = 1e-3
"""Difference of a rate. The kernels give the same bits anywhere, but controllers use LAPACK, whose
roundings differ by machine: an episode in 500 may end some steps earlier or later."""

_ROUNDING = 1e-9
"""Relative difference of the cost of a plan, which is played without feedback: the same bits."""


def add_evaluate(verbs: Any) -> None:
    """Add the verb `evaluate`."""
    evaluating = verbs.add_parser(
        "evaluate",
        help="success and efficiency of a policy over 500 fixed starts",
        usage="rigid-envs evaluate ID --policy NAME|FILE [--starts N] [--name NAME] [--out FILE] "
        "[--json] [--KEY VALUE]",
        description="Play one episode from each of the fixed starts. Any hyperparameter can be "
        "given as an option.",
        allow_abbrev=False,
    )
    evaluating.add_argument("id", metavar="ID")
    evaluating.add_argument(
        "--policy",
        required=True,
        metavar="NAME|FILE",
        help="a reference controller, `reference` for the best, `nmpc` where there is one (it "
        "needs the extra `control`), `sampling`, `zero`, `random`; a trained policy: a file "
        "(.safetensors), or `BallPark`, the published one of that id; or a replay (.npz) of the "
        "first starts, whose actions are played again",
    )
    evaluating.add_argument("--starts", type=int, metavar="N", help="(500, or those of the replay)")
    evaluating.add_argument("--name", help="of the policy in tables (its own)")
    evaluating.add_argument(
        "--out", type=Path, metavar="FILE", help="write a row of the leaderboard"
    )
    evaluating.add_argument("--json", action="store_true", help="print that row, not a table")
    evaluating.set_defaults(act=_evaluate)


def add_best(verbs: Any) -> None:
    """Add the verb `best`."""
    finding = verbs.add_parser(
        "best",
        help="compute the best known cost from each start, and keep it as data",
        description="Play the untrained policies, the stored plans, the published policy and "
        "recorded episodes from the starts of the evaluation set, and keep the least cost of a "
        "success from each start with its finder.",
        allow_abbrev=False,
    )
    finding.add_argument("ids", nargs="*", metavar="ID", help="these environments only")
    finding.add_argument(
        "--with",
        dest="files",
        nargs="+",
        type=Path,
        default=[],
        metavar="FILE",
        help="replays (.npz) of the first starts of one id; their actions are played again, and "
        "their labels say who found them",
    )
    finding.add_argument(
        "--plan",
        action="store_true",
        help="improve the stored plans first, or plan where there are none: minutes for each id "
        "that has a recipe",
    )
    finding.add_argument("--starts", type=int, metavar="N", help="fewer starts, for a first look")
    finding.add_argument("--out", type=Path, metavar="FOLDER", help="instead of the package's data")
    finding.add_argument(
        "--rows", type=Path, metavar="FOLDER", help="leaderboard rows of the untrained policies"
    )
    finding.set_defaults(act=_best)


def _evaluate(options: argparse.Namespace, rest: list[str]) -> None:
    from rigid_envs.scores import N_STARTS, evaluate
    from rigid_envs.scores.repeating import policy_named

    env_id, config = catalogue.checked_id(options.id), config_of(rest)
    refuse_missing_folder("--out", options.out)
    policy: Any = options.policy
    n = N_STARTS if options.starts is None else options.starts
    if policy.endswith(".npz"):
        if config or options.starts is not None:
            raise ValueError(f"--policy = {policy}; expected no other option: a replay has its own")
        found = _again(Path(policy), env_id)
    else:
        chosen = policy_named(policy)
        found = evaluate(env_id, chosen, n=n, config=config or None, progress=tell)
    tell("")
    found = found if options.name is None else replace(found, policy=options.name)
    file = found.save(options.out) if options.out else None
    if options.json:
        print(json.dumps(found.row(), indent=1, allow_nan=False))
        return
    print(found)
    if file:
        print(f"written to {file}")


def _again(file: Path, env_id: str) -> Any:
    """What comes of the actions of a replay from the first starts."""
    from rigid_envs.replays import load_replay
    from rigid_envs.scores import evaluate, recorded

    replay = load_replay(file)
    if replay.env_id != env_id:
        raise ValueError(f"{file}: env_id = {replay.env_id}; expected {env_id}")
    longest = max(map(len, replay.episodes))
    actions = np.stack(
        [
            np.pad(each.actions, [(0, longest - len(each)), (0, 0)], mode="edge")
            for each in replay.episodes
        ],
        axis=1,
    )
    actions = actions[..., 0] if replay.task.n_choices else actions
    policy = recorded(actions, replay.episodes[0].label or file.stem)
    config = catalogue.changed(env_id, replay.task)
    return evaluate(env_id, policy, n=len(replay.episodes), config=config)


def _best(options: argparse.Namespace, rest: list[str]) -> None:
    refuse(rest)
    from rigid_envs.scores import N_STARTS
    from rigid_envs.scores.best import FOLDER

    ids = list(dict.fromkeys(map(catalogue.checked_id, options.ids or ENVIRONMENTS)))
    n = N_STARTS if options.starts is None else options.starts
    if not 1 <= n <= N_STARTS or (n < N_STARTS and options.out is None):
        raise ValueError(f"--starts = {n}; expected 1 to {N_STARTS}; with --out if it is less")
    if options.files and len(ids) != 1:
        raise ValueError(f"--with: ID = {options.ids}; expected the one id that the files are of")
    folder = options.out or FOLDER
    if not folder.is_dir():
        raise ValueError(f"--out = {folder}; expected a folder that exists")
    for env_id in ids:
        begin = time.perf_counter()
        tell(env_id)
        found = _measured(env_id, n, folder, options)
        tell("")
        shares = ", ".join(f"{name} {count}" for name, count in found.shares.items()) or "nobody"
        print(f"{env_id}   {time.perf_counter() - begin:.1f} s   best {found.cost}: {shares}")
        rows = [
            (name, *(_figure(each[key]) for key in _COLUMNS))
            for name, each in found.policies.items()
        ]
        print(table(("", *_COLUMNS), rows, "<" + ">" * len(_COLUMNS)), end="\n\n")
    print(f"written to {folder}")


def _measured(env_id: str, n: int, folder: Path, options: argparse.Namespace) -> Best:
    """Plan if that is asked for, play all that is known, and write what is best."""
    from rigid_envs.scores import find
    from rigid_envs.scores.best import file_of, read_best, write_best
    from rigid_envs.scores.finding import played, replayed, trained
    from rigid_envs.scores.planner import plan, recipe_of
    from rigid_envs.scores.plans import FOLDER as folder_of_plans
    from rigid_envs.scores.plans import file_of_plans, read_plans, write_plans

    file, plans = file_of(env_id, folder), options.out or folder_of_plans
    known = read_best(file) if file.exists() else None
    others = [_again(each, env_id) for each in options.files]
    untrained = played(env_id, n)
    if options.plan and recipe_of(env_id) is not None:
        place = file_of_plans(env_id, plans)
        stored = read_plans(place) if place.exists() else None
        write_plans(place, plan(env_id, n, stored))
    others += [*replayed(env_id, n, plans), *trained(env_id, n)]
    found = find(env_id, known, others, untrained, n)
    write_best(file, found)
    for name, each in untrained.items() if options.rows else ():
        row = options.rows / env_id.rpartition("/")[2] / f"{name}.json"
        row.parent.mkdir(parents=True, exist_ok=True)
        each.against(found.costs).save(row)
    return found


_COMPARED = ("success_rate", "efficiency")
_COLUMNS = ("success_rate", "efficiency", "cost_mean", "bound_mean", "gap", "return_mean")


def _figure(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def verify_scores(ids: Sequence[str]) -> bool:
    """Play the untrained policies of some ids again, and compare their figures with the data.

    Args:
        ids: Gymnasium's ids; if there are none, one of each kind of environment.

    Returns:
        Whether all agree.
    """
    from rigid_envs.scores import best_known
    from rigid_envs.scores.finding import played, replayed, trained

    print(heading(provenance()), end="\n\n")
    rows, holds = [], True
    for env_id in ids or catalogue.one_of_each():
        tell(env_id)
        known = best_known(env_id)
        if known is None:
            rows.append((env_id, "", "", "", "", "no data"))
            holds = False
            continue
        for name, found in played(env_id, len(known.costs)).items():
            now, then = found.against(known.costs).summary(), known.policies.get(name, {})
            off = max(abs(now[key] - then.get(key, np.inf)) for key in _COMPARED)
            holds &= off <= _TOLERANCE
            figures = f"{now['success_rate']:.3f}", f"{now['efficiency']:.4f}", f"{off:.1e}"
            rows.append((env_id, name, *figures, "holds" if off <= _TOLERANCE else "FAILS"))
        for found in (*replayed(env_id), *trained(env_id)):
            own = np.array([name == found.policy for name in known.finders])
            off = float(np.max(np.abs(found.costs[own] / known.costs[own] - 1.0), initial=0.0))
            met = bool(found.successes[own].all()) and off <= _ROUNDING
            holds &= met
            figures = f"{found.success.mean:.3f}", f"{own.mean():.4f}", f"{off:.1e}"
            rows.append((env_id, found.policy, *figures, "holds" if met else "FAILS"))
    tell("")
    print(table(("id", "policy", "success", "efficiency", "off by", ""), rows, "<<>>><"))
    print(f"\noff by: the larger difference of success and efficiency; {_TOLERANCE:g}")
    return holds
