"""Results of policies in one table and one plot."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import in_markdown, in_plot, markdown_table, write_atomic
from rigid_envs.envs.display import needed
from rigid_envs.envs.lookup import task_of
from rigid_envs.scores.best import best_known
from rigid_envs.scores.evaluation import published_evaluation
from rigid_envs.scores.records import read_results
from rigid_envs.scores.result import Evaluation, interval, rates_of
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, VERSION, Cost, cost_of
from rigid_envs.scores.statistics import estimate, interquartile_mean
from rigid_envs.scores.trained import published
from rigid_envs.tasks.registry import ENVIRONMENTS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# Rows of the leaderboard: of evaluations, of published policies, of what needs no training.


class Row(NamedTuple):
    """A row of the leaderboard.

    Attributes:
        env_id: Gymnasium's id.
        policy: Who acted.
        figures: Those of `Evaluation.figures`.
        cost: What an episode costs.
        source: Starts, versions and commit.
        unranked: Why it is listed apart; None if it is ranked.
    """

    env_id: str
    policy: str
    figures: Mapping[str, Any]
    cost: Cost
    source: str
    unranked: str | None


def row_of(found: Evaluation) -> Row:
    """The row of an evaluation; of a part of the starts it is not ranked: they may be easy ones."""
    unranked = found.unranked or ("no best is known" if found.efficiencies is None else None)
    if found.unranked is None and found.n != N_STARTS:
        unranked = f"n = {found.n}; expected all {N_STARTS} starts"
    source = _source(found.n, found.seed, found.provenance)
    assert found.cost is not None  # of an id that has a record
    return Row(found.env_id, found.policy, found.figures(), found.cost, source, unranked)


def packaged_rows() -> list[Row]:
    """Rows of what comes with the package: published policies, and those without training."""
    rows = [row_of(published_evaluation(name)) for name in published()]
    for env_id in ENVIRONMENTS:
        if (known := best_known(env_id)) is not None:
            cost = cost_of(env_id, task_of(env_id))
            source = _source(len(known.costs), TEST_SEED, known.provenance)
            rows += [Row(env_id, *each, cost, source, None) for each in known.policies.items()]
    return rows


def _source(n: int, seed: int, where: Mapping[str, Any]) -> str:
    commit = "no commit" if where["git_commit"] is None else f"commit {where['git_commit'][:12]}"
    return (
        f"{n} starts of seed {seed}, evaluation set {VERSION}; rigid-envs "
        f"{where['versions']['rigid-envs']}, kernels {where['kernel_hash']}, {commit}"
        f"{' with changes' if where['git_dirty'] else ''}."
    )


def sorted_rows(rows: Sequence[Row]) -> list[Row]:
    """By environment, the most efficient first."""
    known = list(ENVIRONMENTS)
    return sorted(rows, key=lambda row: (known.index(row.env_id), -_rank(row)))


def kind_of(row: Row) -> str:
    """Legend entry: reference controllers, whose names differ by environment, share one."""
    best = next(iter(ENVIRONMENTS[row.env_id].controllers), None)
    return "reference controller" if row.policy == best else row.policy


def _rank(row: Row) -> float:
    efficiency = row.figures["efficiency"]
    return -1.0 if efficiency is None else float(efficiency)


# Looks of the plots of policies: colours, markers, grid.

INK, MUTED, _GRID = "#22272e", "#6b7480", "#e3e7ec"
_COLOURS = ("#1f5fbf", "#c9772b", "#3a8f5c", "#8a4fbf", "#b8383d", "#2a9aa8", "#7a7f2b", "#6b7480")
_MARKERS = "osD^v"


def look(k: int) -> tuple[str, str]:
    """Colour and marker of the k-th of many policies; no two of the first 40 look the same."""
    rounds, colour = divmod(k, len(_COLOURS))
    return _COLOURS[colour], _MARKERS[rounds % len(_MARKERS)]


def new_figure(width: float, height: float, dpi: int) -> Figure:
    """An empty figure, its size in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), dpi=dpi, layout="constrained", facecolor="white")


