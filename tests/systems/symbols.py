"""Compiled equations as SymPy sees them, and the kinematics of z-x-z Euler angles."""

import types
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import sympy as sp
from numba.core.dispatcher import Dispatcher

from rigid_envs.engine.dynamics import Dynamics

# Half angles, so that the quaternion is a polynomial in their sines and cosines.
HALF = sp.symbols("a b c")
ANGLES = sp.Matrix([2 * half for half in HALF])  # phi, theta, psi
RATES = sp.Matrix(sp.symbols("phi_t theta_t psi_t"))
ACCELERATIONS = sp.Matrix(sp.symbols("phi_tt theta_tt psi_tt"))


def plain(function: Any, stand_ins: Mapping[str, Callable[..., Any]] | None = None) -> Any:
    """A compiled function as Python, and so everything that it calls.

    Roots, sines and cosines know floats only: `stand_ins` are called in their place, by name.
    """
    source, others = getattr(function, "py_func", function), stand_ins or {}
    names = source.__code__.co_names
    scope = {
        name: plain(value, others) if isinstance(value, Dispatcher) else others.get(name, value)
        for name, value in source.__globals__.items()
        if name in names
    }
    return types.FunctionType(source.__code__, {**scope, "__builtins__": __builtins__})


def named(kind: type[Any], values: Sequence[Any]) -> Any:
    """A row with names, of its first values; the others are not looked at, and 0 here."""
    n = len(kind._fields)  # type: ignore[attr-defined]
    return kind(*values[:n], *(0,) * (n - len(values)))


def rates(
    dynamics: Dynamics, y: Sequence[Any], u: Sequence[Any], p: Sequence[Any], **stand_ins: Any
) -> tuple[Any, ...]:
    """What ``dynamics.rhs`` makes of rows of symbols; see `plain`."""
    rows = named(dynamics.State, y), named(dynamics.Input, u), named(dynamics.Parameters, p)
    return tuple(plain(dynamics.rhs, stand_ins)(*rows))


def integrals(
    dynamics: Dynamics, y: Sequence[Any], p: Sequence[Any], **stand_ins: Any
) -> tuple[Any, ...]:
    """What ``dynamics.invariants`` makes of rows of symbols; see `plain`."""
    rows = named(dynamics.State, y), named(dynamics.Parameters, p)
    return tuple(plain(dynamics.invariants, stand_ins)(*rows))


def reduced(expression: Any) -> Any:
    """The one polynomial in sines and cosines of the half angles that has no cosine squared."""
    expression = sp.expand(sp.expand_trig(expression))
    s, c = sp.Dummy("s"), sp.Dummy("c")
    for half in HALF:
        polynomial = sp.Poly(expression.subs({sp.sin(half): s, sp.cos(half): c}), c)
        rest = sp.rem(polynomial, sp.Poly(c**2 + s**2 - 1, c))
        expression = sp.expand(rest.as_expr().subs({s: sp.sin(half), c: sp.cos(half)}))
    return expression


def in_time(expression: Any) -> Any:
    """Total time derivative of a function of angles and their rates."""
    by_angle = sum(
        sp.diff(expression, half) * rate / 2 for half, rate in zip(HALF, RATES, strict=True)
    )
    by_rate = sum(
        sp.diff(expression, rate) * acceleration
        for rate, acceleration in zip(RATES, ACCELERATIONS, strict=True)
    )
    return by_angle + by_rate


def rotation() -> sp.Matrix:
    """R = Rz(phi) Rx(theta) Rz(psi)."""

    def about_z(angle):
        s, c = sp.sin(angle), sp.cos(angle)
        return sp.Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    s, c = sp.sin(ANGLES[1]), sp.cos(ANGLES[1])
    about_x = sp.Matrix([[1, 0, 0], [0, c, -s], [0, s, c]])
    return about_z(ANGLES[0]) * about_x * about_z(ANGLES[2])


def quaternion() -> sp.Matrix:
    """The textbook quaternion of z-x-z Euler angles."""
    a, b, c = HALF
    return sp.Matrix(
        [
            sp.cos(b) * sp.cos(a + c),
            sp.sin(b) * sp.cos(a - c),
            sp.sin(b) * sp.sin(a - c),
            sp.cos(b) * sp.sin(a + c),
        ]
    )


R = rotation()
SPIN = R.T * R.applyfunc(in_time)  # [omega_body] x
OMEGA = sp.Matrix([SPIN[2, 1], SPIN[0, 2], SPIN[1, 0]]).applyfunc(reduced)
BY_RATES = OMEGA.jacobian(RATES)  # omega_body = BY_RATES (phi', theta', psi')
