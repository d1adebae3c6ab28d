"""Every kind of file that is read: how a good one is written, and the function that reads it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

from agents.config.entries import config_from
from agents.config.reading import read_yaml
from agents.storage.logs import load_newest, read_evaluations, save_newest, write_evaluations
from agents.storage.runs import read_config, write_config
from rigid_envs import load
from rigid_envs.scores.best import file_of as file_of_best
from rigid_envs.scores.best import file_of_plans, read_best, read_plans
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.records import read_evaluation, read_record
from rigid_envs.scores.trained import file_of as file_of_policy
from rigid_envs.watch.replays.recording import RecordReplay
from rigid_envs.watch.replays.replay import load_replay

ID = "RigidEnvs/Detumble-v0"
PLANNED = "RigidEnvs/PivotTop-v0"
_EVALUATIONS = ("results", "ep_lengths", "successes", "costs")


class Reader(NamedTuple):
    """A kind of file.

    Attributes:
        name: of the file.
        write: puts a good one at a path.
        read: reads the one at a path.
    """

    name: str
    write: Callable[[Path], Any]
    read: Callable[[Path], Any]


def _copy_of(file):
    return lambda path: path.write_bytes(file.read_bytes())


def _replay(path):
    env = RecordReplay(gym.make(ID), path)
    env.reset(seed=0)
    for _ in range(3):
        env.step(np.zeros(3, dtype=np.float32))
    env.close()


def _checkpoint(path):
    save_newest(path.parent, 1, {"weights": np.arange(6.0)}, {"age": 1})


READERS = {
    "policy": Reader("policy.safetensors", _copy_of(file_of_policy("Detumble")), load),
    "checkpoint": Reader(
        "000000000000001.safetensors",
        _checkpoint,
        lambda path: load_newest(path.parent, lambda arrays, document: None),
    ),
    "replay": Reader("replay.npz", _replay, load_replay),
    "plans": Reader("plans.npz", _copy_of(file_of_plans(PLANNED)), read_plans),
    "evaluations": Reader(
        "evaluations.npz",
        lambda path: write_evaluations(
            path, {"timesteps": np.arange(3), **dict.fromkeys(_EVALUATIONS, np.zeros((3, 2)))}
        ),
        read_evaluations,
    ),
    "best": Reader("best.json", _copy_of(file_of_best(ID)), read_best),
    "record": Reader(
        "record.json", _copy_of(file_of_policy("Detumble").with_suffix(".json")), read_record
    ),
    "result": Reader(
        "result.json", lambda path: evaluate(ID, "zero", n=2).save(path), read_evaluation
    ),
    "run config": Reader(
        "config.yaml",
        lambda path: write_config(path, config_from({"algo": "ppo", "env_id": ID})),
        read_config,
    ),
    "config": Reader(
        "config.yaml", lambda path: path.write_text("env_id: Detumble\nseed: 1\n"), read_yaml
    ),
}
