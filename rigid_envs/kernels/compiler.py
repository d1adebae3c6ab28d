"""How functions are compiled.

=============  ===================================================================================
`scalar`       a function of one row, which dissolves into the loop that calls it
`phase`        a part of a kernel, copied into it before anything is compiled
`routine`      a part of a kernel that is called once per block
`instruction`  a function given by the machine instructions it becomes
`kernel`       a loop over rows that Python calls; its code is kept on disk
=============  ===================================================================================
"""

import sys
import time
from collections.abc import Callable, Iterable
from typing import Any, TypeVar, cast

import numba
from numba import extending
from numba.core import event

from rigid_envs.kernels.cache import KernelCache, cache_directory, cache_name

__all__ = ["instruction", "kernel", "phase", "routine", "scalar"]

Function = TypeVar("Function", bound=Callable[..., Any])

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


def kernel(function: Function, label: str | None = None, parts: Iterable[Any] = ()) -> Function:
    """Compile a loop over rows; the result is kept on disk and runs without the interpreter lock.

    If no private cache folder can be made (read-only home), or there is no source file to tell
    what the kernel is made of, it is compiled anew in every process.

    Args:
        function: The loop: a function of a module, or a closure that names `parts`.
        label: What it is, for messages and names of files; by default its module and name.
        parts: Functions, classes and tuples of numbers that a closure is made of.
    """
    label = label or f"{function.__module__}.{function.__name__}"
    compiled: Any = numba.njit(nogil=True, error_model="numpy")(function)
    folder, name = cache_directory(), cache_name(label, parts or (function,))
    if folder is not None and name is not None:
        compiled._cache = KernelCache(function, folder, name)
    _labels[compiled] = label.removeprefix("rigid_envs.")
    return cast(Function, compiled)


class _Announcer(event.Listener):
    """Says in one line on stderr what a long first compilation was."""

    def __init__(self) -> None:
        self._started: dict[Any, float] = {}

    def on_start(self, event: event.Event) -> None:
        if event.data["dispatcher"] in _labels:
            self._started[event.data["dispatcher"]] = time.perf_counter()

    def on_end(self, event: event.Event) -> None:
        dispatcher = event.data["dispatcher"]
        started = self._started.pop(dispatcher, None)
        if started is None or (took := time.perf_counter() - started) < _SLOW:
            return
        is_kept = isinstance(dispatcher._cache, KernelCache)
        kept = "kept for the next process" if is_kept else "not kept: no cache folder"
        print(
            f"rigid-envs: compiled {_labels[dispatcher]} in {took:.1f} s ({kept})", file=sys.stderr
        )


_labels: dict[Any, str] = {}
cast(Any, event).register("numba:compile", _Announcer())
