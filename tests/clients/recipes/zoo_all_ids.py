"""RL Baselines3 Zoo: the files of this repository set up an experiment for every id."""

import json
import tempfile
from argparse import Namespace
from pathlib import Path

import yaml
from rl_zoo3.exp_manager import ExperimentManager

import rigid_envs

CONFIGS = Path(__file__).parents[3] / "configs" / "zoo"
figures = {}
for file in sorted(CONFIGS.glob("*.yml")):
    algo, ids = file.stem, list(yaml.safe_load(file.read_text()))
    for env_id in ids:
        with tempfile.TemporaryDirectory() as folder:
            experiment = ExperimentManager(
                Namespace(), algo, env_id, folder, config=str(file), eval_freq=-1, device="cpu"
            )
            model, _ = experiment.setup_experiment()
            model.get_env().reset()
            model.get_env().close()
    figures[f"ids, {algo}"] = len(ids)
assert figures["ids, ppo"] == len(rigid_envs.ENVIRONMENTS)
print(json.dumps(figures))
