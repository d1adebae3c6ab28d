"""Scores: 0 is the random policy and 1 the anchor, and the data can be computed again."""

import json
from dataclasses import replace

import numpy as np
import pytest

import rigid_envs
from rigid_envs import ENVIRONMENTS
from rigid_envs.cli import main
from rigid_envs.cli.scoring import verify_scores
from rigid_envs.scores import ScoreScale, anchors, evaluate, uniform
from rigid_envs.scores.anchor_data import FORMAT, compute_anchors
from rigid_envs.scores.scales import ANCHORS, Anchors
from rigid_envs.scores.untrained import untrained_policies, untrained_policy

DETUMBLE = "RigidEnvs/Detumble-v0"


def test_a_score_is_0_for_the_random_policy_and_1_at_the_anchor():
    scale = ScoreScale("effort", random=6.0, anchor=2.0, kind="reference", why="lqr", failed=6.0)
    assert (scale(6.0), scale(2.0), scale(4.0), scale(1.0)) == (0.0, 1.0, 0.5, 1.25)
    np.testing.assert_array_equal(scale(np.array([8.0, 6.0])), [-0.5, 0.0])


def test_the_random_policy_scores_0_by_every_metric():
    n = 20
    scales = compute_anchors(DETUMBLE, n).scales
    failed = {name: scale.failed for name, scale in scales.items()}
    for name, values in evaluate(DETUMBLE, uniform(), n).values(failed).items():
        assert scales[name](values.mean()) == 0.0
    assert [s.kind for s in scales.values()] == ["exact", "bound", "exact", "reference"]


def test_the_data_is_of_every_id_and_says_where_it_comes_from():
    data = json.loads(ANCHORS.read_text())
    assert data["format"] == FORMAT
    assert data["evaluation_set"] == {"version": 1, "seed": 314159, "starts": 500}
    assert {"versions", "kernel_hash", "git_commit", "command"} <= data["provenance"].keys()
    assert set(data["ids"]) == set(ENVIRONMENTS)
    for env_id, found in anchors().items():
        controllers = ENVIRONMENTS[env_id].controllers
        assert {"success", "return"} <= set(found.scales)
        for scale in found.scales.values():
            assert scale.kind in ("exact", "bound", "reference") and scale.why
            assert scale.kind != "reference" or scale.why in controllers
        assert list(found.means) == [*controllers, "zero", "random"]
        for means in found.means.values():
            assert tuple(means) == ENVIRONMENTS[env_id].metrics
        for name, scale in found.scales.items():
            assert found.means["random"][name] == scale.random
            if scale.kind == "reference":  # LAPACK rounds differently on the machines of the data
                assert found.means[scale.why][name] == pytest.approx(scale.anchor, rel=1e-9)


def test_the_data_can_be_computed_again(capsys):
    assert verify_scores([DETUMBLE])
    assert capsys.readouterr().out.count("holds") == 4


def test_data_that_has_been_changed_is_found(monkeypatch, capsys):
    found = anchors()[DETUMBLE]
    old = found.scales["effort"]
    scales = {**found.scales, "effort": replace(old, anchor=0.99 * old.anchor)}
    changed = Anchors(scales, found.means, found.n_starts)
    monkeypatch.setattr("rigid_envs.cli.scoring.anchors", lambda: {DETUMBLE: changed})
    assert main(["verify", "--scores", DETUMBLE]) == 1
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "FAILS" in line]
    assert "effort" in line


def test_the_package_tells_the_scale_of_a_metric():
    scale = rigid_envs.score_scale(DETUMBLE, "return")
    assert isinstance(scale, ScoreScale)
    assert scale is rigid_envs.score(DETUMBLE) and scale(scale.anchor) == 1.0
    with pytest.raises(ValueError, match=r"metric = 'speed'; expected one of \['return'"):
        rigid_envs.score(DETUMBLE, "speed")
    with pytest.raises(ValueError, match="env_id = 'RigidEnvs/Spin-v0'; expected an id with"):
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


def test_untrained_policies_are_named_and_others_refused():
    assert list(untrained_policies(DETUMBLE))[-3:] == ["sampling", "zero", "random"]
    assert untrained_policy(DETUMBLE, "reference")[0] == "riccati"
    with pytest.raises(ValueError, match=r"controller = 'pid'; expected one of \['riccati'"):
        untrained_policy(DETUMBLE, "pid")
