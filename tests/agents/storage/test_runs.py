"""A run folder belongs to one process, keeps its config, and reads its newest good checkpoint.

Flipped bits and cut files: `tests/loading`.
"""

import shutil
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from agents.cli.command_line import main
from agents.config.entries import config_from, config_to_dict
from agents.config.reading import dump_yaml, parse_yaml
from agents.storage import runs
from agents.storage.logs import load_newest, read_evaluations, save_newest, write_evaluations
from rigid_envs.base.files import DamagedFileError
from tests.agents.sessions import begun

VALUES = {
    "learning_rate": [1e-3, 1e-4],
    "env_kwargs": {"frame": "reduced", "radius": [0.9, 1.1], "action_delay": 2},
    "cost_price": [0.0, 3e-7],
    "target_kl": 0.02,
}


@pytest.fixture
def config(tmp_path):
    return config_from({**VALUES, "log_dir": str(tmp_path), "run_name": "r"})


HOLDER = """
import sys, time
from pathlib import Path
from agents.storage.runs import open_run
open_run(Path(sys.argv[1]))
print("held", flush=True)
time.sleep(60)
"""
STARTER = """
import sys
from agents.config.entries import config_from
from agents.storage.runs import create_run, RunInUseError
config = config_from({"log_dir": sys.argv[1], "run_name": "r"})
sys.stdin.read(1)
try:
    create_run(config)
    print("mine", flush=True)
    sys.stdin.read(1)
except (RunInUseError, FileExistsError) as error:
    print(f"{type(error).__name__}: {error}", flush=True)
"""


def python(code, *arguments):
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def test_runs_are_numbered(tmp_path):
    config = config_from({"log_dir": str(tmp_path), "env_id": "module:Some/Thing-v3"})
    names = [runs.create_run(config).folder.name for _ in range(3)]
    assert names == ["Thing-v3_1", "Thing-v3_2", "Thing-v3_3"]
    (tmp_path / "ppo" / "Thing-v3_41").mkdir()
    (tmp_path / "ppo" / "Thing-v3_x").mkdir()
    assert runs.create_run(config).folder.name == "Thing-v3_42"


def test_a_name_that_is_taken_needs_a_flag(config):
    run = begun(config)
    (run / "deep").mkdir()
    (run / "deep" / "file").touch()
    with pytest.raises(FileExistsError, match="--overwrite"):
        runs.create_run(config)
    assert (run / "deep" / "file").exists()
    again = runs.create_run(config, overwrite=True)
    assert (run / "deep" / "file").exists()
    again.begin()
    assert sorted(path.name for path in again.folder.iterdir()) == ["config.yaml", "run.lock"]


def test_a_folder_that_is_no_run_is_never_deleted(tmp_path, config):
    folder = tmp_path / "ppo" / "r"
    folder.mkdir(parents=True)
    (folder / "thesis.tex").touch()
    with pytest.raises(FileExistsError, match="it is no run"):
        runs.create_run(config, overwrite=True)
    assert (folder / "thesis.tex").exists()
    with pytest.raises(FileNotFoundError, match="no run here"):
        runs.open_run(folder)


def test_what_an_overwritten_run_links_to_stays(tmp_path, config):
    run = begun(config)
    (tmp_path / "kept").mkdir()
    (run / "config.yaml").rename(tmp_path / "kept" / "config.yaml")
    (run / "config.yaml").symlink_to(tmp_path / "kept" / "config.yaml")
    (run / "checkpoints").symlink_to(tmp_path / "kept")
    (run / "deep").mkdir()
    (run / "deep" / "link").symlink_to(tmp_path / "kept")
    (run / "nowhere").symlink_to(tmp_path / "none")
    before = (tmp_path / "kept" / "config.yaml").read_bytes()
    runs.create_run(replace(config, seed=3), overwrite=True).begin()
    assert [path.name for path in (tmp_path / "kept").iterdir()] == ["config.yaml"]
    assert (tmp_path / "kept" / "config.yaml").read_bytes() == before
    assert sorted(path.name for path in run.folder.iterdir()) == ["config.yaml", "run.lock"]
    assert not (run / "config.yaml").is_symlink() and runs.find_run(run.folder).config().seed == 3


