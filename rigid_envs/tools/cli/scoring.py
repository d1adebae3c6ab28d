"""Verbs of scores: evaluate, best, optima, leaderboard, repeat, recheck, verify."""

import argparse
import itertools
import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rigid_envs.base.checks import require
from rigid_envs.engine.provenance import heading, provenance
from rigid_envs.envs import lookup as catalogue
from rigid_envs.scores import best, finding, optima
from rigid_envs.scores.comparison import KINDS, compare
from rigid_envs.scores.evaluation import evaluate, make_rows, recheck, repeat
from rigid_envs.scores.leaderboard import write_leaderboard
from rigid_envs.scores.policies import recorded
from rigid_envs.scores.records import read_evaluation
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, evaluation_seeds
from rigid_envs.scores.trained import published
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli import words
from rigid_envs.tools.pages.tables import short_figure, table
from rigid_envs.watch.replays.replay import load_replay

# `rigid-envs leaderboard`: its arguments.


@words.verb(
    words.option("folder", type=Path, metavar="FOLDER"),
    words.option(
        "--packaged",
        action="store_true",
        help="also of what comes with the package: published policies and controllers",
    ),
)
def leaderboard_(options: argparse.Namespace) -> None:
    """One table and plot of evaluations.

    Collect all results below a folder, of `rigid-envs evaluate --out` and of rigid_envs.evaluate,
    into leaderboard.md and leaderboard.png there.
    """
    text = write_leaderboard(options.folder, options.packaged)
    print(f"{text}\nwritten to {options.folder}: leaderboard.md, leaderboard.png")


# Evaluated again: `rigid-envs verify --policies` and `rigid-envs verify FILE.json`.

_HEADER = ("policy", "acts as", "success", "published", "efficiency", "published", "seconds", "")


def verify_results(files: Sequence[str], policy: str | None) -> bool:
    """Play the episodes of results again.

    Args:
        files: From `rigid-envs evaluate --out`.
        policy: Name or file of the policy; None takes the one that each result names.

    Returns:
        Whether every number of every start is hit to the last digit.
    """
    print(heading(provenance()), end="\n\n")
    holds = True
    for file in files:
        words.tell(file)
        again = repeat(file, policy)
        words.tell("")
        then, n = again.then, again.then.n
        print(f"{file}: {then.env_id}, {then.policy}, {n} starts of seed {then.seed}")
        for line in again.differences:
            print(f"FAILS: {line}")
        if again.differences:
            rates = (f"{100 * each.success.mean:.1f} %" for each in (then, again.now))
            print("success {} then, {} now".format(*rates))
        else:
            print("every number of every start is the same, to the last digit")
        holds &= not again.differences
    return holds


def verify_policies(names: Sequence[str], seed: int | None) -> bool:
    """Evaluate published policies again.

    Args:
        names: Their names; all if there are none.
        seed: Seed of other starts than the published ones; None takes those.

    Returns:
        Whether all published figures are hit.
    """
    print(heading(provenance()), end="\n\n")
    rows, complaints = [], []
    for name in names or published():
        words.tell(name)
        begin = time.perf_counter()
        again = recheck(name, seed)
        seconds = time.perf_counter() - begin
        pair = (again.now, again.then)
        rates = [f"{100 * each.success.mean:.1f} %" for each in pair]
        means = ["-" if each.efficiency is None else f"{each.efficiency.mean:.4f}" for each in pair]
        verdict = "FAILS" if again.differences else "holds"
        own = again.then.env_id.rpartition("/")[2]
        rows.append((own, again.then.policy, *rates, *means, f"{seconds:.1f}", verdict))
        complaints += [f"{own}: {line}" for line in again.differences]
    words.tell("")
    print(table(_HEADER, rows, "<<>>>>><"))
    for line in complaints:
        print(f"FAILS: {line}")
    claim = (
        "success and cost of every published start, compared to the last digit"
        if seed is None
        else f"success from starts of seed {seed}, compared with the 95 % interval published"
    )
    print(f"\n{claim}: {len(rows)} policies")
    return not complaints


# Evaluation and best known costs: `rigid-envs evaluate`, `best` and `verify --scores`.

_TOLERANCE = 1e-3
"""Difference of a rate. The kernels give the same bits anywhere, but controllers use LAPACK, whose
roundings differ by machine: an episode in 500 may end some steps earlier or later."""

