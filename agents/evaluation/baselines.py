"""The page of baselines and its figures."""

import hashlib
import itertools
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import in_markdown, in_plot, markdown_table, write_atomic
from rigid_envs.envs.lookup import families, task_of
from rigid_envs.scores import statistics
from rigid_envs.scores.comparison import Drawn, draw_intervals, draw_profiles
from rigid_envs.scores.leaderboard import INK, MUTED, file_of, look, new_figure
from rigid_envs.scores.records import Record, read_records
from rigid_envs.scores.result import Evaluation, interval
from rigid_envs.scores.starts import cost_of
from rigid_envs.tasks.registry import ENVIRONMENTS

from .reports import draw_curves

# The page of the baselines: all records below a folder as tables, and the figures beside them.

Grouped = Mapping[str, Mapping[str, Sequence[Record]]]
"""Records by policy and id, one for each seed."""

SOLVED = 0.99
"""Rate of success from which on an environment counts as solved."""

_INTRODUCTION = Path(__file__).with_suffix(".md")  # how the page begins


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
    means = {name: statistics.interquartile_mean(results_of(found, name)) for name in found}
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


def digest_of(groups: Grouped) -> str:
    """Hash of all that the figures show."""
    digest = hashlib.sha256()
    for name, by_id in groups.items():
        for env_id, records in by_id.items():
            for record in records:
                digest.update(f"{name} {env_id} {record.seed} {_efficiency(record)}".encode())
                digest.update(f"{record.evaluation.success.mean} {dict(record.curve)}".encode())
    return digest.hexdigest()


def markdown(groups: Grouped, folder: str) -> str:
    """The page.

    Args:
        groups: All records.
        folder: Of records and figures, as seen from the page.
    """
    introduction = _INTRODUCTION.read_text(encoding="utf-8").rstrip().format(folder=folder)
    parts = [introduction, "## All environments", _overall(groups)]
    if len(groups) > 1:
        parts += [_IMPROVEMENT, _comparisons(groups)]
    names = [name for name in figures_of(groups) if name in _TITLES]
    parts += [f"![{_TITLES[name]}]({folder}/{name}.png)" for name in names]
    for family, members in families().items():
        rows = [row for env_id in members for row in _rows(groups, env_id)]
        if rows:
            figure = f"![Learning curves: {family}]({folder}/{_curves_of(family)}.png)"
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
    *("cost", "mean", "ratio", "steps", f"CPU to {SOLVED:.0%}", "CPU"),
)


def _overall(groups: Grouped) -> str:
    """One row for each policy: over all environments that it has been trained on."""
    header = ("policy", "environments", "trainings", f"success >= {SOLVED:.0%}", "success",
              "efficiency (IQM)", "95 %", "longest CPU")  # fmt: skip
    rows: list[tuple[str, ...]] = []
    for name, by_id in groups.items():
        rates = [np.mean(_rates(each)) for each in by_id.values()]
        mean, ends = statistics.estimate(statistics.interquartile_mean, results_of(groups, name))
        cpu = max(_cpu(record) for each in by_id.values() for record in each)
        rows.append((
            in_markdown(name),
            str(len(by_id)),
            str(sum(map(len, by_id.values()))),
            f"{sum(rate >= SOLVED for rate in rates)} of {len(by_id)}",
            f"{100 * np.mean(rates):.1f} %",
            f"**{mean:.3f}**",
            interval(ends),
            f"{cpu:.0f} s",
        ))  # fmt: skip
    return _table(header, rows)


