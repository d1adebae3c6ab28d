"""Copies of compiled functions that take their elementary functions from another library."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from rigid_envs.engine import elementary
from rigid_envs.engine.algebra import log_rotation, normalize
from rigid_envs.mechanics.symbolic import (
    Tracer,
    elements,
)
from rigid_envs.systems.free_body.dynamics import rhs

casadi = pytest.importorskip("casadi")


POINTS = {
    elementary.atan2: [(0.3, -2.0), (-1.0, 0.5), (0.0, 1.0)],
    elementary.cbrt: [(0.3,), (27.0,)],
    elementary.expm1: [(1e-9,), (-0.7,), (3.0,)],
    elementary.fma: [(0.3, -2.0, 1.0)],
    elementary.log: [(0.3,), (7.0,)],
    elementary.select: [(True, 1.0, 2.0), (False, 1.0, 2.0)],
    elementary.sincos: [(0.3,), (-4.0,)],
    elementary.sqrt: [(0.3,), (7.0,)],
    elementary.tanh: [(0.3,), (-7.0,)],
    elementary.sine_ratio: [(0.0,), (1e-9,), (0.7,), (-3.0,)],
}


def test_every_elementary_function_is_looked_at():
    assert {getattr(elementary, name) for name in elementary.__all__} == POINTS.keys() - {
        elementary.sine_ratio
    }


@pytest.mark.parametrize("function", POINTS, ids=lambda each: each.__name__)
def test_each_element_has_the_values_of_the_function_that_it_stands_for(function):
    traced = Tracer(elements())(function)
    for point in POINTS[function]:
        symbols = [casadi.SX.sym("x") for _ in point]
        found = traced(*symbols)
        entries = found if isinstance(found, tuple) else (found,)
        whole = casadi.Function("f", symbols, [casadi.vertcat(*entries)])
        expected = np.atleast_1d(function(*point))
        np.testing.assert_allclose(np.array(whole(*point))[:, 0], expected, rtol=1e-14, atol=1e-16)


def test_a_copy_calls_copies_and_the_original_stays_as_it_is():
    seen = []

    def root(x):
        seen.append(x)
        return math.sqrt(x)

    copy = Tracer({math.sqrt: root})(normalize)
    for function in (copy, normalize):
        np.testing.assert_allclose(function((0.0, 3.0, 0.0, 4.0)), (0.0, 0.6, 0.0, 0.8), rtol=1e-15)
    assert seen == [25.0]


def test_without_a_library_a_copy_is_the_function_in_plain_python():
    q = (0.5, -0.1, 0.7, 0.5)
    np.testing.assert_allclose(Tracer({})(log_rotation)(q), log_rotation(q), rtol=1e-14)


def test_numbers_of_any_kind_pass_through():
    y = SimpleNamespace(w=1, x=0, y=0, z=0, omega1=1 + 1j, omega2=2, omega3=3)
    u, p = SimpleNamespace(tau1=0, tau2=0, tau3=0), SimpleNamespace(I1=1, I2=2, I3=3)
    assert Tracer({})(rhs)(y, u, p)[5] == (3 - 1) * 3 * (1 + 1j) / 2


def _factorial(n):
    return 1 if n == 0 else n * _factorial(n - 1)


def test_functions_are_copied_once_and_may_call_themselves():
    tracer = Tracer({})
    copy = tracer(_factorial)
    assert copy(5) == 120
    assert tracer(_factorial) is copy is copy.__globals__["_factorial"]
