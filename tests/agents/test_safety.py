"""Nothing in `agents` can run code from a file."""

import ast
from pathlib import Path

import pytest

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
                assert path.name == "environments.py"
            if called.startswith("subprocess."):
                assert "shell" not in ast.unparse(node)
