"""What is made of a finished training: policy file, record, report."""

import copy
import math
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import torch
from gymnasium.spaces import Dict
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm

from rigid_envs import load
from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import canonical_json, file_digest, write_atomic
from rigid_envs.engine.provenance import provenance
from rigid_envs.sb3.adapter import NonFiniteError, all_finite
from rigid_envs.sb3.exporting import contents
from rigid_envs.scores.policies import from_predict
from rigid_envs.scores.records import Record, write_record
from rigid_envs.scores.starts import N_STARTS, ActionFunction
from rigid_envs.scores.trained import FOLDER, FORMAT, CompiledPolicy, write_policy
from rigid_envs.tasks.registry import ENVIRONMENTS

from ..config.entries import PLACES, Config, DAggerConfig, config_to_dict
from ..evaluation.reports import evaluate
from ..storage.logs import read_evaluations, read_rows
from ..storage.runs import Run, manifest
from .dagger import with_dead_band

# The policy of a model in training: as it is saved, and as it acts.


@contextmanager
def stronger(model: Any, gain: float) -> Iterator[None]:
    """While in this context, a model with a Gaussian policy does what it would times a factor.

    Args:
        model: SB3 model; it is afterwards, to the bit, what it was before.
        gain: The factor; with 1 any model is left as it is.
    """
    if gain == 1.0:
        yield
        return
    policy = model.policy
    before = copy.deepcopy(policy.state_dict())
    try:
        with torch.no_grad():
            for weights in policy.action_net.parameters():
                weights.mul_(gain)
            policy.log_std.add_(math.log(gain))
        yield
    finally:
        policy.load_state_dict(before)


def as_saved(model: Any, config: Config) -> AbstractContextManager[None]:
    """While in this context, a model does what its policy is evaluated and saved to do.

    Args:
        model: SB3 model.
        config: Config of the run.
    """
    if isinstance(config, DAggerConfig):
        return with_dead_band(model, config.dead_band)
    return stronger(model, config.policy_gain)


def acting(model: BaseAlgorithm, venv: VectorEnv[Any, Any, Any]) -> ActionFunction:
    """What a model does in its environment, whose observations it sees as in training.

    Args:
        model: SB3 model.
        venv: The environment, without the wrappers of the training.

    Returns:
        A function of the observations of all rows; it raises a NonFiniteError for bad ones.
    """
    of_seen = from_predict(model)(venv)
    goals = isinstance(venv.single_observation_space, Dict)
    alone = goals and not isinstance(model.observation_space, Dict)

    def act(observations: Any) -> NDArray[Any]:
        seen = observations["observation"] if alone else observations
        if not all_finite(seen):
            raise NonFiniteError("an observation of the evaluation is not finite")
        return of_seen(seen)

    return act


def save_policy(model: BaseAlgorithm, config: Config, folder: Path) -> None:
    """Write the policy of a model, atomically: for programs, and without its weights for people.

    Args:
        model: SB3 model.
        config: Config of the run.
        folder: Folder of the files; made if it is not there.
    """
    document, arrays = contents(model, config.env_id, config.env_kwargs)
    document = {**document, "seed": config.seed}
    CompiledPolicy(document, arrays)  # refuses what could not be loaded
    folder.mkdir(exist_ok=True)
    write_policy(folder / "policy.safetensors", document, arrays)
    text = canonical_json({"format": FORMAT, **document}, indent=2)
    write_atomic(folder / "policy.json", f"{text}\n")


# The record of a run: read from its files, and evaluated as its published policy would be.

_STEPS = "time/total_timesteps"
_POLICY = "best_model/policy.safetensors"


def is_complete(run: Run) -> bool:
    """Whether all steps of a run are made."""
    times = _times(run)
    return bool(times) and int(times[_STEPS]) >= run.config().total_timesteps


def make_record(run: Run, n: int) -> Record:
    """Evaluate the best policy of a run, compiled, on the first n test starts.

    Args:
        run: A complete run.
        n: Number of starts.
    """
    config, path = run.config(), run / _POLICY
    policy, times = load(path), _times(run)
    found = evaluate(policy, config.env_id, n, env_kwargs=policy.env_kwargs, name=policy.name)
    document, where, also = policy.document, provenance(), manifest()
    where["versions"] |= also["versions"]
    where["cpu_capability"] = also["cpu_capability"]
    return Record(
        env_id=found.env_id,
        policy=found.policy,
        settings=found.config,
        successes=found.successes,
        costs=found.costs,
        algo=config.algo,
        frame=config.frame,
        seed=config.seed,
        config=config_to_dict(config, PLACES),
        training={
            "timesteps": int(times[_STEPS]),
            "policy_timesteps": document["timesteps"],
            "seconds": float(times["seconds"]),
            "cpu_seconds": float(times["cpu_seconds"]),
            **{key: document[key] for key in ("git_commit", "git_dirty", "kernel_hash")},
        },
        policy_sha256=file_digest(path),
        curve=_curve(run),
        provenance=where,
    )


def publish(run: Run, folder: Path = FOLDER) -> Path:
    """Copy the best policy of a run into a folder, and write its record beside it.

    Args:
        run: A complete run of a registered environment.
        folder: Folder of published policies.

    Returns:
        The copy.

    Raises:
        ConfigError: The run is not complete, or of an environment of another package.
    """
    env_id = run.config().env_id
    if env_id not in ENVIRONMENTS or not is_complete(run):
        raise ConfigError(f"{run.folder}: expected a complete run of an environment of rigid_envs")
    record = make_record(run, N_STARTS)
    path = folder / f"{env_id.rpartition('/')[2]}.safetensors"
    write_record(path.with_suffix(".json"), record)
    write_atomic(path, (run / _POLICY).read_bytes())
    return path


def _times(run: Run) -> dict[str, str]:
    """The last row of the clock of a run; empty if there is none."""
    path = run / "times.csv"
    rows = read_rows(path) if path.is_file() else []
    return rows[-1] if rows else {}


def _curve(run: Run) -> dict[str, list[Any]]:
    """Rate of success, mean return and mean cost of the successes, of the held-out starts."""
    held_out = read_evaluations(run / "evaluations.npz")
    won, costs = held_out["successes"].astype(bool), held_out["costs"]
    means = [float(row[own].mean()) if own.any() else None
             for row, own in zip(costs, won, strict=True)]  # fmt: skip
    return {
        "timesteps": held_out["timesteps"].tolist(),
        "success_rate": [_short(value) for value in won.mean(axis=1)],
        "return_mean": [_short(value) for value in held_out["results"].mean(axis=1)],
        "cost_mean": [None if value is None else _short(value) for value in means],
    }


def _short(value: float) -> float:
    """Six digits."""
    return float(f"{value:.6g}")
