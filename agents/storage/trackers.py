"""Trackers of experiments, which get what TensorBoard gets; imported where they are asked for."""

import importlib
from collections.abc import Mapping
from typing import Any

from stable_baselines3.common.logger import KVWriter

_PROJECT = "rigid-envs"


class Wandb(KVWriter):
    """Weights & Biases: each session of a training is a run of the project "rigid-envs"."""

    def __init__(self, name: str, config: Mapping[str, Any]) -> None:
        """Begin a run.

        Args:
            name: Of the run.
            config: Its entries, as JSON values.
        """
        wandb = importlib.import_module("wandb")
        self._run = wandb.init(project=_PROJECT, name=name, config=dict(config))

    def write(  # noqa: D102
        self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0
    ) -> None:
        self._run.log(dict(key_values), step=step)

    def close(self) -> None:
        """End the run."""
        self._run.finish()


class Mlflow(KVWriter):
    """MLflow: each session of a training is a run of the experiment "rigid-envs"."""

    def __init__(self, name: str, config: Mapping[str, Any]) -> None:
        """Begin a run; see `Wandb`."""
        self._mlflow = importlib.import_module("mlflow")
        self._mlflow.set_experiment(_PROJECT)
        self._mlflow.start_run(run_name=name)
        self._mlflow.log_params(dict(config))

    def write(  # noqa: D102
        self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0
    ) -> None:
        self._mlflow.log_metrics(dict(key_values), step=step)

    def close(self) -> None:
        """End the run."""
        self._mlflow.end_run()


TRACKERS = {"wandb": Wandb, "mlflow": Mlflow}
"""By the name of their package."""
