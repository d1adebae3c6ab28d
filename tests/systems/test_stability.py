"""Lyapunov exponents and sections against closed forms and the structure of the motion."""

import math

import numpy as np
import pytest

from rigid_envs.mechanics.events import crossing, flat
from rigid_envs.mechanics.stability import lyapunov_exponents, poincare_section
from rigid_envs.systems.free_body import closed_forms as free_body
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.heavy_top import closed_forms as heavy_top
from rigid_envs.systems.heavy_top.system import HeavyTop
from rigid_envs.systems.rolling_disk.system import RollingDisk

BODY = FreeBody(1.0, 2.0, 3.0)


def leaning(theta):
    return (math.cos(0.5 * theta), math.sin(0.5 * theta), 0.0, 0.0)


def test_the_unstable_axis_has_the_growth_rate_of_its_linearisation():
    spin, T = 1.5, 60.0
    found = lyapunov_exponents(BODY, BODY.state(omega_body=(0.0, spin, 0.0)), T)
    growth = free_body.growth_rate(BODY.moments, spin)
    # The first departure is that direction but for a factor, whose logarithm is left over T.
    np.testing.assert_allclose(found[[0, -1]], [growth, -growth], rtol=0, atol=2.0 / T)
    longer = lyapunov_exponents(BODY, BODY.state(omega_body=(0.0, spin, 0.0)), 2.0 * T)
    # Runge-Kutta in steps of 1/16 rad: (1/16)^4 / 120 of the rate
    assert 2.0 * T * longer[0] - T * found[0] == pytest.approx(T * growth, rel=1e-7)
    np.testing.assert_allclose(found[1:-1], 0.0, rtol=0, atol=2.0 / T)


@pytest.mark.parametrize("spin", [0.4, 3.9])
def test_a_slow_top_upright_has_the_exponents_of_the_sleeping_top(spin):
    top, T = HeavyTop(), 60.0
    found = lyapunov_exponents(top, top.state(omega_body=(0.0, 0.0, spin)), T)
    growth = heavy_top.sleeping_exponents(spin, i_perp=1.0, i3=0.5, mgl=1.0)[0].real
    # each of the two directions of the tilt; the pivot may drift: ln(T) / T
    np.testing.assert_allclose(found[:2], growth, rtol=0, atol=math.log(T) / T)
    np.testing.assert_allclose(found[-2:], -growth, rtol=0, atol=math.log(T) / T)
    np.testing.assert_allclose(found[2:-2], 0.0, rtol=0, atol=1.5 * math.log(T) / T)


def test_motions_with_a_closed_form_have_exponents_that_fall_like_ln_t_over_t():
    free = BODY, BODY.state(omega_body=(1.0, 0.4, 0.3))
    lagrange = HeavyTop(), HeavyTop().state(q=leaning(2.0), omega_body=(0.3, 0.2, 2.0))
    for system, y in (free, lagrange):
        for T in (100.0, 400.0):
            found = lyapunov_exponents(system, y, T)
            assert np.max(np.abs(found)) <= 1.5 * math.log(T) / T


def test_a_top_without_symmetry_is_chaotic_and_its_exponents_come_in_pairs():
    # Ziglin 1983: there is no third integral
    top, T = HeavyTop(0.925, 1.15, 0.55), 400.0
    found = lyapunov_exponents(top, top.state(q=leaning(0.5), omega_body=(0.3, 0.2, 1.0)), T)
    assert found[0] > 10.0 * math.log(T) / T
    # Liouville: the flow keeps volumes (fourth order: 5e-9 of a rate of 3 rad/s)
    assert abs(np.sum(found)) <= 1e-7
    # Hamiltonian: exponents come as +-; each is known to ln(T) / T
    np.testing.assert_allclose(found + found[::-1], 0.0, rtol=0, atol=math.log(T) / T)


def test_a_constant_torque_is_an_input_and_a_steady_disk_has_its_stability():
    disk = RollingDisk.uniform()
    upright = disk.state(q=leaning(0.5 * math.pi))
    at_rest = lyapunov_exponents(disk, upright, 4.0)
    # it falls: I1 + m r^2 turned by m g r
    growth = math.sqrt(9.81 / 1.25)
    assert at_rest[0] == pytest.approx(growth, abs=2.0 / 4.0)
    spun = lyapunov_exponents(BODY, BODY.state(), 10.0, u=(0.1, 0.0, 0.0))
    assert np.max(np.abs(spun)) <= 1.0  # a slow spin-up about a stable axis


def test_a_periodic_motion_has_one_point_on_its_section():
    omega0 = (0.5, 1.0, 0.3)
    section = crossing(BODY, "omega_body", 0, direction=1.0)
    t, y = poincare_section(BODY, BODY.state(omega_body=omega0), section, 80.0)
    assert len(t) == 4
    np.testing.assert_allclose(y[:, 4:], y[:1, 4:].repeat(len(t), axis=0), rtol=0, atol=1e-8)
    period = free_body.polhode(BODY.moments, omega0).period
    np.testing.assert_allclose(np.diff(t), period, rtol=0, atol=1e-8)


def test_the_section_of_a_chaotic_top_keeps_the_energy_and_fills_an_area():
    top = HeavyTop(0.925, 1.15, 0.55)
    start = top.state(q=leaning(0.5), omega_body=(0.3, 0.2, 1.0))
    t, y = poincare_section(top, start, crossing(top, "gamma", 0, direction=1.0), 60.0)
    assert np.all(np.diff(t) > 0.0)
    np.testing.assert_allclose(top.energy(y), top.energy(start), rtol=0, atol=1e-8)
    np.testing.assert_allclose(top.accessors["gamma"](y)[:, 0], 0.0, rtol=0, atol=1e-14)
    assert np.linalg.matrix_rank(y[:, 4:7] - y[0, 4:7], tol=0.1) == 3


def test_bad_arguments_are_refused_by_name():
    y = BODY.state()
    for call, message in (
        (lambda: lyapunov_exponents(BODY, [y, y], 1.0), r"^shape of y0 = \[2, 7\]; expected one"),
        (lambda: lyapunov_exponents(BODY, y, 0.0), r"^duration = 0\.0; expected a positive"),
        (lambda: lyapunov_exponents(BODY, None, 1.0), r"^y = None; expected real numbers"),
        (lambda: poincare_section(BODY, y, crossing(BODY, "omega_body", 0), -1.0), r"^duration = "),
        (lambda: poincare_section(BODY, y, "omega", 1.0), r"^events = 'o'; expected functions"),
    ):
        with pytest.raises(ValueError, match=message):
            call()
    disk = RollingDisk.uniform()
    with pytest.raises(ValueError, match=r"^motion = 'at t = .*; expected one that lasts"):
        poincare_section(disk, disk.state(q=leaning(0.1)), flat(0.5), 1.0)