def test_a_run_is_not_overwritten_through_a_link_with_another_name(config):
    run = begun(config)
    run.folder.with_name("best").symlink_to("r")
    before = {path: path.read_bytes() for path in run.folder.iterdir()}
    with pytest.raises(FileExistsError, match="best exists; it is no run, or a link to one"):
        runs.create_run(replace(config, run_name="best"), overwrite=True)
    assert {path: path.read_bytes() for path in run.folder.iterdir()}.keys() == before.keys()
    assert runs.find_run(run.folder).config() == config


def test_a_start_that_came_to_nothing_leaves_the_name_free(tmp_path, config):
    run = runs.create_run(config)
    run.close()  # as if killed before the run began
    again = runs.create_run(config)
    again.discard()
    assert list((tmp_path / "ppo").iterdir()) == []


def test_a_second_process_is_told_who_has_it_and_changes_nothing(tmp_path, config):
    run = begun(config)
    holder = python(HOLDER, str(run.folder))
    assert holder.stdout is not None and holder.stdout.readline() == "held\n"
    before = {path: path.read_bytes() for path in run.folder.iterdir()}
    for attempt in (
        lambda: runs.open_run(run.folder),
        lambda: runs.create_run(config),
        lambda: runs.create_run(config, overwrite=True),
    ):
        begin = time.perf_counter()
        with pytest.raises(runs.RunInUseError, match=rf"in use by process {holder.pid} on \S+"):
            attempt()
        assert time.perf_counter() - begin < 1
    assert {path: path.read_bytes() for path in run.folder.iterdir()} == before
    assert [path.name for path in (tmp_path / "ppo").iterdir()] == ["r"]
    holder.kill()  # which leaves the lock file, and no lock
    holder.communicate()
    runs.open_run(run.folder).close()


@pytest.mark.parametrize("n_tries", [1, pytest.param(50, marks=pytest.mark.long)])
def test_of_two_starts_at_once_one_gets_the_run(tmp_path, n_tries):
    for k in range(n_tries):
        folder = tmp_path / str(k)
        starters = [python(STARTER, str(folder)) for _ in range(2)]
        for starter in starters:
            starter.stdin.write("g")
            starter.stdin.flush()
        said = [starter.stdout.readline() for starter in starters]
        pids = [starter.pid for starter in starters]
        for starter in starters:
            starter.communicate()
        winner = said.index("mine\n")
        assert said[1 - winner].startswith("RunInUseError")
        assert f"process {pids[winner]} on" in said[1 - winner]


def test_a_copied_run_is_free(tmp_path, config):
    run = runs.create_run(config)
    run.begin()
    shutil.copytree(run.folder, tmp_path / "copy")
    runs.open_run(tmp_path / "copy").close()
    run.close()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("gamma: 0.99", "gamma: 0.9"),
        ("seed: 0", "seed: 1"),
        ("radius: [0.9, 1.1]", "radius: [0.9, 1.5]"),
        ("run_name: r\n", "run_name: s\n"),
        ("target_kl: 0.02\n", ""),
        ("target_kl: 0.02\n", "target_kl: .nan\n"),
        ("target_kl: 0.02\n", "target_kl: 2026-01-01\n"),
    ],
)
def test_a_changed_entry_is_refused_before_the_first_checkpoint(config, capsys, old, new):
    run = begun(config)
    path = run / "config.yaml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    assert main(["train", "--resume", str(run.folder)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"agents: {path}: its entries do not match") and said.count("\n") == 1
    assert f"python -m agents train --config {path}" in said
    assert sorted(each.name for each in run.folder.iterdir()) == ["config.yaml", "run.lock"]


