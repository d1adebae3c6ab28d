"""Leaderboard: all results below a folder in one table and one plot."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigid_envs import ENVIRONMENTS
from rigid_envs.errors import ConfigError
from rigid_envs.files import read_bytes, write_atomic
from rigid_envs.scores.metrics import METRICS

from .measures import FORMAT
from .plots import INK, MUTED, dress

__all__ = ["draw", "markdown", "read_results", "write_leaderboard"]

_LIMIT = 2**20  # bytes of a result
_HEADER = (
    "environment",
    "policy",
    "success",
    "95 %",
    "metric",
    "value",
    "95 %",
    "score",
    "95 %",
    "score 1 is",
)
_INTRODUCTION = """# Leaderboard

One episode from each start. A score is 0 for the random policy, and 1 where the last column says;
policies are ranked by that of the metric in the middle.

![Scores of all policies in all environments](leaderboard.png)
"""
_COLOURS = ("#1f5fbf", "#c9772b", "#3a8f5c", "#8a4fbf", "#b8383d", "#2a9aa8", "#7a7f2b", "#6b7480")


def write_leaderboard(folder: Path) -> str:
    """Write `leaderboard.md` and `leaderboard.png` of all results below a folder.

    Args:
        folder: Folder of the results, and of what is written.

    Returns:
        The page.

    Raises:
        ConfigError: No result below the folder.
    """
    results = read_results(folder)
    if not results:
        raise ConfigError(
            f"folder = {folder}; expected a results.json of `python -m agents evaluate` below it"
        )
    text = markdown(results)
    write_atomic(folder / "leaderboard.md", text)
    buffer = io.BytesIO()
    draw(results).savefig(buffer, format="png")
    write_atomic(folder / "leaderboard.png", buffer.getvalue())
    return text


def read_results(folder: Path) -> list[dict[str, Any]]:
    """All results below a folder, by environment, the best score first.

    Args:
        folder: Where to look for `results.json`; what has no metrics is left out.
    """
    found = [json.loads(read_bytes(path, _LIMIT)) for path in sorted(folder.rglob("results.json"))]
    known = list(ENVIRONMENTS)
    results = [r for r in found if r.get("format") == FORMAT and r["env_id"] in known]
    return sorted(results, key=lambda r: (known.index(r["env_id"]), -_first_score(r)))


def markdown(results: Sequence[Mapping[str, Any]]) -> str:
    """The page: the plot, the table, and under it where its numbers come from.

    Args:
        results: In the order of the rows.
    """
    sides = ("---", "---", "---:", "---:", "---", *["---:"] * 4, "---")
    lines = [_HEADER, sides, *map(_cells, results)]
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    ranking = sorted({result["primary"] for result in results})
    meanings = "\n".join(f"- {name}: {METRICS[name].text}" for name in ranking)
    notes = "\n".join(dict.fromkeys(_note(result) for result in results))
    return f"{_INTRODUCTION}\n{table}\n\n{meanings}\n\n{notes}\n"


def draw(results: Sequence[Mapping[str, Any]]) -> Figure:
    """One line for each environment, with the score of each policy and its interval.

    Args:
        results: In the order of the lines.
    """
    scored = [result for result in results if _score(result)]
    ids = list(dict.fromkeys(result["env_id"] for result in scored))
    names = list(dict.fromkeys(map(_kind, scored)))
    figure = Figure(
        figsize=(8.0, 1.4 + 0.36 * len(ids)), dpi=150, layout="constrained", facecolor="white"
    )
    axes = figure.subplots()
    for k, name in enumerate(names):
        own = [result for result in scored if _kind(result) == name]
        scores = np.array([[_score(r)["score"], *_score(r)["interval_95"]] for r in own])
        at = [-ids.index(r["env_id"]) - 0.5 * (k / max(len(names) - 1, 1) - 0.5) for r in own]
        colour = _COLOURS[k % len(_COLOURS)]
        axes.hlines(at, scores[:, 1], scores[:, 2], color=colour, lw=1.6, alpha=0.6)
        axes.plot(scores[:, 0], at, "o", ms=4.5, color=colour, label=name)
    _mark(axes, 0.0, "random policy")
    _mark(axes, 1.0, "anchor")
    axes.set_yticks([-k for k in range(len(ids))], [i.split("/")[-1] for i in ids], color=INK)
    low = min([-0.1, *(_score(r)["interval_95"][0] for r in scored)])
    axes.set_xlim(max(low - 0.05, -0.6), None)
    dress(axes, "")
    axes.set_xlabel("score", color=MUTED)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=8,
                labelcolor=MUTED)  # fmt: skip
    return figure


def _mark(axes: Axes, score: float, what: str) -> None:
    axes.axvline(score, color=MUTED, lw=0.8, ls=(0, (4, 3)))
    axes.annotate(
        what, (score, 1.0), xycoords=("data", "axes fraction"), ha="center",
        xytext=(0, 3), textcoords="offset points", fontsize=8, color=MUTED,
    )  # fmt: skip


def _kind(result: Mapping[str, Any]) -> str:
    """Legend entry: reference controllers, whose names differ by environment, share one."""
    name = str(result["algo"])
    return "reference controller" if name in ENVIRONMENTS[result["env_id"]].controllers else name


def _score(result: Mapping[str, Any]) -> dict[str, Any]:
    """The score that ranks policies; empty where there is none."""
    found: dict[str, Any] = result["scores"].get(result["primary"], {})
    return found


def _first_score(result: Mapping[str, Any]) -> float:
    return float(_score(result).get("score", -np.inf))


def _cells(result: Mapping[str, Any]) -> tuple[str, ...]:
    metric, score = result["metrics"][result["primary"]], _score(result)
    low, high = metric["interval_95"]
    policy = result["policy"]
    worth = ("-", "-", "-")
    if score:
        ends = " .. ".join(f"{round(end, 2) + 0.0:.2f}" for end in score["interval_95"])
        worth = (
            f"**{round(score['score'], 3) + 0.0:.3f}**",
            ends,
            f"{score['anchor']:.4g}, {score['kind']}: {score['why']}",
        )
    return (
        f"`{result['env_id'].split('/')[-1]}`",
        str(result["algo"]),
        f"{100 * policy['success_rate']:.1f} %",
        " .. ".join(f"{100 * end:.1f}" for end in policy["success_rate_95"]),
        result["primary"],
        f"{metric['mean']:.4g}",
        f"{low:.4g} .. {high:.4g}",
        *(cell.replace("|", "\\|") for cell in worth),
    )


def _note(result: Mapping[str, Any]) -> str:
    commit = "no commit" if result["git_commit"] is None else f"commit {result['git_commit'][:12]}"
    return (
        f"{result['policy']['episodes']} starts of seed {result['test_seed']}, evaluation set "
        f"{result['evaluation_version']}; rigid-envs {result['versions']['rigid-envs']}, kernels "
        f"{result['kernel_hash']}, {commit}{' with changes' if result['git_dirty'] else ''}."
    )
