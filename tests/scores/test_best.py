"""Best known costs: the least of those who succeeded, in files that say who and when."""

import json
from dataclasses import replace

import numpy as np
import pytest

from rigid_envs import load
from rigid_envs.base.files import DamagedFileError, write_document
from rigid_envs.engine.provenance import heading, provenance
from rigid_envs.scores.best import (
    FOLDER,
    FORMAT,
    best_known,
    file_of,
    nobody,
    read_best,
    write_best,
)
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.finding import find, trained
from rigid_envs.scores.policies import from_controller, reference_controllers
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli import main
from rigid_envs.tools.cli.scoring import verify_scores
from rigid_envs.watch.replays.recording import record_starts

DETUMBLE = "RigidEnvs/Detumble-v0"
GRID = "RigidEnvs/BallGrid-v0"


def test_the_least_cost_of_a_success_is_kept_with_who_found_it():
    known = nobody(DETUMBLE, "loss", 4).improved("a", [1, 1, 0, 0], [3.0, 2.0, 0.0, 0.0])
    known = known.improved("b", [1, 1, 1], [3.0 * (1 - 1e-12), 1.0, 5.0])
    np.testing.assert_array_equal(known.costs, [3.0, 1.0, 5.0, np.nan])
    assert known.finders == ("a", "b", "b", "") and known.shares == {"b": 2, "a": 1}


def test_the_data_are_of_every_id_and_say_where_they_come_from():
    assert {path.name for path in FOLDER.iterdir()} == {file_of(i).name for i in ENVIRONMENTS}
    for env_id in ENVIRONMENTS:
        data, known = json.loads(file_of(env_id).read_text()), best_known(env_id)
        assert data["format"] == FORMAT and data["env_id"] == env_id
        assert data["evaluation_set"] == {"version": 1, "seed": 314159, "starts": 500}
        assert {"versions", "kernel_hash", "git_commit", "date"} <= data["provenance"].keys()
        assert known.costs.shape == (500,) and np.isfinite(known.costs).all()
        assert list(known.policies) == [*ENVIRONMENTS[env_id].controllers, "zero", "random"]


def test_the_data_can_be_computed_again(capsys):
    assert verify_scores([DETUMBLE])
    out = capsys.readouterr().out
    assert out.startswith(heading(provenance()).partition("\n")[0]) and out.count("holds") == 5


def test_the_random_policy_draws_the_actions_that_its_figures_are_of():
    told, found = best_known(DETUMBLE).policies["random"], evaluate(DETUMBLE, "random").summary()
    assert found["return_mean"] == pytest.approx(told["return_mean"], rel=1e-9)


def test_published_policies_are_among_those_who_search():
    (found,) = trained(GRID, 20)
    assert found.n == 20 and found.policy == load(GRID).name and found.successes.all()


def test_data_that_have_been_changed_are_found(monkeypatch, capsys):
    known = best_known(DETUMBLE)
    changed = replace(known, costs=0.99 * known.costs)
    monkeypatch.setattr("rigid_envs.scores.best.best_known", lambda _: changed)
    assert main(["verify", "--scores", DETUMBLE]) == 1
    assert "riccati" in next(x for x in capsys.readouterr().out.splitlines() if "FAILS" in x)


def test_figures_that_differ_are_told_of_their_policies_alone(monkeypatch, capsys):
    known = best_known(DETUMBLE)
    (found,) = trained(DETUMBLE)
    start = int(np.flatnonzero(found.successes)[0])
    finders = (*known.finders[:start], found.policy, *known.finders[start + 1 :])
    who = found.policy.split()[0]
    for cost, rate, told in ((1e-8, 0.9e-3, {who}), (0.0, 1.1e-3, {"zero"})):
        costs, zero = known.costs.copy(), dict(known.policies["zero"])
        costs[start] = found.costs[start] * (1.0 - cost)
        zero["success_rate"] += rate
        policies = {**known.policies, "zero": zero}
        changed = replace(known, costs=costs, finders=finders, policies=policies)
        monkeypatch.setattr("rigid_envs.scores.best.best_known", lambda _, changed=changed: changed)
        assert main(["verify", "--scores", DETUMBLE]) == 1
        lines = [line.split() for line in capsys.readouterr().out.splitlines()]
        assert {words[1] for words in lines if words[-1:] == ["FAILS"]} == told


def test_a_file_is_read_as_it_was_written(tmp_path):
    known, file = find(GRID, n=5), tmp_path / "grid.json"
    write_best(file, replace(known, costs=np.array([*known.costs[:4], np.nan]),
                             finders=(*known.finders[:4], "")))  # fmt: skip
    again = read_best(file)
    np.testing.assert_array_equal(again.costs[:4], known.costs[:4])
    assert np.isnan(again.costs[4]) and again.finders == (*known.finders[:4], "")
    assert again.policies == json.loads(json.dumps(known.policies))


def test_the_name_of_a_finder_is_a_text(tmp_path):
    file = tmp_path / "grid.json"
    write_best(file, find(GRID, n=2))
    said = {"finders": ["zero", 3], "finder": [0, 1]}
    write_document(file, json.loads(file.read_text()) | said)
    with pytest.raises(DamagedFileError, match="expected names"):
        read_best(file)


