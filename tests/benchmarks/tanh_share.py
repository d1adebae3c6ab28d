"""What PPO gains by its tanh of a sigmoid, beside the one of torch, in one interleaved run.

Run from the checkout: ``python -m tests.benchmarks.tanh_share [--updates 20]``. Two trainings on
BallPark by its recipe take their updates in turns, on one torch thread. Prints the median time of
an update and its quartiles, collecting steps included.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from unittest.mock import patch

import numpy as np
from torch import nn

from agents.config.by_algorithm import config_from
from agents.config.recipes import recipe_for
from agents.storage.runs import Run, create_run
from agents.training.progress_bar import Progress
from agents.training.trainer import Trainer
from rigid_envs.policies.layers import ACTIVATIONS


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
        with patch.dict(ACTIVATIONS, tanh=nn.Tanh):
            plain = started("torch", folder)
        both = (started("sigmoid", folder), plain)
        for _, trainer in both:
            seconds(trainer)  # compiles what is not compiled yet
        times = np.array([[seconds(trainer) for _, trainer in both] for _ in range(updates)])
        for run, trainer in both:
            trainer.close()
            run.close()
    for name, column in zip(("2 sigmoid(2 x) - 1", "torch.tanh"), times.T, strict=True):
        low, middle, high = np.quantile(column, [0.25, 0.5, 0.75])
        print(f"{name:20}{middle:8.3f} s   {low:.3f} .. {high:.3f}")
    low, middle, high = np.quantile(times[:, 1] / times[:, 0], [0.25, 0.5, 0.75])
    print(f"{'ratio':20}{middle:8.3f}     {low:.3f} .. {high:.3f}")


if __name__ == "__main__":
    main()
