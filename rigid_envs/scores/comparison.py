"""Policies from the same starts: table, figure, intervals and tests of their differences."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rigid_envs.base.checks import Array, ConfigError, printable, require
from rigid_envs.base.files import in_plot, latex_table, write_atomic
from rigid_envs.envs.display import needed
from rigid_envs.envs.lookup import SEEN
from rigid_envs.scores import statistics
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.leaderboard import INK, MUTED, dress, file_of, look, new_figure
from rigid_envs.scores.result import Estimate, Evaluation
from rigid_envs.scores.trained import is_trained, load

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

AGGREGATES: dict[str, Callable[[statistics.Runs], float]] = {
    "IQM": statistics.interquartile_mean,
    "median": lambda runs: float(np.median(np.concatenate(list(runs)))),
    "mean": lambda runs: float(np.mean(np.concatenate(list(runs)))),
    "optimality gap": statistics.optimality_gap,
}
"""Aggregates over starts; IQM is the interquartile mean. Source: see `statistics`."""

_ROUNDING = 1e-9  # two that differ by less have the same score


class Pair(NamedTuple):
    """A policy and another one, from the same starts.

    Attributes:
        difference: Mean of the scores of the first less those of the second, with the interval of
            the paired bootstrap: starts are drawn, each with both scores.
        improvement: Probability that the first is better from a start, a tie is half; likewise.
        better: Number of starts from which the first is better.
        worse: Number of starts from which it is worse.
        p: Of the two-sided sign test of these, ties left out.
    """

    difference: Estimate
    improvement: Estimate
    better: int
    worse: int
    p: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """Evaluations of several policies from the same starts of one task.

    A score is the efficiency of an episode; or its success where no best is known, as in a task
    with other settings. All intervals are of 95 % and over the starts: they say how certain the
    figures of these policies are, and nothing of other trainings.

    Attributes:
        evaluations: By the name of the policy.
    """

    evaluations: Mapping[str, Evaluation]

    def __post_init__(self) -> None:
        """Refuse evaluations that cannot stand beside each other.

        Raises:
            ValueError: Of other environments, settings or starts than the first.
        """
        first = next(iter(self.evaluations.values()))
        for name, each in self.evaluations.items():
            printable(name, "policies")
            expected = f"the id, settings, seed and number of starts of the first: {_task(first)}"
            require(_task(each) == _task(first), _task(each), f"policies: {name}", expected)

    @property
    def measure(self) -> str:
        """What the scores are: "efficiency", or "success" where no best is known."""
        known = [each.efficiencies is not None for each in self.evaluations.values()]
        return "efficiency" if all(known) else "success"

    @property
    def scores(self) -> dict[str, Array]:
        """Score from each start, shape (n,), by policy."""
        known = self.measure == "efficiency"
        return {
            name: np.asarray(each.efficiencies if known else each.values["success"])
            for name, each in self.evaluations.items()
        }

    @cached_property
    def aggregates(self) -> dict[str, dict[str, Estimate]]:
        """Of each policy its `AGGREGATES` by name, with bootstrap intervals."""
        return {
            name: {
                key: Estimate(of([x]), *statistics.stratified_bootstrap(of, [x]))
                for key, of in AGGREGATES.items()
            }
            for name, x in self.scores.items()
        }

    @cached_property
    def pairs(self) -> dict[tuple[str, str], Pair]:
        """Every policy beside every later one."""
        both = itertools.combinations(self.scores.items(), 2)
        return {(one, other): _pair(x - y) for (one, x), (other, y) in both}

    def _tables(self) -> list[list[list[str]]]:
        """Cells of the table of policies and, of several, of that of pairs, below their titles."""
        policies = [["policy", "success [%]", *AGGREGATES]]
        for name, each in self.evaluations.items():
            success = _cell(each.success, 100.0, 1)
            policies.append([name, success, *map(_cell, self.aggregates[name].values())])
        pairs = [[f"{self.measure}, paired", "difference", "P(better)", "better", "worse", "p"]]
        for names, (difference, improvement, better, worse, p) in self.pairs.items():
            told = "< 0.001" if p < 0.001 else f"{p:.3f}"
            cells = [_cell(difference), _cell(improvement), str(better), str(worse), told]
            pairs.append([" - ".join(names), *cells])
        return [policies, pairs] if self.pairs else [policies]

    def __str__(self) -> str:
        """Two small tables."""
        first = next(iter(self.evaluations.values()))
        policies, *pairs = self._tables()
        head = f"{first.env_id}: {self.measure} from {first.n} starts of seed {first.seed}"
        turned = [list(column) for column in zip(*policies, strict=True)]
        return "\n\n".join([f"{head}, 95 % intervals", *map(_aligned, [turned, *pairs])])

    def latex(self, path: str | Path | None = None) -> str:
        """Both tables for LaTeX, with its package booktabs.

        Args:
            path: Where to save them; None does not.
        """
        tables = (latex_table(header, rows) for header, *rows in self._tables())
        text = "\n\n".join(tables) + "\n"
        if path is not None:
            write_atomic(Path(path), text)
        return text

    def figure(self, path: str | Path | None = None) -> Figure:
        """Performance profiles, and means, both with intervals.

        Args:
            path: Where to save it, ``NAME.pdf``, ``NAME.svg`` or ``NAME.png``; None does not.

        Raises:
            ConfigError: Another ending.
            DependencyNotInstalled: matplotlib is missing.
        """
        needed("matplotlib", "the figure of a comparison needs matplotlib")
        figure = new_figure(7.0, 2.6 + 0.2 * len(self.evaluations), 200)
        left, right = figure.subplots(1, 2, width_ratios=(1.2, 1.0))
        runs = {in_plot(name): [x] for name, x in self.scores.items()}
        means = [each["mean"] for each in self.aggregates.values()]
        rows = {f"{name}\n{_cell(x)}": (x.mean, x[1:]) for name, x in zip(runs, means, strict=True)}
        colours = [look(k)[0] for k in range(len(runs))]
        draw_profiles(left, runs, colours, self.measure, "starts")
        draw_intervals(right, rows, colours, f"mean {self.measure}")
        for line, style in zip(left.get_lines(), itertools.cycle(("-", "--", "-.", ":"))):
            line.set_linestyle(style)  # so that they can be told apart without colours
        figure.legend(loc="outside upper left", ncols=4, frameon=False, labelcolor=MUTED)
        if path is not None:
            save_figure(figure, path)
        return figure


def compare(
    env_id: str, policies: Mapping[str, Any], config: Mapping[str, Any] | None = None, **more: Any
) -> Comparison:
    """Play several policies from the same starts.

    Args:
        env_id: Gymnasium's id.
        policies: By name, each as `evaluate` takes it; or what `evaluate` gave of it, from the same
            starts: so each can have its own settings of the observation.
        config: Hyperparameters of the task for all, over the `env_kwargs` of each.
        **more: ``n``, ``seed``, ``progress``: as of `evaluate`.

    Raises:
        ValueError: As `evaluate`; or evaluations of other tasks or starts.
    """
    known = hasattr(policies, "items") and len(policies) > 0
    require(known, policies, "policies", "policies by name, at least one")
    found = {}
    for name, each in policies.items():
        policy = load(each) if isinstance(each, str) and is_trained(each) else each
        if not isinstance(policy, Evaluation):
            own = {**getattr(policy, "env_kwargs", {}), **(config or {})}
            policy = evaluate(env_id, policy, config=own, name=name, **more)
        found[name] = policy
    return Comparison(found)


def _task(found: Evaluation) -> tuple[Any, ...]:
    """What evaluations must have in common: of what is ranked, the task is that of the id."""
    others = {key: value for key, value in found.config.items() if key not in SEEN}
    return found.env_id, {} if found.unranked is None else others, found.seed, found.n


def _pair(differences: Array) -> Pair:
    x = np.where(np.abs(differences) > _ROUNDING, differences, 0.0)
    chance = 0.5 + 0.5 * np.sign(x)
    return Pair(
        Estimate(float(x.mean()), *statistics.mean_interval(x)),
        Estimate(float(chance.mean()), *statistics.mean_interval(chance)),
        int((x > 0.0).sum()),
        int((x < 0.0).sum()),
        statistics.sign_test(x),
    )


def _cell(estimate: Estimate, scale: float = 1.0, digits: int = 3) -> str:
    mean, low, high = (f"{scale * value:.{digits}f}" for value in estimate)
    return f"{mean} [{low}, {high}]"


def _aligned(rows: Sequence[Sequence[str]]) -> str:
    """Columns of one width each, the first on the left, the others on the right."""
    sizes = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ([row[0].ljust(sizes[0]), *map(str.rjust, row[1:], sizes[1:])] for row in rows)
    return "\n".join("  ".join(line).rstrip() for line in lines)


# Figures of scores: profiles and intervals, in any axes; in files that journals take.

KINDS = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}, ".png": {}}
"""Endings of files, with the metadata under which equal figures are equal files."""

Drawn = tuple[float, Sequence[float] | None]
"""A value, and the ends of its interval where that is known."""


def draw_band(
    axes: Axes, at: Array, curve: Callable[..., Array], runs: Sequence[Any], **style: Any
) -> None:
    """Draw a curve over the runs of each id in percent, with its interval where there are several.

    Args:
        axes: The plot.
        at: Where the points of the curve are, shape (k,).
        curve: Of the runs, shape (k,).
        runs: One array for each id, its first axis that of the runs.
        **style: Of the line.
    """
    if all(len(each) > 1 for each in runs):
        low, high = statistics.stratified_band(curve, runs, n_resamples=500)
        axes.fill_between(at, 100 * low, 100 * high, color=style["color"], alpha=0.2, lw=0)
    axes.plot(at, 100 * curve(runs), **style)
    axes.set_ylim(-3, 103)
    axes.yaxis.set_major_formatter("{x:.0f} %")


def draw_profiles(
    axes: Axes, policies: Mapping[str, statistics.Runs], colours: Sequence[str], label: str, of: str
) -> None:
    """Draw the share of runs above each score from 0 to 1, with its interval.

    Args:
        axes: The plot.
        policies: Scores of each policy, by id and run; the interval is drawn of several runs.
        colours: Of the policies.
        label: What the scores are.
        of: What the runs are.
    """
    at = np.linspace(0.0, 1.0, 101)
    profile = partial(statistics.performance_profile, thresholds=at)
    for (name, runs), colour in zip(policies.items(), colours, strict=True):
        draw_band(axes, at, profile, runs, color=colour, lw=1.8, label=name)
    dress(axes, f"share of {of} above it")
    axes.set_xlabel(label, color=MUTED)


def draw_intervals(
    axes: Axes, rows: Mapping[str, Drawn], colours: Sequence[str], label: str
) -> None:
    """Draw values with their intervals where these are known, one under the other, from 0 to 1.

    Args:
        axes: The plot.
        rows: By name.
        colours: Of the rows.
        label: What the values are.
    """
    for k, (value, ends) in enumerate(rows.values()):
        if ends is not None:
            axes.plot(ends, [-k, -k], color=colours[k], lw=6, alpha=0.3, solid_capstyle="butt")
        axes.plot([value], [-k], "o", color=colours[k], ms=6, clip_on=False)
    axes.set_yticks([-k for k in range(len(rows))], list(rows), color=INK)
    axes.set_ylim(0.6 - len(rows), 0.6)
    axes.set_xlim(-0.02, 1.02)
    dress(axes, "")
    axes.set_xlabel(label, color=MUTED)


def save_figure(figure: Figure, path: str | Path) -> Path:
    """Write a figure, atomically, in the format that the ending of the file says.

    Letters are letters in a PDF (TrueType), and equal figures give equal files.

    Args:
        figure: The figure.
        path: ``NAME.pdf``, ``NAME.svg`` or ``NAME.png``.

    Raises:
        ConfigError: Another ending.
    """
    import matplotlib

    file = Path(path)
    if file.suffix not in KINDS:
        raise ConfigError(f"path = {str(path)!r}; expected a name with one of {', '.join(KINDS)}")
    with matplotlib.rc_context({"pdf.fonttype": 42, "svg.hashsalt": "rigid-envs"}):
        write_atomic(file, file_of(figure, file.suffix[1:], KINDS[file.suffix]))
    return file
