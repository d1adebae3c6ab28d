"""A command writes where it is told; whatever a path is, it ends in one line that names it.

`rigid-envs` has the same promise: see `tests/cli/test_mistakes.py`.
"""

import errno
import json
import os
import shutil
import tempfile
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import tests.agents.drift  # noqa: F401, registers the environment
from agents.cli.command_line import main
from agents.training import trainer as trainer_module
from agents.training.trainer import Trainer, train
from rigid_envs.engine.compiler import cache_directory
from rigid_envs.scores.trained import file_of
from tests.agents.sessions import SMALL, begun, small
from tests.paths import NOT_A_FILE, NOT_A_FOLDER, PATHS
from tests.programs import printed

READ = [
    ["train", "--config", "PATH"],
    ["train", "--resume", "PATH"],
    ["train", "--resume", "PATH", "--print-config"],
    ["evaluate", "PATH"],
    ["evaluate", "PATH", "--which", "last"],
    ["enjoy", "PATH", "--table"],
    ["enjoy", "PATH", "--random", "--table"],
    ["leaderboard", "PATH"],
    ["search", "PATH"],
    ["baselines", "PATH"],
    ["curves", "PATH"],
    ["publish", "PATH"],
]
WRITTEN = [
    ["train", "--quiet", "--total_timesteps", "1", "--log_dir", "PATH"],
    ["evaluate", str(file_of("Detumble")), "--episodes", "1", "--out", "PATH"],
]

CASES = [*product(READ, NOT_A_FILE), *product(WRITTEN, NOT_A_FOLDER)]


@pytest.mark.parametrize(
    ("words", "kind"), CASES, ids=[f"{' '.join(words)}-{kind}" for words, kind in CASES]
)
def test_what_is_not_what_it_should_be_is_named_in_one_line_and_left_as_it_is(
    tmp_path, capsys, words, kind
):
    path = PATHS[kind](tmp_path)
    before = path.read_bytes() if path.is_file() else None
    said = refused([str(path) if word == "PATH" else word for word in words], capsys)
    assert str(path) in said
    assert before is None or path.read_bytes() == before


def refused(words, capsys):
    """What a command says that is refused, in one line."""
    capsys.readouterr()
    assert main(words) in (1, 2)
    said = capsys.readouterr().err
    assert said.startswith("agents: ") and said.count("\n") == 1, said
    return said


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    config = small(tmp_path_factory.mktemp("logs"), total_timesteps=1024)
    return train(config, quiet=True).folder


@pytest.mark.parametrize("verb", ["evaluate", "enjoy"])
@pytest.mark.parametrize("which", ["best", "last"])
def test_a_run_without_a_policy_yet_says_when_there_is_one(tmp_path, capsys, verb, which):
    run = begun(small(tmp_path))
    said = refused([verb, str(run.folder), "--which", which], capsys)
    assert f"{run.folder}: no {which} policy yet" in said and f"--resume {run.folder}" in said


def garbage(path):
    path.write_bytes(np.random.default_rng(0).bytes(300))


def emptied(path):
    path.write_bytes(b"")


def swapped(path):
    """A folder for a file, a file for a folder."""
    if path.is_dir():
        shutil.rmtree(path)
        path.touch()
    else:
        path.unlink()
        path.mkdir()


POLICY, RESUME = "best_model/policy.safetensors", "train --quiet --resume"
SPOILS = (garbage, emptied, swapped)
NAMES = ("best_model", "checkpoints/000000000001024.safetensors", "last_model", "tensorboard",
         "progress.csv")  # fmt: skip
RUIN = [
    *((POLICY, ruin, ["evaluate", "enjoy", RESUME]) for ruin in (*SPOILS, Path.unlink)),
    *(("config.yaml", ruin, ["publish", "train --resume"]) for ruin in SPOILS),
    *(("evaluations.npz", ruin, [RESUME]) for ruin in (*SPOILS, Path.unlink)),
    *((name, swapped, [RESUME]) for name in NAMES),
    ("run.lock", swapped, ["train --resume"]),
]


@pytest.mark.parametrize(
    ("name", "ruin", "verb"), [(name, ruin, verb) for name, ruin, verbs in RUIN for verb in verbs]
)
def test_a_spoilt_file_of_a_run_is_named_in_one_line(complete, tmp_path, capsys, name, ruin, verb):
    run = Path(shutil.copytree(complete, tmp_path / "run"))
    ruin(run / name)
    said = refused([*verb.split(), str(run)], capsys)
    assert str(run / name) in said or (name == "config.yaml" and f"{run}: no run here" in said)


def train_in(folder):
    """The words of a small training."""
    words = [word for key, value in SMALL.items() for word in (f"--{key}", str(value))]
    return ["train", *words, "--log_dir", str(folder), "--run_name", "r", "--quiet"]


