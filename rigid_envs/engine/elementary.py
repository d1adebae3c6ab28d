"""Elementary functions built from ``+ - * / sqrt`` and fma: the same bits on every processor.

The C library's sin, cos, exp or atan2 differ between processors with and without FMA. These do not.
They have no branches, so that loops over rows are vectorised; accuracy is a few units in the last
place over the stated range (measured in the tests against NumPy).

Equations of motion are differentiated by complex step: the functions in them also take complex
numbers x + i y with a tiny y, and return f(x) + i y f'(x).
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types
from numba.core.typing.templates import Signature
from numba.extending import lower_builtin, overload, type_callable

from rigid_envs.engine.compiler import instruction, scalar

_PI = math.pi
_DISSOLVED: Any = {"forceinline": True, "error_model": "numpy"}  # as `scalar`
_TO_INTEGER = 6755399441055744.0  # 1.5 * 2**52: adding and subtracting it rounds to an integer
# pi / 2 in three parts, the first two of 33 bits: n * part is exact for n < 2**20
_HALF_PI = (1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
_LOG_2 = (6.93147180369123816490e-01, 1.90821492927058770002e-10)  # log 2, the first of 33 bits


@instruction
def _bits(_context: Any, x: Any) -> tuple[Signature, Callable[..., Any]]:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], context.get_value_type(signature.return_type))

    return types.int64(types.float64), generate


@instruction
def _from_bits(_context: Any, n: Any) -> tuple[Signature, Callable[..., Any]]:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], context.get_value_type(signature.return_type))

    return types.float64(types.int64), generate


def fma(a: float, b: float, c: float) -> float:
    """``a * b + c`` rounded once where compiled (as plain Python: any number type, unfused)."""
    return a * b + c


def _type_of_fma(_context: Any) -> Callable[..., Any]:
    def typer(a: Any, b: Any, c: Any) -> Any:
        # complex arguments occur where an equation of motion is differentiated by complex step
        kind = types.complex128 if types.complex128 in (a, b, c) else types.float64
        return kind(kind, kind, kind)

    return typer


def _fused(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
    return builder.fma(*arguments)


def _plain(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return context.compile_internal(builder, lambda a, b, c: a * b + c, signature, arguments)


type_callable(fma)(_type_of_fma)
lower_builtin(fma, *3 * [types.float64])(_fused)
lower_builtin(fma, *3 * [types.complex128])(_plain)


def sqrt(x: float) -> float:
    """Square root; for a complex ``x`` its linearisation at the real part."""
    return math.sqrt(x)


@overload(sqrt, jit_options=_DISSOLVED)  # type: ignore[untyped-decorator]
def _compiled_sqrt(x: Any) -> Callable[..., Any]:
    def root(x: Any) -> Any:
        return math.sqrt(x)

    def tangent(x: Any) -> Any:
        value = math.sqrt(x.real)
        return complex(value, 0.5 * x.imag / value)

    return tangent if x == types.complex128 else root


def select(condition: bool, a: float, b: float) -> float:
    """``a if condition else b``, compiled to a blend."""
    return a if condition else b


def _type_of_select(context: Any) -> Callable[..., Any]:
    def typer(_condition: Any, a: Any, b: Any) -> Any:
        kind: Any = context.unify_types(*map(types.unliteral, (a, b)))
        return kind(types.boolean, kind, kind)

    return typer


def _blend(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
    return builder.select(*arguments)


type_callable(select)(_type_of_select)
lower_builtin(select, types.boolean, types.Number, types.Number)(_blend)


@scalar
def clamp(x: float, low: float, high: float) -> float:
    """The nearest number in [low, high]: as ``min(max(x, low), high)``, compiled in less time."""
    x = select(low > x, low, x)
    return select(high < x, high, x)


def sign(x: float) -> float:
    """1, 0 or -1 with the sign of ``x``; see `sqrt` for a complex ``x``."""
    return select(x > 0.0, 1.0, select(x < 0.0, -1.0, 0.0))


@overload(sign, jit_options=_DISSOLVED)  # type: ignore[untyped-decorator]
def _compiled_sign(x: Any) -> Callable[..., Any]:
    def side(x: Any) -> Any:
        return select(x.real > 0.0, 1.0, select(x.real < 0.0, -1.0, 0.0))

    return side


def sincos(x: float) -> tuple[float, float]:
    """Sine and cosine of ``x`` [rad], for abs(x) up to 1e6; see `sqrt` for a complex ``x``."""
    return _sincos(x)


@overload(sincos, jit_options=_DISSOLVED)  # type: ignore[untyped-decorator]
def _compiled_sincos(x: Any) -> Callable[..., Any]:
    def circular(x: Any) -> Any:
        return _sincos(x)

    def tangent(x: Any) -> Any:
        s, c = _sincos(x.real)
        return complex(s, x.imag * c), complex(c, -x.imag * s)

    return tangent if x == types.complex128 else circular


@scalar
def _sincos(x: float) -> tuple[float, float]:
    """Sine and cosine of a real number.

    Cody & Waite reduction to [-pi/4, pi/4], then the Taylor polynomials to x^17 and x^16, whose
    first neglected term is below 1e-18 there.
    """
    n = (x * (2.0 / _PI) + _TO_INTEGER) - _TO_INTEGER
    r = fma(-n, _HALF_PI[2], fma(-n, _HALF_PI[1], fma(-n, _HALF_PI[0], x)))
    z = r * r
    s = fma(z, 1.0 / 355687428096000.0, -1.0 / 1307674368000.0)
    s = fma(z, fma(z, s, 1.0 / 6227020800.0), -1.0 / 39916800.0)
    s = fma(z, fma(z, s, 1.0 / 362880.0), -1.0 / 5040.0)
    s = fma(r * z, fma(z, fma(z, s, 1.0 / 120.0), -1.0 / 6.0), r)
    c = fma(z, 1.0 / 20922789888000.0, -1.0 / 87178291200.0)
    c = fma(z, fma(z, c, 1.0 / 479001600.0), -1.0 / 3628800.0)
    c = fma(z, fma(z, c, 1.0 / 40320.0), -1.0 / 720.0)
    c = fma(z, fma(z, fma(z, c, 1.0 / 24.0), -0.5), 1.0)
    quarter = n - 4.0 * ((n * 0.25 + _TO_INTEGER) - _TO_INTEGER)  # -2, -1, 0, 1 or 2
    odd = abs(quarter) == 1.0
    sine = select(odd, c, s)
    cosine = select(odd, s, c)
    sine = select((quarter == -1.0) | (abs(quarter) == 2.0), -sine, sine)
    cosine = select((quarter == 1.0) | (abs(quarter) == 2.0), -cosine, cosine)
    return sine, cosine


@scalar
def atan2(y: float, x: float) -> float:
    """Angle of the point (x, y) in [-pi, pi] [rad]; 0 at the origin.

    Rational approximation on [0, tan(pi/8)] (S. L. Moshier, Cephes library, atan.c), after
    reduction by symmetry and by tan(a - pi/4).
    """
    ax, ay = abs(x), abs(y)
    low, high = select(ay < ax, ay, ax), select(ay > ax, ay, ax)
    far = low > 0.41421356237309503 * high
    numerator = select(far, low - high, low)
    denominator = select(far, low + high, high)
    t = numerator / select(denominator == 0.0, 1.0, denominator)
    z = t * t
    p = fma(z, -8.750608600031904122785e-1, -1.615753718733365076637e1)
    p = fma(z, fma(z, p, -7.500855792314704667340e1), -1.228866684490136173410e2)
    p = fma(z, p, -6.485021904942025371773e1)
    q = fma(z, z + 2.485846490142306297962e1, 1.650270098316988542046e2)
    q = fma(z, fma(z, q, 4.328810604912902668951e2), 4.853903996359136964868e2)
    q = fma(z, q, 1.945506571482613964425e2)
    angle = fma(t * z, p / q, t) + select(far, 0.25 * _PI, 0.0)
    angle = select(ay > ax, 0.5 * _PI - angle, angle)
    angle = select(x < 0.0, _PI - angle, angle)
    return select(y < 0.0, -angle, angle)


@scalar
def cbrt(x: float) -> float:
    """Cube root of ``x`` >= 1e-300: a third of the exponent, then three steps of Halley."""
    third = 0.333333333333333333
    y: float = _from_bits(np.int64(float(_bits(x)) * third) + 3071306043645493248)
    for _ in range(3):
        cube = y * y * y
        y = y * (fma(2.0, x, cube) / fma(2.0, cube, x))
    return y


@scalar
def log(x: float) -> float:
    """Natural logarithm of a normal ``x`` > 0: 2 artanh((m - 1) / (m + 1)) + e log 2."""
    bits = _bits(x)
    exponent = float((bits >> 52) - 1023)
    m = _from_bits((bits & 0xFFFFFFFFFFFFF) | 0x3FF0000000000000)  # in [1, 2)
    big = m > 1.4142135623730951
    m = select(big, 0.5 * m, m)
    exponent = select(big, exponent + 1.0, exponent)
    s = (m - 1.0) / (m + 1.0)
    z = s * s
    total = 1.0 / 23.0
    for k in range(10, -1, -1):
        total = fma(z, total, 1.0 / (2.0 * k + 1.0))
    return fma(exponent, 0.6931471805599453, 2.0 * s * total)


@scalar
def expm1(x: float) -> float:
    """``exp(x) - 1``, for ``x`` up to 700; below -60, where the result is -1, as at -60.

    x = n log 2 + r with abs(r) <= log(2) / 2, the Taylor polynomial of r to r^13, whose first
    neglected term is below 2e-17 r there, and 2^n (exp(r) - 1) + (2^n - 1).
    """
    x = max(x, -60.0)
    shifted = fma(x, 1.4426950408889634, _TO_INTEGER)  # its lowest bits are those of n
    n = shifted - _TO_INTEGER
    scale: float = _from_bits((_bits(shifted) + 1023) << 52)  # 2^n
    r = fma(-n, _LOG_2[1], fma(-n, _LOG_2[0], x))
    p = fma(r, 1.0 / 6227020800.0, 1.0 / 479001600.0)
    p = fma(r, fma(r, p, 1.0 / 39916800.0), 1.0 / 3628800.0)
    p = fma(r, fma(r, p, 1.0 / 362880.0), 1.0 / 40320.0)
    p = fma(r, fma(r, p, 1.0 / 5040.0), 1.0 / 720.0)
    p = fma(r, fma(r, p, 1.0 / 120.0), 1.0 / 24.0)
    p = fma(r * r, fma(r, fma(r, p, 1.0 / 6.0), 0.5), r)
    return fma(scale, p, scale - 1.0)


@scalar
def tanh(x: float) -> float:
    """Hyperbolic tangent: t / (t + 2) with t = exp(2 abs(x)) - 1; beyond 20 it is 1."""
    t = expm1(2.0 * min(abs(x), 20.0))
    return math.copysign(t / (t + 2.0), x)


@scalar
def sine_ratio(x: float) -> float:
    """sin(x) / x, 1 at 0."""
    return sincos(x)[0] / x if x != 0.0 else 1.0
