"""A file or document is there whole or not at all, as it was written, or is refused by name."""

import errno
import json
import os
import resource
import signal
import stat
from concurrent.futures import ThreadPoolExecutor

import pytest

from rigid_envs.base import files
from tests.refusals import refuses


def test_what_is_too_large_or_no_file_is_not_read(tmp_path):
    sparse = tmp_path / "sparse"
    with sparse.open("wb") as file:
        file.truncate(2**33)
    with pytest.raises(files.DamagedFileError, match="8589934592 bytes; expected at most 1000"):
        files.read_bytes(sparse, 1000)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(files.DamagedFileError, match="not a regular file"):
        files.read_bytes(pipe, 1000)
    with pytest.raises(files.DamagedFileError, match="not a regular file"):
        files.read_bytes(tmp_path, 1000)


def test_a_full_disk_leaves_the_old_file_and_says_how_much_was_needed(tmp_path):
    path = tmp_path / "a"
    files.write_atomic(path, b"old")
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        with pytest.raises(
            OSError, match=r"write 5000 bytes \(File too large\).*untouched"
        ) as error:
            files.write_atomic(path, b"x" * 5000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, before)
    assert error.value.errno == errno.EFBIG
    assert path.read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == ["a"]


def test_a_file_is_on_the_disk_before_it_has_its_name_and_its_name_before_the_end(
    tmp_path, monkeypatch
):
    calls = []

    def fsync(descriptor):
        status = os.fstat(descriptor)
        calls.append(("fsync", status.st_ino, status.st_size))

    def replace(old, new):
        calls.append(("replace", old.stat().st_ino, new))
        rename(old, new)

    rename = os.replace
    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(os, "replace", replace)
    path = tmp_path / "a"
    files.write_atomic(path, b"x" * 50)  # less than the buffer of a file
    inode = path.stat().st_ino
    assert calls[:2] == [("fsync", inode, 50), ("replace", inode, path)]
    assert [call[:2] for call in calls[2:]] == [("fsync", tmp_path.stat().st_ino)]


def without_folders(monkeypatch, call, code):
    """Let `os.open` or `os.fsync` fail, for folders only."""
    real = getattr(os, call)

    def fail(target, *more):
        if stat.S_ISDIR(os.stat(target).st_mode):
            raise OSError(code, os.strerror(code))
        return real(target, *more)

    monkeypatch.setattr(os, call, fail)


@pytest.mark.parametrize(
    ("call", "code"),
    [
        ("open", errno.EACCES),
        *(("fsync", code) for code in (errno.EBADF, errno.EINVAL, errno.ENOTSUP)),
    ],
)
def test_a_file_is_written_where_folders_cannot_be_synced(tmp_path, monkeypatch, call, code):
    without_folders(monkeypatch, call, code)
    files.write_atomic(tmp_path / "a", b"new")
    assert (tmp_path / "a").read_bytes() == b"new"


def test_a_disk_that_fails_after_the_rename_is_told_as_it_is(tmp_path, monkeypatch):
    path = tmp_path / "a"
    files.write_atomic(path, b"old")
    without_folders(monkeypatch, "fsync", errno.ENOSPC)
    why = rf"could not sync a folder \({os.strerror(errno.ENOSPC)}\).*is in place"
    with pytest.raises(OSError, match=why) as error:
        files.write_atomic(path, b"new")
    assert (error.value.errno, error.value.filename) == (errno.ENOSPC, str(tmp_path))
    assert "untouched" not in str(error.value)
    assert path.read_bytes() == b"new"


def test_threads_that_write_one_file_do_not_disturb_each_other(tmp_path):
    path = tmp_path / "a"

    def write(k):
        for _ in range(20):
            files.write_atomic(path, bytes([k]) * 100_000)
            assert path.read_bytes() in contents

    contents = [bytes([k]) * 100_000 for k in range(4)]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(write, range(4)))
    assert [file.name for file in tmp_path.iterdir()] == ["a"]


def test_a_folder_that_is_none_is_named(tmp_path):
    files.write_atomic(tmp_path / "a", b"")
    with pytest.raises(NotADirectoryError, match=r"could not write 3 bytes .*untouched"):
        files.write_atomic(tmp_path / "a" / "b", b"new")


def test_json_has_one_spelling_and_no_nan():
    a, b = {"x": 1, "y": [0.1, "é"]}, {"y": [0.1, "é"], "x": 1}
    assert files.canonical_json(a) == files.canonical_json(b) == '{"x":1,"y":[0.1,"\\u00e9"]}'
    assert json.loads(files.canonical_json(a)) == a
    assert files.canonical_json({"x": 1}, indent=2) == '{\n  "x": 1\n}'
    with pytest.raises(ValueError, match="not JSON compliant"):
        files.canonical_json({"x": float("nan")})


def test_text_is_written_as_utf_8(tmp_path):
    files.write_atomic(tmp_path / "a", "é\n")
    assert (tmp_path / "a").read_bytes() == b"\xc3\xa9\n"


