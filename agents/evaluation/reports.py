"""Evaluation of a policy on unseen starts, and its report."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from rigid_envs.base.checks import Array
from rigid_envs.base.files import file_digest, in_plot, write_atomic, write_document
from rigid_envs.scores import evaluation
from rigid_envs.scores.comparison import draw_band, save_figure
from rigid_envs.scores.leaderboard import INK, MUTED, dress, file_of, look, new_figure
from rigid_envs.scores.result import Evaluation, rates_of
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, Cost
from rigid_envs.scores.statistics import wilson_interval
from rigid_envs.scores.trained import load
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli.words import tell
from rigid_envs.tools.pages import tables

from ..config.entries import PLACES, Config, config_to_dict
from ..environments import make
from ..storage.logs import read_evaluations, read_rows
from ..storage.runs import Run, manifest
from .showing import try_film

# Evaluation of a policy: one episode from each of many fixed starts, all at once.


def evaluate(
    policy: Any,
    env_id: str,
    n: int = 500,
    seed: int = TEST_SEED,
    env_kwargs: Mapping[str, Any] | None = None,
    **named: Any,
) -> Evaluation:
    """Evaluate as `rigid_envs.evaluate` does, also in native environments of other packages.

    Args:
        policy: See `rigid_envs.evaluate`; None plays at random.
        env_id: The environment.
        n: Number of starts.
        seed: Seed that the starts are spawned from.
        env_kwargs: Hyperparameters of the task.
        **named: See `rigid_envs.evaluate`: `name`, `progress`.
    """
    venv, own = make(env_id, env_kwargs or {}, n), env_id.rpartition(":")[2]
    try:
        return evaluation.evaluate(
            own if own in ENVIRONMENTS else env_id,
            "random" if policy is None else policy,
            n=n,
            seed=seed,
            env=venv,
            **named,
        )
    finally:
        venv.close()


# Report of an evaluation: the policy beside the random baseline, as table, JSON and CSV.


def report(path: Path, n: int, seed: int, quiet: bool = False) -> tuple[dict[str, Any], Evaluation]:
    """Evaluate a policy file and the random policy on the same starts.

    Args:
        path: The policy file.
        n: Number of starts.
        seed: Seed of the starts.
        quiet: Whether no progress is shown.

    Returns:
        A row of the leaderboard without its starts, and where it comes from, as JSON values; and
        the evaluation.
    """
    policy = load(path)
    document, progress = policy.document, (lambda _: None) if quiet else tell
    where = document["env_id"], n, seed, document["env_kwargs"]
    found = evaluate(policy, *where, name=document["algo"], progress=progress)
    baseline = evaluate(None, *where, progress=progress)
    progress("")
    row = {
        **{key: value for key, value in found.row().items() if key not in ("starts", "sha256")},
        "random_policy": baseline.summary(),
        **manifest(),
        "command": " ".join([Path(sys.executable).name, "-m", "agents", *sys.argv[1:]]),
        "training_seed": document["seed"],
        "training_timesteps": document["timesteps"],
        "policy_sha256": file_digest(path),
    }
    return row, found


def conclude(run: Run, timesteps: int, seconds: float, quiet: bool = False) -> dict[str, Any]:
    """Evaluate the best policy of a run, and write figures, learning curve and film into it.

    Args:
        run: A complete run.
        timesteps: Its steps.
        seconds: Time spent on it.
        quiet: Whether no progress is shown.

    Returns:
        The figures of `report`, where `training_timesteps` is the age of that policy, and of all
        the training `run_timesteps` and `training_seconds`.
    """
    path = run / "best_model" / "policy.safetensors"
    figures, found = report(path, N_STARTS, TEST_SEED, quiet)
    figures["run_timesteps"] = timesteps
    figures["training_seconds"] = round(seconds, 3)
    write_report(run.folder, figures, found)
    draw_learning_curve(run)
    try_film(load(path), run.folder, TEST_SEED)
    return figures


def write_report(folder: Path, row: dict[str, Any], found: Evaluation) -> None:
    """Write `results.json`, and `episodes.csv` with one row per start.

    Args:
        folder: Folder of the files.
        row: From `report`.
        found: From `report`.
    """
    bounds = [""] * found.n if found.bounds is None else found.bounds.tolist()
    columns = zip(
        found.seeds,
        found.successes.astype(int).tolist(),
        found.values["return"].tolist(),
        found.values["length"].astype(int).tolist(),
        found.costs.tolist(),
        bounds,
        strict=True,
    )
    lines = ["seed,is_success,return,length,cost,bound", *(",".join(map(str, c)) for c in columns)]
    write_atomic(folder / "episodes.csv", "\n".join(lines) + "\n")
    write_document(folder / "results.json", found.row() | row)


def table(row: dict[str, Any]) -> str:
    """Figures of `report` as an aligned table."""
    policy, baseline = row["policy"], row["random_policy"]
    cost = Cost(*(row["cost"] or ("cost", "", 0.0)))
    header = ("", "success", "95 %", "efficiency", "95 %", cost.title,
              "best", "bound", "return")  # fmt: skip
    rows = [_row(row["algo"], policy), _row("random policy", baseline)]
    title = f"{row['env_id']}: {policy['episodes']} unseen starts, one episode from each"
    figures = tables.table(header, rows, "<" + ">" * (len(header) - 1), indent=0)
    note = f"{cost.name}, best known and bound: means over the starts that succeeded"
    return f"{title}\n\n{figures}\n\n{note}"


def _row(name: str, figures: dict[str, Any]) -> tuple[str, ...]:
    means = [figures[f"{key}_mean"] for key in ("cost", "best", "bound", "return")]
    return name, *rates_of(figures), *("-" if mean is None else f"{mean:.3f}" for mean in means)


# The learning curve of a run.

_HELD_OUT, _TRAINING = "#1f5fbf", "#c9772b"


def draw_learning_curve(run: Run) -> Path:
    """Draw success and return against steps, in training and on the held-out starts.

    Args:
        run: A run with `progress.csv` and `evaluations.npz`.

    Returns:
        The picture, `learning_curve.png`.
    """
    rows = read_rows(run / "progress.csv")
    held_out = read_evaluations(run / "evaluations.npz")
    config = run.config()
    figure = new_figure(8.0, 6.4, 150)
    top, bottom = figure.subplots(2, 1, sharex=True)
    _draw_success(top, rows, held_out)
    _draw_return(bottom, rows, held_out)
    top.set_title(
        f"{config.env_id}   {config.algo.upper()}   seed {config.seed}",
        loc="left", fontsize=12, color=INK, pad=26,
    )  # fmt: skip
    bottom.set_xlabel("environment steps", color=MUTED)
    bottom.xaxis.set_major_formatter(FuncFormatter(short_number))
    bottom.xaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 2.5, 5, 10]))
    bottom.set_xlim(0, 1.02 * held_out["timesteps"].max(initial=1))
    figure.align_ylabels()
    path = run / "learning_curve.png"
    write_atomic(path, file_of(figure))
    return path


def _draw_success(axes: Axes, rows: Sequence[dict[str, str]], held_out: dict[str, Any]) -> None:
    steps, wins = held_out["timesteps"], held_out["successes"]
    ends = np.array([wilson_interval(int(row.sum()), len(row)) for row in wins])
    axes.plot(*_column(rows, "rollout/success_rate", 100), color=_TRAINING, lw=1.3, alpha=0.9,
              label="training, last 500 episodes")  # fmt: skip
    axes.fill_between(steps, *(100 * ends.T), color=_HELD_OUT, alpha=0.15, lw=0)
    axes.plot(steps, 100 * wins.mean(axis=1), color=_HELD_OUT, lw=2, marker="o", ms=3.5,
              label=f"{wins.shape[1]} held-out starts, 95 % interval")  # fmt: skip
    axes.set_ylim(-3, 103)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0f} %"))
    dress(axes, "success")
    axes.legend(
        loc="lower left", bbox_to_anchor=(-0.01, 1.0), ncols=2, frameon=False, fontsize=9,
        labelcolor=MUTED, borderaxespad=0.2, handlelength=1.6,
    )  # fmt: skip


def _draw_return(axes: Axes, rows: Sequence[dict[str, str]], held_out: dict[str, Any]) -> None:
    steps, results = held_out["timesteps"], held_out["results"]
    low, high = np.quantile(results, [0.25, 0.75], axis=1)
    axes.plot(*_column(rows, "rollout/ep_rew_mean"), color=_TRAINING, lw=1.3, alpha=0.9)
    axes.fill_between(steps, low, high, color=_HELD_OUT, alpha=0.15, lw=0)
    axes.plot(steps, results.mean(axis=1), color=_HELD_OUT, lw=2, marker="o", ms=3.5)
    axes.annotate("band: middle half of the episodes", (0.99, 0.04), xycoords="axes fraction",
                  ha="right", fontsize=9, color=MUTED)  # fmt: skip
    dress(axes, "return of an episode")


def _column(
    rows: Sequence[dict[str, str]], name: str, scale: float = 1.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    points = [(float(row["time/total_timesteps"]), float(row[name])) for row in rows if row[name]]
    steps, values = np.array(points).reshape(-1, 2).T
    return steps, scale * values


# Learning curves of several trainings in one plot.

Curve = tuple[Array | Sequence[float], Array | Sequence[float]]
"""Steps, and rates of success on held-out starts, of one training, each of shape (k,)."""

_LONG_AXIS = 100.0  # times as many steps at its end as at its beginning


def draw_curves(axes: Axes, runs: Mapping[str, Sequence[Curve]], colours: Sequence[str]) -> None:
    """Draw mean rates of success against steps, with their intervals where there are several.

    Args:
        axes: The plot.
        runs: By name the curves of all seeds, drawn as far as all have come.
        colours: Of the policies.
    """
    for (name, curves), colour in zip(runs.items(), colours, strict=True):
        steps, rates = _together(curves)
        style = {"color": colour, "lw": 1.5, "label": name}
        draw_band(axes, steps, lambda drawn: drawn[0].mean(axis=0), [rates], **style)
    axes.set_xscale("log")
    dress(axes, "")
    axes.tick_params(which="both", length=0)
    # With fewer, a short axis holds one of them alone, and the locator marks it at equal distances;
    # with more, those of a long axis overlap.
    first, last = axes.get_xlim()
    marks = (1.0, 2.0, 4.0) if last < _LONG_AXIS * first else (1.0, 3.0)
    axes.xaxis.set_major_locator(LogLocator(subs=marks))
    axes.xaxis.set_major_formatter(FuncFormatter(short_number))
    axes.xaxis.set_minor_formatter(NullFormatter())


def _together(curves: Sequence[Curve]) -> tuple[Array, Array]:
    """Steps (k,) and rates of success (number of seeds, k), as far as all seeds have come."""
    steps = np.unique(np.concatenate([each for each, _ in curves])).astype(np.float64)
    steps = steps[steps <= min(np.max(each) for each, _ in curves)]
    return steps, np.array([np.interp(steps, *curve) for curve in curves])


def draw_runs(runs: Sequence[Run], path: Path) -> Path:
    """Draw the learning curves of runs; those that differ in their seed alone are one curve.

    Args:
        runs: Runs with `evaluations.npz`.
        path: ``NAME.pdf``, ``NAME.svg`` or ``NAME.png``.

    Raises:
        ConfigError: Another ending.
        FileNotFoundError: A run that has not been evaluated yet.
    """
    policies: dict[str, list[Curve]] = {}
    for run, name in zip(runs, _names([run.config() for run in runs]), strict=True):
        found = read_evaluations(run / "evaluations.npz")
        curve = found["timesteps"], found["successes"].mean(axis=1)
        policies.setdefault(in_plot(name), []).append(curve)
    figure = new_figure(6.0, 3.4, 200)
    axes = figure.subplots()
    draw_curves(axes, policies, [look(k)[0] for k in range(len(policies))])
    axes.set_ylabel("success, held-out starts", color=MUTED)
    axes.set_xlabel("environment steps", color=MUTED)
    figure.legend(loc="outside upper left", frameon=False, labelcolor=MUTED)
    return save_figure(figure, path)


def _names(configs: Sequence[Config]) -> list[str]:
    """Algorithm and frame of each, and the entries in which those of the same of both differ."""
    names = []
    entries = [config_to_dict(config, (*PLACES, "seed")) for config in configs]
    kinds = [f"{config.algo} {config.frame}".removesuffix(" world") for config in configs]
    for own, kind in zip(entries, kinds, strict=True):
        like = [each for each, other in zip(entries, kinds, strict=True) if other == kind]
        more = [f"{key} {own[key]}" for key in own if any(each[key] != own[key] for each in like)]
        names.append(", ".join([kind, *more]))
    return names


def short_number(value: float, _: object = None) -> str:
    """A number of steps as 3 M or 200 k."""
    for size, letter in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if abs(value) >= size:
            return f"{value / size:g} {letter}"
    return f"{value:g}"