def test_a_changed_config_of_a_run_starts_a_new_one(config, capsys):
    run = begun(config)
    text = (run / "config.yaml").read_text().replace("gamma: 0.99", "gamma: 0.9")
    (run / "config.yaml").write_text(text)
    words = ["train", "--config", str(run / "config.yaml"), "--run_name", "s", "--print-config"]
    assert main(words) == 0
    expected = {**config_to_dict(config), "gamma": 0.9, "run_name": "s"}
    assert parse_yaml(capsys.readouterr().out) == expected


def test_order_notes_and_spelling_are_free(tmp_path, config):
    path = tmp_path / "config.yaml"
    runs.write_config(path, config)
    head, _, text = path.read_text().partition("\n")
    turned = dump_yaml(dict(reversed(parse_yaml(text).items())))
    assert "3.0e-07" in turned and turned != text
    path.write_text(f"{head}\n# a note\n{turned.replace('3.0e-07', '0.0000003')}")
    assert runs.read_config(path) == config


def test_a_run_of_an_older_version_has_no_digest_and_is_read(tmp_path, config):
    path = tmp_path / "config.yaml"
    path.write_text(dump_yaml(config_to_dict(config)))
    assert runs.read_config(path) == config


ARRAYS = {
    "timesteps": np.array([512, 1024]),
    "results": np.arange(6.0).reshape(2, 3),
    "ep_lengths": np.arange(6).reshape(2, 3),
    "successes": np.eye(2, 3, dtype=bool),
    "costs": np.ones((2, 3)),
}


def test_evaluations_come_back_to_the_bit(tmp_path):
    path = tmp_path / "evaluations.npz"
    write_evaluations(path, ARRAYS)
    found = read_evaluations(path)
    assert found.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        assert found[name].dtype == array.dtype
        np.testing.assert_array_equal(found[name], array)


@pytest.mark.parametrize(
    "changes",
    [
        {"timesteps": np.array([512])},
        {"costs": np.ones((2, 4))},
        {"costs": np.full((2, 3), np.nan)},
        {"costs": np.array(["a"])},
        {"more": np.ones(3)},
        {name: array[:0] for name, array in ARRAYS.items()},
    ],
)
def test_what_no_run_can_have_written_is_refused_by_name(tmp_path, changes):
    path = tmp_path / "evaluations.npz"
    np.savez(path, **ARRAYS | changes)
    with pytest.raises(DamagedFileError, match=r"evaluations\.npz"):
        read_evaluations(path)


def save(folder, *ages):
    for age in ages:
        save_newest(folder, age, {"a": np.full(3, age)}, {"age": age})


def good(arrays, document):
    """Nothing is wrong."""


def test_the_last_two_are_kept_and_the_newest_is_read(tmp_path):
    folder = tmp_path / "checkpoints"
    assert load_newest(folder, good) is None
    save(folder, 5, 40, 300, 2000)
    assert [int(path.stem) for path in sorted(folder.iterdir())] == [300, 2000]
    found = load_newest(folder, good)
    assert found is not None
    assert found[1] == {"age": 2000} and found[0]["a"].tolist() == [2000] * 3 and found[2] == []


def test_one_that_is_not_good_is_named_and_passed_over(tmp_path):
    def old(arrays, document):
        if document["age"] > limit:
            raise DamagedFileError(f"age = {document['age']}; expected less")

    save(tmp_path, 300, 2000)
    limit = 1000
    found = load_newest(tmp_path, old)
    assert found is not None and found[1] == {"age": 300}
    assert found[2] == [f"{tmp_path / '000000000002000.safetensors'}: age = 2000; expected less"]
    limit = 100
    with pytest.raises(DamagedFileError, match=r"2000\.safetensors: age .*300\.safetensors: age"):
        load_newest(tmp_path, old)
