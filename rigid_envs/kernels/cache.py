"""Disk cache of compiled code, and its keys.

Numba's own cache checks only the file of the compiled function: after an edit to a helper in
another file it would load stale code (numba issue 1833), and it does not distinguish two closures
of one factory. Here the key of a kernel consists of the names of its functions and a hash of every
source file that can be compiled into it: all kernels and tasks of this package, and all files of
any other package from which one of the functions comes; and of the versions and the processor that
the code was made for. A checksum of the key and the code is compared before anything is loaded.
"""

import functools
import hashlib
import logging
import os
import stat
import sys
import sysconfig
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core import caching, compiler, serialize

from rigid_envs.files import DamagedFileError, write_atomic

__all__ = ["KernelCache", "cache_directory", "kernel_hash"]

_numba: Any = numba  # knows more than its types say
_serialize: Any = serialize
_Result: Any = compiler.CompileResult
_PACKAGE = Path(__file__).resolve().parent.parent
_CHECKSUM = hashlib.sha256().digest_size
_log = logging.getLogger(__name__)
_said: set[tuple[str, Path]] = set()


class KernelCache(caching.NullCache):
    """Files of one kernel, ``<name>-<hash of the key>.nbc``, in the private folder.

    Each holds the code for one key, see `_key`: a checksum of both, then the code.

    Args:
        folder: `cache_directory()`.
        name: Unique name of the kernel: see `cache_name`.
    """

    def __init__(self, folder: Path, name: str) -> None:
        """Set the known folder and name, without a search."""
        self._folder, self._name = folder, name

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled code from its file; None where there is none, or it is another's."""
        target_context.refresh()  # what the code may call
        key = _key(self._name, sig, target_context.codegen())
        try:
            return _Result._rebuild(target_context, *_serialize.loads(_read(self._file(key), key)))
        except FileNotFoundError:
            return None
        except Exception as error:  # or a class of a third package that is not there any more
            _say_once("read", self._folder, error)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep compiled code in a file; where that fails the process goes on without."""
        key = _key(self._name, sig, data.codegen)
        try:
            if data.library.has_dynamic_globals:
                raise OSError("it holds addresses of this process")
            code = _serialize.dumps(data._reduce())
            write_atomic(self._file(key), _checksum(key, code) + code)
        except OSError as error:  # a full disk, a limit of size, a folder that is gone
            _say_once("kept", self._folder, error)

    def _file(self, key: bytes) -> Path:
        return self._folder / f"{self._name}-{hashlib.sha256(key).hexdigest()[:16]}.nbc"


def _key(name: str, sig: Any, codegen: Any) -> bytes:
    """What the code of a kernel depends on: its name, types of arguments, versions, processor."""
    python = sysconfig.get_config_var("EXT_SUFFIX")  # tag and ABI
    versions = (python, numba.__version__, llvmlite.__version__)
    options = (_numba.config.OPT, _numba.config.BOUNDSCHECK)
    return repr((name, sig, versions, codegen.magic_tuple(), options)).encode()


def _checksum(key: bytes, code: bytes) -> bytes:
    return hashlib.sha256(hashlib.sha256(key).digest() + code).digest()


def _read(path: Path, key: bytes) -> bytes:
    """The code in a file.

    Raises:
        DamagedFileError: It is not the code that was written for this key.
        FileNotFoundError: No file.
    """
    data = path.read_bytes()
    if data[:_CHECKSUM] != _checksum(key, data[_CHECKSUM:]):
        raise DamagedFileError(f"{path.name} is not as it was written")
    return data[_CHECKSUM:]


def _say_once(deed: str, folder: Path, error: Exception) -> None:
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
