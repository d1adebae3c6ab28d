"""What a command writes lies in the folder that it was given, or in the cache of kernels."""

import json
import os
import tempfile
from pathlib import Path

import pytest

from rigid_envs.engine.compiler import cache_directory
from tests.programs import printed

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
