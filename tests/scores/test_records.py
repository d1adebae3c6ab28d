"""Records of trainings: what was written is read, and nothing else."""

import json
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigid_envs.base.files import DamagedFileError, write_document
from rigid_envs.engine.provenance import provenance
from rigid_envs.scores.best import read_best, read_plans
from rigid_envs.scores.records import read_evaluation, read_record, read_results, write_record
from rigid_envs.scores.repeating import published_record
from rigid_envs.scores.trained import load, published
from tests.loading.readers import READERS

PROVENANCE = tuple(provenance())
FORGED = "ppo |\n| forged"


@pytest.fixture
def file(kind: str, tmp_path: Path) -> Path:
    """A good file of a kind."""
    READERS[kind].write(tmp_path / READERS[kind].name)
    return tmp_path / READERS[kind].name


@pytest.mark.parametrize("won", [False, True])
def test_a_record_is_read_as_it_was_written(tmp_path: Path, won: bool) -> None:
    record, file = published_record(published()[0]), tmp_path / "new" / "record.json"
    record = replace(record, successes=np.full(500, won))
    write_record(file, record)
    again = read_record(file)
    for field in fields(record):
        np.testing.assert_equal(getattr(again, field.name), getattr(record, field.name))
    cost = json.loads(file.read_text())["evaluation"]["cost_mean"]
    assert cost == (pytest.approx(record.costs.mean()) if won else None)


@pytest.mark.parametrize(
    ("about", "changed"),
    [
        ({"format": "rigid-envs record 0"}, {}),
        *(({}, changed) for changed in ({"version": 0}, {"seed": 5}, {"starts": 499})),
    ],
)
def test_records_of_other_formats_and_starts_are_refused(
    about: dict[str, Any], changed: dict[str, Any], tmp_path: Path
) -> None:
    file = tmp_path / "record.json"
    write_record(file, published_record(published()[0]))
    data = json.loads(file.read_text()) | about
    data["evaluation"] |= changed
    write_document(file, data)
    with pytest.raises(DamagedFileError, match=r"record\.json: (format|version, seed = |costs)"):
        read_record(file)


@pytest.mark.parametrize(
    ("kind", "part", "names"),
    [
        ("record", "provenance", PROVENANCE),
        ("record", "training", ("timesteps", "policy_timesteps", "seconds", "cpu_seconds")),
        ("record", "curve", ("timesteps", "success_rate", "return_mean", "cost_mean")),
        ("record", "evaluation", ("version", "seed", "starts", "settings")),
        ("best", "provenance", PROVENANCE),
        ("best", "evaluation_set", ("version", "seed", "starts")),
        ("result", "", PROVENANCE),
    ],
)
def test_what_figures_come_from_is_told_in_full_by_every_file_of_figures(
    kind: str, part: str, names: tuple[str, ...], file: Path
) -> None:
    whole = json.loads(file.read_text())
    assert READERS[kind].read(file)
    wrong: dict[str, Any]
    for name in names:
        for wrong in ({}, {name: [{}]}):
            told = whole[part] if part else whole
            told = {key: value for key, value in told.items() if key != name} | wrong
            write_document(file, whole | {part: told} if part else told)
            with pytest.raises(DamagedFileError, match=f"{name}|{part or name}"):
                READERS[kind].read(file)


@pytest.mark.parametrize("kind", ["record", "best", "result"])
def test_figures_of_no_version_of_this_library_are_refused(kind: str, file: Path) -> None:
    whole = json.loads(file.read_text())
    told = whole.get("provenance", whole)
    wrong: dict[str, Any]
    for wrong in ({}, {"rigid-envs": [{}]}):
        told["versions"] = wrong
        write_document(file, whole)
        with pytest.raises(DamagedFileError, match="rigid-envs"):
            READERS[kind].read(file)


@pytest.mark.parametrize(
    ("read", "limit"),
    [
        *((read_record, 2**20), (read_best, 2**20), (read_evaluation, 2**24), (read_plans, 2**25)),
        (load, 2**28),
        (lambda file: read_results(file.parent), 2**24),
    ],
)
def test_a_file_of_more_bytes_than_make_sense_is_not_read(
    read: Callable[[Path], Any], limit: int, tmp_path: Path
) -> None:
    with (tmp_path / "file.json").open("wb") as sparse:
        sparse.truncate(limit + 1)
    with pytest.raises(DamagedFileError, match=f"{limit + 1} bytes; expected at most {limit}"):
        read(tmp_path / "file.json")


@pytest.mark.parametrize(
    ("kind", "key", "value"),
    [
        *(("record", key, FORGED) for key in ("policy", "algo", "env_id")),
        ("record", "config", {"a": FORGED}),
        ("best", "finders", ["a\x1b[2J"]),
        ("result", "algo", "\x1b]0;owned\x07"),
        ("result", "algo", "zero |\n| forged | 1.000"),
        ("result", "config", {"frame": "\x1b[2J"}),
        ("result", "cost", ["loss", "\x1b[2J", 0.0]),
        ("result", "versions", {"rigid-envs": "\x1b[2J"}),
        ("result", "env_id", "\x1b[2J"),
    ],
)
def test_text_that_would_steer_a_terminal_or_forge_a_row_is_refused(
    kind: str, key: str, value: Any, file: Path
) -> None:
    write_document(file, json.loads(file.read_text()) | {key: value})
    with pytest.raises(DamagedFileError, match="can be printed"):
        READERS[kind].read(file)
