"""Figures of the baselines: learning curves, aggregates, profiles, probabilities of improvement."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray

from rigid_envs.catalogue import families
from rigid_envs.files import write_atomic
from rigid_envs.leaderboard.escaping import in_plot
from rigid_envs.leaderboard.style import INK, MUTED, dress, look
from rigid_envs.scores.aggregates import (
    interquartile_mean,
    performance_profile,
    probability_of_improvement,
    stratified_band,
)
from rigid_envs.scores.records import Record

from .baselines import (
    SOLVED,
    Grouped,
    digest_of,
    grouped,
    interval_of,
    markdown,
    pairs,
    pictures,
    policies_of,
    results_of,
)
from .plots import short_number

__all__ = ["write_baselines"]

_COLUMNS = 4
_LONG_AXIS = 100.0  # times as many steps at its end as at its beginning
_RESAMPLES = 500  # of bands, whose ends are seen to a hundredth or so
Array = NDArray[np.float64]


def write_baselines(folder: Path) -> str:
    """Write the page of the records below a folder, beside the folder, and the figures into it.

    Args:
        folder: Folder of records.

    Returns:
        The page.

    Raises:
        ConfigError: There are none.
    """
    groups = grouped(folder)
    about = {"Description": digest_of(groups)}
    for name, figure in zip(pictures(groups), _figures(groups), strict=True):
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", metadata=about)
        write_atomic(folder / f"{name}.png", buffer.getvalue())
    text = markdown(groups, folder.name)
    write_atomic(folder.with_name(f"{folder.name}.md"), text)
    return text


def _figures(groups: Grouped) -> list[Figure]:
    """In the order of `pictures`."""
    ids = {env_id for by_id in groups.values() for env_id in by_id}
    own = [[env_id for env_id in members if env_id in ids] for members in families().values()]
    figures = [_draw_aggregates(groups), _draw_profiles(groups)]
    figures += [_draw_improvement(groups)] if len(groups) > 1 else []
    return figures + [_draw_curves(groups, members) for members in own if members]


def _new(width: float, height: float) -> Figure:
    return Figure(figsize=(width, height), dpi=110, layout="constrained", facecolor="white")


def _draw_curves(groups: Grouped, ids: Sequence[str]) -> Figure:
    """Success on held-out starts against steps, a panel for each id."""
    columns = min(_COLUMNS, len(ids))
    rows = -(-len(ids) // columns)
    figure = _new(2.75 * columns, 0.5 + 2.2 * rows)
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
    for name, records in policies_of(groups, env_id).items():
        steps, rates = _curves(records)
        colour = _colour(groups, name)
        if len(records) > 1:
            low, high = stratified_band(_mean_curve, [rates], n_resamples=_RESAMPLES)
            axes.fill_between(steps, 100 * low, 100 * high, color=colour, alpha=0.2, lw=0)
        axes.plot(steps, 100 * rates.mean(axis=0), color=colour, lw=1.5)
    axes.axhline(100 * SOLVED, color=MUTED, lw=0.6, ls=":")
    axes.set_title(env_id.rpartition("/")[2].removesuffix("-v0"), loc="left", fontsize=9, color=INK)
    axes.set_ylim(-3, 103)
    axes.set_xscale("log")
    dress(axes, "")
    axes.tick_params(which="both", labelsize=7, length=0)
    # With fewer, a short axis holds one of them alone, and the locator marks it at equal distances;
    # with more, those of a long axis overlap.
    first, last = axes.get_xlim()
    marks = (1.0, 2.0, 4.0) if last < _LONG_AXIS * first else (1.0, 3.0)
    axes.xaxis.set_major_locator(LogLocator(subs=marks))
    axes.xaxis.set_major_formatter(FuncFormatter(short_number))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0f} %"))


def _curves(records: Sequence[Record]) -> tuple[Array, Array]:
    """Steps (k,) and rates of success (number of seeds, k), as far as all seeds have come."""
    curves = [record.curve for record in records]
    steps = np.unique(np.concatenate([curve["timesteps"] for curve in curves])).astype(np.float64)
    steps = steps[steps <= min(max(curve["timesteps"]) for curve in curves)]
    each = [np.interp(steps, curve["timesteps"], curve["success_rate"]) for curve in curves]
    return steps, np.array(each)


def _mean_curve(runs: Sequence[Array]) -> Array:
    return np.asarray(runs[0].mean(axis=0))


def _draw_profiles(groups: Grouped) -> Figure:
    """Share of trainings above each efficiency."""
    figure = _new(7.0, 4.2)
    axes = figure.subplots()
    at = np.linspace(0.0, 1.0, 101)
    for name in groups:
        runs, colour = results_of(groups, name), _colour(groups, name)
        if all(len(each) > 1 for each in runs):
            low, high = stratified_band(
                lambda drawn: performance_profile(drawn, at), runs, n_resamples=_RESAMPLES
            )
            axes.fill_between(at, 100 * low, 100 * high, color=colour, alpha=0.2, lw=0)
        share = 100 * performance_profile(runs, at)
        axes.plot(at, share, color=colour, lw=1.8, label=_with_count(groups, name))
    dress(axes, "share of trainings above it")
    axes.set_xlabel("efficiency", color=MUTED)
    axes.set_ylim(-3, 103)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0f} %"))
    axes.legend(loc="lower left", frameon=False, fontsize=9, labelcolor=MUTED)
    return figure


def _draw_aggregates(groups: Grouped) -> Figure:
    """Interquartile mean of the efficiencies of each policy."""
    rows = {}
    for name in groups:
        runs = results_of(groups, name)
        ends = interval_of(interquartile_mean, runs, n_resamples=_RESAMPLES)
        rows[_with_count(groups, name)] = interquartile_mean(runs), ends
    colours = [_colour(groups, name) for name in groups]
    return _draw_intervals(rows, colours, "interquartile mean of the efficiency")


def _draw_improvement(groups: Grouped) -> Figure:
    """Probability that one policy does better than another."""
    rows, colours = {}, []
    for one, other, ids in pairs(groups):
        runs = results_of(groups, one, ids), results_of(groups, other, ids)
        ends = interval_of(probability_of_improvement, *runs, n_resamples=_RESAMPLES)
        rows[f"{in_plot(one)} > {in_plot(other)} ({len(ids)})"] = (
            probability_of_improvement(*runs),
            ends,
        )
        colours.append(_colour(groups, one))
    figure = _draw_intervals(rows, colours, "probability of improvement")
    figure.axes[0].axvline(0.5, color=MUTED, lw=0.8, ls=":")
    return figure


def _draw_intervals(
    rows: Mapping[str, tuple[float, tuple[float, float] | None]],
    colours: Sequence[str],
    label: str,
) -> Figure:
    """Values with their intervals where these are known, one under the other, from 0 to 1."""
    figure = _new(7.0, 1.0 + 0.34 * len(rows))
    axes = figure.subplots()
    for k, ((value, ends), colour) in enumerate(zip(rows.values(), colours, strict=True)):
        if ends is not None:
            axes.plot(ends, [-k, -k], color=colour, lw=6, alpha=0.3, solid_capstyle="butt")
        axes.plot([value], [-k], "o", color=colour, ms=6)
    axes.set_yticks([-k for k in range(len(rows))], list(rows), color=INK)
    axes.set_ylim(0.6 - len(rows), 0.6)
    axes.set_xlim(-0.02, 1.02)
    dress(axes, "")
    axes.set_xlabel(label, color=MUTED)
    return figure


def _colour(groups: Grouped, name: str) -> str:
    return look(list(groups).index(name))[0]


def _with_count(groups: Grouped, name: str) -> str:
    count = len(groups[name])
    return f"{in_plot(name)} ({count} environment{'s' if count > 1 else ''})"
