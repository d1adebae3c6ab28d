"""What PPO gains by its tanh and by a fused Adam, in one interleaved run.

Run from the checkout: ``python -m tests.benchmarks.update_share [--updates 20]``. Trainings on
BallPark by its recipe take their updates in turns, on one torch thread: as they are here, with
either tanh, and with Adam as it is by default. Prints the median time of an update and its
quartiles, collecting steps included, and the ratio to those as they are here.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from unittest.mock import patch

import numpy as np
from torch import nn

from agents.config.entries import config_from
from agents.config.reading import recipe_for
from agents.storage.runs import Run, create_run
from agents.training.trainer import Trainer
from agents.training.validation import Progress
from rigid_envs.sb3.exporting import ACTIVATIONS, Tanh


def started(name: str, folder: str) -> tuple[Run, Trainer]:
    """A training that has not begun."""
    recipe = recipe_for("RigidEnvs/BallPark-v0", "ppo", "reduced")
    entries = {"eval_every": 10**9, "checkpoint_every": 10**9, "log_dir": folder, "run_name": name}
    run = create_run(config_from({**recipe, **entries}))
    run.begin()
    return run, Trainer(run, run.config(), Progress(quiet=True))


def seconds(trainer: Trainer) -> float:
    """Time of an update."""
    begin = time.perf_counter()
    trainer.iterate()
    return time.perf_counter() - begin


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--updates", type=int, default=20)
    updates = parser.parse_args().updates
    with tempfile.TemporaryDirectory() as folder:
        trainings = {"as here": started("here", folder)}
        for name, kind in {"torch.tanh": nn.Tanh, "tanh by sigmoid": Tanh}.items():
            with patch.dict(ACTIVATIONS, tanh=kind):
                trainings[name] = started(name.replace(" ", "_"), folder)
        trainings["default Adam"] = started("adam", folder)
        for group in trainings["default Adam"][1].model.policy.optimizer.param_groups:
            group["fused"] = None
        for _, trainer in trainings.values():
            seconds(trainer)  # compiles what is not compiled yet
        times = np.array(
            [[seconds(trainer) for _, trainer in trainings.values()] for _ in range(updates)]
        )
        for run, trainer in trainings.values():
            trainer.close()
            run.close()
    for name, column in zip(trainings, times.T, strict=True):
        low, middle, high = np.quantile(column, [0.25, 0.5, 0.75])
        less, ratio, more = np.quantile(column / times[:, 0], [0.25, 0.5, 0.75])
        print(
            f"{name:16}{middle:8.3f} s  {low:.3f} .. {high:.3f}   "
            f"ratio {ratio:.3f}  {less:.3f} .. {more:.3f}"
        )


if __name__ == "__main__":
    main()
