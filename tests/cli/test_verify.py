"""`rigid-envs verify`: laws and published policies; what does not hold is told and fails it."""

import hashlib
import json
import math
import shutil
import subprocess
import time
from dataclasses import replace

import numpy as np
import pytest

from rigid_envs.engine import provenance as about
from rigid_envs.engine.provenance import heading, provenance
from rigid_envs.mechanics.laws import Outcome, Subject
from rigid_envs.scores import evaluation as published
from rigid_envs.scores import trained as loading
from rigid_envs.scores.records import write_record
from rigid_envs.scores.trained import FOLDER, read_policy, write_policy
from rigid_envs.tools import laws
from rigid_envs.tools.cli import main
from rigid_envs.tools.laws import SUBJECTS, Verdict, verify

LAWS = [law for subject in SUBJECTS.values() for law in subject.laws]


@pytest.fixture
def found():
    """As if all laws had been checked."""
    outcomes = [Outcome(law, 0.5 * law.bound, 0.1) for law in LAWS]
    return Verdict(provenance(), outcomes, 1.0)


@pytest.fixture
def planted(monkeypatch):
    """A subject of its own, in the place of all others."""
    subject = Subject("planted", "what a test has written down")
    monkeypatch.setattr(laws, "SUBJECTS", {"planted": subject})
    return subject


def plant(subject, measure, bound=1.0):
    """Write down a law of that name."""
    subject.law("one with another", bound=bound, why="it has to be something")(measure)


def good():
    return 0.5


def bad():
    return 2.0


def no_number():
    return math.nan


def broken():
    raise ZeroDivisionError("nothing to divide by")


def test_the_table_shows_every_law_on_a_page_of_100_columns(found):
    text = found.as_text()
    assert text.startswith(heading(provenance()).partition("\n")[0])
    assert max(map(len, text.splitlines())) <= 100
    assert max(map(len, heading(provenance() | {"cpu": 99 * "x "}).splitlines())) <= 100
    for subject in SUBJECTS.values():
        assert f"\n{subject.name}: {subject.title}\n" in text
    assert text.count("  holds") == len(LAWS)
    assert f"All {len(LAWS)} laws hold" in text


def test_json_has_every_law_with_its_error_bound_and_reason(found):
    document = json.loads(json.dumps(found.as_json(), allow_nan=False))
    assert document["holds"] is True
    assert [(row["subject"], row["name"]) for row in document["laws"]] == [
        (law.subject, law.name) for law in LAWS
    ]
    for row in document["laws"]:
        assert row["error"] == 0.5 * row["bound"]
        assert row["statement"] and row["compared"] and row["why"]
    assert {"versions", "kernel_hash", "cpu"} <= set(document["provenance"])


