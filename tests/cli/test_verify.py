"""`rigid-envs verify`: every law is shown, and one that fails fails the command."""

import json
import math
from pathlib import Path

import pytest

from rigid_envs.engine.provenance import heading, provenance
from rigid_envs.mechanics.laws import Outcome, Subject
from rigid_envs.tools import laws
from rigid_envs.tools.cli import main
from rigid_envs.tools.laws import SUBJECTS, Verdict, verify
from tests.fixtures import Capture, Patch

LAWS = [law for subject in SUBJECTS.values() for law in subject.laws]


@pytest.fixture
def found() -> Verdict:
    """As if all laws had been checked."""
    outcomes = [Outcome(law, 0.5 * law.bound, 0.1) for law in LAWS]
    return Verdict(provenance(), outcomes, 1.0)


@pytest.fixture
def planted(monkeypatch: Patch) -> Subject:
    """A subject of its own, in the place of all others."""
    subject = Subject("planted", "what a test has written down")
    monkeypatch.setattr(laws, "SUBJECTS", {"planted": subject})
    return subject


def plant(subject: Subject, measure: object, bound: float = 1.0) -> None:
    """Write down a law of that name."""
    subject.law("one with another", bound=bound, why="it has to be something")(measure)


def good() -> float:
    return 0.5


def bad() -> float:
    return 2.0


def no_number() -> float:
    return math.nan


def broken() -> float:
    raise ZeroDivisionError("nothing to divide by")


def test_the_table_shows_every_law_on_a_page_of_100_columns(found: Verdict) -> None:
    text = found.as_text()
    assert text.startswith(heading(provenance()).partition("\n")[0])
    assert max(map(len, text.splitlines())) <= 100
    for subject in SUBJECTS.values():
        assert f"\n{subject.name}: {subject.title}\n" in text
    assert text.count("  holds") == len(LAWS)
    assert f"All {len(LAWS)} laws hold" in text


def test_json_has_every_law_with_its_error_bound_and_reason(found: Verdict) -> None:
    document = json.loads(json.dumps(found.as_json(), allow_nan=False))
    assert document["holds"] is True
    assert [(row["subject"], row["name"]) for row in document["laws"]] == [
        (law.subject, law.name) for law in LAWS
    ]
    for row in document["laws"]:
        assert row["error"] == 0.5 * row["bound"]
        assert row["statement"] and row["compared"] and row["why"]
    assert {"versions", "kernel_hash", "cpu"} <= set(document["provenance"])


def test_json_alone_is_all_that_is_printed(planted: Subject, capsys: Capture) -> None:
    plant(planted, good)
    assert main(["verify", "planted", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["laws"][0]["error"] == 0.5


def test_json_goes_into_a_file_beside_the_table(
    planted: Subject, capsys: Capture, tmp_path: Path
) -> None:
    plant(planted, bad)
    file = tmp_path / "laws.json"
    assert main(["verify", "--json", str(file)]) == 1
    assert "FAILS" in capsys.readouterr().out
    assert json.loads(file.read_text())["holds"] is False


@pytest.mark.parametrize(
    ("measure", "complaint"),
    [
        (bad, "FAILS: planted: bad. error 2, bound 1: it has to be something"),
        (no_number, "FAILS: planted: no number. error nan, bound 1: it has to be something"),
        (broken, "FAILS: planted: broken. ZeroDivisionError: nothing to divide by"),
    ],
)
def test_a_law_that_fails_fails_the_run_and_says_why(
    planted: Subject, capsys: Capture, measure: object, complaint: str
) -> None:
    plant(planted, measure)
    plant(planted, good)
    assert main(["verify"]) == 1
    text = capsys.readouterr().out
    assert f"\n{complaint}\n" in f"{text}\n"
    assert "1 of 2 laws FAIL" in text
    assert "good" in text  # the others are checked all the same


@pytest.mark.parametrize(("length", "cut"), [(299, ""), (300, ""), (301, " ...")])
def test_a_long_message_is_cut(length: int, cut: str) -> None:
    said = ("of all words " * 30)[:length]
    text = Verdict(provenance(), [Outcome(LAWS[0], math.nan, 0.0, said)], 0.0).as_text()
    start = f"FAILS: {LAWS[0].subject}: {LAWS[0].name}. "
    assert f"{start}{said[:300].strip()}{cut} 1 of 1 laws FAIL" in " ".join(text.split())


def test_an_error_that_is_no_number_is_null_in_json(planted: Subject) -> None:
    plant(planted, no_number)
    (row,) = verify().as_json()["laws"]
    assert (row["error"], row["holds"]) == (None, False)


def test_subjects_can_be_chosen(capsys: Capture) -> None:
    assert main(["verify", "upright_coin", "upright_coin", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert {row["subject"] for row in document["laws"]} == {"upright_coin"}
    assert len(document["laws"]) == len(SUBJECTS["upright_coin"].laws)