@pytest.mark.parametrize(
    ("costs", "finders"), [((1.0, 2.0), ("zero", "")), ((1.0, np.nan), ("zero",) * 2),
                           ((1.0, -1.0), ("zero",) * 2)]
)  # fmt: skip
def test_a_cost_has_a_finder_and_a_finder_a_cost_from_0(costs, finders, tmp_path):
    known, file = find(GRID, n=2), tmp_path / "grid.json"
    write_best(file, replace(known, costs=np.array(costs), finders=finders))
    with pytest.raises(DamagedFileError, match="expected a cost from 0 and a finder, or neither"):
        read_best(file)


def test_what_is_best_is_known_of_the_id_itself_and_of_no_other_of_its_name():
    assert best_known(DETUMBLE).env_id == DETUMBLE
    assert best_known("Mine/Detumble-v0") is None
    assert best_known("Mine/Nothing-v0") is None


def test_another_finder_is_added_by_its_recorded_actions(tmp_path, capsys):
    brake = from_controller(reference_controllers(DETUMBLE)["brake"], "brake")
    replay = record_starts(brake, DETUMBLE, 5, "somebody").save(tmp_path / "found.npz")
    command = ["best", DETUMBLE, "--starts", "5", "--out", str(tmp_path)]
    file = file_of(DETUMBLE, tmp_path)
    assert main(command) == 0
    assert read_best(file).shares == {"riccati": 5}
    assert main([*command, "--with", str(replay)]) == 0
    assert read_best(file).shares == {"riccati": 5}  # a worse one changes nothing
    command[1] = "RigidEnvs/BallParkDynamic-v0"
    assert main([*command, "--with", str(replay)]) == 2
    assert "expected RigidEnvs/BallParkDynamic-v0" in capsys.readouterr().err
    assert main(["evaluate", DETUMBLE, "--policy", str(replay)]) == 0
    said = capsys.readouterr().out
    assert "somebody, 5 starts" in said
    told = evaluate(DETUMBLE, "brake", n=5).efficiency.mean
    assert f"{told:.3f}" in said


@pytest.mark.parametrize(
    ("env_id", "config", "label", "name"),
    [(DETUMBLE, {"dt": 0.09}, "somebody", "somebody"), (GRID, {}, "", "found")],
)
def test_a_replay_is_evaluated_as_whoever_played_it(env_id, config, label, name, tmp_path, capsys):
    told = evaluate(env_id, "reference", n=5, config=config)
    policy = from_controller(reference_controllers(env_id)[told.policy])
    replay = record_starts(policy, env_id, 5, label, config=config)
    lengths = {len(episode) for episode in replay.episodes}
    assert (len(lengths) > 1) == (env_id == GRID)  # its episodes end at success
    file = replay.save(tmp_path / "found.npz")
    assert main(["evaluate", env_id, "--policy", str(file), "--json"]) == 0
    row, expected = json.loads(capsys.readouterr().out), told.row()
    assert row["algo"] == name
    assert all(row[key] == expected[key] for key in ("env_id", "config", "policy", "starts"))


@pytest.mark.parametrize("who", ["breadth_first 500", "nobody"])
def test_the_command_says_who_found_what_and_how_well_each_policy_does(who, monkeypatch, capsys):
    found = best_known(GRID)
    if who == "nobody":
        found = replace(found, costs=np.full(500, np.nan), finders=("",) * 500)
    monkeypatch.setattr("rigid_envs.tools.cli.scoring._measured", lambda *_: found)
    assert main(["best", "BallGrid"]) == 0
    title, *lines = capsys.readouterr().out.splitlines()
    assert title.endswith(f" s   best path: {who}")
    rows = {line.split()[0]: line.split()[1:3] for line in lines[2:-2] if line.strip()}
    figures = [(each["success_rate"], each["efficiency"]) for each in found.policies.values()]
    assert rows == {
        name: [f"{each:.4g}" for each in pair]
        for name, pair in zip(found.policies, figures, strict=True)
    }


def test_what_others_found_stays_when_the_controllers_are_played_anew():
    better = find(DETUMBLE, n=5).improved("somebody", [1, 0, 1], [0.0, 0.0, 0.0])
    again = find(DETUMBLE, better, n=5)
    assert again.cost == ENVIRONMENTS[DETUMBLE].metrics[0] == "loss"
    assert again.finders == ("somebody", "riccati", "somebody", "riccati", "riccati")
    assert again.policies["riccati"]["efficiency"] < 0.7


def test_what_a_finder_found_stays_when_another_one_of_its_name_plays():
    riccati = evaluate(DETUMBLE, "riccati", n=5)

    def trained_to(shares):
        values = {**riccati.values, riccati.cost.name: riccati.costs * shares}
        return replace(riccati, policy="ppo", values=values)

    before = find(DETUMBLE, None, [trained_to([0.5, 2.0, 0.5, 2.0, 2.0])], n=5)
    anew = trained_to([0.6, 0.6, 0.4, 2.0, 2.0])
    after = find(DETUMBLE, before, [anew], n=5)
    assert after.finders == ("ppo, earlier", "ppo", "ppo", "riccati", "riccati")
    np.testing.assert_allclose(after.costs / riccati.costs, [0.5, 0.6, 0.4, 1.0, 1.0], rtol=1e-12)
    assert find(DETUMBLE, after, [anew], n=5).finders == after.finders
