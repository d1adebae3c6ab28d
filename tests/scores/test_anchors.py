"""Scores: 0 is chance and 1 the anchor, and the data can be computed again."""

import json

import numpy as np
import pytest

import rigid_envs
from rigid_envs import ENVIRONMENTS
from rigid_envs.cli import main
from rigid_envs.cli.scoring import verify_scores
from rigid_envs.scores import anchors as module
from rigid_envs.scores.anchors import Scale, anchors, compute
from rigid_envs.scores.evaluation import at_random, evaluate
from rigid_envs.scores.players import player_of, players_of
from rigid_envs.scores.references import REFERENCES

DETUMBLE = "RigidEnvs/Detumble-v0"


def test_a_score_is_0_for_chance_and_1_at_the_anchor():
    scale = Scale("effort", random=6.0, anchor=2.0, kind="reference", why="lqr", failed=6.0)
    assert (scale(6.0), scale(2.0), scale(4.0), scale(1.0)) == (0.0, 1.0, 0.5, 1.25)
    np.testing.assert_array_equal(scale(np.array([8.0, 6.0])), [-0.5, 0.0])


def test_the_random_policy_scores_0_by_every_metric():
    n = 20
    scales = compute(DETUMBLE, n)
    failed = {scale.metric: scale.failed for scale in scales}
    for name, values in evaluate(DETUMBLE, at_random(), n).values(failed).items():
        assert {s.metric: s for s in scales}[name](values.mean()) == 0.0
    assert [s.kind for s in scales] == ["exact", "bound", "exact", "reference"]


def test_the_data_is_of_every_id_and_says_where_it_comes_from():
    data = json.loads(module.ANCHORS.read_text())
    assert data["format"] == module.FORMAT
    assert data["evaluation_set"] == {"version": 1, "seed": 314159, "starts": 500}
    assert {"versions", "kernel_hash", "git_commit", "command"} <= data["provenance"].keys()
    assert set(data["ids"]) == set(ENVIRONMENTS)
    for env_id, scales in anchors().items():
        assert {"success", "return"} <= set(scales)
        for scale in scales.values():
            assert scale.kind in ("exact", "bound", "reference") and scale.why
            assert scale.kind != "reference" or scale.why in REFERENCES[env_id]


def test_the_data_can_be_computed_again(capsys):
    assert verify_scores([DETUMBLE])
    assert capsys.readouterr().out.count("holds") == 4


def test_data_that_has_been_changed_is_found(monkeypatch, capsys):
    scales = dict(anchors()[DETUMBLE])
    old = scales["effort"]
    scales["effort"] = Scale("effort", old.random, 0.99 * old.anchor, old.kind, old.why, old.failed)
    monkeypatch.setattr("rigid_envs.cli.scoring.anchors", lambda: {DETUMBLE: scales})
    assert main(["verify", "--scores", DETUMBLE]) == 1
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "FAILS" in line]
    assert "effort" in line


def test_the_package_tells_the_scale_of_a_metric():
    scale = rigid_envs.score(DETUMBLE, "return")
    assert scale is rigid_envs.score(DETUMBLE) and scale(scale.anchor) == 1.0
    with pytest.raises(ValueError, match=r"no anchors of 'speed'; expected one of \['return'"):
        rigid_envs.score(DETUMBLE, "speed")
    with pytest.raises(ValueError, match="RigidEnvs/Spin-v0: no anchors; expected one of"):
        rigid_envs.score("RigidEnvs/Spin-v0")


def test_anchors_are_written_and_others_kept(tmp_path, capsys):
    file = tmp_path / "anchors.json"
    for env_id in (DETUMBLE, "RigidEnvs/AxisFlip-v0"):
        assert main(["anchors", "--ids", env_id, "--starts", "5", "--out", str(file)]) == 0
    data = json.loads(file.read_text())
    assert list(data["ids"]) == [DETUMBLE, "RigidEnvs/AxisFlip-v0"]
    assert "riccati" in capsys.readouterr().out
    assert main(["anchors", "--starts", "5"]) == 2
    assert "--out FILE" in capsys.readouterr().err


def test_players_are_named_and_others_refused():
    assert list(players_of(DETUMBLE))[-2:] == ["sampling", "random"]
    assert player_of(DETUMBLE, "reference")[0] == next(iter(REFERENCES[DETUMBLE]))
    with pytest.raises(ValueError, match=r"has no controller 'pid'; expected one of \['riccati'"):
        player_of(DETUMBLE, "pid")
