"""How functions are compiled, and where the compiled code is kept between processes.

Numba's own cache looks at the file of the compiled function only: after an edit to a helper in
another file it would serve stale code (numba issue 1833). The cache of this package therefore
lies in a folder named by a hash over every source file that can end up inside a kernel.
"""

import functools
import hashlib
import os
import stat
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba import extending
from numba.core import event

__all__ = ["cache_directory", "instruction", "kernel", "kernel_hash", "phase", "routine", "scalar"]

Function = TypeVar("Function", bound=Callable[..., Any])

_config: Any = numba.config  # made of environment variables, without types
_PACKAGE = Path(__file__).resolve().parent.parent
_SLOW = 1.0  # [s] compilations longer than this are announced


def scalar(function: Function) -> Function:
    """Compile a function of scalars and tuples so that it dissolves into the loop that calls it."""
    return cast(Function, numba.njit(forceinline=True, error_model="numpy")(function))


def instruction(function: Callable[..., Any]) -> Callable[..., Any]:
    """Define a function by the machine instructions it becomes."""
    return cast(Callable[..., Any], extending.intrinsic(function))


def phase(function: Function) -> Function:
    """Copy a function into its caller before anything is compiled: for parts of a kernel."""
    return cast(Function, numba.njit(inline="always", error_model="numpy")(function))


def routine(function: Function) -> Function:
    """Compile a function that is called once per block: not worth copying into its caller."""
    return cast(Function, numba.njit(error_model="numpy")(function))


def kernel(function: Function) -> Function:
    """Compile a loop over rows; the result is kept on disk and runs without the interpreter lock.

    If no private cache folder can be made (read-only home), the kernel is compiled per process.
    """
    folder = cache_directory()
    compile_ = numba.njit(nogil=True, error_model="numpy", cache=folder is not None)
    kept = _config.CACHE_DIR
    _config.CACHE_DIR = str(folder or kept)
    try:
        compiled = compile_(function)
    finally:
        _config.CACHE_DIR = kept  # other users of numba keep their own setting
    _ours.add(compiled)
    return cast(Function, compiled)


@functools.cache
def kernel_hash() -> str:
    """SHA-256 over the sources of all compiled code in the package, as 16 hex digits."""
    digest = hashlib.sha256(numba.__version__.encode())
    for folder in ("kernels", "tasks"):
        for path in sorted((_PACKAGE / folder).rglob("*.py")):
            digest.update(path.relative_to(_PACKAGE).as_posix().encode() + b"\0")
            digest.update(path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


@functools.cache
def cache_directory() -> Path | None:
    """The private folder for compiled code of exactly these sources, or None if there is none.

    It lies below ``NUMBA_CACHE_DIR``, else below ``XDG_CACHE_HOME``, else below ``~/.cache``. A
    folder that belongs to somebody else, or that others may write to, is never read from.
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


class _Announcer(event.Listener):
    """Says in one line on stderr what a long first compilation was."""

    def __init__(self) -> None:
        self._started: dict[Any, float] = {}

    def on_start(self, event: event.Event) -> None:
        if event.data["dispatcher"] in _ours:
            self._started[event.data["dispatcher"]] = time.perf_counter()

    def on_end(self, event: event.Event) -> None:
        started = self._started.pop(event.data["dispatcher"], None)
        if started is None or (took := time.perf_counter() - started) < _SLOW:
            return
        name = event.data["dispatcher"].__module__.removeprefix("rigid_envs.")
        kept = "kept for the next process" if cache_directory() else "not kept: no cache folder"
        print(f"rigid-envs: compiled {name} in {took:.1f} s ({kept})", file=sys.stderr)


_ours: set[Any] = set()
cast(Any, event).register("numba:compile", _Announcer())