def dress(axes: Axes, label: str) -> None:
    """Give a plot our looks.

    Args:
        axes: The plot.
        label: What its vertical axis shows.
    """
    axes.set_ylabel(label, color=MUTED)
    axes.grid(True, color=_GRID, lw=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(colors=MUTED, length=0)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.spines["bottom"].set_color(_GRID)


def file_of(figure: Figure, kind: str = "png", about: Mapping[str, Any] | None = None) -> bytes:
    """What a file of a figure holds.

    Args:
        figure: The figure.
        kind: Format, as matplotlib calls it.
        about: Metadata.
    """
    buffer = io.BytesIO()
    figure.savefig(buffer, format=kind, metadata=about)
    return buffer.getvalue()


# The plot of the leaderboard.


def draw(results: Sequence[Row]) -> Figure:
    """One line for each environment, with the efficiency of each policy and its interval.

    Args:
        results: Ranked ones, in the order of the lines.
    """
    ids = list(dict.fromkeys(each.env_id for each in results))
    names = list(dict.fromkeys(map(kind_of, results)))
    figure = new_figure(8.0, 1.4 + 0.36 * len(ids), 150)
    axes = figure.subplots()
    for k, name in enumerate(names):
        own = [each for each in results if kind_of(each) == name]
        figures = np.array([(r.figures["efficiency"], *r.figures["efficiency_95"]) for r in own])
        at = [-ids.index(r.env_id) - 0.5 * (k / max(len(names) - 1, 1) - 0.5) for r in own]
        colour, marker = look(k)
        axes.hlines(at, figures[:, 1], figures[:, 2], color=colour, lw=1.6, alpha=0.6)
        axes.plot(figures[:, 0], at, marker, ms=4.5, color=colour, label=in_plot(name))
    axes.set_yticks([-k for k in range(len(ids))], [i.split("/")[-1] for i in ids], color=INK)
    axes.set_xlim(-0.02, 1.02)
    dress(axes, "")
    axes.set_xlabel("efficiency", color=MUTED)
    if names:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=8,
                    labelcolor=MUTED)  # fmt: skip
    return figure


# Leaderboard: all results below a folder in one table and one plot.

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
    needed("matplotlib", "the plot of the leaderboard needs matplotlib")
    rows = [*map(row_of, read_results(folder)), *(packaged_rows() if packaged else [])]
    if not rows:
        raise ConfigError(
            f"folder = {folder}; expected results below it, of `rigid-envs evaluate --out` or "
            "`Evaluation.save`"
        )
    rows = sorted_rows(rows)
    text = markdown(rows)
    write_atomic(folder / "leaderboard.md", text)
    figure = draw([row for row in rows if row.unranked is None])
    write_atomic(folder / "leaderboard.png", file_of(figure))
    return text


def markdown(results: Sequence[Row]) -> str:
    """The page: the plot, the tables, and under them where their numbers come from.

    Args:
        results: In the order of the rows.
    """
    ranked = [row for row in results if row.unranked is None]
    header = ("policy", "environments", "runs", "efficiency", "95 %")
    overall = markdown_table(header, _overall(ranked), "<>>>>")
    table = markdown_table(_HEADER, map(_cells, ranked), "<<>>>><>>>>")
    notes = "\n".join(dict.fromkeys(f"- {in_markdown(row.source)}" for row in results))
    apart = _apart([row for row in results if row.unranked is not None])
    sources = f"## Where the figures come from\n\n{notes}"
    return f"{_INTRODUCTION}\n{_ALL}\n{overall}\n\n{table}\n\n{apart}{sources}\n"


def _apart(results: Sequence[Row]) -> str:
    """Table of the rows that are not ranked, with the reasons; nothing without any."""
    if not results:
        return ""
    cells = [(*_cells(row)[:4], in_markdown(row.unranked or "")) for row in results]
    return f"{_APART}\n{markdown_table((*_HEADER[:4], 'why'), cells, '<<>><')}\n\n"


def _overall(results: Sequence[Row]) -> list[tuple[str, ...]]:
    """Aggregates of each kind of policy, the best first."""
    kinds: dict[str, dict[str, list[float]]] = {}
    for each in results:
        runs = kinds.setdefault(kind_of(each), {})
        runs.setdefault(each.env_id, []).append(each.figures["efficiency"])
    found = []
    for name, runs in kinds.items():
        by_id, n = list(runs.values()), sum(map(len, runs.values()))
        mean, ends = estimate(interquartile_mean, by_id)
        found.append((mean, name, len(by_id), n, interval(ends)))
    return [
        (in_markdown(name), str(n_ids), str(n), f"{mean:.3f}", ends)
        for mean, name, n_ids, n, ends in sorted(found, reverse=True)
    ]


def _cells(result: Row) -> tuple[str, ...]:
    figures, cost = result.figures, result.cost
    success, interval, efficiency, ends = rates_of(figures)
    means = [figures[name] for name in ("cost_mean", "best_mean", "bound_mean")]
    return (
        f"`{result.env_id.split('/')[-1]}`",
        in_markdown(result.policy),
        success,
        interval,
        f"**{efficiency}**",
        ends,
        cost._replace(unit=in_markdown(cost.unit)).title,
        *("-" if mean is None else f"{mean:.4g}" for mean in means),
        "-" if figures["gap"] is None else f"{100 * figures['gap']:.1f} %",
    )
