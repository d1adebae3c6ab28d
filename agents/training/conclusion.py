"""Final evaluation of a complete run."""

from __future__ import annotations

from typing import Any

from ..evaluation.plots import draw_learning_curve
from ..evaluation.reports import report, write_report
from ..evaluation.short_film import try_film
from ..policies.policy_file import load_policy
from ..storage.runs import Run
from .trainer import Outcome

__all__ = ["conclude"]


def conclude(run: Run, outcome: Outcome, n: int, seed: int, quiet: bool = False) -> dict[str, Any]:
    """Evaluate the best policy of a run, and write figures, learning curve and film into it.

    Args:
        run: A complete run.
        outcome: Its steps and seconds.
        n: Number of unseen starts.
        seed: Seed of the starts.
        quiet: Whether no progress is shown.

    Returns:
        The figures of `report`, where `training_timesteps` is the age of that policy, and of all
        the training `run_timesteps` and `training_seconds`.
    """
    path = run / "best_model" / "policy.safetensors"
    figures, episodes = report(path, n, seed, quiet)
    figures["run_timesteps"] = outcome.timesteps
    figures["training_seconds"] = round(outcome.seconds, 3)
    write_report(run.folder, figures, episodes)
    draw_learning_curve(run)
    try_film(load_policy(path), run.folder, seed)
    return figures
