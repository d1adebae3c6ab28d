"""Floating-point operations of the compiled functions, counted as they run in plain Python.

What a compiler computes once is counted once: equal operations on equal numbers, and operations of
numbers that are the same for all rows (not at all).
"""

from __future__ import annotations

import math
import operator
from collections import Counter
from typing import Any

from rigid_envs.engine import elementary
from rigid_envs.envs.lookup import task_of
from rigid_envs.mechanics.symbolic import Tracer

IDS = ("IntermediateAxis", "Reorient", "SleepingTop", "BallPark", "DiskRoll")
KINDS = ("sum", "product", "fma", "quotient", "root", "choice")
"""What is counted; differences are sums, comparisons, minima and maxima are choices.

Change of sign and absolute value are not: a bit, or part of another instruction.
"""

Origin = tuple[Any, ...]
"""Kind and name of an operation, and its operands: numbers, or ``(index,)`` of an operation."""


class Counted(float):
    """A number that knows the operation which it comes from; one that is new is noted."""

    origins: dict[Origin, int]
    index: int

    def __new__(cls, value, origins, origin):
        """The result of an operation."""
        made = super().__new__(cls, value)
        made.origins = origins
        made.index = origins.setdefault(origin, len(origins))
        return made


def _counting(kind, name, function):
    """A function of numbers, noted where one of them is counted."""

    def counted(*numbers):
        origins = next((x.origins for x in numbers if isinstance(x, Counted)), None)
        result = function(*(float(x) if isinstance(x, Counted) else x for x in numbers))
        if origins is None:
            return result
        operands = ((x.index,) if isinstance(x, Counted) else x for x in numbers)
        found = Counted(result, origins, (kind, name, *operands))
        return result if isinstance(result, bool) else found

    return counted


def _reflected(function):
    return lambda a, b: function(b, a)


for _name, _kind in {"add": "sum", "sub": "sum", "mul": "product", "truediv": "quotient"}.items():
    _operation = _counting(_kind, _name, getattr(operator, _name))
    setattr(Counted, f"__{_name}__", _operation)
    setattr(Counted, f"__r{_name}__", _reflected(_operation))
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Counted, f"__{_name}__", _counting("choice", _name, getattr(operator, _name)))
for _name in ("neg", "abs"):
    setattr(Counted, f"__{_name}__", _counting("sign", _name, getattr(operator, _name)))

_fused = _counting("fma", "fma", lambda a, b, c: a * b + c)


def _fma(a, b, c):
    """``a * b + c``; with a factor of 1 it is a sum, as a compiler makes it."""
    if not isinstance(b, Counted) and b == 1.0:
        return a + c
    return _fused(a, b, c)


_ROOT = _counting("root", "sqrt", math.sqrt)
_LIBRARY = {
    elementary.fma: _fma,
    elementary.sqrt: _ROOT,
    math.sqrt: _ROOT,
    elementary.select: _counting("choice", "select", lambda which, a, b: a if which else b),
    min: _counting("choice", "min", min),
    max: _counting("choice", "max", max),
}


def count(function, *arguments):
    """Operations of one call, by `KINDS`.

    Args:
        function: compiled or not.
        arguments: rows of numbers, and plain numbers, which are the same for all rows.
    """
    origins = {}
    rows = [
        _row(given, k, origins) if isinstance(given, tuple) else given
        for k, given in enumerate(arguments)
    ]
    Tracer(_LIBRARY)(function)(*rows)
    found = Counter(kind for kind, *_ in origins)
    return Counter({kind: found[kind] for kind in KINDS})


def _row(row, argument, origins):
    numbers = (Counted(x, origins, ("given", argument, k)) for k, x in enumerate(row))
    return type(row)(*numbers) if hasattr(row, "_fields") else tuple(numbers)


def flops(counts):
    """Floating-point operations: an fma is two of them, a choice is none."""
    return sum(counts[kind] for kind in KINDS if kind != "choice") + counts["fma"]


def of_substep(dynamics):
    """Operations of a step of the integrator: all of its stages, and `restore`."""
    state, inputs, parameters = dynamics.prototypes
    counts = count(dynamics.restore, state)
    stage = count(dynamics.step, state, inputs, parameters, 0.1)
    for _ in dynamics.weights:
        counts.update(stage)
    return counts


def of_period(env_id):
    """Operations of the integrator in a control period of an environment."""
    task = task_of(env_id)
    substep = of_substep(task.compiled.dynamics)
    return Counter({kind: task.n_substeps * substep[kind] for kind in KINDS})
