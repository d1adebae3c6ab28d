"""Published policies hit every published figure, to the last digit, wherever they are played."""

import random
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigid_envs.engine.provenance import commit
from rigid_envs.scores.evaluation import evaluate
from rigid_envs.scores.records import (
    read_evaluation,
    read_record,
    read_records,
    record_file,
    write_record,
)
from rigid_envs.scores.repeating import published_evaluation, published_record, recheck
from rigid_envs.scores.trained import FOLDER, load, published
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tools.cli import main
from tests.fixtures import Capture, Patch

ROOT = Path(__file__).parents[2]
NAMES = published()
AT_A_PUSH = 4  # of 24, two seconds each
OTHER_SEED = 161803  # of starts that nobody has published figures of


def sample() -> list[str]:
    """Policies drawn by the commit: the same within a push, others at the next one."""
    head = commit()["git_commit"] or ""
    return random.Random(head).sample(NAMES, min(AT_A_PUSH, len(NAMES)))


def test_there_are_published_policies_each_named_by_its_environment() -> None:
    assert NAMES
    for name in NAMES:
        policy, record = load(name), published_record(name)
        assert policy.env_id in ENVIRONMENTS
        assert policy.env_id == record.env_id == f"RigidEnvs/{name}"
        assert policy.name == record.policy and policy.document["seed"] == record.seed


@pytest.mark.parametrize("name", sample())
def test_a_sample_hits_every_published_figure(name: str) -> None:
    assert recheck(name).differences == ()


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_all_hit_every_published_figure(name: str) -> None:
    assert recheck(name).differences == ()


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_success_from_other_starts_is_within_the_published_interval(name: str) -> None:
    assert recheck(name, OTHER_SEED).differences == ()


def test_records_of_the_same_policy_among_the_baselines_have_the_same_figures() -> None:
    for name in NAMES:
        mine = published_record(name)
        file = record_file(ROOT / "docs/baselines", mine.env_id, mine.algo, mine.frame, mine.seed)
        if file.is_file() and (other := read_record(file)).policy_sha256 == mine.policy_sha256:
            np.testing.assert_array_equal(mine.successes, other.successes)
            np.testing.assert_array_equal(mine.costs, other.costs)


def test_a_record_of_an_easier_task_has_no_efficiency() -> None:
    record = published_record(NAMES[0])
    assert record.evaluation.efficiency is not None
    easier = replace(record, settings={"frame": "reduced", "dt": 0.07})
    assert easier.evaluation.efficiency is None


def test_records_of_other_tasks_and_of_a_part_of_the_starts_are_passed_over(tmp_path: Path) -> None:
    record = published_record(NAMES[0])
    few = replace(record, successes=record.successes[:9], costs=record.costs[:9])
    elsewhere = replace(record, env_id="Mine/Top-v0")
    easier = replace(record, settings={"dt": 0.07})
    for name, each in (("a", record), ("b", few), ("c", elsewhere), ("d", easier)):
        write_record(tmp_path / "folder" / f"{name}.json", each)
    (found,) = read_records(tmp_path)
    assert (found.env_id, len(found.costs)) == (record.env_id, 500)


def test_a_rate_at_the_end_of_the_published_interval_is_within_it(
    tmp_path: Path, monkeypatch: Patch
) -> None:
    name = NAMES[0]
    for file in FOLDER.glob(f"{name}.*"):
        shutil.copy(file, tmp_path)
    won = np.ones(500, dtype=bool)  # the interval of a rate of 1 ends there
    write_record(tmp_path / f"{name}.json", replace(published_record(name), successes=won))
    like = published_evaluation(name)
    for rate, held in ((1.0, True), (0.9, False)):
        success = {"success": (np.arange(500) < 500 * rate).astype(np.float64)}
        found = replace(like, values={**like.values, **success})
        monkeypatch.setattr("rigid_envs.scores.repeating.evaluate", lambda *a, f=found, **k: f)
        assert (recheck(name, OTHER_SEED, tmp_path).differences == ()) == held


def test_the_command_shows_what_holds_and_refuses_what_is_not_there(capsys: Capture) -> None:
    assert main(["verify", "--policies", NAMES[0]]) == 0
    out = capsys.readouterr().out
    assert NAMES[0] in out and "holds" in out and "to the last digit: 1 policies" in out
    assert main(["verify", "--policies", "Nothing"]) == 2
    assert f"a published policy: {NAMES[0]}" in capsys.readouterr().err


def test_a_policy_file_is_evaluated_by_the_command(tmp_path: Path, capsys: Capture) -> None:
    name = NAMES[0]
    words = ["evaluate", f"RigidEnvs/{name}", "--policy", str(FOLDER / f"{name}.safetensors")]
    assert main([*words, "--starts", "20", "--out", str(tmp_path / "row.json")]) == 0
    found, record = read_evaluation(tmp_path / "row.json"), published_record(name)
    np.testing.assert_array_equal(found.costs, record.costs[:20])
    assert found.policy == record.policy
    assert main([*words, "--starts", "2", "--name", "mine", "--out", str(tmp_path / "b.json")]) == 0
    assert read_evaluation(tmp_path / "b.json").policy == "mine"
    short = name.removesuffix("-v0")
    words = ["evaluate", short, "--policy", short, "--starts", "20"]
    assert main([*words, "--out", str(tmp_path / "c.json")]) == 0
    np.testing.assert_array_equal(read_evaluation(tmp_path / "c.json").costs, found.costs)


def test_a_record_is_as_good_as_the_evaluation_that_it_is_of() -> None:
    name = NAMES[0]
    told, found = published_evaluation(name), evaluate(f"RigidEnvs/{name}", load(name))
    assert (told.success, told.efficiency, told.gap) == (found.success, found.efficiency, found.gap)
    assert told.mean(told.costs) == found.mean(found.costs)


def test_the_example_of_the_page_loads_acts_and_evaluates(capsys: Capture) -> None:
    text = (ROOT / "docs" / "policies.md").read_text(encoding="utf-8")
    (code, *_) = re.findall(r"```python\n(.+?)```", text, flags=re.DOTALL)
    names: dict[str, Any] = {}
    exec(code, names)
    assert names["env"].action_space.contains(names["action"])
    out = capsys.readouterr().out
    assert out.count("efficiency") == 2 and "RigidEnvs/BallReorient-v0 frame='reduced': ppo" in out
