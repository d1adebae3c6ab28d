"""`rigid-envs verify --policies`: what is not what was published is told, and fails the command."""

import hashlib
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigid_envs.engine.provenance import heading, provenance
from rigid_envs.scores import repeating as published
from rigid_envs.scores import trained as loading
from rigid_envs.scores.records import Record, write_record
from rigid_envs.scores.trained import FOLDER, read_policy, write_policy
from rigid_envs.tools.cli import main
from tests.fixtures import Capture, Patch

NAMES = ("BallPark-v0", "Detumble-v0")
N = 6  # starts: the first of the published ones


@pytest.fixture
def shelf(tmp_path: Path, monkeypatch: Patch) -> Path:
    """A folder in the place of that of the published policies, with two, each of a few starts."""
    for name in NAMES:
        shutil.copy(FOLDER / f"{name}.safetensors", tmp_path)
        whole = published.published_record(name)
        few = replace(whole, successes=whole.successes[:N], costs=whole.costs[:N])
        write_record(tmp_path / f"{name}.json", few)
    for function in (
        loading.published,
        loading.file_of,
        published.published_record,
        published.published_evaluation,
    ):
        monkeypatch.setattr(function, "__defaults__", (tmp_path,))
    monkeypatch.setattr(published.recheck, "__defaults__", (None, tmp_path))
    return tmp_path


def rewritten(change: Callable[[Record], Record]) -> Callable[[Path], None]:
    """A change of the record of the first policy."""

    def act(folder: Path) -> None:
        write_record(folder / f"{NAMES[0]}.json", change(published.published_record(NAMES[0])))

    return act


def one_other_weight(folder: Path) -> None:
    """By its last bit."""
    file = folder / f"{NAMES[0]}.safetensors"
    document, arrays = read_policy(file)
    arrays["layers.0.bias"] = arrays["layers.0.bias"].copy()
    arrays["layers.0.bias"][0] = np.nextafter(arrays["layers.0.bias"][0], np.float32(np.inf))
    write_policy(file, document, arrays)


def other_cost(record: Record) -> Record:
    costs = record.costs.copy()
    costs[-1] = np.nextafter(costs[-1], 0.0)
    return replace(record, costs=costs)


def other_success(record: Record) -> Record:
    won = record.successes.copy()
    won[2] ^= True
    return replace(record, successes=won)


def other_file(record: Record) -> Record:
    return replace(record, policy_sha256=hashlib.sha256(b"another").hexdigest())


CHANGES: dict[str, tuple[Callable[[Path], None], str]] = {
    "one weight": (one_other_weight, "the record is of another file"),
    "the last digit of a cost": (rewritten(other_cost), "path: 1 of 6 starts differ"),
    "one success": (rewritten(other_success), "success: 1 of 6 starts differ, start 2 first"),
    "hash of the file": (rewritten(other_file), "the record is of another file"),
}


def rows(out: str) -> dict[str, str]:
    """The verdict on each policy."""
    lines = [line.split() for line in out.splitlines() if line.split()[:1]]
    return {words[0]: words[-1] for words in lines if words[0] in NAMES}


def test_what_is_as_it_was_published_holds(shelf: Path, capsys: Capture) -> None:
    assert main(["verify", "--policies"]) == 0
    out = capsys.readouterr().out
    assert rows(out) == dict.fromkeys(NAMES, "holds") and "FAILS" not in out
    assert "to the last digit: 2 policies" in out
    assert out.startswith(heading(provenance()).partition("\n")[0])


@pytest.mark.parametrize("what", CHANGES)
@pytest.mark.parametrize("order", [1, -1])
def test_one_difference_fails_its_policy_and_the_command_and_no_other_policy(
    shelf: Path, capsys: Capture, what: str, order: int
) -> None:
    change, said = CHANGES[what]
    change(shelf)
    assert main(["verify", "--policies", *NAMES[::order]]) == 1
    out = capsys.readouterr().out
    assert rows(out) == {NAMES[0]: "FAILS", NAMES[1]: "holds"}
    lines = [line for line in out.splitlines() if line.startswith("FAILS")]
    assert all(line.startswith(f"FAILS: {NAMES[0]}: ") for line in lines)
    assert any(said in line for line in lines)
    assert main(["verify", "--policies", NAMES[1]]) == 0


def test_from_other_starts_the_rate_of_success_is_compared_and_the_file_too(
    shelf: Path, capsys: Capture
) -> None:
    words = ["verify", "--policies", NAMES[0], "--seed", "7"]
    rewritten(other_cost)(shelf)  # that of the published starts says nothing here
    assert main(words) == 0
    assert "success from starts of seed 7, compared with the 95 %" in capsys.readouterr().out
    rewritten(lambda record: replace(record, successes=~record.successes))(shelf)
    assert main(words) == 1
    assert f"FAILS: {NAMES[0]}: success 1.000 of other starts; expected 0.000 to" in (
        capsys.readouterr().out
    )
    rewritten(lambda record: other_file(replace(record, successes=~record.successes)))(shelf)
    assert main(words) == 1
    assert f"FAILS: {NAMES[0]}: the record is of another file" in capsys.readouterr().out