def _comparisons(groups: Grouped) -> str:
    rows: list[tuple[str, ...]] = []
    for one, other, ids in pairs(groups):
        runs = results_of(groups, one, ids), results_of(groups, other, ids)
        chance, ends = statistics.estimate(statistics.probability_of_improvement, *runs)
        cells = (str(len(ids)), f"{100 * chance:.0f} %", interval(ends, 100.0))
        rows.append((in_markdown(one), in_markdown(other), *cells))
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
    rows: list[tuple[str, ...]] = []
    for name, records in policies_of(groups, env_id).items():
        rates = _rates(records)
        efficiency = [_efficiency(record) for record in records]
        able = [record.evaluation for record in records if record.successes.any()]
        costs = [found.mean(found.costs) for found in able]
        rows.append((
            f"`{env_id.rpartition('/')[2].removesuffix('-v0')}`",
            in_markdown(name),
            str(len(records)),
            f"{100 * np.mean(rates):.1f} %",
            _interval(rates, 100.0),
            f"**{np.mean(efficiency):.3f}**",
            _interval(efficiency),
            cost.title,
            f"{np.mean(costs):.4g}" if costs else "-",
            f"{np.mean(list(map(_ratio, able))):.2f}" if costs else "-",
            _steps(records),
            _cpu_until_solved(records),
            f"{np.mean([_cpu(record) for record in records]):.0f} s",
        ))  # fmt: skip
    return rows


def _rates(records: Sequence[Record]) -> list[float]:
    return [record.evaluation.success.mean for record in records]


def _efficiency(record: Record) -> float:
    """Mean efficiency of a training; every id of this package has best known costs."""
    found = record.evaluation.efficiencies
    assert found is not None
    return float(found.mean())


def _ratio(found: Evaluation) -> float:
    """Mean cost of the successes over the mean best known cost from the same starts."""
    assert found.best is not None
    return found.mean(found.costs) / float(np.nanmean(found.best[found.successes]))


def _cpu(record: Record) -> float:
    return float(record.training["cpu_seconds"])


def _cpu_until_solved(records: Sequence[Record]) -> str:
    """Mean processor time until the first evaluation on held-out starts that counts as solved."""
    times = []
    for record in records:
        pairs = zip(record.curve["timesteps"], record.curve["success_rate"], strict=True)
        steps = next((steps for steps, rate in pairs if rate >= SOLVED), None)
        if steps is None:
            return "-"
        times.append(_cpu(record) * steps / record.training["timesteps"])
    return f"{np.mean(times):.0f} s"


def _steps(records: Sequence[Record]) -> str:
    steps = float(np.mean([record.training["timesteps"] for record in records]))
    return f"{steps / 1e6:.2f} M" if steps >= 1e6 else f"{steps / 1e3:.0f} k"


def _interval(values: Sequence[float], scale: float = 1.0) -> str:
    return interval(statistics.mean_interval(values) if len(values) > 1 else None, scale)


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    texts = ("environment", "policy", "against", "cost")
    return markdown_table(header, rows, "".join("<" if name in texts else ">" for name in header))


# Figures of the baselines: learning curves, aggregates, profiles, probabilities of improvement.

_COLUMNS = 3
_DPI = 110
_RESAMPLES = 500  # of intervals, whose ends are seen to a hundredth or so


def write_baselines(folder: Path) -> Path:
    """Write the page of the records below a folder, beside the folder, and the figures into it.

    Args:
        folder: Folder of records.

    Returns:
        The page.

    Raises:
        ConfigError: There are none.
    """
    groups = grouped(folder)
    folder = Path(os.path.abspath(folder))  # "." has a name, too
    about = {"Description": digest_of(groups)}
    for name, draw in figures_of(groups).items():
        write_atomic(folder / f"{name}.png", file_of(draw(), about=about))
    page = folder.with_name(f"{folder.name}.md")
    write_atomic(page, markdown(groups, folder.name))
    return page


def figures_of(groups: Grouped) -> dict[str, Callable[[], Figure]]:
    """What draws each figure, by its name: of the suite, and learning curves of each family."""
    drawn = {"aggregates": _draw_aggregates, "profiles": _draw_profiles}
    drawn |= {"improvement": _draw_improvement} if len(groups) > 1 else {}
    figures: dict[str, Callable[[], Figure]]
    figures = {name: partial(draw, groups) for name, draw in drawn.items()}
    for family, members in families().items():
        if own := [env_id for env_id in members if policies_of(groups, env_id)]:
            figures[_curves_of(family)] = partial(_draw_curves, groups, own)
    return figures


