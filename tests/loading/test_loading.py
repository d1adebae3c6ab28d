"""No file that is read runs code; its damage is named or harmless: it is what was written.

Also of what was changed on purpose, with a digest to match: wrong types and counts are refused.
"""

import ast
import json
import pickle
from pathlib import Path

import numpy as np
import pytest

from rigid_envs.base.checks import ConfigError
from rigid_envs.base.files import DamagedFileError, lined_json, sealed
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
def told():
    """What the audit and the trap found, one after the other in one process."""
    modules = "from tests.loading import audited, trapped"
    audit, trap = said_by(f"{modules}\naudited.main({N})\ntrapped.main()")
    return audit | trap


@pytest.mark.long
@pytest.mark.push
@pytest.mark.parametrize("kind", READERS)
def test_reading_does_nothing_but_read(told, kind):
    assert told[kind]["found"] == {}
    assert not told[kind]["ran"]


@pytest.mark.long
@pytest.mark.push
@pytest.mark.parametrize("kind", READERS)
def test_what_is_no_good_file_is_refused_by_name(told, kind):
    n_harmful = len([*harmful(Path("mark"))])
    ends = told[kind]["ends"]
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


@pytest.mark.long
@pytest.mark.push
@pytest.mark.parametrize("kind", NAMED)
@pytest.mark.parametrize("entry", ENTRIES)
def test_code_that_a_file_names_is_not_even_looked_for(told, entry, kind):
    touched = told[f"{entry}: {kind}"]
    assert not touched["ran"] and touched["found"] == [], touched


@pytest.mark.long
@pytest.mark.push
def test_code_that_a_users_own_call_names_is_run(told):
    assert told["gym.make"]["ran"] and told["gym.make"]["found"]


ROOT = Path(__file__).parents[2]
SOURCES = sorted((ROOT / "agents").rglob("*.py"))
MODULES = {"pickle", "cloudpickle", "dill", "marshal", "shelve", "jsonpickle", "joblib", "ctypes"}
CALLS = {"eval", "exec", "compile", "__import__", "yaml.load", "yaml.unsafe_load", "yaml.full_load",
         "torch.load", "torch.save", "os.system"}  # fmt: skip


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.name)
def test_no_source_loads_pickles_or_evaluates_text(path):
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


KEPT = [kind for kind in READERS if kind != "config"]  # which people write by hand: no digest
DOCUMENTS = [kind for kind in KEPT if READERS[kind].name.endswith(".json")]
OTHERS = [None, 3, -1, 0.5, True, "x", "\x1b[2J", [], [1], [None], ["x"], [[1], [2]], {},
                     {"a": 1}, {"a": {}}, 10**400, [10**400]]  # fmt: skip


def content(value):
    """What was read, in a form that can be compared."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, dict):
        return {name: content(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [content(each) for each in value]
    if hasattr(value, "document"):  # a policy
        return content([value.document, value.arrays])
    return content(vars(value)) if hasattr(value, "__dict__") else repr(value)


def damaged(good, flips, cuts):
    """Versions of a file with one bit flipped, then such that are cut off."""
    rng = np.random.default_rng(0)
    for k in rng.integers(8 * len(good), size=flips).tolist():
        data = bytearray(good)
        data[k // 8] ^= 1 << k % 8
        yield bytes(data)
    for length in rng.integers(len(good), size=cuts).tolist():
        yield good[:length]


def n_refused(reader, path, flips, cuts):
    """How many are refused, by name; all others are read as if nothing were changed."""
    reader.write(path)
    good, before, refused = path.read_bytes(), content(reader.read(path)), 0
    for data in damaged(good, flips, cuts):
        path.write_bytes(data)
        try:
            assert content(reader.read(path)) == before
        except (DamagedFileError, ConfigError) as error:
            assert str(path) in str(error)
            refused += 1
    return refused


@pytest.mark.parametrize("flips", [40, pytest.param(300, marks=pytest.mark.long)])
@pytest.mark.parametrize("kind", KEPT)
def test_damage_is_named_or_harmless(kind, tmp_path, flips):
    assert n_refused(READERS[kind], tmp_path / READERS[kind].name, flips, flips // 2) >= flips


def changes(document):
    """A document with an entry left out, or of another kind; also entries of its entries."""
    for key, value in document.items():
        yield {name: each for name, each in document.items() if name != key}
        for other in OTHERS:
            yield document | {key: other}
        for change in changes(value) if isinstance(value, dict) else ():
            yield document | {key: change}


def share_read(reader, path, step):
    """Share of the changed documents that are read; all others are refused, by name."""
    reader.write(path)
    document = json.loads(path.read_text())
    chosen, read = [*changes(document)][::step], 0
    for other in chosen:
        path.write_text(lined_json(sealed(other)))
        try:
            str(reader.read(path))
            read += 1
        except (DamagedFileError, ConfigError) as error:
            assert str(path) in str(error)
    return read / len(chosen)


@pytest.mark.parametrize("step", [23, pytest.param(1, marks=pytest.mark.long)])
@pytest.mark.parametrize("kind", DOCUMENTS)
def test_entries_of_another_kind_are_refused_by_name_also_under_a_true_digest(kind, tmp_path, step):
    """Settings, versions and metrics can be anything, and are a part of what is changed here."""
    assert share_read(READERS[kind], tmp_path / READERS[kind].name, step) < 0.7
