"""Records of trained policies, and rows in files."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base import files
from rigid_envs.base.checks import Array, exact_array, require
from rigid_envs.engine.provenance import KINDS
from rigid_envs.envs.lookup import id_in_file, task_of
from rigid_envs.scores.proof import best_of, objection, up_to_date
from rigid_envs.scores.result import FORMAT, Evaluation
from rigid_envs.scores.starts import (
    FLOOR,
    N_STARTS,
    TEST_SEED,
    VERSION,
    Cost,
    cost_of,
    shared,
)
from rigid_envs.tasks.registry import ENVIRONMENTS

# Records of trained policies: how each was trained, and what came of it from every start.
#
# A record holds success and cost from each start as they are, to the last digit: the policy gives
# the same numbers on every machine. What follows from them (rates, efficiencies, intervals) is
# computed where it is shown, against the best that is known then.

RECORD_FORMAT = "rigid-envs record 1"

_RECORD_LIMIT = 2**20  # bytes
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

    @cached_property
    def evaluation(self) -> Evaluation:
        """Its episodes, beside what is best known now."""
        n, known = len(self.costs), self.env_id in ENVIRONMENTS
        cost = cost_of(self.env_id, task_of(self.env_id, self.settings)) if known else None
        unranked = objection(self.env_id, self.settings, TEST_SEED, n)
        name = "cost" if cost is None else cost.name
        return Evaluation(
            env_id=self.env_id,
            policy=self.policy,
            config=self.settings,
            seed=TEST_SEED,
            cost=cost,
            values={"success": self.successes.astype(np.float64), name: self.costs},
            provenance=self.provenance,
            unranked=unranked,
            best=None if unranked else best_of(self.env_id, n),
        )


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


def write_record(file: Path, record: Record) -> None:
    """Write a record, atomically; its folder is made if it is not there.

    Args:
        file: Its path.
        record: The record.
    """
    figures = record.evaluation.figures()
    data: dict[str, Any] = {
        "format": RECORD_FORMAT,
        **{key: getattr(record, key) for key in _PLAIN},
        "evaluation": {
            "version": VERSION,
            "seed": TEST_SEED,
            "starts": len(record.costs),
            "settings": dict(record.settings),
            **{key: figures[key] for key in ("success_rate", "cost_mean")},
        },
        "successes": "".join("01"[int(won)] for won in record.successes),
        "costs": record.costs.tolist(),
    }
    file.parent.mkdir(parents=True, exist_ok=True)
    files.write_document(file, data)


def read_record(file: Path) -> Record:
    """Read a record; of one of version 1, the starts that are in the evaluation set of now.

    Args:
        file: Its path.

    Raises:
        DamagedFileError: Of another format or evaluation set, or not complete.
        FileNotFoundError: No such file.
    """
    mend = "write it anew from its run"
    with files.read_document(file, RECORD_FORMAT, _RECORD_LIMIT, mend) as data:
        about = files.checked_values(data["evaluation"], _EVALUATION)
        own = files.checked_values(data, _PLAIN)
        version, seed = about["version"], about["seed"]
        require(1 <= version <= VERSION, version, "version", f"1 to {VERSION}")
        require(seed == TEST_SEED, seed, "seed", str(TEST_SEED))
        costs = exact_array(data["costs"], "costs", "n")
        successes = np.array([{"0": False, "1": True}[won] for won in data["successes"]])
        if not len(costs) == len(successes) == about["starts"]:
            raise ValueError("costs, successes: expected a number and 0 or 1 for each start")
        n = len(files.column(own["curve"]["cost_mean"], "cost_mean"))
        exact_array([own["curve"][name] for name in _CURVE], "curve", len(_CURVE), n)
        own["env_id"] = id_in_file(own["env_id"])
        kept = shared(version, len(costs))
        own |= {"settings": about["settings"], "successes": successes[kept], "costs": costs[kept]}
        return Record(**own)


def read_records(folder: Path) -> Iterator[Record]:
    """All records below a folder that are of registered tasks and of a whole evaluation set.

    Of the set of version 1, these are the starts that are in that of now.

    Args:
        folder: See `record_file`.
    """
    whole = {len(shared(version, N_STARTS)) for version in range(1, VERSION + 1)}
    for file in sorted(folder.glob("*/*.json")):
        record = read_record(file)
        if len(record.costs) in whole and record.evaluation.unranked is None:
            yield record


# Rows of the leaderboard, read again: every figure must follow from the starts.

_LIMIT = 2**24  # bytes
_MEND = "write it anew: rigid-envs evaluate --out"
_KINDS = {
    **{"env_id": str, "algo": str, "config": dict, "policy": dict, "starts": dict},
    **{"evaluation_version": int, "test_seed": int, "cost": list | None, "unranked": str | None},
}
_LEAST = ("success", "return", "length", "cost")


def read_evaluation(path: str | Path, *, anew: bool = False) -> Evaluation:
    """Read a row of the leaderboard, and compute its figures again.

    Args:
        path: A file that `Evaluation.save` wrote, or one with more entries beside.
        anew: Set it beside what is best known and what theory says now, not what was then.

    Raises:
        DamagedFileError: Another format, something else than was written, or figures that do not
            follow from the starts.
        FileNotFoundError: No such file.
    """
    with files.read_document(Path(path), FORMAT, _LIMIT, _MEND) as row:
        found = evaluation_of(row)
        return up_to_date(found) if anew else found


def read_results(folder: Path) -> list[Evaluation]:
    """All results below a folder, beside what is known best and what theory says now.

    Args:
        folder: Where to look for JSON files; what is no result is left out.

    Raises:
        DamagedFileError: No JSON, or a result that `read_evaluation` refuses.
    """
    found = []
    for file in sorted(folder.rglob("*.json")):
        content = files.read_json(file, _LIMIT)
        if isinstance(content, dict) and _is_row(content):
            with files.named_damage(file, _MEND):
                found.append(up_to_date(evaluation_of(files.opened(content, FORMAT))))
    return [each for each in found if each.env_id in ENVIRONMENTS]


def _is_row(content: Mapping[str, Any]) -> bool:
    """Whether this is a result, of any version, or was one before its format was damaged."""
    kind, _, _ = FORMAT.rpartition(" ")
    return str(content.get("format")).startswith(kind) or {"starts", "sha256"} <= content.keys()


def evaluation_of(row: Mapping[str, Any]) -> Evaluation:
    """The evaluation that a row was made of.

    Args:
        row: JSON values.

    Raises:
        KeyError: An entry that is not there.
        ValueError: One that is not what it must be, or figures that do not follow from the starts.
    """
    own, where = files.checked_values(row, _KINDS), files.checked_values(row, KINDS)
    version, n = own["evaluation_version"], row["policy"]["episodes"]
    require(1 <= version <= VERSION, version, "evaluation_version", f"1 to {VERSION}")
    starts = {
        name: None if values is None else _of_starts(values, f"starts.{name}", n)
        for name, values in own["starts"].items()
    }
    best, bounds = starts.pop("best"), starts.pop("bound")
    known = {name: values for name, values in starts.items() if values is not None}
    for name in _LEAST:
        require(bool(np.isfinite(known[name]).all()), known[name], f"starts.{name}", "numbers")
    won = known["success"]
    require((won == 0.0) | (won == 1.0), won, "starts.success", "0 or 1")
    found = Evaluation(
        env_id=id_in_file(own["env_id"]),
        policy=own["algo"],
        config=own["config"],
        seed=own["test_seed"],
        cost=None if own["cost"] is None else _cost(own["cost"], known),
        values=known,
        best=best,
        bounds=bounds,
        provenance=where,
        unranked=own["unranked"],
    )
    for name, value in json.loads(json.dumps(found.summary())).items():
        told = own["policy"][name]
        if told != value and not _close(told, value):
            raise ValueError(f"policy.{name} = {told!r}; expected {value!r}, as the starts have it")
    return found if version == VERSION else _of_now(found, version)


def _of_now(found: Evaluation, version: int) -> Evaluation:
    """From the starts of an older set that are in that of now, and with its least cost."""
    kept = shared(version, found.n) if found.seed == TEST_SEED else np.arange(found.n)
    cost = found.cost
    if cost is not None and cost.name != "time":
        cost = cost._replace(floor=FLOOR)
    best, bounds = (None if a is None else a[kept] for a in (found.best, found.bounds))
    values = {name: each[kept] for name, each in found.values.items()}
    return replace(found, cost=cost, values=values, best=best, bounds=bounds)


def _close(told: Any, value: Any) -> bool:
    """Whether numbers, or lists or mappings of them, agree but for rounding."""
    if isinstance(value, dict):
        alike = isinstance(told, dict) and told.keys() == value.keys()
        return alike and all(_close(told[key], value[key]) for key in value)
    if value is None:
        return told is None
    try:
        return bool(np.allclose(told, value, rtol=1e-9, atol=1e-12))
    except (TypeError, ValueError):
        return False


def _of_starts(values: Any, name: str, n: int) -> Array:
    found = files.column(values, name)
    require(len(found) == n, len(found), f"number of {name}", f"{n}, as there are episodes")
    return found


def _cost(entries: list[Any], known: Mapping[str, Array]) -> Cost:
    """The cost of an episode, one of the known quantities."""
    cost = Cost(*entries)
    files.checked_values(cost._asdict(), {"name": str, "unit": str, "floor": float})
    require(cost.name in known, cost.name, "cost", f"one of {sorted(known)}")
    return cost