_ROUNDING = 1e-9
"""Relative difference of the cost of a plan, which is played without feedback: the same bits."""


@words.verb(
    words.option("id", metavar="ID"),
    words.option(
        "--policy",
        required=True,
        metavar="NAME|FILE",
        help="a reference controller, `reference` for the best, `nmpc` where there is one (it "
        "needs the extra `control`), `sampling`, `zero`, `random`; a trained policy: a file "
        "(.safetensors), or `BallPark`, the published one of that id; or a replay (.npz) of the "
        "first starts, whose actions are played again",
    ),
    words.option("--starts", type=int, metavar="N", help="(500, or those of the replay)"),
    words.option("--name", help="of the policy in tables (its own)"),
    words.option("--out", type=Path, metavar="FILE", help="write a row of the leaderboard"),
    words.option("--json", action="store_true", help="print that row, not a table"),
    usage=(
        "rigid-envs evaluate ID --policy NAME|FILE [--starts N] [--name NAME] [--out FILE] "
        "[--json] [--KEY VALUE]"
    ),
)
def evaluate_(options: argparse.Namespace) -> None:
    """Success and efficiency of a policy over 500 fixed starts.

    Play one episode from each of the fixed starts. Any hyperparameter can be given as an option.
    """
    env_id, config = catalogue.checked_id(options.id), words.config_of(options.rest)
    words.refuse_missing_folder("--out", options.out)
    policy: Any = options.policy
    n = N_STARTS if options.starts is None else options.starts
    if policy.endswith(".npz"):
        if config or options.starts is not None:
            raise ValueError(f"--policy = {policy}; expected no other option: a replay has its own")
        found = _again(Path(policy), env_id)
    else:
        found = evaluate(env_id, policy, n=n, config=config or None, progress=words.tell)
    words.tell("")
    found = found if options.name is None else replace(found, policy=options.name)
    file = found.save(options.out) if options.out else None
    if options.json:
        print(json.dumps(found.row(), indent=1, allow_nan=False))
        return
    print(found)
    if file:
        print(f"written to {file}")


@words.verb(
    words.option("id", metavar="ID"),
    words.option(
        "--policy", required=True, action="append", metavar="[NAME=]POLICY", help="one of several"
    ),
    words.option("--starts", type=int, default=N_STARTS, metavar="N", help="(500)"),
    words.option(
        "--out", nargs="+", type=Path, default=[], metavar="FILE", help="tables and figures"
    ),
    usage="rigid-envs compare ID --policy POLICY ... [--starts N] [--out FILE ...] [--KEY VALUE]",
)
def compare_(options: argparse.Namespace) -> None:
    """Several policies from the same fixed starts, side by side and in pairs.

    Play one episode of each policy from each of the fixed starts: policies as of `rigid-envs
    evaluate`, or results of it (.json). Files are tables for LaTeX (.tex) and figures (.pdf, .svg,
    .png). Any hyperparameter can be given as an option.
    """
    config, policies = words.config_of(options.rest), {}
    for file in options.out:
        words.refuse_missing_folder("--out", file)
        known = ".tex", *KINDS
        require(file.suffix in known, str(file), "--out", f"names with one of {', '.join(known)}")
    for each in options.policy:
        name, _, policy = each.rpartition("=")
        name = name or policy
        require(name not in policies, name, "--policy", "another name: NAME=POLICY")
        policies[name] = read_evaluation(policy) if policy.endswith(".json") else policy
    found = compare(options.id, policies, n=options.starts, config=config, progress=words.tell)
    words.tell("")
    print(found)
    for file in options.out:
        (found.latex if file.suffix == ".tex" else found.figure)(file)
        print(f"written to {file}")


def _again(file: Path, env_id: str) -> Any:
    """What comes of the actions of a replay from the first starts."""
    replay = load_replay(file)
    require(replay.env_id == env_id, replay.env_id, f"{file}: env_id", env_id)
    config, n = catalogue.changed(env_id, replay.task), len(replay.episodes)
    rows = make_rows(env_id, n, config)
    rows.reset(seed=evaluation_seeds(n))
    for k, (each, start) in enumerate(zip(replay.episodes, rows.get_state()["y"], strict=True)):
        expected = "the first starts of the evaluation set: seeds of `evaluation_seeds`"
        require(np.array_equal(each.y[0], start), each.y[0], f"{file}: start {k}", expected)
    longest = max(map(len, replay.episodes))
    actions = np.stack(
        [
            np.pad(each.actions, [(0, longest - len(each)), (0, 0)], mode="edge")
            for each in replay.episodes
        ],
        axis=1,
    )
    policy = recorded(actions, replay.episodes[0].label or file.stem)
    return evaluate(env_id, policy, n=n, config=config)


