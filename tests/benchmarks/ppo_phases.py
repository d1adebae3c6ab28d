"""Where the time of a training goes, and how many steps a second it makes.

Each environment is trained by its recipe for PPO in the reduced frame up to the first evaluation,
on one torch thread.
"""

import tempfile
import time
from contextlib import ExitStack, contextmanager
from unittest.mock import patch

import torch

from agents.config.entries import config_from
from agents.config.reading import recipe_for
from tests.agents.trainings import begun

IDS = ("BallPark", "IntermediateAxis", "SleepingTop", "Reorient", "DiskRoll")

PHASES = (
    *("environment", "policy", "rest of collecting", "forward", "backward", "Adam"),
    *("rest of learning", "evaluation", "logs"),
)
"""Steps of the environment and actions of the policy; losses of batches, their gradients and the
steps along them; evaluations on the starts of validation; all else."""


@contextmanager
def _timed(parts, spent):
    """Add the time spent in methods of objects, by the names of the parts."""

    def timed(name, function):
        def call(*arguments, **options):
            begin = time.perf_counter()
            result = function(*arguments, **options)
            spent[name] = spent.get(name, 0.0) + time.perf_counter() - begin
            return result

        return call

    with ExitStack() as stack:
        for name, (owner, method) in parts.items():
            # a method of a class gets its object as the first argument
            function = timed(name, getattr(owner, method))
            stack.enter_context(patch.object(owner, method, function))
        yield


def measure(env_id, timesteps=None):
    """Train with a stopwatch.

    Args:
        env_id: "BallPark".
        timesteps: number of them, with an evaluation at their end; None takes those up to the first
            evaluation of the recipe.

    Returns:
        The id, steps that were made, steps a second, and the shares of all phases.
    """
    recipe = recipe_for(env_id, "ppo", "reduced")
    steps = timesteps or recipe["eval_every"]
    with tempfile.TemporaryDirectory() as folder:
        changes = {"total_timesteps": steps, "eval_every": steps, "log_dir": folder}
        trainer = begun(config_from({**recipe, **changes}))
        trainer.iterate()  # compiles what is not compiled yet
        spent, first = {}, trainer.model.num_timesteps
        begin = time.perf_counter()
        with _timed(_parts(trainer), spent):
            while not trainer.is_complete():
                trainer.iterate()
        total = time.perf_counter() - begin
        made = trainer.model.num_timesteps - first
        trainer.close()
    shares = {name: seconds / total for name, seconds in _apart(spent, total).items()}
    return {
        "env_id": env_id,
        "timesteps": made,
        "steps_per_second": made / total,
        "shares": shares,
    }


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
    return {name: t[name] for name in PHASES}
