"""A file is there whole or not at all; what is too large is refused; JSON has one spelling."""

import errno
import json
import os
import resource
import signal
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from rigid_envs.base.files import DamagedFileError, canonical_json, read_bytes, sweep, write_atomic
from tests.fixtures import Patch


def test_what_is_too_large_or_no_file_is_not_read(tmp_path: Path) -> None:
    sparse = tmp_path / "sparse"
    with sparse.open("wb") as file:
        file.truncate(2**33)
    with pytest.raises(DamagedFileError, match="8589934592 bytes; expected at most 1000"):
        read_bytes(sparse, 1000)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(DamagedFileError, match="not a regular file"):
        read_bytes(pipe, 1000)
    with pytest.raises(DamagedFileError, match="not a regular file"):
        read_bytes(tmp_path, 1000)


def test_a_full_disk_leaves_the_old_file_and_says_how_much_was_needed(tmp_path: Path) -> None:
    path = tmp_path / "a"
    write_atomic(path, b"old")
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        with pytest.raises(
            OSError, match=r"write 5000 bytes \(File too large\).*untouched"
        ) as error:
            write_atomic(path, b"x" * 5000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, before)
    assert error.value.errno == errno.EFBIG
    assert path.read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == ["a"]


def test_a_file_is_on_the_disk_before_it_has_its_name_and_its_name_before_the_end(
    tmp_path: Path, monkeypatch: Patch
) -> None:
    calls: list[tuple[object, ...]] = []

    def fsync(descriptor: int) -> None:
        status = os.fstat(descriptor)
        calls.append(("fsync", status.st_ino, status.st_size))

    def replace(old: Path, new: Path) -> None:
        calls.append(("replace", old.stat().st_ino, new))
        rename(old, new)

    rename = os.replace
    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(os, "replace", replace)
    path = tmp_path / "a"
    write_atomic(path, b"x" * 50)  # less than the buffer of a file
    inode = path.stat().st_ino
    assert calls[:2] == [("fsync", inode, 50), ("replace", inode, path)]
    assert [call[:2] for call in calls[2:]] == [("fsync", tmp_path.stat().st_ino)]


def without_folders(monkeypatch: Patch, call: str, code: int) -> None:
    """Let `os.open` or `os.fsync` fail, for folders only."""
    real = getattr(os, call)

    def fail(target: object, *more: int) -> object:
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
def test_a_file_is_written_where_folders_cannot_be_synced(
    tmp_path: Path, monkeypatch: Patch, call: str, code: int
) -> None:
    without_folders(monkeypatch, call, code)
    write_atomic(tmp_path / "a", b"new")
    assert (tmp_path / "a").read_bytes() == b"new"


def test_a_disk_that_fails_after_the_rename_is_told_as_it_is(
    tmp_path: Path, monkeypatch: Patch
) -> None:
    path = tmp_path / "a"
    write_atomic(path, b"old")
    without_folders(monkeypatch, "fsync", errno.EIO)
    with pytest.raises(OSError, match=r"could not sync a folder .*is in place") as error:
        write_atomic(path, b"new")
    assert (error.value.errno, error.value.filename) == (errno.EIO, str(tmp_path))
    assert "untouched" not in str(error.value)
    assert path.read_bytes() == b"new"


def test_threads_that_write_one_file_do_not_disturb_each_other(tmp_path: Path) -> None:
    path = tmp_path / "a"

    def write(k: int) -> None:
        for _ in range(20):
            write_atomic(path, bytes([k]) * 100_000)
            assert path.read_bytes() in contents

    contents = [bytes([k]) * 100_000 for k in range(4)]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(write, range(4)))
    assert [file.name for file in tmp_path.iterdir()] == ["a"]


def test_a_folder_that_is_none_is_named(tmp_path: Path) -> None:
    write_atomic(tmp_path / "a", b"")
    with pytest.raises(NotADirectoryError, match=r"could not write 3 bytes .*untouched"):
        write_atomic(tmp_path / "a" / "b", b"new")


def test_json_has_one_spelling_and_no_nan() -> None:
    a, b = {"x": 1, "y": [0.1, "é"]}, {"y": [0.1, "é"], "x": 1}
    assert canonical_json(a) == canonical_json(b) == '{"x":1,"y":[0.1,"\\u00e9"]}'
    assert json.loads(canonical_json(a)) == a
    with pytest.raises(ValueError, match="not JSON compliant"):
        canonical_json({"x": float("nan")})


def test_text_is_written_as_utf_8(tmp_path: Path) -> None:
    write_atomic(tmp_path / "a", "é\n")
    assert (tmp_path / "a").read_bytes() == b"\xc3\xa9\n"


def test_what_interrupted_writes_left_is_swept_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    for name in (".a.1.tmp", "below/.b.2.tmp", "a.tmp", ".hidden"):
        (tmp_path / name).touch()
    sweep(tmp_path)
    assert {path.name for path in tmp_path.rglob("*")} == {"below", "a.tmp", ".hidden"}
