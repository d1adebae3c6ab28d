"""The page of the baselines: all records below a folder as tables, and the figures beside them."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from rigid_envs import ENVIRONMENTS
from rigid_envs.catalogue import families, task_of
from rigid_envs.errors import ConfigError
from rigid_envs.leaderboard.escaping import in_markdown
from rigid_envs.scores.aggregates import (
    interquartile_mean,
    probability_of_improvement,
    stratified_bootstrap,
)
from rigid_envs.scores.best import best_known
from rigid_envs.scores.efficiency import cost_of
from rigid_envs.scores.intervals import mean_interval
from rigid_envs.scores.records import Record, read_records

__all__ = ["Grouped", "digest_of", "grouped", "markdown", "pictures", "policies_of", "results_of"]

Grouped = Mapping[str, Mapping[str, Sequence[Record]]]
"""Records by policy and id, one for each seed."""

SOLVED = 0.99
"""Rate of success from which on an environment counts as solved."""

_HEADING = "<!-- Written by `python -m agents baselines docs/baselines`: not by hand. -->"
_INTRODUCTION = """# Baselines

Every training of `python -m agents benchmark`, one record each: config, learning curve, times, and
success and cost from each of the 500 test starts, which no training has seen, played by the policy
that did best on other starts held out. Records are in [{folder}]({folder}); policies with the same
bits on every processor play them, so that anybody gets the same numbers.

