"""Numbers and functions at the edge of what can be computed: refused by name, never NaN."""

import re

import numpy as np
import pytest

from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.heavy_top.system import HeavyTop
from rigid_envs.systems.roller.system import Roller
from tests.systems.examples import BODY, SYSTEMS, name_of

each_system = pytest.mark.parametrize("system", SYSTEMS, ids=name_of)
Y = BODY.state(omega_body=(0.1, 0.2, 0.3))


@pytest.mark.parametrize(
    ("u", "message"),
    [
        (lambda t: None, r"^u\(0\) = None; expected an input: return zeros for none"),
        (lambda t: None if t > 0.5 else (0.0, 0.0, 0.0), r"^u\(0\.75\) = None; expected an input"),
        (lambda t: 0.0, r"^u has shape \(\); expected"),
        (lambda t: "pull", r"^u = 'pull'; expected real numbers \(tau1, tau2, tau3\)"),
        (lambda t: [None] * 3, r"^u = \[None, None, None\]; expected real numbers"),
        (lambda t: (1j, 0.0, 0.0), r"^u = .*; expected real numbers"),
        (lambda t: np.zeros((2, 3) if t > 0.5 else 3), r"^shapes of u\(t\) = .*; expected one"),
    ],
)
def test_an_input_function_that_gives_no_input_is_refused(u, message):
    with pytest.raises(ValueError, match=message):
        BODY.simulate(Y, [0.0, 1.0], u)


NO_TIMES = ["01", ["0", "1"], None, [0, 1j], [False, True], np.array([0, 1], dtype=object)]


@pytest.mark.parametrize("t", [*NO_TIMES, [0, 10**400]], ids=repr)
def test_times_that_are_no_real_numbers_are_refused(t):
    with pytest.raises(ValueError, match=r"^t = .*; expected real numbers"):
        BODY.simulate(Y, t)
    with pytest.raises(ValueError, match=r"^t has shape \(\); expected \(M,\)"):
        BODY.simulate(Y, np.array(1.0))


def test_times_too_far_apart_to_be_subtracted_are_refused():
    with pytest.raises(ValueError, match=r"^t = .*; expected times whose differences are finite"):
        BODY.simulate(Y, [-1.7e308, 1.7e308])


@each_system
@pytest.mark.parametrize("n_substeps", [np.nan, "2", None, 10**400, 1e30, 2**53])
def test_substeps_that_cannot_be_counted_are_refused(system, n_substeps):
    with pytest.raises(ValueError, match=r"^n_substeps = .*; expected an integer of at least 1"):
        system.advance(system.state(), None, 0.1, n_substeps)


@pytest.mark.parametrize("max_step", [1e-320, 1e-17, 9e-10])
def test_more_steps_than_anybody_waits_for_are_refused(max_step):
    with pytest.raises(ValueError, match=r"^number of steps = .*; expected at most 1e\+09"):
        BODY.simulate(Y, [0.0, 1.0], max_step=max_step)


@each_system
@pytest.mark.parametrize("size", [1.1e50, 1e200, 1e308])
def test_states_and_inputs_whose_products_overflow_are_refused(system, size):
    y, u = system.state(), np.zeros(len(system.input_entries))
    y[-1] = u[0] = size
    shown = re.escape(repr(float(size)))
    for call in (system.rhs, system.linearize, system.invariants):
        with pytest.raises(ValueError, match=rf"^y\[\d+\] = {shown}; expected numbers up to"):
            call(y)
    with pytest.raises(ValueError, match=rf"^u\[0\] = {shown}; expected numbers up to"):
        system.rhs(system.state(), u)


@each_system
def test_the_largest_states_and_inputs_have_finite_rates_or_are_refused(system):
    for size in (1e49, 1e-310, 5e-324):
        for k in range(4 if "q" in system.components else 0, len(system.state_entries)):
            if system.state_entries[k] in {"alpha_x", "alpha_y", "s"} and size > 1e6:
                continue  # sines of such angles have no digit
            y = system.state()
            y[k] = size
            with np.errstate(all="raise", under="ignore"):
                assert np.isfinite(system.rhs(y)).all()
                assert np.isfinite(system.linearize(y)[0]).all()


@pytest.mark.parametrize("system_type", [type(system) for system in SYSTEMS])
@pytest.mark.parametrize("size", [1e-320, 1e-51, 1e51, 1e200])
def test_parameters_whose_products_overflow_are_refused(system_type, size):
    for name in system_type.parameter_names():
        with pytest.raises(ValueError, match=r"^\w+ = .*; expected"):
            system_type(**{name: size})
    with pytest.raises(ValueError, match=r"^I1 = .*; expected a size from 1e-50 to 1e\+50, or 0"):
        FreeBody(size, size, size)


def test_a_motion_that_outruns_the_clock_is_refused():
    plate = SYSTEMS[3]
    with pytest.raises(ValueError, match=r"^span \[s\] from t = 1 s on = .*; expected longer"):
        plate.simulate(plate.state(), [1.0, 2.0], (1e45, 0.0, 0.0, 0.0))


def test_the_ends_of_parameters_still_are_systems():
    assert HeavyTop(g=0.0, ell=0.0).critical_spin == 0.0
    assert np.isfinite(Roller(beta=0.0).rhs([0.0, 1.0])).all()
