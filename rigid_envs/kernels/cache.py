"""Disk cache of compiled code, and its keys.

Numba's own cache checks only the file of the compiled function: after an edit to a helper in
another file it would load stale code (numba issue 1833), and it does not distinguish two closures
of one factory. Here the key of a kernel consists of the names of its functions and a hash of every
source file that can be compiled into it: all kernels and tasks of this package, and all files of
any other package from which one of the functions comes.
"""

import functools
import hashlib
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

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        """Argument types and processor; the file name identifies the functions inside."""
        return sig, codegen.magic_tuple()


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

    It lies below ``NUMBA_CACHE_DIR``, else below ``XDG_CACHE_HOME``, else below ``~/.cache``. A
    folder with another owner, or writable by others, is never read.
    """
    base = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    folder = Path(base).expanduser() / "rigid-envs" / kernel_hash()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        usable = os.access(folder, os.W_OK) and _is_private(folder)
    except (OSError, RuntimeError):  # RuntimeError: no home directory to expand
        return None
    return folder if usable else None


def _is_private(folder: Path) -> bool:
    if not hasattr(os, "getuid"):
        return True
    status = folder.stat()
    return status.st_uid == os.getuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