def _curves_of(family: str) -> str:
    """Name of the learning curves of a family."""
    return f"curves_{family.lower().replace(' ', '_')}"


def _draw_curves(groups: Grouped, ids: Sequence[str]) -> Figure:
    """Success on held-out starts against steps, a panel for each id."""
    columns = min(_COLUMNS, len(ids))
    rows = -(-len(ids) // columns)
    figure = new_figure(2.75 * columns, 0.5 + 2.2 * rows, _DPI)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for panel, env_id in zip(panels, ids, strict=False):
        _draw_panel(panel, groups, env_id)
    for panel in panels[len(ids) :]:
        panel.set_visible(False)
    shown = [name for name in groups if any(env_id in groups[name] for env_id in ids)]
    handles = [panels[0].plot([], [], color=_colour(groups, name))[0] for name in shown]
    names = [in_plot(name) for name in shown]
    figure.legend(handles, names, loc="outside upper left", ncols=len(shown), frameon=False,
                  fontsize=9, labelcolor=MUTED)  # fmt: skip
    return figure


def _draw_panel(axes: Axes, groups: Grouped, env_id: str) -> None:
    curves = {
        name: [(record.curve["timesteps"], record.curve["success_rate"]) for record in records]
        for name, records in policies_of(groups, env_id).items()
    }
    draw_curves(axes, curves, [_colour(groups, name) for name in curves])
    axes.axhline(100 * SOLVED, color=MUTED, lw=0.6, ls=":")
    axes.set_title(env_id.rpartition("/")[2].removesuffix("-v0"), loc="left", fontsize=9, color=INK)
    axes.tick_params(which="both", labelsize=7, length=0)


def _draw_profiles(groups: Grouped) -> Figure:
    """Share of trainings above each efficiency."""
    figure = new_figure(7.0, 4.2, _DPI)
    axes = figure.subplots()
    runs = {_with_count(groups, name): results_of(groups, name) for name in groups}
    colours = [_colour(groups, name) for name in groups]
    draw_profiles(axes, runs, colours, "efficiency", "trainings")
    axes.legend(loc="lower left", frameon=False, fontsize=9, labelcolor=MUTED)
    return figure


def _draw_aggregates(groups: Grouped) -> Figure:
    """Interquartile mean of the efficiencies of each policy."""
    rows = {}
    for name in groups:
        rows[_with_count(groups, name)] = statistics.estimate(
            statistics.interquartile_mean, results_of(groups, name), n_resamples=_RESAMPLES
        )
    colours = [_colour(groups, name) for name in groups]
    return _draw_rows(rows, colours, "interquartile mean of the efficiency")


def _draw_improvement(groups: Grouped) -> Figure:
    """Probability that one policy does better than another."""
    rows, colours = {}, []
    for one, other, ids in pairs(groups):
        runs = results_of(groups, one, ids), results_of(groups, other, ids)
        rows[f"{in_plot(one)} > {in_plot(other)} ({len(ids)})"] = statistics.estimate(
            statistics.probability_of_improvement, *runs, n_resamples=_RESAMPLES
        )
        colours.append(_colour(groups, one))
    figure = _draw_rows(rows, colours, "probability of improvement")
    figure.axes[0].axvline(0.5, color=MUTED, lw=0.8, ls=":")
    return figure


def _draw_rows(rows: Mapping[str, Drawn], colours: Sequence[str], label: str) -> Figure:
    figure = new_figure(7.0, 1.0 + 0.34 * len(rows), _DPI)
    draw_intervals(figure.subplots(), rows, colours, label)
    return figure


def _colour(groups: Grouped, name: str) -> str:
    return look(list(groups).index(name))[0]


def _with_count(groups: Grouped, name: str) -> str:
    count = len(groups[name])
    return f"{in_plot(name)} ({count} environment{'s' if count > 1 else ''})"