@words.verb(
    words.option("ids", nargs="*", metavar="ID", help="these environments only"),
    words.option(
        "--with",
        dest="policies",
        nargs="+",
        default=[],
        metavar="POLICY",
        help="of one id: further policies, as of `rigid-envs evaluate`, or replays (.npz) of the "
        "first starts, whose actions are played again, and whose labels say who found them",
    ),
    words.option(
        "--plan",
        action="store_true",
        help="improve them by planning, from all that is known: hours for an id with 500 starts",
    ),
    words.option(
        "--seed",
        type=int,
        default=TEST_SEED,
        metavar="N",
        help=f"with --plan: other random numbers, which lead to other plans ({TEST_SEED})",
    ),
    words.option("--starts", type=int, metavar="N", help="fewer starts, for a first look"),
    words.option("--out", type=Path, metavar="FOLDER", help="instead of the package's data"),
)
def best_(options: argparse.Namespace) -> None:
    """Compute the best known cost from each start, and keep it as data.

    Play the stored plans, the untrained policies, the published policy and recorded episodes from
    the starts of the evaluation set, and keep the least cost of a success from each start with its
    finder and its actions, the plan.
    """
    ids = words.checked_ids(options.ids or ENVIRONMENTS)
    n = N_STARTS if options.starts is None else options.starts
    known = 1 <= n <= N_STARTS and (n == N_STARTS or options.out is not None)
    require(known, n, "--starts", f"1 to {N_STARTS}; with --out if it is less")
    require(options.seed >= 0, options.seed, "--seed", "a number from 0")
    drawn = options.plan or options.seed == TEST_SEED
    require(drawn, options.seed, "--seed", "--plan beside it: nothing else draws random numbers")
    kept = options.out is not None or set(ids) <= set(ENVIRONMENTS)
    require(kept, options.out, "--out", "a folder: the package keeps data of its own ids alone")
    alone = not options.policies or len(ids) == 1
    require(alone, options.ids, "--with: ID", "the one id that the policies are of")
    folder = options.out or best.FOLDER
    if not folder.is_dir():
        raise ValueError(f"--out = {folder}; expected a folder that exists")
    for env_id in ids:
        begin = time.perf_counter()
        words.tell(env_id)
        found = _measured(env_id, n, folder, options)
        words.tell("")
        shares = ", ".join(f"{name} {count}" for name, count in found.shares.items()) or "nobody"
        print(f"{env_id}   {time.perf_counter() - begin:.1f} s   best {found.cost}: {shares}")
        rows = [
            (name, *(short_figure(each[key]) for key in _COLUMNS))
            for name, each in found.policies.items()
        ]
        print(table(("", *_COLUMNS), rows, "<" + ">" * len(_COLUMNS)), end="\n\n")
    print(f"written to {folder}")


def _measured(env_id: str, n: int, folder: Path, options: argparse.Namespace) -> best.Best:
    """Play all that is known, plan if that is asked for, and write what is best."""
    if options.out is None and (missing := best.missing_plans(env_id)):
        raise ValueError(missing)
    plans = options.out or best.PLANS_FOLDER
    found = finding.stored(env_id, n, folder, plans)
    others = [  # first, as each may be refused
        _again(Path(each), env_id) if each.endswith(".npz") else evaluate(env_id, each, n=n)
        for each in options.policies
    ]
    untrained = finding.played(env_id, n)
    others = [*untrained.values(), *finding.trained(env_id, n), *others]
    for each in others:
        found = found.and_of(each)
    able = options.plan and finding.is_planned(env_id)
    firsts = [each.actions for each in others if each.actions is not None and each.successes.any()]
    for improved in itertools.chain(
        [found], finding.search(found, firsts, options.seed) if able else ()
    ):
        found = improved.told(untrained)
        best.write_plans(best.file_of_plans(env_id, plans), found.actions)
        best.write_best(best.file_of(env_id, folder), found.best)
        words.tell(f"{env_id}   {np.nanmean(found.best.costs):.6g}")
    return found.best


