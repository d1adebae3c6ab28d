"""Compiled functions of a system as functions of CasADi."""

import builtins
import importlib
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import CodeType, FunctionType, ModuleType, SimpleNamespace
from typing import Any

from rigid_envs.base.checks import MissingPackageError, integer, number, require
from rigid_envs.engine import elementary
from rigid_envs.engine.dynamics import Dynamics

# CasADi, and what of it stands for our own elementary functions.


def casadi() -> Any:
    """The package CasADi, of the extra "control".

    Raises:
        MissingPackageError: it is not installed; names the command that installs it.
    """
    try:
        return importlib.import_module("casadi")
    except ImportError as error:
        message = 'symbolic models need CasADi: pip install "rigid-envs[control]"'
        raise MissingPackageError(message, name="casadi") from error


def elements() -> Mapping[Any, Any]:
    """The function of CasADi for each elementary function that compiled code uses.

    Raises:
        MissingPackageError: CasADi is not installed.
    """
    ca = casadi()
    return {
        elementary.atan2: ca.atan2,
        elementary.cbrt: lambda x: x ** (1.0 / 3.0),
        elementary.expm1: ca.expm1,
        elementary.log: ca.log,
        elementary.select: ca.if_else,
        elementary.sign: ca.sign,
        elementary.sincos: lambda x: (ca.sin(x), ca.cos(x)),
        elementary.sqrt: ca.sqrt,
        elementary.tanh: ca.tanh,
        elementary.sine_ratio: lambda x: ca.if_else(
            x == 0.0, 1.0, ca.sin(x) / ca.if_else(x == 0.0, 1.0, x)
        ),
        math.sqrt: ca.sqrt,
        min: ca.fmin,
        max: ca.fmax,
    }


# Compiled functions, run as plain Python on numbers of another kind.


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
        used = set(_names(plain.__code__))
        names.update({name: self._copies(known[name], used) for name in used & known.keys()})
        return copy

    def _copies(self, value: Any, used: set[str]) -> Any:
        """The copy of what a name stands for; of a module those of the names that are used."""
        if not isinstance(value, ModuleType):
            return self(value)
        members = vars(value)
        return SimpleNamespace(**{name: self(members[name]) for name in used & members.keys()})


def _names(code: CodeType) -> Iterator[str]:
    """Global names and attributes in the code of a function, and in the functions inside it."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


# A system as functions of CasADi.


@dataclass(frozen=True, eq=False)
class SymbolicModel:
    """Equations of motion, integrator step and invariants of a system, each a `casadi.Function`.

    Arguments are columns y and u, and p where there are free parameters: symbols (SX, MX) or
    numbers. Values are those of `System.rhs`, `System.advance` and `System.invariants` to rounding,
    not to the bit: sine and cosine are CasADi's, and ``a * b + c`` is rounded twice. Nothing is
    checked: states are to be states, and steps within the stability envelope.

    Attributes:
        dynamics: rows and functions of the system.
        parameters: values of the physical parameters by name.
        free: names of the physical parameters that are the entries of p instead, in this order.

    Raises:
        MissingPackageError: CasADi is not installed.
        ValueError: a free parameter that there is not.
    """

    dynamics: Dynamics
    parameters: Mapping[str, float]
    free: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the names, and that there is CasADi."""
        casadi()
        for name in self.free:
            known = f"some of {', '.join(self.parameters)}"
            require(name in self.parameters, name, "free", known)

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the entries of y."""
        return tuple(self.dynamics.State._fields)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the entries of u."""
        return tuple(self.dynamics.Input._fields)

    @cached_property
    def rhs(self) -> Any:
        """Time derivative of the state, ``rhs(y, u) -> dy``."""
        return self._function("rhs", self._traced(self.dynamics.rhs)(*self._rows), "dy")

    @cached_property
    def invariants(self) -> Any:
        """Quantities that are constant without input, ``invariants(y) -> values``."""
        y, _, p = self._rows
        measured = self._traced(self.dynamics.invariants)(y, p)
        return self._function("invariants", measured, "values", without="u")

    def step(self, dt: float, n_substeps: int = 1) -> Any:
        """The state after a time dt [s] under constant input, ``step(y, u) -> y_next``.

        It is composed as in `System.advance`, of the same stages, quaternions kept at length 1.

        Args:
            dt: time [s].
            n_substeps: number of integrator steps.
        """
        n, h = integer(n_substeps, "n_substeps", 1), number(dt, "dt", "s")
        stage, restore = self._traced(self.dynamics.step), self._traced(self.dynamics.restore)
        y, u, p = self._rows
        for _ in range(n):
            for weight in self.dynamics.weights:
                y = stage(y, u, p, weight * (h / n))
            y = restore(y)
        return self._function("step", y, "y_next")

    @cached_property
    def _traced(self) -> Tracer:
        return Tracer(elements())

    @cached_property
    def _symbols(self) -> dict[str, Any]:
        """Columns y, u and, where there are free parameters, p."""
        sizes = {"y": len(self.states), "u": len(self.inputs), "p": len(self.free)}
        return {name: casadi().SX.sym(name, n) for name, n in sizes.items() if n}

    @cached_property
    def _rows(self) -> tuple[Any, Any, Any]:
        """Rows of state, input and parameters, of scalar symbols."""
        entries = {name: casadi().vertsplit(column) for name, column in self._symbols.items()}
        free = dict(zip(self.free, entries.get("p", ()), strict=True))
        raw = {name: float(value) for name, value in self.parameters.items()} | free
        state, inputs = self.dynamics.State(*entries["y"]), self.dynamics.Input(*entries["u"])
        return state, inputs, self._traced(self.dynamics.derive)(*raw.values())

    def _function(self, name: str, row: Iterable[Any], result: str, without: str = "") -> Any:
        ca = casadi()
        columns = {key: column for key, column in self._symbols.items() if key != without}
        return ca.Function(name, [*columns.values()], [ca.vertcat(*row)], [*columns], [result])
