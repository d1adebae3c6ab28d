"""Records and results: what was written is read and can be played again, and nothing else."""

import json
import locale
import shutil
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from rigid_envs.base.files import DamagedFileError, sealed, write_document
from rigid_envs.engine.provenance import heading, provenance
from rigid_envs.scores.best import read_best, read_plans
from rigid_envs.scores.evaluation import evaluate, published_record, repeat
from rigid_envs.scores.records import read_evaluation, read_record, read_results, write_record
from rigid_envs.scores.starts import FLOOR, TEST_SEED, shared
from rigid_envs.scores.trained import file_of, load, published
from rigid_envs.tools.cli import main
from tests.loading.readers import READERS
from tests.refusals import refuses

PROVENANCE = tuple(provenance())
DOCS = Path(__file__).parents[2] / "docs"
FORGED = "ppo |\n| forged"


@pytest.fixture
def file(kind, tmp_path):
    """A good file of a kind."""
    READERS[kind].write(tmp_path / READERS[kind].name)
    return tmp_path / READERS[kind].name


@pytest.mark.parametrize("won", [False, True])
def test_a_record_is_read_as_it_was_written(tmp_path, won):
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
def test_records_of_other_formats_and_starts_are_refused(about, changed, tmp_path):
    file = tmp_path / "record.json"
    write_record(file, published_record(published()[0]))
    data = json.loads(file.read_text()) | about
    data["evaluation"] |= changed
    write_document(file, data)
    with pytest.raises(DamagedFileError, match=r"record\.json: (format|version = |seed = |costs)"):
        read_record(file)


def test_of_a_record_of_version_1_the_starts_of_now_are_read():
    file = next(DOCS.glob("baselines/SleepingTop-v0/ppo_reduced_*.json"))
    data, record = json.loads(file.read_text()), read_record(file)
    assert data["evaluation"]["version"] == 1 and len(data["costs"]) == 500
    kept = shared(1, 500)
    np.testing.assert_array_equal(record.costs, np.array(data["costs"])[kept])
    assert [data["successes"][k] == "1" for k in kept] == record.successes.tolist()
    assert record.evaluation.unranked is None and record.evaluation.n == len(kept) == 450


@pytest.mark.parametrize(("seed", "n"), [(TEST_SEED, len(shared(1, 40))), (7, 40)])
def test_of_a_result_of_version_1_the_starts_of_now_are_read(seed, n, tmp_path):
    now = evaluate(ID, "zero", n=40, seed=seed)
    row = now.row() | {"evaluation_version": 1, "cost": [*now.cost[:2], 0.01]}
    (tmp_path / "row.json").write_text(json.dumps(sealed(row)))
    then = read_evaluation(tmp_path / "row.json")
    assert then.n == n and then.cost == now.cost and then.cost.floor == FLOOR
    kept = shared(1, 40) if n < 40 else np.arange(40)
    for name, values in now.values.items():
        np.testing.assert_array_equal(then.values[name], values[kept])
    if now.best is not None:
        np.testing.assert_array_equal(then.best, now.best[kept])


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
def test_what_figures_come_from_is_told_in_full_by_every_file_of_figures(kind, part, names, file):
    whole = json.loads(file.read_text())
    assert READERS[kind].read(file)
    for name in names:
        for wrong in ({}, {name: [{}]}):
            told = whole[part] if part else whole
            told = {key: value for key, value in told.items() if key != name} | wrong
            write_document(file, whole | {part: told} if part else told)
            with pytest.raises(DamagedFileError, match=f"{name}|{part or name}"):
                READERS[kind].read(file)


@pytest.mark.parametrize("kind", ["record", "best", "result"])
def test_figures_of_no_version_of_this_library_are_refused(kind, file):
    whole = json.loads(file.read_text())
    told = whole.get("provenance", whole)
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
def test_a_file_of_more_bytes_than_make_sense_is_not_read(read, limit, tmp_path):
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
def test_text_that_would_steer_a_terminal_or_forge_a_row_is_refused(kind, key, value, file):
    write_document(file, json.loads(file.read_text()) | {key: value})
    with pytest.raises(DamagedFileError, match="can be printed"):
        READERS[kind].read(file)


