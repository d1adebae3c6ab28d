"""A system as functions of CasADi."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from rigid_envs.checks import integer, number, require
from rigid_envs.kernels.dynamics import Dynamics
from rigid_envs.symbolic.library import casadi, elements
from rigid_envs.symbolic.tracing import Tracer

__all__ = ["SymbolicModel"]


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
        names: tuple[str, ...] = self.dynamics.State._fields
        return names

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the entries of u."""
        names: tuple[str, ...] = self.dynamics.Input._fields
        return names

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
