"""Systems as functions of CasADi: the same values, derivatives and names as the compiled ones."""

import sys
from dataclasses import asdict, replace

import numpy as np
import pytest

from rigid_envs.base.checks import MissingPackageError
from tests.systems.examples import BODY, SYSTEMS, TOP, TURNING, inputs, name_of, states

casadi = pytest.importorskip("casadi")

each_system = pytest.mark.parametrize("system", SYSTEMS, ids=name_of)
each_turning = pytest.mark.parametrize("system", TURNING, ids=name_of)
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
def test_steps_repeated_stay_with_the_simulation(system):
    y, u = draw(system)
    u *= 0.1
    step, now = system.symbolic().step(DT), y
    for _ in range(25):
        now = rows(step, now, u)
    # roundings of 25 steps, which grow with the motion
    assert_equal(now, system.advance(y, u, 25 * DT, 25), 1e-12)


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


def test_the_derivative_by_a_free_parameter_is_that_of_another_system():
    y, u = (column[0] for column in draw(TOP))
    model = TOP.symbolic(free=["m"])
    by_mass = np.array(model.step(DT).jacobian()(y, u, TOP.m, 0)[2])[:, 0]
    h = 1e-5
    more, less = (replace(TOP, m=TOP.m + sign * h).advance(y, u, DT) for sign in (1.0, -1.0))
    # h^2 = 1e-10 of the third derivative, and roundings of 1e-16 / h
    np.testing.assert_allclose(by_mass, (more - less) / (2.0 * h), atol=1e-10)
    assert np.abs(by_mass).max() > 1e-4


@each_system
def test_entries_and_arguments_have_the_names_of_the_system(system):
    model = system.symbolic(free=system.parameter_names()[:1])
    assert (model.states, model.inputs) == (system.state_entries, system.input_entries)
    for function, result in ((model.rhs, "dy"), (model.step(DT), "y_next")):
        assert function.name_in() == ["y", "u", "p"]
        assert function.name_out() == [result]
    assert model.invariants.name_in() == ["y", "p"]
    assert system.symbolic().rhs.name_in() == ["y", "u"]


def test_functions_take_symbols_of_either_kind():
    model = BODY.symbolic()
    for kind in (casadi.SX, casadi.MX):
        y, u = kind.sym("y", 7), kind.sym("u", 3)
        whole = casadi.Function("f", [y, u], [model.rhs(model.step(DT)(y, u), u)])
        found = np.array(whole(BODY.state(), [1.0, 2.0, 3.0]))[:, 0]
        expected = BODY.rhs(BODY.advance(BODY.state(), [1.0, 2.0, 3.0], DT), [1.0, 2.0, 3.0])
        assert_equal(found, expected, 1e-14)


def test_unknown_parameters_and_steps_that_are_none_are_refused():
    with pytest.raises(ValueError, match=r"^free = 'mass'; expected some of I1, I2, I3, m, g, ell"):
        TOP.symbolic(free=["mass"])
    with pytest.raises(ValueError, match="n_substeps = 0; expected an integer of at least 1"):
        TOP.symbolic().step(DT, 0)
    with pytest.raises(ValueError, match="dt = nan; expected a finite number"):
        TOP.symbolic().step(np.nan)


def test_without_casadi_the_command_that_installs_it_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(MissingPackageError, match=r'pip install "rigid-envs\[control\]"'):
        BODY.symbolic()
    assert issubclass(MissingPackageError, ImportError)
    BODY.rhs(BODY.state())  # all else works
