"""What every contract needs: the ids, environments to run, actions to try, bits to compare."""

from dataclasses import fields
from functools import cache
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt

from rigid_envs import ENVIRONMENTS
from rigid_envs.envs import RigidEnv, RigidVectorEnv
from rigid_envs.tasks import ConfigError, Task

IDS = tuple(ENVIRONMENTS)

# settings under which an episode may also end before its time, for the tasks that can end
EARLY_ENDS = {"RigidEnvs/BallPark-v0": {"position_tolerance": 1.5, "angle_tolerance": 1.6}}


def single(env_id: str, **config: Any) -> RigidEnv:
    """The environment itself, without the time limit around it."""
    return gym.make(env_id, **config).unwrapped


def vector(env_id: str, n: int, **config: Any) -> RigidVectorEnv:
    """N native rows."""
    return gym.make_vec(
        env_id, num_envs=n, vectorization_mode="vector_entry_point", **config
    ).unwrapped


@cache
def task_of(env_id: str) -> Task:
    """The task with its default settings."""
    return single(env_id).task


@cache
def rules(env_id: str) -> dict[str, Any]:
    """What each setting may be."""
    return {field.name: field.metadata["rule"] for field in fields(task_of(env_id))}


@cache
def ranges(env_id: str) -> dict[str, tuple[float, float]]:
    """A range of a tenth around as many physical parameters as the task allows at once."""
    chosen: dict[str, tuple[float, float]] = {}
    for name in task_of(env_id).physical_parameters():
        value = getattr(task_of(env_id), name)
        for pair in ((0.9 * value, 1.1 * value), (value, 1.1 * value), (0.9 * value, value)):
            try:
                single(env_id, **chosen, **{name: pair})
            except ConfigError:
                continue
            chosen[name] = pair
            break
    assert chosen, f"no physical parameter of {env_id} can be a range"
    return chosen


def rich(env_id: str) -> dict[str, Any]:
    """Settings that use everything a task has: drawn parameters, noise, delay, an attitude."""
    return {
        **ranges(env_id),
        **EARLY_ENDS.get(env_id, {}),
        "observe_params": True,
        "rotation": "quat",
        "action_noise": (0.0, 0.2),
        "observation_noise": 0.02,
        "action_delay": (0, 3),
    }


def n_actions(env_id: str) -> int:
    """Length of an action."""
    return len(task_of(env_id).actions())


def is_disc(env_id: str) -> bool:
    """Whether actions are clipped by their norm."""
    return "disc" in task_of(env_id).actions()[0].frame


def actions(env_id: str, n_steps: int, n_rows: int, seed: int = 0) -> npt.NDArray[np.float32]:
    """Actions of shape (n_steps, n_rows, n_action), a few of them outside the space."""
    shape = (n_steps, n_rows, n_actions(env_id))
    return np.random.default_rng(seed).uniform(-1.2, 1.2, shape).astype(np.float32)


def assert_same_bits(a: Any, b: Any, where: str = "") -> None:
    """Two results, however nested, are of the same types and equal in every bit."""
    if isinstance(a, dict):
        assert a.keys() == b.keys(), where
        for key in a:
            assert_same_bits(a[key], b[key], f"{where}[{key!r}]")
    elif isinstance(a, list | tuple):
        assert len(a) == len(b), where
        for k, (x, y) in enumerate(zip(a, b, strict=True)):
            assert_same_bits(x, y, f"{where}[{k}]")
    else:
        x, y = np.asarray(a), np.asarray(b)
        assert (x.dtype, x.shape) == (y.dtype, y.shape), where
        assert x.tobytes() == y.tobytes(), f"{where}: {a} and {b}"


def row_of(infos: dict[str, Any], row: int) -> dict[str, Any]:
    """What a single environment would have in its info."""
    return {
        key: value[row].item()
        for key, value in infos.items()
        if not key.startswith("_") and not key.startswith("final_")
    }


def weights(task: Task) -> dict[str, float]:
    """Weight of each reward term, from the fields that are documented to hold it."""
    names = {field.name for field in fields(task)}
    assert {f"weight_{term}" for term in task.terms} <= names
    return {term: getattr(task, f"weight_{term}") for term in task.terms}


def break_physics(env: RigidEnv | RigidVectorEnv, row: int = 0) -> None:
    """Put a state into a row that no physics leads to; the next step ends its episode."""
    state = env.get_state()
    y = state["y"][row] if isinstance(env, RigidVectorEnv) else state["y"]
    y[-1] = np.nan
    env.set_state(state)
