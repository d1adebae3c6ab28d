"""Disk cache of compiled code, and its keys.

Numba's own cache checks only the file of the compiled function: after an edit to a helper in
another file it would load stale code (numba issue 1833), and it does not distinguish two closures
of one factory. Here the key of a kernel consists of the names of its functions and a hash of every
source file that can be compiled into it: all kernels and tasks of this package, and all files of
any other package from which one of the functions comes.
"""

import contextlib
import functools
import hashlib
import logging
import os
import stat
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numba
from numba.core import caching

__all__ = ["KernelCache", "cache_directory", "kernel_hash"]

_INDEX: Any = caching.IndexDataCacheFile  # untyped
_PACKAGE = Path(__file__).resolve().parent.parent
_log = logging.getLogger(__name__)
_said: set[tuple[str, str]] = set()


class _Place(caching._CacheLocator):
    """Known folder and name of the files of a kernel."""

    def __init__(self, folder: Path, name: str) -> None:
        self._folder, self._py_file = str(folder), name

    def get_cache_path(self) -> str:
        return self._folder

    def get_source_stamp(self) -> str:
        return self._py_file

    def get_disambiguator(self) -> str:
        return ""


class _Results(caching.CompileResultCacheImpl):
    """Serialisation of compiled code as in numba, without its search for a folder."""

    def __init__(self, place: _Place, line: int) -> None:
        self._locator, self._lineno = place, line
        self._filename_base = place.get_source_stamp()


class KernelCache(caching.FunctionCache):
    """Files of one kernel, ``<name>.nbi`` and ``<name>.<n>.nbc``, in the private folder.

    Args:
        function: The kernel.
        folder: `cache_directory()`.
        name: Unique name of the kernel: see `cache_name`.
    """

    def __init__(self, function: Any, folder: Path, name: str) -> None:
        """Set the known folder and names, without a search."""
        self._name, self._py_func = repr(function), function
        self._impl = _Results(_Place(folder, name), function.__code__.co_firstlineno)
        self._cache_path = str(folder)
        self._cache_file = _INDEX(self._cache_path, name, name)
        self._enabled = True

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled code from its file; None where there is none, or it cannot be read."""
        files: Any = super()
        try:
            return files.load_overload(sig, target_context)
        except Exception as error:  # whatever a damaged file makes of unpickling
            _say_once("read", self._cache_path, error)
            with contextlib.suppress(OSError):
                files.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep compiled code in a file; where that fails the process goes on without."""
        files: Any = super()
        try:
            files.save_overload(sig, data)
        except OSError as error:  # a full disk, a limit of size, a folder that is gone
            _say_once("kept", self._cache_path, error)

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        """Argument types and processor; the file name identifies the functions inside."""
        return sig, codegen.magic_tuple()


def _say_once(deed: str, folder: str, error: Exception) -> None:
    """Log that files of a folder cannot be used, once in a process."""
    if (deed, folder) not in _said:
        _said.add((deed, folder))
        _log.warning(
            "compiled code cannot be %s in %s (%s): this process compiles it; where that goes on, "
            "make room, or set NUMBA_CACHE_DIR",
            *(deed, folder, error),
        )


def cache_name(label: str, parts: Iterable[Any]) -> str | None:
    """File name of a kernel, from its functions and types; None if one has no source file.

    Args:
        label: First part of the name.
        parts: Functions, classes and tuples of numbers compiled into the kernel.
    """
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, tuple):
            digest.update(repr(part).encode())
            continue
        stamp = _source_hash(part.__module__)
        if stamp is None or "<" in part.__qualname__:  # typed at a prompt, or a closure
            return None
        digest.update(f"{part.__module__}.{part.__qualname__} {stamp}\0".encode())
    return f"{label}-{digest.hexdigest()[:16]}"


@functools.cache
def kernel_hash() -> str:
    """SHA-256 over the sources of all compiled code in the package, as 16 hex digits."""
    digest = hashlib.sha256(numba.__version__.encode())
    for folder in ("kernels", "tasks"):
        _hash_files(digest, _PACKAGE, _sources(_PACKAGE / folder))
    return digest.hexdigest()[:16]


@functools.cache
def _source_hash(module: str) -> str | None:
    """Hash of the package of a module, or of its file if it has no package."""
    top: Any = sys.modules.get(module.partition(".")[0])
    if top is sys.modules[__package__.partition(".")[0]]:
        return kernel_hash()
    digest = hashlib.sha256()
    if hasattr(top, "__path__"):
        for folder in map(Path, top.__path__):
            _hash_files(digest, folder, _sources(folder))
    elif getattr(top, "__file__", None):
        path = Path(top.__file__)
        _hash_files(digest, path.parent, [path])
    else:
        return None
    return digest.hexdigest()


def _sources(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.py"))


def _hash_files(digest: Any, base: Path, paths: Iterable[Path]) -> None:
    for path in paths:
        digest.update(path.relative_to(base).as_posix().encode() + b"\0")
        digest.update(path.read_bytes() + b"\0")


@functools.cache
def cache_directory() -> Path | None:
    """Private folder for compiled code of exactly these sources; None if it cannot be made.

    It lies below ``NUMBA_CACHE_DIR``, else below ``XDG_CACHE_HOME``, else below ``~/.cache``. What
    lies in it is run. A folder with another owner or writable by others is never read, nor one
    below a folder in which others could put their own in its place: see `_is_safe`.
    """
    base = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    try:
        folder = Path(base).expanduser().absolute() / "rigid-envs" / kernel_hash()
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        usable = os.access(folder, os.W_OK) and _is_private(folder) and _is_safe(folder.resolve())
    except (OSError, RuntimeError):  # RuntimeError: no home directory to expand
        usable = False
    if usable:
        return folder
    _log.warning(
        "compiled code is not kept: no folder below %s that only this user can change; every "
        "process compiles it: set NUMBA_CACHE_DIR to one",
        base,
    )
    return None


def _is_private(folder: Path) -> bool:
    """Whether the folder belongs to the user, and no other may write to it."""
    if not hasattr(os, "getuid"):
        return True
    status = folder.stat()
    return status.st_uid == os.getuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _is_safe(folder: Path) -> bool:
    """Whether no other user can rename the folder or one above it.

    Each of these belongs to the user or to the system, and is closed to all others, or open as
    ``/tmp`` is, where nobody renames what belongs to another. The user's own group is trusted: many
    systems give each user one.
    """
    if not hasattr(os, "getuid"):
        return True
    for above in folder.parents:
        status = above.stat()
        group = 0 if status.st_gid == os.getgid() else stat.S_IWGRP
        is_open = status.st_mode & (group | stat.S_IWOTH) and not status.st_mode & stat.S_ISVTX
        if is_open or status.st_uid not in (0, os.getuid()):
            return False
    return True
