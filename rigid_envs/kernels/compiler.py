"""Decorators that compile functions.

=============  ===================================================================================
`scalar`       a function of one row, inlined into the loop that calls it
`phase`        a part of a kernel, inlined before type inference
`routine`      a part of a kernel, called once per block and not inlined
`instruction`  a function defined by its LLVM instructions
`kernel`       a loop over rows that Python calls, cached on disk
=============  ===================================================================================
"""

import gc
import logging
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar, cast

import numba
from numba import extending
from numba.core import event

from rigid_envs.kernels.cache import KernelCache, cache_directory, cache_name
from rigid_envs.kernels.parts import part

__all__ = [
    "COMPILES",
    "address_of",
    "compiled_for",
    "instruction",
    "kernel",
    "phase",
    "routine",
    "scalar",
]

Function = TypeVar("Function", bound=Callable[..., Any])

_numba: Any = numba  # knows more than its types say
COMPILES: bool = not _numba.config.DISABLE_JIT
"""Whether functions are compiled; with ``NUMBA_DISABLE_JIT=1`` they run as plain Python."""

_SLOW = 1.0  # [s] compilations longer than this are announced


def scalar(function: Function) -> Function:
    """Compile a function of scalars and tuples, inlined into the loop that calls it."""
    return part(function, forceinline=True)


def instruction(function: Callable[..., Any]) -> Callable[..., Any]:
    """Define a function by its LLVM instructions."""
    return cast(Callable[..., Any], extending.intrinsic(function))


def phase(function: Function) -> Function:
    """Inline a function into its caller before type inference: for parts of a kernel."""
    return cast(Function, numba.njit(inline="always", error_model="numpy")(function))


def routine(function: Function) -> Function:
    """Compile a function that is called once per block, without inlining."""
    return part(function)


def kernel(function: Function, label: str | None = None, parts: Iterable[Any] = ()) -> Function:
    """Compile a loop over rows; the code is cached on disk and releases the interpreter lock.

    If no private cache folder can be made (read-only home), or a part has no source file, the
    kernel is compiled again in every process.

    Args:
        function: The loop: a function of a module, or a closure over `parts`.
        label: Name for messages and files; by default module and function name.
        parts: Functions, classes and tuples of numbers in a closure.
    """
    label = label or f"{function.__module__}.{function.__name__}"
    folder, name = cache_directory(), cache_name(label, parts or (function,))
    if name is not None:
        # Numba counts the functions of a process in its names for them: the code of two loops that
        # other processes have compiled could bear the same one, and be taken for each other
        function.__qualname__ = name
    compiled = _numba.njit(nogil=True, error_model="numpy", no_cfunc_wrapper=True)(function)
    if folder is not None and name is not None:
        compiled._cache = KernelCache(folder, name)
    _labels[compiled] = label.removeprefix("rigid_envs.")
    return cast(Function, compiled)


def compiled_for(kernel: Function, *arguments: Any) -> Function:
    """The machine code of a kernel for arguments of certain types; compiled, or loaded, now.

    A call of it does not look at the types of its arguments, which takes 0.1 us.

    Args:
        kernel: From `kernel`.
        arguments: Examples of the types.
    """
    if not COMPILES:
        return kernel
    compiled: Any = kernel
    with _no_collection():
        return cast(Function, compiled.compile(tuple(map(numba.typeof, arguments))))


def address_of(kernel: Function, *arguments: Any) -> int:
    """Address of the machine code of a kernel for arguments of certain types.

    Args:
        kernel: From `kernel`.
        arguments: Examples of the types.
    """
    compiled_for(kernel, *arguments)
    compiled: Any = kernel
    result = compiled.overloads[tuple(map(numba.typeof, arguments))]
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))


@contextmanager
def _no_collection() -> Iterator[None]:
    """Without garbage collection, which takes a tenth of the time and finds hardly anything."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


class _Announcer(event.Listener):
    """Logs each long compilation."""

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
        kept = "to be kept for the next process" if is_kept else "not kept: no cache folder"
        _log.info("compiled %s in %.1f s (%s)", _labels[dispatcher], took, kept)


_log = logging.getLogger(__name__)
_labels: dict[Any, str] = {}
cast(Any, event).register("numba:compile", _Announcer())
