"""Where the time of a training goes, and how many steps a second it makes.

Run from the checkout: ``python -m tests.benchmarks.ppo_phases``. Each environment is trained by its
recipe for PPO in the reduced frame up to the first evaluation, on one torch thread.
"""

from __future__ import annotations

import tempfile
import time
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from unittest.mock import patch

import torch

from agents.config.entries import config_from
from agents.config.reading import recipe_for
from agents.storage.runs import create_run
from agents.training.trainer import Trainer
from agents.training.validation import Progress
from rigid_envs.tools.pages.tables import table

IDS = ("BallPark", "IntermediateAxis", "SleepingTop", "Reorient", "DiskRoll")

PHASES = (
    *("environment", "policy", "rest of collecting", "forward", "backward", "Adam"),
    *("rest of learning", "evaluation", "logs"),
)
"""Steps of the environment and actions of the policy; losses of batches, their gradients and the
steps along them; evaluations on the starts of validation; all else."""


@dataclass(frozen=True)
class Phases:
    """Where the time of a training went.

    Attributes:
        env_id: what was trained.
        timesteps: that were made.
        seconds: of every phase, in the order of `PHASES`.
    """

    env_id: str
    timesteps: int
    seconds: tuple[float, ...]

    @property
    def steps_per_second(self):
        """Speed of the training, all phases together."""
        return self.timesteps / sum(self.seconds)

    @property
    def shares(self):
        """Parts of the time, which add up to 1."""
        return tuple(seconds / sum(self.seconds) for seconds in self.seconds)


class _Timers:
    """Time spent in functions, by name."""

    def __init__(self):
        self.spent = {}

    def timed(self, name, function):
        def call(*arguments, **options):
            begin = time.perf_counter()
            result = function(*arguments, **options)
            self.spent[name] = self.spent.get(name, 0.0) + time.perf_counter() - begin
            return result

        return call

    @contextmanager
    def on(self, parts):
        """Time methods of objects."""
        with ExitStack() as stack:
            for name, (owner, method) in parts.items():
                timed = self.timed(name, getattr(owner, method))
                # a method of a class gets its object as the first argument
                stack.enter_context(patch.object(owner, method, timed))
            yield


def measure(env_id, timesteps=None):
    """Train with a stopwatch.

    Args:
        env_id: "BallPark".
        timesteps: number of them, with an evaluation at their end; None takes those up to the first
            evaluation of the recipe.
    """
    recipe = recipe_for(env_id, "ppo", "reduced")
    steps = timesteps or recipe["eval_every"]
    with tempfile.TemporaryDirectory() as folder:
        changes = {"total_timesteps": steps, "eval_every": steps, "log_dir": folder}
        run = create_run(config_from({**recipe, **changes}))
        run.begin()
        trainer = Trainer(run, run.config(), Progress(quiet=True))
        trainer.iterate()  # compiles what is not compiled yet
        timers, first = _Timers(), trainer.model.num_timesteps
        begin = time.perf_counter()
        with timers.on(_parts(trainer)):
            while not trainer.is_complete():
                trainer.iterate()
        total = time.perf_counter() - begin
        made = trainer.model.num_timesteps - first
        trainer.close()
        run.close()
    return Phases(env_id, made, _apart(timers.spent, total))


def _parts(trainer):
    model = trainer.model
    return {
        "collecting": (model, "collect_rollouts"),
        "environment": (trainer._adapter.venv, "step"),
        "policy": (model.policy, "forward"),
        "learning": (model, "train"),
        "forward": (model.policy, "evaluate_actions"),
        "backward": (torch.Tensor, "backward"),
        "Adam": (model.policy.optimizer, "step"),
        "evaluation": (trainer._validation, "run"),
    }


def _apart(spent, total):
    """Seconds of the phases: what is inside another is taken from it."""
    t = {**spent}
    t["rest of collecting"] = t.pop("collecting") - t["environment"] - t["policy"]
    t["rest of learning"] = t.pop("learning") - t["forward"] - t["backward"] - t["Adam"]
    t["logs"] = total - sum(t.values())
    return tuple(t[name] for name in PHASES)


def main():
    """Print one line for every environment."""
    rows = []
    for found in map(measure, IDS):
        shares = (f"{share:.1%}" for share in found.shares)
        rows.append((found.env_id, f"{found.steps_per_second:,.0f}", *shares))
    print(table(("", "steps/s", *PHASES), rows, "<" + ">" * (1 + len(PHASES)), indent=0))


if __name__ == "__main__":
    main()
