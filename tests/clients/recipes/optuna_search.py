"""Optuna: a search over two hyperparameters of a training with `agents`."""

import json
import tempfile
from pathlib import Path

import optuna

import rigid_envs
from agents.config.reading import config_for
from agents.training.trainer import train

ENV_ID = "RigidEnvs/IntermediateAxis-v0"
FOLDER = tempfile.mkdtemp()


def objective(trial):
    """Mean return of a short training, on starts that are not those of the test."""
    entries = {
        "total_timesteps": 40_000,
        "learning_rate": trial.suggest_float("learning_rate", 1e-4, 3e-3, log=True),
        "gamma": trial.suggest_float("gamma", 0.95, 0.995),
        "log_dir": FOLDER,
        "run_name": f"trial_{trial.number}",
    }
    outcome = train(config_for(ENV_ID, entries), quiet=True)
    policy = rigid_envs.load(Path(outcome.folder, "best_model", "policy.safetensors"))
    return rigid_envs.evaluate(ENV_ID, policy, n=100, seed=1).values["return"].mean()


optuna.logging.set_verbosity(optuna.logging.WARNING)
study = optuna.create_study(direction="maximize", sampler=optuna.samplers.TPESampler(seed=0))
study.optimize(objective, n_trials=4)
values = [trial.value for trial in study.trials]
assert len(set(values)) == 4
figures = {"trials": len(values), "worst return": min(values), "best return": max(values)}
print(json.dumps({**figures, **study.best_params}))