def test_json_alone_is_all_that_is_printed(planted, capsys):
    plant(planted, good)
    assert main(["verify", "planted", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["laws"][0]["error"] == 0.5


def test_json_goes_into_a_file_beside_the_table(planted, capsys, tmp_path):
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
def test_a_law_that_fails_fails_the_run_and_says_why(planted, capsys, measure, complaint):
    plant(planted, measure)
    plant(planted, good)
    assert main(["verify"]) == 1
    text = capsys.readouterr().out
    assert f"\n{complaint}\n" in f"{text}\n"
    assert "1 of 2 laws FAIL" in text
    assert "good" in text  # the others are checked all the same


@pytest.mark.parametrize(("length", "cut"), [(299, ""), (300, ""), (301, " ...")])
def test_a_long_message_is_cut(length, cut):
    said = ("of all words " * 30)[:length]
    text = Verdict(provenance(), [Outcome(LAWS[0], math.nan, 0.0, said)], 0.0).as_text()
    start = f"FAILS: {LAWS[0].subject}: {LAWS[0].name}. "
    assert f"{start}{said[:300].strip()}{cut} 1 of 1 laws FAIL" in " ".join(text.split())


def test_an_error_that_is_no_number_is_null_in_json(planted):
    plant(planted, no_number)
    (row,) = verify().as_json()["laws"]
    assert (row["error"], row["holds"]) == (None, False)


def test_subjects_can_be_chosen(capsys):
    assert main(["verify", "upright_coin", "upright_coin", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert {row["subject"] for row in document["laws"]} == {"upright_coin"}
    assert len(document["laws"]) == len(SUBJECTS["upright_coin"].laws)


NAMES = ("BallPark-v0", "Detumble-v0")
N = 6  # starts: the first of the published ones


@pytest.fixture
def shelf(tmp_path, monkeypatch):
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


def rewritten(change):
    """A change of the record of the first policy."""

    def act(folder):
        write_record(folder / f"{NAMES[0]}.json", change(published.published_record(NAMES[0])))

    return act


def one_other_weight(folder):
    """By its last bit."""
    file = folder / f"{NAMES[0]}.safetensors"
    document, arrays = read_policy(file)
    arrays["layers.0.bias"] = arrays["layers.0.bias"].copy()
    arrays["layers.0.bias"][0] = np.nextafter(arrays["layers.0.bias"][0], np.float32(np.inf))
    write_policy(file, document, arrays)


def other_cost(record):
    costs = record.costs.copy()
    costs[-1] = np.nextafter(costs[-1], 0.0)
    return replace(record, costs=costs)


def other_success(record):
    won = record.successes.copy()
    won[2] ^= True
    return replace(record, successes=won)


def other_file(record):
    return replace(record, policy_sha256=hashlib.sha256(b"another").hexdigest())


CHANGES = {
    "one weight": (one_other_weight, "the record is of another file"),
    "the last digit of a cost": (rewritten(other_cost), "path: 1 of 6 starts differ"),
    "one success": (rewritten(other_success), "success: 1 of 6 starts differ, start 2 first"),
    "hash of the file": (rewritten(other_file), "the record is of another file"),
}


def rows(out):
    """The verdict on each policy."""
    lines = [line.split() for line in out.splitlines() if line.split()[:1]]
    return {words[0]: words[-1] for words in lines if words[0] in NAMES}


def test_what_is_as_it_was_published_holds(shelf, capsys):
    begin = time.perf_counter()
    assert main(["verify", "--policies"]) == 0
    out, took = capsys.readouterr().out, time.perf_counter() - begin
    assert rows(out) == dict.fromkeys(NAMES, "holds") and "FAILS" not in out
    seconds = [float(line.split()[-2]) for line in out.splitlines() if line.endswith("holds")]
    assert len(seconds) == 2 and min(seconds) >= 0.0 and sum(seconds) <= took + 0.1  # rounded
    assert "to the last digit: 2 policies" in out
    for name in NAMES:  # both of it, then and now
        share = published.published_evaluation(name).efficiency.mean
        assert out.split().count(f"{share:.4f}") == 2
    assert out.startswith(heading(provenance()).partition("\n")[0])


@pytest.mark.parametrize("what", CHANGES)
@pytest.mark.parametrize("order", [1, -1])
def test_one_difference_fails_its_policy_and_the_command_and_no_other_policy(
    shelf, capsys, what, order
):
    change, said = CHANGES[what]
    change(shelf)
    assert main(["verify", "--policies", *NAMES[::order]]) == 1
    out = capsys.readouterr().out
    assert rows(out) == {NAMES[0]: "FAILS", NAMES[1]: "holds"}
    lines = [line for line in out.splitlines() if line.startswith("FAILS")]
    assert all(line.startswith(f"FAILS: {NAMES[0]}: ") for line in lines)
    assert any(said in line for line in lines)
    assert main(["verify", "--policies", NAMES[1]]) == 0


def test_from_other_starts_the_rate_of_success_is_compared_and_the_file_too(shelf, capsys):
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


WHERE = {
    "versions": {"rigid-envs": "1.2", "numpy": "2.0"},
    "cpu": "Some CPU",
    "cores": 2,
    "load": None,
    "git_commit": None,
    "git_dirty": None,
    "kernel_hash": "abc",
    "date": "2026-01-01",
}


@pytest.mark.parametrize(
    ("known", "said"),
    [
        ({}, ""),
        ({"load": 0.04}, "; load before 0.0"),
        ({"git_commit": "0123456789", "git_dirty": False}, "; commit 012345678"),
        ({"git_commit": "0123456789", "git_dirty": True}, "; commit 012345678 and changes"),
    ],
    ids=str,
)
def test_a_heading_says_load_and_commit_where_they_are_known(known, said):
    first, second = heading(WHERE | known).splitlines()
    assert first == "rigid-envs 1.2, numpy 2.0"
    assert second == f"Some CPU, 2 cores{said}; kernels abc; 2026-01-01"


def test_the_load_is_that_of_the_last_minute_where_the_system_tells_it(monkeypatch):
    monkeypatch.setattr("os.getloadavg", lambda: (0.5, 0.6, 0.7), raising=False)
    assert provenance()["load"] == 0.5
    monkeypatch.delattr("os.getloadavg")
    assert provenance()["load"] is None


def test_a_commit_is_that_of_the_checkout_and_of_no_repository_around_it(monkeypatch, tmp_path):
    subprocess.run(["git", "init", "--quiet", tmp_path], check=True)
    for root, asked in ((tmp_path, ".git"), (tmp_path / "site-packages", None)):
        root.mkdir(exist_ok=True)
        monkeypatch.setattr(about, "_ROOT", root)
        assert about._git("rev-parse", "--git-dir") == asked
