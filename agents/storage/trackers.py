"""Trackers of experiments, which get what TensorBoard gets; imported where they are asked for."""

from collections.abc import Callable, Mapping
from typing import Any

from stable_baselines3.common.logger import KVWriter

_PROJECT = "rigid-envs"


class Tracker(KVWriter):
    """A writer of SB3's logger that gives figures to a tracker."""

    def __init__(self, log: Callable[..., Any], end: Callable[[], Any]) -> None:
        """A run has begun.

        Args:
            log: Takes the figures of an update by name, and its `step`.
            end: Ends the run.
        """
        self._log, self._end = log, end

    def write(  # noqa: D102
        self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0
    ) -> None:
        self._log(dict(key_values), step=step)

    def close(self) -> None:
        """End the run."""
        self._end()


def _wandb(name: str, config: Mapping[str, Any]) -> Tracker:
    import wandb

    run = wandb.init(project=_PROJECT, name=name, config=dict(config))
    return Tracker(run.log, run.finish)


def _mlflow(name: str, config: Mapping[str, Any]) -> Tracker:
    import mlflow

    mlflow.set_experiment(_PROJECT)
    mlflow.start_run(run_name=name)
    mlflow.log_params(dict(config))
    return Tracker(mlflow.log_metrics, mlflow.end_run)


TRACKERS = {"wandb": _wandb, "mlflow": _mlflow}
"""What begins a run, from its name and its config, by the package of the tracker."""
