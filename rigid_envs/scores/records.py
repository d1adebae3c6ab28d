"""Records of trained policies: how each was trained, and what came of it from every start.

A record holds success and cost from each start as they are, to the last digit: the policy gives the
same numbers on every machine. What follows from them (rates, efficiencies, intervals) is computed
where it is shown, against the best that is known then.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.catalogue import id_in_file, task_of
from rigid_envs.checks import exact_array
from rigid_envs.documents import checked_values, column, read_document, write_document
from rigid_envs.provenance import KINDS
from rigid_envs.scores.efficiency import cost_of, efficiencies
from rigid_envs.scores.result import Evaluation
from rigid_envs.scores.standing import best_of, objection
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, VERSION

__all__ = ["Record", "read_record", "read_records", "record_file", "record_of", "write_record"]

FORMAT = "rigid-envs record 1"

_LIMIT = 2**20  # bytes
_TRAINING = {"timesteps": int, "policy_timesteps": int, "seconds": float, "cpu_seconds": float}
_PLAIN = {
    **dict.fromkeys(("env_id", "policy", "algo", "frame"), str),
    **{"seed": int, "config": dict, "training": _TRAINING, "policy_sha256": str},
    **{"provenance": KINDS, "curve": dict},
}
_EVALUATION = {"version": int, "seed": int, "starts": int, "settings": dict}
_CURVE = ("timesteps", "success_rate", "return_mean")


@dataclass(frozen=True, eq=False)
class Record:
    """A trained policy: how it was trained, and what came of it.

    Attributes:
        env_id: Gymnasium's id.
        policy: Name of the policy: the algorithm, and the frame if it is not that of the world.
        algo: Learning algorithm.
        frame: Frame of observations and actions, "world" or "reduced".
        seed: Seed of the training.
        config: All entries of the training, as JSON values.
        training: Steps, age of the policy [steps], time [s] and processor time [s], commit.
        policy_sha256: Of the policy file.
        curve: By steps, on starts held out of the training: rate of success, mean return, and
            mean ``info["cost"]`` summed over the episodes that succeeded, None without any.
        settings: Settings of the evaluation.
        successes: Success from each start of the evaluation set, shape (n,).
        costs: Cost of each episode, also where it failed, shape (n,).
        provenance: Of the evaluation: versions, kernels, commit, machine and date.
    """

    env_id: str
    policy: str
    algo: str
    frame: str
    seed: int
    config: Mapping[str, Any]
    training: Mapping[str, Any]
    policy_sha256: str
    curve: Mapping[str, list[Any]]
    settings: Mapping[str, Any]
    successes: npt.NDArray[np.bool_]
    costs: npt.NDArray[np.float64]
    provenance: Mapping[str, Any]

    @property
    def success_rate(self) -> float:
        """Share of the starts from which it succeeds."""
        return float(self.successes.mean())

    @property
    def cost_mean(self) -> float:
        """Mean cost of the successes; NaN without any."""
        return float(self.costs[self.successes].mean()) if self.successes.any() else float("nan")

    @property
    def ranked(self) -> bool:
        """Whether it is of the registered task, and of the evaluation set."""
        return objection(self.env_id, self.settings, TEST_SEED, len(self.costs)) is None

    @cached_property
    def efficiency(self) -> float | None:
        """Mean efficiency against what is best known now; None where it is not ranked."""
        best = best_of(self.env_id, len(self.costs))
        if best is None or not self.ranked:
            return None
        floor = cost_of(self.env_id, task_of(self.env_id)).floor
        return float(efficiencies(self.successes, self.costs, best, floor).mean())

    def differences(self, found: Evaluation) -> list[str]:
        """Where an evaluation differs from the record, to the last digit.

        Args:
            found: An evaluation of the same policy from the same starts.

        Returns:
            A line for each kind of figure; none if all are the same.
        """
        lines = []
        for name, mine, now in (
            ("success", self.successes, found.successes),
            ("cost", self.costs, found.costs),
        ):
            if len(mine) != len(now):
                return [f"{len(now)} starts; the record has {len(mine)}"]
            wrong = np.flatnonzero(mine != now)
            if len(wrong):
                k = wrong[0]
                lines.append(
                    f"{name} differs from {len(wrong)} of {len(mine)} starts; from start {k} it is "
                    f"{now[k]!r}, in the record {mine[k]!r}"
                )
        return lines


def record_file(folder: Path, env_id: str, algo: str, frame: str, seed: int) -> Path:
    """File of a record below a folder of them: `BallPark-v0/ppo_reduced_0.json`.

    Args:
        folder: The folder.
        env_id: See `Record`.
        algo: See `Record`.
        frame: See `Record`.
        seed: See `Record`.
    """
    name = env_id.rpartition(":")[2].rpartition("/")[2]
    return folder / name / f"{algo}_{frame}_{seed}.json"


def record_of(found: Evaluation, **how: Any) -> Record:
    """The record of an evaluation.

    Args:
        found: On the evaluation set.
        **how: The attributes that are not of the evaluation.
    """
    return Record(
        env_id=found.env_id,
        policy=found.policy,
        settings=found.config,
        successes=found.successes,
        costs=found.costs,
        **how,
    )


def write_record(file: Path, record: Record) -> None:
    """Write a record, atomically; its folder is made if it is not there.

    Args:
        file: Its path.
        record: The record.
    """
    data: dict[str, Any] = {
        "format": FORMAT,
        **{key: getattr(record, key) for key in _PLAIN},
        "evaluation": {
            "version": VERSION,
            "seed": TEST_SEED,
            "starts": len(record.costs),
            "settings": dict(record.settings),
            "success_rate": record.success_rate,
            "cost_mean": None if np.isnan(record.cost_mean) else record.cost_mean,
        },
        "successes": "".join("01"[int(won)] for won in record.successes),
        "costs": record.costs.tolist(),
    }
    file.parent.mkdir(parents=True, exist_ok=True)
    write_document(file, data)


def read_record(file: Path) -> Record:
    """Read a record.

    Args:
        file: Its path.

    Raises:
        DamagedFileError: Of another format or evaluation set, or not complete.
        FileNotFoundError: No such file.
    """
    with read_document(file, FORMAT, _LIMIT, "write it anew from its run") as data:
        about, own = checked_values(data["evaluation"], _EVALUATION), checked_values(data, _PLAIN)
        if (about["version"], about["seed"]) != (VERSION, TEST_SEED):
            raise ValueError(f"version, seed = {about['version']}, {about['seed']}; expected "
                             f"{VERSION}, {TEST_SEED}")  # fmt: skip
        costs = exact_array(data["costs"], "costs", "n")
        successes = np.array([{"0": False, "1": True}[won] for won in data["successes"]])
        if not len(costs) == len(successes) == about["starts"]:
            raise ValueError("costs, successes: expected a number and 0 or 1 for each start")
        n = len(column(own["curve"]["cost_mean"], "cost_mean"))
        exact_array([own["curve"][name] for name in _CURVE], "curve", len(_CURVE), n)
        own["env_id"] = id_in_file(own["env_id"])
        return Record(**own, settings=about["settings"], successes=successes, costs=costs)


def read_records(folder: Path) -> Iterator[Record]:
    """All records below a folder that are of registered tasks and of the whole evaluation set.

    Args:
        folder: See `record_file`.
    """
    for file in sorted(folder.glob("*/*.json")):
        record = read_record(file)
        if len(record.costs) == N_STARTS and record.ranked:
            yield record