def test_what_interrupted_writes_left_is_swept_and_nothing_else(tmp_path):
    (tmp_path / "below").mkdir()
    for name in (".a.1.tmp", "below/.b.2.tmp", "a.tmp", ".hidden"):
        (tmp_path / name).touch()
    files.sweep(tmp_path)
    assert {path.name for path in tmp_path.rglob("*")} == {"below", "a.tmp", ".hidden"}


FORMAT = "rigid-envs example 1"
VALUES = {"format": FORMAT, "n": 3, "costs": [0.1, None, 1e-17], "where": {"cpu": "a"}, "who": "me"}


def read(file):
    with files.read_document(file, FORMAT, 10_000, "write it anew") as document:
        return document


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "a.json"
    files.write_document(path, VALUES)
    return path


def test_a_document_is_read_as_it_was_written_and_written_as_it_was_read(file):
    content, document = file.read_bytes(), read(file)
    assert {key: value for key, value in document.items() if key != "sha256"} == VALUES
    assert [line.partition(":")[0] for line in content.decode().splitlines()[1:-1]] == [
        f'"{key}"' for key in (*VALUES, "sha256")
    ]
    files.write_document(file, document)
    assert file.read_bytes() == content


@pytest.mark.parametrize("key", VALUES)
def test_no_entry_can_be_changed_taken_out_or_put_in(file, key):
    document = json.loads(file.read_text())
    rest = {name: value for name, value in document.items() if name != key}
    for changed in (document | {key: "x"}, rest, document | {"more": 1}):
        file.write_text(json.dumps(changed))
        with pytest.raises(files.DamagedFileError, match=r"a\.json: (sha256|format) = .*anew$"):
            read(file)


HOSTILE = {
    "nothing": (b"", "Expecting value"),
    "no UTF-8": (b"\xff\xfe{}", "codec can't decode"),
    "no object": (b"[1]", r"content = \[1\]; expected a JSON object"),
    "NaN": (b'{"a": NaN}', "NaN: expected finite numbers"),
    "infinity": (b'{"a": -Infinity}', "-Infinity: expected finite"),
    "too large a number": (b'{"a": 1e999}', "1e999: expected finite"),
    "too long a number": (b'{"a": ' + b"9" * 9000 + b"}", "digits"),
    "a key twice": (b'{"a": 1, "b": 2, "a": 1}', "'a' is there twice"),
    "deep": (b"[" * 9000, "nested too deeply"),
    "deep, closed": (b'{"a":' * 900 + b"1" + b"}" * 900, "nested too deeply|format = None"),
    "without a format": (b"{}", "format = None; expected 'rigid-envs example 1'"),
    "of another format": (b'{"format": "other 1"}', "format = 'other 1'; expected"),
    "without a digest": (b'{"format": "rigid-envs example 1"}', "no sha256; expected one"),
    "large": (b" " * 10_001, "10001 bytes; expected at most 10000"),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_what_is_no_document_is_refused_by_name(file, kind):
    content, message = HOSTILE[kind]
    file.write_bytes(content)
    with pytest.raises(files.DamagedFileError, match=rf"a\.json: .*({message})"):
        read(file)


def test_what_goes_wrong_while_a_document_is_taken_apart_names_the_file(file):
    wrong = [lambda d: d["x"], lambda d: d["n"][0], lambda d: d["who"].x,
                        lambda d: 1 / 0, lambda d: d["costs"][9],
                        lambda d: float(d["who"])]  # fmt: skip
    for take in wrong:
        with (
            pytest.raises(files.DamagedFileError, match=r"a\.json: .*; write it anew$"),
            files.read_document(file, FORMAT, 10_000, "write it anew") as document,
        ):
            take(document)


def test_a_boolean_is_no_number_and_text_is_one_line_that_can_be_printed():
    wrong = [(True, int), (1, bool), (1.0, int), (None, str), ([], dict),
                        (1, str | None), ([], {"b": int})]  # fmt: skip
    for value, kind in wrong:
        with pytest.raises(ValueError, match=r"a = .*; expected a value of type"):
            files.checked_values({"a": value}, {"a": kind})
    assert files.checked_values({"a": None, "b": 1}, {"a": float | None}) == {"a": None}
    inside = {"a": {"b": 1, "c": 2}}
    assert files.checked_values(inside, {"a": {"b": int}}) == inside
    refuses(r"b = 1; expected a value of type str", files.checked_values, inside, {"a": {"b": str}})
    with pytest.raises(KeyError, match="d"):
        files.checked_values(inside, {"a": {"d": int}})
    refuses("can be printed", files.checked_values, {"a": {"b": "\x1b[2J"}}, {"a": dict})


def test_one_number_is_a_column():
    assert files.column([3], "costs").tolist() == [3.0]


@pytest.mark.parametrize("values", [[], 3, "12", ["1"], [True], [[1.0]], [[1], [1, 2]], [10**400]])
def test_what_is_no_list_of_numbers_is_refused(values):
    refuses("costs", files.column, values, "costs")
