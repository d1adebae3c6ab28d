"""What part of PPO's time the environment takes, and how many steps a second PPO makes.

Run from the checkout: ``python -m tests.benchmarks.ppo_share [--steps 1000000]``. One process, one
torch thread, 256 rows, batches of 2048, 4 epochs.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from typing import Any

import rigid_envs
from agents.config.by_algorithm import config_from
from agents.storage.runs import create_run
from agents.training.progress_bar import Progress
from agents.training.trainer import Trainer


def measure(env_id: str, steps: int, folder: str) -> tuple[float, float]:
    """Steps per second of PPO, and the share of the time spent in the environment's `step`."""
    config = config_from(
        {
            "env_id": env_id,
            "total_timesteps": steps,
            "n_envs": 256,
            "n_steps": 64,
            "batch_size": 2048,
            "n_epochs": 4,
            "eval_every": 10**9,
            "log_dir": folder,
        }
    )
    run = create_run(config)
    run.begin()
    trainer = Trainer(run, config, Progress(quiet=True))
    venv = trainer._adapter.venv
    inside, step = 0.0, venv.step

    def timed(actions: Any) -> Any:
        nonlocal inside
        begin = time.perf_counter()
        result = step(actions)
        inside += time.perf_counter() - begin
        return result

    venv.step = timed
    trainer.iterate()  # compiles what is not compiled yet
    inside, begin, first = 0.0, time.perf_counter(), trainer.model.num_timesteps
    while not trainer.is_complete():
        trainer.iterate()
    total = time.perf_counter() - begin
    made = trainer.model.num_timesteps - first
    trainer.close()
    run.close()
    return made / total, inside / total


def main() -> None:
    """Print one line for every environment."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=1_000_000)
    steps = parser.parse_args().steps
    print(f"{'environment':34}{'PPO steps/s':>14}{'share of env.step':>20}")
    with tempfile.TemporaryDirectory() as folder:
        for env_id in rigid_envs.ENVIRONMENTS:
            speed, share = measure(env_id, steps, folder)
            print(f"{env_id:34}{speed:14,.0f}{share:20.1%}")


if __name__ == "__main__":
    main()