@words.verb(
    words.option("ids", nargs="*", metavar="ID", help="these environments only"),
    words.option(
        "--prove",
        action="store_true",
        help=f"prove that no cost is below {optima.SHARE} of the stored optima: up to an hour",
    ),
)
def optima_(options: argparse.Namespace) -> None:
    """Search for the least cost from each start, or prove bounds of it, and keep that as data.

    The search is over extremals, and finds what its first guesses lead to, the best known plans
    among them: its optima are no proof. A minute or two for each id. A proof excludes all
    extremals that cost less than a bound.
    """
    able = [env_id for env_id, record in ENVIRONMENTS.items() if record.optimum]
    for env_id in words.checked_ids(options.ids or able):
        words.tell(env_id)
        begin = time.perf_counter()
        found = _proven(env_id) if options.prove else _searched(env_id)
        optima.write_optima(best.file_of(env_id, optima.FOLDER), env_id, found)
        words.tell("")
        means = f"mean {found.costs.mean():.6g}, proven {found.proven.mean():.6g}"
        print(f"{env_id}   {time.perf_counter() - begin:.1f} s   {means}")
    print(f"written to {optima.FOLDER}")


def _searched(env_id: str) -> optima.Optima:
    """Optima searched for anew; what was proven stays."""
    if missing := best.missing_plans(env_id):
        raise ValueError(missing)
    costs, _ = optima.searched(env_id, finding.stored_plans(env_id, N_STARTS, best.PLANS_FOLDER))
    stored = optima.stored_optima(env_id)
    return optima.Optima(costs, np.zeros(N_STARTS) if stored is None else stored.proven)


def _proven(env_id: str) -> optima.Optima:
    """The stored optima, with what is proven of them now, or was before."""
    proven, stored = optima.proven(env_id, optima.SHARE), optima.stored_optima(env_id)
    assert stored is not None
    return stored._replace(proven=np.maximum(proven, stored.proven))


_COMPARED = ("success_rate", "efficiency")
_COLUMNS = ("success_rate", "efficiency", "cost_mean", "bound_mean", "gap", "return_mean")


def verify_scores(ids: Sequence[str]) -> bool:
    """Play the untrained policies of some ids again, and compare their figures with the data.

    Args:
        ids: Gymnasium's ids; if there are none, one of each kind of environment.

    Returns:
        Whether all agree.
    """
    print(heading(provenance()), end="\n\n")
    chosen = list(ids or catalogue.one_of_each())
    rows: list[tuple[str, ...]] = []
    for env_id in chosen:
        words.tell(env_id)
        known = best.best_known(env_id)
        rows += [(env_id, "", "", "", "", "no data")] if known is None else _compared(known)
    words.tell("")
    print(table(("id", "policy", "success", "efficiency", "off by", ""), rows, "<<>>><"))
    print(f"\noff by: the larger difference of success and efficiency; {_TOLERANCE:g}")
    for line in filter(None, map(best.missing_plans, chosen)):
        print(f"not played: {line}")
    return all(row[-1] == "holds" for row in rows)


def _compared(known: best.Best) -> list[tuple[str, ...]]:
    """A row for each policy that is played again: how far it is off what the data say of it."""
    rows = []
    for name, found in finding.played(known.env_id, len(known.costs)).items():
        now, then = found.against(known.costs).summary(), known.policies.get(name, {})
        off = max(abs(now[key] - then.get(key, np.inf)) for key in _COMPARED)
        rows.append((found, now["efficiency"], off, off <= _TOLERANCE))
    if best.missing_plans(known.env_id) is None:
        found, own = finding.replayed(known.env_id), ~np.isnan(known.costs)
        size = np.where(known.costs > 0.0, known.costs, 1.0)[own]  # who rests may pay nothing
        off = float(np.max(np.abs(found.costs[own] - known.costs[own]) / size, initial=0.0))
        met = bool(found.successes[own].all()) and off <= _ROUNDING
        rows.append((replace(found, policy="best known"), float(own.mean()), off, met))
    return [
        (known.env_id, found.policy, f"{found.success.mean:.3f}", f"{share:.4f}", f"{off:.1e}",
         "holds" if holds else "FAILS")
        for found, share, off, holds in rows
    ]  # fmt: skip