`success` and `efficiency` are means over the seeds of the training, with 95 % intervals over the
seeds (bootstrap, within each environment; Agarwal et al. 2021, arXiv:2108.13264); one seed says
nothing about others, and has none. What is taken over all environments has an interval where each
has several seeds; each has the same weight, however many. `efficiency` is against the best known
cost from each start, `cost` the mean of the successes, `ratio` how much more it is than what is
best known from these starts. `CPU` is the time of processors, user and system, of a whole
training, evaluations on the way included."""


def grouped(folder: Path) -> Grouped:
    """The records below a folder by policy and id, the policy of most environments first.

    Of equally many, that of the highest interquartile mean of the efficiencies is first.

    Raises:
        ConfigError: There are none.
    """
    found: dict[str, dict[str, list[Record]]] = {}
    for record in read_records(folder):
        found.setdefault(record.policy, {}).setdefault(record.env_id, []).append(record)
    if not found:
        raise ConfigError(f"folder = {folder}; expected records of `python -m agents benchmark`")
    means = {name: interquartile_mean(results_of(found, name)) for name in found}
    names = sorted(found, key=lambda name: (-len(found[name]), -means[name]))
    return {
        name: {
            env_id: sorted(found[name][env_id], key=lambda record: record.seed)
            for env_id in ENVIRONMENTS
            if env_id in found[name]
        }
        for name in names
    }


def policies_of(groups: Grouped, env_id: str) -> dict[str, Sequence[Record]]:
    """The records of an id by policy."""
    return {name: by_id[env_id] for name, by_id in groups.items() if env_id in by_id}


def results_of(groups: Grouped, name: str, ids: Iterable[str] = ENVIRONMENTS) -> list[list[float]]:
    """Mean efficiencies of a policy: for each id that it has been trained on, those of its seeds.

    Args:
        groups: All records.
        name: The policy.
        ids: Other ids are left out.
    """
    mine = groups[name]
    return [[_efficiency(record) for record in mine[each]] for each in ids if each in mine]


def interval_of(
    statistic: Callable[..., float], *policies: Sequence[Sequence[float]], n_resamples: int = 2000
) -> tuple[float, float] | None:
    """The interval of a statistic over the seeds, as `stratified_bootstrap` has it.

    None where an environment has one training alone, which says nothing about others.
    """
    if any(len(each) < 2 for runs in policies for each in runs):
        return None
    return stratified_bootstrap(statistic, *policies, n_resamples=n_resamples)


def pictures(groups: Grouped) -> list[str]:
    """Names of the figures: three of the suite, and learning curves of each family."""
    ids = {env_id for by_id in groups.values() for env_id in by_id}
    own = [family for family, members in families().items() if ids & set(members)]
    curves = [f"curves_{family.lower().replace(' ', '_')}" for family in own]
    return ["aggregates", "profiles", *(["improvement"] if len(groups) > 1 else []), *curves]


def digest_of(groups: Grouped) -> str:
    """Hash of all that the figures show."""
    digest = hashlib.sha256()
    for name, by_id in groups.items():
        for env_id, records in by_id.items():
            for record in records:
                digest.update(f"{name} {env_id} {record.seed} {record.efficiency}".encode())
                digest.update(f"{record.success_rate} {dict(record.curve)}".encode())
    return digest.hexdigest()


def markdown(groups: Grouped, folder: str) -> str:
    """The page.

    Args:
        groups: All records.
        folder: Of records and figures, as seen from the page.
    """
    parts = [_HEADING, _INTRODUCTION.format(folder=folder), "## All environments", _overall(groups)]
    if len(groups) > 1:
        parts += [_IMPROVEMENT, _comparisons(groups)]
    parts += [f"![{_TITLES[name]}]({folder}/{name}.png)" for name in pictures(groups)[:3]
              if name in _TITLES]  # fmt: skip
    curves = iter(name for name in pictures(groups) if name.startswith("curves_"))
    for family, members in families().items():
        rows = [row for env_id in members for row in _rows(groups, env_id)]
        if rows:
            figure = f"![Learning curves: {family}]({folder}/{next(curves)}.png)"
            parts += [f"## {family}", _table(_HEADER, rows), figure]
    return "\n\n".join(parts) + "\n"


_TITLES = {
    "aggregates": "Interquartile means with intervals",
    "profiles": "Performance profiles",
    "improvement": "Probabilities of improvement",
}
_IMPROVEMENT = """The probability that a training of the first policy ends with a higher efficiency
than one of the second, averaged over the environments that both have:"""
_HEADER = (
    *("environment", "policy", "seeds", "success", "95 %", "efficiency", "95 %"),
    *("cost", "mean", "ratio", "steps", "CPU"),
)


def _overall(groups: Grouped) -> str:
    """One row for each policy: over all environments that it has been trained on."""
    header = ("policy", "environments", "trainings", f"success >= {SOLVED:.0%}", "success",
              "efficiency (IQM)", "95 %", "longest CPU")  # fmt: skip
    rows: list[tuple[str, ...]] = []
    for name, by_id in groups.items():
        rates = [np.mean([record.success_rate for record in each]) for each in by_id.values()]
        runs = results_of(groups, name)
        cpu = max(_cpu(record) for each in by_id.values() for record in each)
        rows.append((
            in_markdown(name),
            str(len(by_id)),
            str(sum(map(len, by_id.values()))),
            f"{sum(rate >= SOLVED for rate in rates)} of {len(by_id)}",
            f"{100 * np.mean(rates):.1f} %",
            f"**{interquartile_mean(runs):.3f}**",
            _told(interval_of(interquartile_mean, runs)),
            f"{cpu:.0f} s",
        ))  # fmt: skip
    return _table(header, rows)


def _comparisons(groups: Grouped) -> str:
    rows: list[tuple[str, ...]] = []
    for one, other, ids in pairs(groups):
        runs = results_of(groups, one, ids), results_of(groups, other, ids)
        chance = probability_of_improvement(*runs)
        ends = interval_of(probability_of_improvement, *runs)
        rows.append(
            (
                in_markdown(one),
                in_markdown(other),
                str(len(ids)),
                f"{100 * chance:.0f} %",
                _told(ends, 100.0),
            )
        )
    return _table(("policy", "against", "environments", "probability", "95 %"), rows)


def pairs(groups: Grouped) -> list[tuple[str, str, list[str]]]:
    """Pairs of policies, with the ids that both have been trained on."""
    found = []
    for one, other in itertools.combinations(groups, 2):
        ids = [env_id for env_id in groups[one] if env_id in groups[other]]
        found += [(one, other, ids)] if ids else []
    return found


def _rows(groups: Grouped, env_id: str) -> list[tuple[str, ...]]:
    """Rows of an id, one for each policy."""
    cost = cost_of(env_id, task_of(env_id))
    unit = f" [{cost.unit}]" if cost.unit else ""
    rows: list[tuple[str, ...]] = []
    for name, records in policies_of(groups, env_id).items():
        rates = [record.success_rate for record in records]
        efficiency = [_efficiency(record) for record in records]
        costs = [record.cost_mean for record in records if record.successes.any()]
        ratios = [_ratio(record) for record in records if record.successes.any()]
        rows.append((
            f"`{env_id.rpartition('/')[2].removesuffix('-v0')}`",
            in_markdown(name),
            str(len(records)),
            f"{100 * np.mean(rates):.1f} %",
            _interval(rates, 100.0),
            f"**{np.mean(efficiency):.3f}**",
            _interval(efficiency),
            f"{cost.name}{unit}",
            f"{np.mean(costs):.4g}" if costs else "-",
            f"{np.mean(ratios):.2f}" if costs else "-",
            _steps(records),
            f"{np.mean([_cpu(record) for record in records]):.0f} s",
        ))  # fmt: skip
    return rows


def _efficiency(record: Record) -> float:
    """Mean efficiency of a training; every id of this package has best known costs."""
    found = record.efficiency
    assert found is not None
    return found


def _ratio(record: Record) -> float:
    """Mean cost of the successes over the mean best known cost from the same starts."""
    known = best_known(record.env_id)
    assert known is not None
    best = known.costs[: len(record.costs)][record.successes]
    return record.cost_mean / float(np.nanmean(best))


def _cpu(record: Record) -> float:
    return float(record.training["cpu_seconds"])


def _steps(records: Sequence[Record]) -> str:
    steps = float(np.mean([record.training["timesteps"] for record in records]))
    return f"{steps / 1e6:.2f} M" if steps >= 1e6 else f"{steps / 1e3:.0f} k"


def _interval(values: Sequence[float], scale: float = 1.0) -> str:
    return _told(mean_interval(values) if len(values) > 1 else None, scale)


def _told(ends: tuple[float, float] | None, scale: float = 1.0) -> str:
    digits = 1 if scale > 1.0 else 3
    return "-" if ends is None else " .. ".join(f"{scale * end:.{digits}f}" for end in ends)


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    texts = ("environment", "policy", "against", "cost")
    rules = ["---" if name in texts else "---:" for name in header]
    return "\n".join(f"| {' | '.join(row)} |" for row in (header, rules, *rows))