ID = "RigidEnvs/Detumble-v0"
N = 6


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A result of a trained policy in another task than the registered one, from other starts."""
    file = tmp_path_factory.mktemp("result") / "mine.json"
    config = {"frame": "reduced", "dt": 0.09, "observation_noise": 0.01}
    evaluate(ID, load("Detumble"), n=N, config=config, seed=7).save(file)
    return file


def changed(file, folder, change, seal=lambda row: row):
    row = json.loads(file.read_text())
    change(row)
    other = folder / "other.json"
    other.write_text(json.dumps(seal(row)))
    return other


def test_the_same_policy_gives_the_same_numbers(saved):
    again = repeat(saved, "Detumble")
    assert not again.differences
    assert again.now.values["cost"].tobytes() == again.then.values["cost"].tobytes()
    assert again.now.config == again.then.config


def test_another_policy_is_told_by_the_numbers_that_differ(saved):
    told = f"return: {N} of {N} starts differ, start 0 first"
    assert any(line.startswith(told) for line in repeat(saved, "zero").differences)


def test_a_quantity_that_was_not_yet_counted_is_told(tmp_path):
    found = evaluate(ID, "brake", n=N)
    values = {name: each for name, each in found.values.items() if name != "time"}
    file = replace(found, values=values).save(tmp_path / "row.json")
    assert repeat(file).differences == ("time: only now",)


@pytest.mark.parametrize("policy", ["brake", "zero", "random"])
def test_what_a_result_names_need_not_be_told(policy, tmp_path):
    file = evaluate(ID, policy, n=N).save(tmp_path / "row.json")
    assert not repeat(file).differences


def test_a_published_policy_is_known_by_its_record(tmp_path):
    file = evaluate(ID, load("Detumble"), n=N).save(tmp_path / "row.json")
    assert not repeat(file).differences
    with pytest.raises(ValueError, match=r"algo = 'mine'; expected a controller of .*or its file"):
        repeat(changed(file, tmp_path, lambda row: row.update(algo="mine"), sealed))


def test_the_digest_does_not_depend_on_the_order_of_keys_or_on_the_locale(saved):
    row = json.loads(saved.read_text())
    backwards = dict(reversed([(k, v) for k, v in row.items()]))
    backwards["starts"] = dict(reversed(row["starts"].items()))
    assert sealed(backwards)["sha256"] == row["sha256"]
    before = locale.setlocale(locale.LC_ALL)
    try:
        locale.setlocale(locale.LC_ALL, "C")
        assert sealed(row)["sha256"] == row["sha256"]
    finally:
        locale.setlocale(locale.LC_ALL, before)


def test_the_command_plays_results_again(saved, tmp_path, capsys):
    policy = shutil.copy(file_of("Detumble"), tmp_path / "policy.safetensors")
    assert main(["verify", str(saved), "--policy", str(policy)]) == 0
    said = capsys.readouterr().out
    assert said.startswith(heading(provenance()).partition("\n")[0])
    assert f"{saved}: {ID}, {load('Detumble').name}, {N} starts of seed 7\n" in said
    assert "every number of every start is the same, to the last digit" in said
    assert main(["verify", str(saved), str(saved), "--policy", "zero"]) == 1
    said = capsys.readouterr().out
    assert said.count("FAILS: return") == said.count("success 100.0 % then, 0.0 % now") == 2
    assert "every number" not in said
    assert main(["verify", str(saved), "rotations"]) == 2
    said = "SUBJECT = ['rotations']; expected only FILE.json, --policy"
    assert said in capsys.readouterr().err
    assert main(["verify", "none.json"]) == 1
    assert "none.json" in capsys.readouterr().err


def test_a_name_that_could_not_be_read_again_is_refused_before_anything_is_played():
    message, policy = r"^name = .*can be printed", lambda seen: 1 / 0
    refuses(message, evaluate, ID, policy, n=N, name="a\nb")
    policy.__name__ = "a\nb"
    refuses(message, evaluate, ID, policy, n=N)


def test_the_id_of_a_result_is_one_that_is_registered_already(saved, tmp_path):
    other = changed(saved, tmp_path, lambda row: row.update(env_id=f"trap:{ID}"), sealed)
    assert read_evaluation(other).env_id == ID


def test_a_result_of_another_evaluation_set_is_refused(saved, tmp_path):
    other = changed(saved, tmp_path, lambda row: row.update(evaluation_version=0), sealed)
    with pytest.raises(DamagedFileError, match="evaluation_version = 0; expected 1 to 2"):
        read_evaluation(other)
