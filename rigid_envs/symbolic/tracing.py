"""Compiled functions, run as plain Python on numbers of another kind."""

from __future__ import annotations

import builtins
import math
from collections.abc import Iterator, Mapping
from types import CodeType, FunctionType, SimpleNamespace
from typing import Any

__all__ = ["Tracer"]


class Tracer:
    """Copies functions, such that they take elementary functions from another library.

    The copy of a function has the same code; the names that it uses stand for the elements of the
    library, or for copies of the functions that it calls. The originals stay as they are.
    """

    def __init__(self, library: Mapping[Any, Any]) -> None:
        """Copy nothing yet.

        Args:
            library: what stands for each elementary function. Functions that are not in it are
                copied; `fma`, ``a * b + c`` in plain Python, needs no element.
        """
        self._found = dict(library)

    def __call__(self, function: Any) -> Any:
        """The copy of a function, compiled or not; what is no function of Python as it is."""
        plain = getattr(function, "py_func", function)
        if function is math:
            return SimpleNamespace(**{name: self(value) for name, value in vars(math).items()})
        if isinstance(plain, FunctionType):
            return self._found.get(function) or self._copied(function, plain)
        return self._found.get(function, function) if callable(function) else function

    def _copied(self, function: Any, plain: FunctionType) -> Any:
        names: dict[str, Any] = {}
        copy = FunctionType(
            plain.__code__, names, plain.__name__, plain.__defaults__, plain.__closure__
        )
        self._found[function] = copy  # before its names are looked up: functions may be recursive
        known = {**vars(builtins), **plain.__globals__}
        names.update({name: self(known[name]) for name in _names(plain.__code__) if name in known})
        return copy


def _names(code: CodeType) -> Iterator[str]:
    """Global names and attributes in the code of a function, and in the functions inside it."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)
