"""No file that is read runs code, imports, starts processes, opens sockets or writes."""

import ast
import json
import pickle
from pathlib import Path

import pytest

from tests.loading.bombs import BOMBS
from tests.loading.payloads import changed, harmful
from tests.loading.readers import READERS
from tests.loading.trapped import ENTRIES, NAMED
from tests.programs import printed

N = 112  # changed files of each kind: more than 1000 together


def said_by(code):
    """Lines of JSON that a program prints at its end, as a process of its own."""
    told = printed("-W", "ignore", "-c", code, cwd=Path(__file__).parents[2])
    return [json.loads(line) for line in told.splitlines() if line.startswith("{")]


@pytest.fixture(scope="module")
def both():
    """What the audit and the trap found, one after the other in one process."""
    modules = "from tests.loading import audited, trapped"
    return said_by(f"{modules}\naudited.main({N})\ntrapped.main()")


@pytest.fixture(scope="module")
def audited(both):
    return both[0]


@pytest.mark.parametrize("kind", READERS)
def test_reading_does_nothing_but_read(audited, kind):
    assert audited[kind]["found"] == {}
    assert not audited[kind]["ran"]


@pytest.mark.parametrize("kind", READERS)
def test_what_is_no_good_file_is_refused_by_name(audited, kind):
    n_harmful = len([*harmful(Path("mark"))])
    ends = audited[kind]["ends"]
    assert sum(ends.values()) == n_harmful + N
    refused = "ConfigError" if kind.endswith("config") else "DamagedFileError"
    assert set(ends) <= {refused, "read"}
    assert ends[refused] >= n_harmful - 2  # text may be YAML, though no configuration


def test_payloads_do_run_where_a_reader_lets_them(tmp_path):
    for k, data in enumerate(harmful(tmp_path / "mark")):
        if k <= pickle.HIGHEST_PROTOCOL:
            (tmp_path / "mark").unlink(missing_ok=True)
            pickle.loads(data)
            assert (tmp_path / "mark").exists()
    assert len({*changed(b"0123456789" * 20, N, 0)}) > 0.95 * N


@pytest.mark.long
def test_bombs_are_refused_before_they_take_memory_or_time():
    (found,) = said_by("from tests.loading import bombs\nbombs.main()")
    assert len(found) == len(READERS) * len(BOMBS)
    for name, (end, seconds, grown) in found.items():
        assert end != "read", name
        assert seconds < 1.0, (name, seconds)
        assert grown < 256.0, (name, grown)


@pytest.fixture(scope="module")
def trapped(both):
    return both[1]


@pytest.mark.parametrize("kind", NAMED)
@pytest.mark.parametrize("entry", ENTRIES)
def test_code_that_a_file_names_is_not_even_looked_for(trapped, entry, kind):
    told = trapped[f"{entry}: {kind}"]
    assert not told["ran"] and told["found"] == [], told


def test_code_that_a_users_own_call_names_is_run(trapped):
    told = trapped["gym.make"]
    assert told["ran"] and told["found"]


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
