"""Rows of the leaderboard, read again: every figure must follow from the starts."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.catalogue import id_in_file
from rigid_envs.files import DamagedFileError, read_json
from rigid_envs.scores.best import best_known
from rigid_envs.scores.efficiency import Cost
from rigid_envs.scores.result import FORMAT, Evaluation, digest
from rigid_envs.scores.starts import TEST_SEED, VERSION

__all__ = ["evaluation_of", "read_evaluation", "up_to_date"]

_LIMIT = 2**24  # bytes
_PROVENANCE = (
    *("versions", "kernel_hash", "cpu", "cores", "system", "load"),
    *("git_commit", "git_dirty", "date"),
)


def read_evaluation(path: str | Path, *, anew: bool = False) -> Evaluation:
    """Read a row of the leaderboard, and compute its figures again.

    Args:
        path: A file that `Evaluation.save` wrote, or one with more entries beside.
        anew: Set it beside what is best known now, not what was then.

    Raises:
        DamagedFileError: Another format, other numbers than were written, or figures that do not
            follow from the starts.
        FileNotFoundError: No such file.
    """
    file = Path(path)
    try:
        found = evaluation_of(read_json(file, _LIMIT))
    except (KeyError, TypeError, ValueError) as error:
        why = f"no {error}" if isinstance(error, KeyError) else str(error)
        raise DamagedFileError(f"{file}: {why}; write it anew: Evaluation.save") from error
    return up_to_date(found) if anew else found


def evaluation_of(row: Mapping[str, Any]) -> Evaluation:
    """The evaluation that a row was made of.

    Args:
        row: JSON values.

    Raises:
        ValueError: Another format, other numbers than were written (a row of before digests has
            none), or figures that do not follow from the starts.
    """
    if row.get("format") != FORMAT or row.get("evaluation_version") != VERSION:
        raise ValueError(
            f"format = {row.get('format')!r}, evaluation_version = "
            f"{row.get('evaluation_version')!r}; expected {FORMAT!r}, {VERSION}"
        )
    if (written := row.get("sha256")) is not None and written != (now := digest(row)):
        raise ValueError(f"sha256 = {written!r}; expected {now!r}: numbers were changed")
    starts = {name: None if each is None else _array(each) for name, each in row["starts"].items()}
    best, bounds = starts.pop("best"), starts.pop("bound")
    known = {name: values for name, values in starts.items() if values is not None}
    lengths = {len(values) for values in (best, bounds, *known.values()) if values is not None}
    if len(lengths) != 1:
        raise ValueError(f"starts: numbers of entries {sorted(lengths)}; expected one for all")
    found = Evaluation(
        env_id=id_in_file(row["env_id"]),
        policy=row["algo"],
        config=row["config"],
        seed=row["test_seed"],
        cost=None if row["cost"] is None else Cost(*row["cost"]),
        values=known,
        best=best,
        bounds=bounds,
        provenance={key: row[key] for key in _PROVENANCE if key in row},
    )
    for name, value in json.loads(json.dumps(found.summary())).items():
        told = row["policy"].get(name)
        if told != value and not _close(told, value):
            raise ValueError(f"policy.{name} = {told!r}; expected {value!r}, as the starts have it")
    return found


def up_to_date(found: Evaluation) -> Evaluation:
    """An evaluation beside what is best known now, if it was beside what was then."""
    now = best_known(found.env_id)
    comparable = found.best is not None and found.seed == TEST_SEED
    if now is None or not comparable or found.n > len(now.costs):
        return found
    return found.against(now.costs[: found.n])


def _close(told: Any, value: Any) -> bool:
    """Whether numbers, or lists or mappings of them, agree but for rounding."""
    if isinstance(value, dict):
        return (
            isinstance(told, dict)
            and told.keys() == value.keys()
            and all(_close(told[key], value[key]) for key in value)
        )
    if told is None or value is None:
        return told is value
    try:
        return bool(np.allclose(told, value, rtol=1e-9, atol=1e-12))
    except (TypeError, ValueError):
        return False


def _array(values: list[Any]) -> npt.NDArray[np.float64]:
    return np.array(values, dtype=np.float64)  # None becomes NaN