# The thread of TensorBoard has a file of its own in there, and a word of its own to say.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_run_folder_that_is_deleted_while_it_is_trained_ends_it(tmp_path, monkeypatch, capsys):
    made = []

    def iterate(self):
        made.append(self)
        if len(made) == 4:
            shutil.rmtree(tmp_path / "ppo" / "r")
        original(self)

    original = Trainer.iterate
    monkeypatch.setattr(Trainer, "iterate", iterate)
    assert str(tmp_path / "ppo" / "r") in refused(train_in(tmp_path), capsys)
    assert len(made) < 10


@pytest.mark.parametrize("code", [errno.EACCES, errno.EROFS, errno.ENOSPC, errno.EIO])
@pytest.mark.parametrize("name", ["checkpoints", "last_model", "best_model"])
def test_what_may_not_be_written_ends_a_training_in_one_line(
    tmp_path, monkeypatch, capsys, name, code
):
    def replace(old, new):
        if new.parent.name == name:
            raise OSError(code, os.strerror(code), str(new))
        rename(old, new)

    rename = os.replace
    monkeypatch.setattr(os, "replace", replace)
    said = refused(train_in(tmp_path), capsys)
    assert str(tmp_path / "ppo" / "r" / name) in said and os.strerror(code) in said
    assert list((tmp_path / "ppo" / "r").rglob("*.tmp")) == []


@pytest.mark.parametrize("words", [["train", "--config"], ["evaluate"], ["train", "--resume"]])
def test_what_may_not_be_read_is_named_in_one_line(complete, tmp_path, monkeypatch, capsys, words):
    run = Path(shutil.copytree(complete, tmp_path / "run"))
    name = {"evaluate": POLICY}.get(words[0], "config.yaml")
    path = run / name if "--config" in words else run

    def read(self):
        if self == run / name:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(self))
        return original(self)

    original = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", read)
    assert str(run / name) in refused([*words, str(path)], capsys)


def test_a_bug_is_not_dressed_up_as_a_mistake(complete, monkeypatch):
    def broken(*_):
        raise KeyError("a bug")

    monkeypatch.setattr(trainer_module, "sweep", broken)
    with pytest.raises(KeyError, match="a bug"):
        main(["train", "--resume", str(complete), "--quiet"])


def test_the_name_of_a_file_cannot_steer_the_terminal(tmp_path, capsys):
    (tmp_path / "\x1b[2J\r.json").touch()
    assert "\\x1b[2J\\r.json" in refused(["leaderboard", str(tmp_path)], capsys)


ROOT = Path(__file__).parents[3]
# Runs a module and prints which files were opened to write, and which were made or renamed.
PROGRAM = """
import json, os, runpy, sys
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
found = set()

def hook(event, arguments):
    if event == "open" and isinstance(arguments[2], int) and arguments[2] & WRITING:
        found.add(arguments[0])
    elif event in ("os.mkdir", "os.rename", "os.symlink", "os.link"):
        found.update(arguments[:2])

sys.addaudithook(hook)
del sys.argv[0]
try:
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
finally:
    named = (each for each in found if isinstance(each, (str, bytes, os.PathLike)))
    print(json.dumps([os.path.realpath(os.fsdecode(each)) for each in named]))
"""
TRAIN = "--n_envs 16 --n_steps 16 --batch_size 64 --total_timesteps 512 --quiet"


@pytest.mark.long
@pytest.mark.push
@pytest.mark.parametrize(
    "words",
    [
        f"agents train --env_id Detumble {TRAIN} --log_dir HERE",
        "rigid_envs.tools.cli evaluate Detumble --policy brake --out HERE/row.json",
        "rigid_envs.tools.cli verify upright_coin --json HERE/laws.json",
    ],
)
def test_nothing_is_written_elsewhere(tmp_path, words):
    here, elsewhere = tmp_path / "here", tmp_path / "elsewhere"
    here.mkdir()
    elsewhere.mkdir()
    given = words.replace("HERE", str(here)).split()
    told = printed(
        "-c", PROGRAM, *given, cwd=elsewhere, PYTHONPATH=str(ROOT), PYTHONDONTWRITEBYTECODE="1"
    )
    written = [Path(each) for each in json.loads(told.splitlines()[-1])]
    allowed = [here.resolve(), Path("/dev"), Path(os.environ.get("HOME", "/"), ".cache")]
    cache = cache_directory()
    allowed += [] if cache is None else [cache.resolve().parent]
    scratch = Path(tempfile.gettempdir()).resolve()
    strays = [
        path
        for path in written
        if not any(path.is_relative_to(folder) for folder in allowed)
        and not (path.parent == scratch and not path.exists())  # made and removed
        and not path.name.startswith(("matplotlib", "torchinductor"))  # of other packages
    ]
    assert not strays
    assert any(path.is_relative_to(here.resolve()) for path in written)
    assert not [*elsewhere.iterdir()]
