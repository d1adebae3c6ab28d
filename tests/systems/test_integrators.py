"""The equations in the hands of others: integrators, finite differences, python-control."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import approx_fprime, check_grad
from scipy.optimize._numdiff import approx_derivative

from tests.systems.examples import COIN, SYSTEMS, TURNING, inputs, name_of, states

each_system = pytest.mark.parametrize("system", SYSTEMS, ids=name_of)
each_turning = pytest.mark.parametrize("system", TURNING, ids=name_of)
each_seed = pytest.mark.parametrize("seed", range(5))
TIME = 2.0  # [s] some radians of each motion
RTOL, ATOL = 1e-3, 1e-6  # the defaults of solve_ivp


def start(system, seed):
    """A random state and a gentle input: the motions stay regular for some seconds."""
    rng = np.random.default_rng(seed)
    return states(system, rng), 0.1 * inputs(system, rng)


def bound(system, t, y, u):
    """Largest error at the end [units of y] that errors within the tolerance add up to.

    Each step adds RTOL |y| + ATOL at most, which travels on by the linearised motion.
    """
    local = np.linalg.norm(RTOL * np.abs(y) + ATOL, axis=-1)
    A, _ = system.linearize(0.5 * (y[1:] + y[:-1]), u)
    error, travelled = 0.0, np.eye(y.shape[-1])
    for k in range(len(t) - 1, 0, -1):
        error += np.linalg.norm(travelled, 2) * local[k]
        travelled = travelled @ expm((t[k] - t[k - 1]) * A[k - 1])
    return error


@each_system
@each_seed
def test_solve_ivp_with_its_defaults_agrees_with_simulate_within_its_tolerance(system, seed):
    y, u = start(system, seed)
    found = solve_ivp(lambda _, y: system.rhs(y, u), (0.0, TIME), y)
    assert found.success
    error = np.linalg.norm(found.y[:, -1] - system.simulate(y, found.t, u).y[-1])
    assert error < bound(system, found.t, found.y.T, u)


@each_system
@each_seed
def test_solve_ivp_converges_to_simulate(system, seed):
    y, u = start(system, seed)
    found = solve_ivp(
        lambda _, y: system.rhs(y, u), (0.0, TIME), y, method="DOP853", rtol=1e-10, atol=1e-10
    )
    exact = system.simulate(y, found.t, u).y
    # some dozens of steps of 1e-10 that grow tenfold; simulate itself is good to 1e-10
    np.testing.assert_allclose(found.y.T, exact, rtol=0, atol=1e-8)


@each_system
@pytest.mark.parametrize("method", ["RK23", "DOP853", "Radau", "BDF", "LSODA"])
def test_every_integrator_of_scipy_runs_with_its_defaults(system, method):
    y, u = start(system, 0)
    jacobian = {"jac": lambda _, y: system.linearize(y, u)[0]}
    options = jacobian if method in ("Radau", "BDF", "LSODA") else {}
    found = solve_ivp(lambda _, y: system.rhs(y, u), (0.0, TIME), y, method=method, **options)
    assert found.success
    exact = system.simulate(y, [0.0, TIME], u).y[-1]
    # some dozens of steps, each within 1e-3
    np.testing.assert_allclose(found.y[:, -1], exact, rtol=0, atol=0.03)


@each_turning
def test_the_field_beside_the_sphere_keeps_the_length_of_the_quaternion(system):
    rng = np.random.default_rng(1)
    y, u = states(system, rng, 20), inputs(system, rng, 20)
    y[:, :4] *= rng.uniform(0.4, 2.0, (20, 1))
    rates = system.rhs(y, u)
    along = np.sum(y[:, :4] * rates[:, :4], axis=-1)
    size = np.linalg.norm(y[:, :4], axis=-1) * np.linalg.norm(rates[:, :4], axis=-1)
    np.testing.assert_allclose(along / size, 0.0, atol=1e-14)


def test_the_field_of_the_upright_coin_keeps_its_lean():
    rng = np.random.default_rng(2)
    y = states(COIN, rng, 20)
    y[:, :4] = rng.normal(size=(20, 4))
    rates = COIN.rhs(y)
    signs = np.array([1.0, -1.0, -1.0, 1.0])  # e3 . e_z = w^2 - x^2 - y^2 + z^2
    np.testing.assert_allclose(np.sum(signs * y[:, :4] * rates[:, :4], axis=-1), 0.0, atol=1e-14)


@each_system
@pytest.mark.parametrize("method", ["2-point", "3-point"])
def test_finite_differences_of_scipy_are_the_jacobians(system, method):
    y, u = start(system, 3)
    # truncation: h = 1.5e-8 or h^2 = 4e-11 times derivatives of some ten; rounding: 1e-16 / h
    options = {"method": method}
    atol = 1e-6 if method == "2-point" else 1e-9
    for at in (u, 0.0 * u):
        A, B = system.linearize(y, at)
        by_state = approx_derivative(lambda y, at=at: system.rhs(y, at), y, **options)
        by_input = approx_derivative(lambda u: system.rhs(y, u), at, **options)
        np.testing.assert_allclose(by_state, A, rtol=0, atol=atol)
        np.testing.assert_allclose(by_input, B, rtol=0, atol=atol)


@each_system
def test_the_checks_of_optimisers_find_the_jacobians_right(system):
    y, u = start(system, 4)
    rng = np.random.default_rng(4)
    weights = rng.normal(size=len(y))

    def value(y):
        return weights @ system.rhs(y, u)

    def gradient(y):
        return weights @ system.linearize(y, u)[0]

    # forward differences of 1.5e-8
    assert check_grad(value, gradient, y) < 1e-6 * np.linalg.norm(gradient(y))
    np.testing.assert_allclose(approx_fprime(y, value), gradient(y), rtol=0, atol=1e-5)


def block(system):
    """The system as a block of python-control, with all states as outputs."""
    control = pytest.importorskip("control")
    return control.nlsys(
        lambda t, y, u, params: system.rhs(y, u),
        inputs=list(system.input_entries),
        states=list(system.state_entries),
        name=name_of(system),
    )


@each_system
def test_python_control_linearizes_the_systems(system):
    y, u = start(system, 5)
    found = block(system).linearize(y, u)
    A, B = system.linearize(y, u)
    # forward differences of 1e-6, of second derivatives of some ten
    np.testing.assert_allclose(found.A, A, rtol=0, atol=3e-5)
    np.testing.assert_allclose(found.B, B, rtol=0, atol=3e-5)


@each_system
def test_python_control_simulates_the_systems(system):
    control = pytest.importorskip("control")
    y, u = start(system, 6)
    t = np.linspace(0.0, TIME, 101)
    held = np.repeat(u[:, None], len(t), axis=1)
    found = control.input_output_response(block(system), t, held, y)
    exact = system.simulate(y, t, u).y.T
    # by solve_ivp with its defaults: some dozens of steps, each within 1e-3
    np.testing.assert_allclose(found.states, exact, rtol=0, atol=0.03)
