"""Nothing in `agents` can run code from a file, and a run writes in its folder only."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.agents.sessions import SMALL

ROOT = Path(__file__).parents[2]
SOURCES = sorted((ROOT / "agents").rglob("*.py"))
MODULES = {"pickle", "cloudpickle", "dill", "marshal", "shelve", "jsonpickle", "joblib", "ctypes"}
CALLS = {"eval", "exec", "compile", "__import__", "yaml.load", "yaml.unsafe_load", "yaml.full_load",
         "torch.load", "torch.save", "os.system"}  # fmt: skip


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.name)
def test_no_source_loads_pickles_or_evaluates_text(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            assert not {name.name.split(".")[0] for name in node.names} & MODULES
        elif isinstance(node, ast.ImportFrom):
            assert (node.module or "").split(".")[0] not in MODULES
        elif isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            assert called not in CALLS, ast.unparse(node)
            if called == "np.load":
                assert "allow_pickle=False" in ast.unparse(node)
            if called in ("importlib.import_module", "__import__"):
                assert path.name == "registering.py"
            if called.startswith("subprocess."):
                assert "shell" not in ast.unparse(node)


@pytest.mark.long
def test_a_run_leaves_files_in_its_folder_only(tmp_path: Path) -> None:
    code = f"""
import tests.agents.drift
from agents.config.entries import config_from
from agents.training.trainer import train
train(config_from({ {**SMALL, "total_timesteps": 2048}!r}), quiet=True)
"""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
    (tmp_path / "tmp").mkdir()
    environment["TMPDIR"] = str(tmp_path / "tmp")
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, check=True)
    made = {path.relative_to(tmp_path) for path in tmp_path.rglob("*") if path.is_file()}
    assert made
    assert {path.parts[:3] for path in made} == {("logs", "ppo", "Drift-v0_1")}
