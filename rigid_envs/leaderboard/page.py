"""Leaderboard: all results below a folder in one table and one plot."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rigid_envs import ENVIRONMENTS
from rigid_envs.errors import ConfigError
from rigid_envs.files import read_json, write_atomic
from rigid_envs.leaderboard.drawing import draw, require_matplotlib
from rigid_envs.leaderboard.escaping import in_markdown
from rigid_envs.leaderboard.rows import Row, kind_of, packaged_rows, row_of, sorted_rows
from rigid_envs.scores.aggregates import interquartile_mean, stratified_bootstrap
from rigid_envs.scores.reading import read_evaluation
from rigid_envs.scores.result import FORMAT, Evaluation

__all__ = ["markdown", "read_results", "write_leaderboard"]

_LIMIT = 2**24  # bytes of a result
_HEADER = ("environment", "policy", "success", "95 %", "efficiency", "95 %", "cost", "mean", "best",
           "bound", "gap")  # fmt: skip
_INTRODUCTION = """# Leaderboard

One episode from each start. The efficiency of an episode is 0 for a failure, and for a success
b / max(b, c): c is its cost, b the best known cost from its start. Policies are ranked by its mean.
`mean`, `best` (known) and `bound` (of theory) are means of the cost over the starts from which the
policy succeeded, `gap` is how far the first is above the last.

![Efficiency of all policies in all environments](leaderboard.png)
"""
_APART = """## Not ranked

Other tasks and starts than those of the evaluation set, parts of it, and what is not proven.
"""
_ALL = """Over all environments and training seeds: the interquartile mean of the efficiencies, with
a 95 % interval by stratified bootstrap over the seeds where all have several (Agarwal et al. 2021,
arXiv:2108.13264).
"""


def write_leaderboard(folder: Path, packaged: bool = False) -> str:
    """Write `leaderboard.md` and `leaderboard.png` of all results below a folder.

    Args:
        folder: Folder of the results, and of what is written.
        packaged: Whether what comes with the package has rows too: published policies, and those
            that need no training.

    Returns:
        The page.

    Raises:
        ConfigError: No result below the folder.
        DependencyNotInstalled: matplotlib is missing.
    """
    require_matplotlib()
    rows = [*map(row_of, read_results(folder)), *(packaged_rows() if packaged else [])]
    if not rows:
        raise ConfigError(
            f"folder = {folder}; expected results below it, of `rigid-envs evaluate --out` or "
            "`Evaluation.save`"
        )
    rows = sorted_rows(rows)
    text = markdown(rows)
    write_atomic(folder / "leaderboard.md", text)
    buffer = io.BytesIO()
    draw([row for row in rows if row.unranked is None]).savefig(buffer, format="png")
    write_atomic(folder / "leaderboard.png", buffer.getvalue())
    return text


def read_results(folder: Path) -> list[Evaluation]:
    """All results below a folder, beside what is known best and what theory says now.

    Args:
        folder: Where to look for JSON files; what is no result is left out.

    Raises:
        DamagedFileError: No JSON, or a result that `read_evaluation` refuses.
    """
    found = []
    for path in sorted(folder.rglob("*.json")):
        content = read_json(path, _LIMIT)
        if isinstance(content, dict) and _is_row(content):
            evaluation = read_evaluation(path, anew=True)
            if evaluation.env_id in ENVIRONMENTS:
                found.append(evaluation)
    return found


def _is_row(content: Mapping[str, Any]) -> bool:
    """Whether this is a result, of any version, or was one before its format was damaged."""
    kind, _, _ = FORMAT.rpartition(" ")
    return str(content.get("format")).startswith(kind) or {"starts", "sha256"} <= content.keys()


def markdown(results: Sequence[Row]) -> str:
    """The page: the plot, the tables, and under them where their numbers come from.

    Args:
        results: In the order of the rows.
    """
    ranked = [row for row in results if row.unranked is None]
    overall = [("policy", "environments", "runs", "efficiency", "95 %"),
               ("---", *["---:"] * 4), *_overall(ranked)]  # fmt: skip
    sides = ("---", "---", *["---:"] * 4, "---", *["---:"] * 4)
    rows = [_HEADER, sides, *map(_cells, ranked)]
    notes = "\n".join(dict.fromkeys(in_markdown(row.source) for row in results))
    apart = _apart([row for row in results if row.unranked is not None])
    return f"{_INTRODUCTION}\n{_ALL}\n{_table(overall)}\n\n{_table(rows)}\n\n{apart}{notes}\n"


def _apart(results: Sequence[Row]) -> str:
    """Table of the rows that are not ranked, with the reasons; nothing without any."""
    if not results:
        return ""
    cells = [(*_cells(row)[:4], in_markdown(row.unranked or "")) for row in results]
    rows = [(*_HEADER[:4], "why"), ("---", "---", "---:", "---:", "---"), *cells]
    return f"{_APART}\n{_table(rows)}\n\n"


def _overall(results: Sequence[Row]) -> list[tuple[str, ...]]:
    """Aggregates of each kind of policy, the best first."""
    kinds: dict[str, dict[str, list[float]]] = {}
    for each in results:
        assert each.efficiency is not None  # as of all that are ranked
        runs = kinds.setdefault(kind_of(each), {})
        runs.setdefault(each.env_id, []).append(each.efficiency.mean)
    found = []
    for name, runs in kinds.items():
        by_id, n = list(runs.values()), sum(map(len, runs.values()))
        ends = "-"
        if all(len(each) > 1 for each in by_id):  # one run says nothing about others
            ends = "{:.3f} .. {:.3f}".format(*stratified_bootstrap(interquartile_mean, by_id))
        found.append((interquartile_mean(by_id), name, len(by_id), n, ends))
    return [
        (in_markdown(name), str(n_ids), str(n), f"{mean:.3f}", ends)
        for mean, name, n_ids, n, ends in sorted(found, reverse=True)
    ]


def _table(rows: Sequence[Sequence[str]]) -> str:
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _cells(result: Row) -> tuple[str, ...]:
    success, found, cost = result.success, result.efficiency, result.cost
    unit = f" [{in_markdown(cost.unit)}]" if cost is not None and cost.unit else ""
    return (
        f"`{result.env_id.split('/')[-1]}`",
        in_markdown(result.policy),
        f"{100 * success.mean:.1f} %",
        f"{100 * success.low:.1f} .. {100 * success.high:.1f}",
        "-" if found is None else f"**{found.mean:.3f}**",
        "-" if found is None else f"{found.low:.3f} .. {found.high:.3f}",
        f"{'cost' if cost is None else cost.name}{unit}",
        *("-" if np.isnan(mean) else f"{mean:.4g}" for mean in result.means),
        "-" if result.gap is None else f"{100 * result.gap:.1f} %",
    )
