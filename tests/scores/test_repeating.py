"""A result in a file can be played again, and tells when a number in it was changed."""

import json
import locale
import shutil
from dataclasses import replace

import pytest

from rigid_envs import load
from rigid_envs.base.files import sealed
from rigid_envs.engine.provenance import heading, provenance
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.records import read_evaluation
from rigid_envs.scores.repeating import repeat
from rigid_envs.scores.trained import file_of
from rigid_envs.tools.cli import main

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
    with pytest.raises(ValueError, match=r"^name = .*can be printed"):
        evaluate(ID, lambda seen: 1 / 0, n=N, name="a\nb")


def test_the_id_of_a_result_is_one_that_is_registered_already(saved, tmp_path):
    other = changed(saved, tmp_path, lambda row: row.update(env_id=f"trap:{ID}"), sealed)
    assert read_evaluation(other).env_id == ID
