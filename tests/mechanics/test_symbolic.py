"""Systems as functions of CasADi, whose values and derivatives are the compiled ones'."""

import math
import sys
from dataclasses import asdict
from types import SimpleNamespace

import numpy as np
import pytest

from rigid_envs.base.checks import MissingPackageError
from rigid_envs.engine import elementary
from rigid_envs.engine.algebra import log_rotation, normalize
from rigid_envs.mechanics.symbolic import Tracer, elements
from rigid_envs.systems.free_body.dynamics import rhs
from tests.refusals import refuses
from tests.systems.examples import BODY, TOP, each_system, each_turning, inputs, states

casadi = pytest.importorskip("casadi")
N = 50
DT = 0.02  # within the stability envelope of all states and inputs of `examples`


def draw(system, seed=0):
    rng = np.random.default_rng(seed)
    return states(system, rng, N), inputs(system, rng, N)


def rows(function, *columns):
    """Values of a function of CasADi at many rows, shape (N, n)."""
    return np.array(function(*(column.T for column in columns))).T


def assert_equal(found, expected, tolerance):
    """Agreement relative to the larger of 1 and the entry."""
    np.testing.assert_allclose(found, expected, rtol=tolerance, atol=tolerance)


@each_system
def test_the_rates_are_those_of_the_compiled_equations(system):
    y, u = draw(system)
    assert_equal(rows(system.symbolic().rhs, y, u), system.rhs(y, u), 1e-12)


@each_turning
def test_beside_the_unit_sphere_the_rates_are_the_same_too(system):
    y, u = draw(system)
    y[:, :4] *= np.random.default_rng(1).uniform(0.5, 2.0, (N, 1))
    assert_equal(rows(system.symbolic().rhs, y, u), system.rhs(y, u), 1e-12)


@each_system
@pytest.mark.parametrize(("dt", "n_substeps"), [(DT, 1), (-DT, 1), (2.0 * DT, 3)])
def test_the_step_is_that_of_advance(system, dt, n_substeps):
    y, u = draw(system)
    step = system.symbolic().step(dt, n_substeps)
    assert_equal(rows(step, y, u), system.advance(y, u, dt, n_substeps), 1e-12)


@each_system
def test_the_invariants_are_those_of_the_system(system):
    y, _ = draw(system)
    y[0] = system.state()
    found = rows(system.symbolic().invariants, y)
    assert_equal(found, np.stack([*system.invariants(y).values()], axis=-1), 1e-12)


@each_system
def test_the_jacobians_are_those_of_linearize(system):
    y, u = draw(system)
    model = system.symbolic()
    columns = casadi.SX.sym("y", len(model.states)), casadi.SX.sym("u", len(model.inputs))
    rates = model.rhs(*columns)
    jacobians = casadi.Function("AB", [*columns], [casadi.jacobian(rates, c) for c in columns])
    A, B = system.linearize(y, u)
    for k in range(N):
        found = map(np.array, jacobians(y[k], u[k]))
        for one, other in zip(found, (A[k], B[k]), strict=True):
            assert_equal(one, other, 1e-10)


@each_system
def test_derivatives_are_finite_at_the_state_of_rest(system):
    model = system.symbolic()
    y, u = system.state(), np.zeros(len(model.inputs))
    for function in (model.rhs, model.step(DT)):
        assert np.isfinite(np.array(function.jacobian()(y, u, 0)[0])).all()
    assert np.isfinite(np.array(model.invariants.jacobian()(y, 0))).all()


@each_system
def test_free_parameters_are_an_input_of_every_function(system):
    y, u = draw(system)
    names = type(system).parameter_names()
    model, fixed = system.symbolic(free=names[::-1]), system.symbolic()
    assert model.free == names[::-1]
    values = np.tile([asdict(system)[name] for name in names[::-1]], (N, 1))
    assert_equal(rows(model.rhs, y, u, values), rows(fixed.rhs, y, u), 1e-14)
    assert_equal(rows(model.step(DT), y, u, values), rows(fixed.step(DT), y, u), 1e-13)
    assert_equal(rows(model.invariants, y, values), rows(fixed.invariants, y), 1e-13)


@each_system
def test_entries_and_arguments_have_the_names_of_the_system(system):
    model = system.symbolic(free=system.parameter_names()[:1])
    assert (model.states, model.inputs) == (system.state_entries, system.input_entries)
    for function, result in ((model.rhs, "dy"), (model.step(DT), "y_next")):
        assert function.name_in() == ["y", "u", "p"]
        assert function.name_out() == [result]
    assert model.invariants.name_in() == ["y", "p"]
    assert system.symbolic().rhs.name_in() == ["y", "u"]


def test_unknown_parameters_and_steps_that_are_none_are_refused():
    refuses(r"^free = 'mass'; expected some of I1, I2, I3, m, g, ell", TOP.symbolic, free=["mass"])
    refuses("n_substeps = 0; expected an integer of at least 1", TOP.symbolic().step, DT, 0)
    refuses("dt = nan; expected a finite number", TOP.symbolic().step, np.nan)


def test_without_casadi_the_command_that_installs_it_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(MissingPackageError, match=r'pip install "rigid-envs\[control\]"'):
        BODY.symbolic()
    assert issubclass(MissingPackageError, ImportError)
    BODY.rhs(BODY.state())  # all else works


POINTS = {
    elementary.atan2: [(0.3, -2.0), (-1.0, 0.5), (0.0, 1.0)],
    elementary.cbrt: [(0.3,), (27.0,)],
    elementary.expm1: [(1e-9,), (-0.7,), (3.0,)],
    elementary.fma: [(0.3, -2.0, 1.0)],
    elementary.log: [(0.3,), (7.0,)],
    elementary.clamp: [(0.5, -1.0, 1.0), (-2.0, -1.0, 1.0), (2.0, -1.0, 1.0)],
    elementary.select: [(True, 1.0, 2.0), (False, 1.0, 2.0)],
    elementary.sign: [(0.3,), (0.0,), (-4.0,)],
    elementary.sincos: [(0.3,), (-4.0,)],
    elementary.sqrt: [(0.3,), (7.0,)],
    elementary.tanh: [(0.3,), (-7.0,)],
    elementary.sine_ratio: [(0.0,), (1e-9,), (0.7,), (-3.0,)],
}


def test_every_elementary_function_is_looked_at():
    public = {name: f for name, f in vars(elementary).items() if not name.startswith("_")}
    assert POINTS.keys() == {
        f for f in public.values() if callable(f) and f.__module__ == elementary.__name__
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
