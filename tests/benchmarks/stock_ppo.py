"""A training by Stable-Baselines3 as it is, and by this application: speed and learning curves.

All train on `IntermediateAxis` by its recipe for PPO in the reduced frame, which has no setting
that Stable-Baselines3 lacks, on one torch thread, with three seeds, in turns. The times of this
application include the evaluations on its way. Curves are on 100 starts that are neither of its
validation nor of its test.
"""

from __future__ import annotations

import dataclasses
import tempfile
import time
from dataclasses import dataclass

import torch
from stable_baselines3 import PPO
from stable_baselines3.common import env_util
from stable_baselines3.common.callbacks import BaseCallback

from agents.config.entries import config_from
from agents.config.reading import recipe_for
from rigid_envs import evaluate
from rigid_envs.sb3.adapter import make_vec_env
from tests.agents.trainings import begun

_ENV = "RigidEnvs/IntermediateAxis-v0"
_SEED, _N_STARTS = 1, 100  # of the curves
_N_POINTS = 5


@dataclass(frozen=True)
class Stock:
    """Trainings of one kind, one for each seed.

    Attributes:
        name: What trains, on what rows.
        timesteps: Of a training.
        seconds: Of each training, without the evaluations of the curve.
        fractions: Parts of the timesteps at which the curve is taken.
        returns: Of each training, at each of them: the mean over the starts.
    """

    name: str
    timesteps: int
    seconds: list[float]
    fractions: list[float]
    returns: list[list[float]]


class _Curve(BaseCallback):
    """Takes the curve between updates, and the time without it."""

    def __init__(self, total):
        super().__init__()
        self.returns = []
        self.seconds, self._total = 0.0, total

    def begin(self):
        """Start the clock."""
        self._begin = time.perf_counter()

    def between_updates(self, done, policy):
        """Take a point of the curve where one is due, with the clock stopped."""
        self.seconds += time.perf_counter() - self._begin
        if done >= self._total * (len(self.returns) + 1) // _N_POINTS:
            found = evaluate(_ENV, policy(), n=_N_STARTS, seed=_SEED, config={"frame": "reduced"})
            self.returns.append(float(found.values["return"].mean()))
        self.begin()

    def _on_rollout_start(self):
        self.between_updates(self.num_timesteps, lambda: self.model)

    def _on_step(self):
        return True


def _stable_baselines(make):
    """A training as the documentation of Stable-Baselines3 has it."""

    def train(config):
        start, end = config.learning_rate
        model = PPO(
            "MlpPolicy",
            make(config.n_envs),
            learning_rate=lambda left: end + (start - end) * max(left, 0.0),
            n_steps=config.n_steps,
            batch_size=config.batch_size,
            n_epochs=config.n_epochs,
            gamma=config.gamma,
            gae_lambda=config.gae_lambda,
            policy_kwargs={"net_arch": list(config.net_arch), "log_std_init": config.log_std_init},
            seed=config.seed,
            device="cpu",
        )
        curve = _Curve(config.total_timesteps)
        curve.begin()
        model.learn(config.total_timesteps, curve)
        curve.between_updates(model.num_timesteps, lambda: model)
        model.env.close()
        return curve

    return train


def _application(config):
    """A training as ``python -m agents train`` makes it, without the files at its end."""
    with tempfile.TemporaryDirectory() as folder:
        trainer = begun(dataclasses.replace(config, log_dir=folder))
        curve = _Curve(config.total_timesteps)
        curve.begin()
        while not trainer.is_complete():
            trainer.iterate()
            if trainer.checkpoint_is_due():
                trainer.save()
            curve.between_updates(trainer.model.num_timesteps, lambda: trainer.model)
        trainer.close()
    return curve


TRAINERS = {
    "Stable-Baselines3, its `make_vec_env`": _stable_baselines(
        lambda n: env_util.make_vec_env(_ENV, n, env_kwargs={"frame": "reduced"})
    ),
    "Stable-Baselines3, `rigid_envs.sb3.make_vec_env`": _stable_baselines(
        lambda n: make_vec_env(_ENV, n, frame="reduced")
    ),
    "`python -m agents train`": _application,
}


def measure(seeds=(0, 1, 2), timesteps=None):
    """Train in turns.

    Args:
        seeds: Of the trainings of each kind.
        timesteps: Of each; None takes those of the recipe.
    """
    recipe = recipe_for(_ENV, "ppo", "reduced")
    if timesteps is not None:
        recipe |= {"total_timesteps": timesteps}
    curves = {name: [] for name in TRAINERS}
    for seed in seeds:
        config = config_from({**recipe, "seed": seed})
        torch.set_num_threads(config.torch_threads)
        for name, train in TRAINERS.items():
            curves[name].append(train(config))
    fractions = [(k + 1) / _N_POINTS for k in range(_N_POINTS)]
    return [
        Stock(
            name,
            config.total_timesteps,
            [curve.seconds for curve in kind],
            fractions,
            [curve.returns for curve in kind],
        )
        for name, kind in curves.items()
    ]
