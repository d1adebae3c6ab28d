"""Compiled definition of a physical system, and the loops of its NumPy interface."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from rigid_envs.engine import rows as batch
from rigid_envs.engine.algebra import NO_CONTACT, SUZUKI, Contact, Row
from rigid_envs.engine.compiler import COMPILES, kernel, scalar
from rigid_envs.engine.returns import Returns
from rigid_envs.engine.rows import Array, Prototype, prototype

Function = Callable[..., Any]


@scalar
def at_rest(_y: Row, _p: Row) -> float:
    """Rate 0, of a system whose rates are those of its input."""
    return 0.0


@scalar
def unchanged(y: Any) -> Any:
    """The state itself, of a system whose step leaves no drift to remove."""
    return y


@dataclass(frozen=True, eq=False)
class Dynamics:
    """Equations of motion of a system: named rows and compiled functions of one row.

    Attributes:
        State: `NamedTuple` of the state y; its defaults are the rest state.
        Input: `NamedTuple` of the input u.
        Parameters: `NamedTuple` of the parameters p: first the physical ones, in the order of the
            arguments of `derive`, then the derived ones.
        Invariants: `NamedTuple` of the quantities conserved without input.
        derive: ``derive(*physical parameters) -> Parameters``.
        rhs: ``rhs(y, u, p) -> y'``, for real and complex numbers.
        step: ``step(y, u, p, h) -> y`` after h [s], symmetric and of second order, or exact.
        restore: ``restore(y) -> y`` with rounding drift removed (|q| = 1).
        invariants: ``invariants(y, p) -> Invariants``.
        weights: lengths of the stages that a step is composed of (`kernels.composition`).
        rate: ``rate(y, p)``, largest rate [rad/s] of the motion and of the turns of a step; an
            episode whose rate leaves the stability envelope ends. By default 0: nothing limits it.
        contact: force of the ground and the friction that rolling needs; by default none.

    Raises:
        TypeError: a function that is not compiled, or `Parameters` that do not begin with the
            arguments of `derive`.
    """

    State: type[Any]
    Input: type[Any]
    Parameters: type[Any]
    Invariants: type[Any]
    derive: Function
    rhs: Function
    step: Function
    restore: Function
    invariants: Function
    weights: tuple[float, ...] = SUZUKI
    rate: Function = at_rest
    contact: Contact = NO_CONTACT

    def __post_init__(self) -> None:
        """Check the order of the parameters, and the functions."""
        check_derive(self.derive, self.Parameters)
        check_compiled(self)

    @property
    def raw_names(self) -> tuple[str, ...]:
        """Names of the physical parameters, the arguments of `derive`."""
        return argument_names(self.derive)

    @cached_property
    def prototypes(self) -> tuple[Prototype, Prototype, Prototype]:
        """Prototype rows of state, input and parameters, for which loops are compiled."""
        return prototype(self.State), prototype(self.Input), prototype(self.Parameters)

    @property
    def parts(self) -> tuple[Any, ...]:
        """Functions, types and weights that the compiled steps contain."""
        return (self.step, self.restore, self.State, self.Input, self.Parameters, self.weights)

    @cached_property
    def evaluate_rows(self) -> Callable[[Array, Array, Array, Array], None]:
        """Compiled ``out[i] = rhs(y[i], u[i], p)``; real or complex."""
        rhs, prototypes = self.rhs, self.prototypes

        def evaluate_rows(y: Array, u: Array, p: Array, out: Array) -> None:
            batch.evaluate(rhs, prototypes, y, u, p, out)

        y, u, p = prototypes
        return self._kernel(evaluate_rows, Returns("rhs", rhs, (y, u, p), y))

    @cached_property
    def force_rows(self) -> Callable[[Array, Array, Array, Array], None]:
        """Compiled ``out[i] = contact.force(y[i], u[i], p)``."""
        force, prototypes = self.contact.force, self.prototypes

        def force_rows(y: Array, u: Array, p: Array, out: Array) -> None:
            batch.evaluate(force, prototypes, y, u, p, out)

        y, u, p = prototypes
        n_force = (1.0,) * self.contact.n_force
        return self._kernel(force_rows, Returns("force", force, (y, u, p), n_force))

    @cached_property
    def measure_rows(self) -> Callable[[Array, Array, Array], None]:
        """Compiled ``out[i] = invariants(y[i], p)``."""
        invariants, prototypes = self.invariants, self.prototypes

        def measure_rows(y: Array, p: Array, out: Array) -> None:
            batch.measure(invariants, prototypes, y, p, out)

        y, _, p = prototypes
        kept = prototype(self.Invariants)
        return self._kernel(measure_rows, Returns("invariants", invariants, (y, p), kept))

    @cached_property
    def rate_rows(self) -> Callable[[Array, Array, Array], None]:
        """Compiled ``out[i] = rate(y[i], p)``."""
        rate, prototypes = self.rate, self.prototypes

        def rate_rows(y: Array, p: Array, out: Array) -> None:
            batch.rates(rate, prototypes, y, p, out)

        y, _, p = prototypes
        return self._kernel(rate_rows, Returns("rate", rate, (y, p), 1.0))

    @cached_property
    def simulate_rows(self) -> Callable[..., None]:
        """Compiled `batch.simulate` of this system."""
        step, restore, prototypes = self.step, self.restore, self.prototypes

        def simulate_rows(
            weights: Array,
            p: Array,
            u: Array,
            u_per_stage: bool,
            h: Array,
            n_substeps: Array,
            y: Array,
        ) -> None:
            batch.simulate(step, restore, weights, prototypes, p, u, u_per_stage, h, n_substeps, y)

        y, u, p = prototypes
        steps = Returns("step", step, (y, u, p, 1.0), y), Returns("restore", restore, (y,), y)
        return self._kernel(simulate_rows, *steps)

    def _kernel(self, loop: Function, *returns: Returns) -> Function:
        label = f"{self.step.__module__}.{loop.__name__}"
        others = (self.rhs, self.invariants, self.rate, self.contact.force)
        checks = [each.check for each in returns]
        return kernel(loop, label, (*others, *self.parts), checks=checks)


def argument_names(function: Function) -> tuple[str, ...]:
    """Names of the arguments of a compiled function."""
    return tuple(inspect.signature(getattr(function, "py_func", function)).parameters)


def check_derive(derive: Function, parameters: type[Any], n: int | None = None) -> None:
    """Check that a parameter row begins with the arguments of `derive`.

    Args:
        derive: Function of the physical parameters.
        parameters: `NamedTuple` of the parameter row.
        n: Number of physical parameters; by default the number of arguments.

    Raises:
        TypeError: names or order differ.
    """
    names = argument_names(derive)
    first = parameters._fields[: len(names) if n is None else n]
    if first != names:
        raise TypeError(
            f"{derive.__module__}.{derive.__name__} has arguments {names}; "
            f"expected those that {parameters.__qualname__} begins with, {first}"
        )


def check_compiled(definition: Any) -> None:
    """Check that the functions of a system or a task are compiled ones.

    Raises:
        TypeError: a function without `scalar`.
    """
    for name, value in vars(definition).items():
        if COMPILES and inspect.isfunction(value):
            raise TypeError(
                f"{name} = {value.__module__}.{value.__name__}, a plain function; "
                "expected a compiled one: decorate it with @scalar"
            )
