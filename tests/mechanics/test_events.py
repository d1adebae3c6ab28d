"""Events, sections and Lyapunov exponents, against closed forms, SciPy and the simulation."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from rigid_envs.mechanics.events import Event, crossing, flat, lift_off, slip
from rigid_envs.mechanics.system import lyapunov_exponents, poincare_section
from rigid_envs.systems.free_body import closed_forms as free_body
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.heavy_top import closed_forms as heavy_top
from rigid_envs.systems.heavy_top.system import HeavyTop
from rigid_envs.systems.rolling_disk.system import RollingDisk
from tests.refusals import refuses
from tests.systems.examples import BODY, DISK, PLATE, ROLLER, each_system, inputs, states
from tests.systems.measures import leaning

EPS = np.finfo(np.float64).eps
RACKET, W0 = FreeBody(1.0, 2.0, 3.0), (0.5, 1.0, 0.3)
START = RACKET.state(omega_body=W0)


def tipping(lean=0.1):
    """A disk at rest that leans by this angle from flat: it only tips."""
    return RollingDisk.uniform(1.3, 0.5), leaning(lean)


# Where events are
def test_a_body_passes_its_section_once_in_each_period_of_the_polhode():
    section = crossing(RACKET, "omega_body", 0, direction=1.0)
    motion = RACKET.simulate(START, np.linspace(0.0, 60.0, 4), events=section)
    period = free_body.polhode(RACKET.moments, W0).period
    assert len(motion.t_events[0]) in (int(60.0 / period), int(60.0 / period) + 1)
    # default steps: near 1e-10 per radian of a rate near 1 rad/s
    np.testing.assert_allclose(np.diff(motion.t_events[0]), period, rtol=0, atol=1e-8)
    assert np.max(np.abs(motion.y_events[0][:, 4])) <= 8 * EPS
    exact = free_body.omega(motion.t_events[0], RACKET.moments, W0)
    np.testing.assert_allclose(motion.y_events[0][:, 4:], exact, rtol=0, atol=1e-8)
    assert (motion.status, motion.message) == (0, "the end of the times was reached")


@pytest.mark.parametrize("direction", [-1.0, 0.0, 1.0])
@pytest.mark.parametrize("terminal", [False, True, 2])
def test_events_are_those_of_scipys_solve_ivp(direction, terminal):
    event = crossing(RACKET, "omega_body", 1, value=0.2, direction=direction, terminal=terminal)
    t = np.linspace(0.0, 30.0, 7)
    motion = RACKET.simulate(START, t, events=[event, lambda s, y: s - 1.5])
    other = solve_ivp(
        lambda _, y: RACKET.rhs(y), (0.0, 30.0), START, "DOP853", rtol=1e-12, atol=1e-12,
        events=[event, lambda s, y: s - 1.5],
    )  # fmt: skip
    assert motion.status == other.status
    for ours, theirs in zip(motion.t_events, other.t_events, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-8)
    np.testing.assert_allclose(motion.y_events[0], other.y_events[0], rtol=0, atol=1e-8)
    if motion.status == 1:
        assert motion.t[-1] == motion.t_events[0][-1]
        np.testing.assert_array_equal(motion.y[-1], motion.y_events[0][-1])
        np.testing.assert_array_equal(motion.t[:-1], t[t < motion.t[-1]])
    else:
        np.testing.assert_array_equal(motion.t, t)


@each_system
def test_events_do_not_change_the_motion(system):
    rng = np.random.default_rng(81)
    y, u = states(system, rng), inputs(system, rng, 4)
    t = np.linspace(0.3, 0.7, 5)
    for given in (None, u[0], u, lambda s: u[0] * math.cos(s)):
        plain = system.simulate(y, t, given)
        watched = system.simulate(y, t, given, events=lambda s, y: s - 0.5)
        np.testing.assert_array_equal(watched.t, t)
        np.testing.assert_allclose(watched.y, plain.y, rtol=0, atol=1e-9)
        assert watched.t_events[0] == pytest.approx([0.5], abs=4 * EPS)


def test_events_are_found_backwards_in_time():
    section = crossing(RACKET, "omega_body", 0)
    ahead = RACKET.simulate(START, [0.0, 12.0], events=section)
    back = RACKET.simulate(ahead.y[-1], [12.0, 0.0], events=section)
    np.testing.assert_allclose(back.t_events[0][::-1], ahead.t_events[0], rtol=0, atol=1e-9)


def test_a_function_without_attributes_is_an_event_that_does_not_end_the_motion():
    motion = RACKET.simulate(START, [0.0, 1.0], events=lambda t, y: t - 0.25)
    np.testing.assert_allclose(motion.t_events[0], [0.25], rtol=0, atol=2 * EPS)
    assert motion.status == 0


# Events that are there
def test_a_disk_that_falls_flat_is_returned_with_the_time_of_its_fall():
    disk, q = tipping()
    motion = disk.simulate(disk.state(q=q), [0.0, 0.05, 1.0], events=flat(1e-3))
    time = falling_time(disk, 0.1, math.asin(1e-3))
    assert motion.t_events[0] == pytest.approx([time], abs=1e-9)
    np.testing.assert_array_equal(motion.t, [0.0, 0.05, *motion.t_events[0]])
    assert motion.status == 1
    assert disk.tilt(motion.y[-1]) == pytest.approx(1e-3, rel=1e-6)


def falling_time(disk, start, end):
    """Time of a tipping disk from one lean to another, by its energy: a quadrature of 1 / rate."""
    inertia, weight = disk.I1 + disk.m * disk.radius**2, disk.m * disk.g * disk.radius

    # theta = start - (start - end) s^2 takes the root out of the rate at rest
    def slowness(s):
        theta = start - (start - end) * s * s
        fallen = weight * (math.sin(start) - math.sin(theta))
        return 2.0 * (start - end) * s / math.sqrt(2.0 * fallen / inertia) if s else 0.0

    return quad(slowness, 0.0, 1.0, epsabs=1e-13, epsrel=1e-13)[0]


def test_a_disk_that_tips_from_high_lifts_off_before_it_is_flat():
    # z = radius sin(theta), and theta by the energy: N = m (g + z'') passes zero
    disk, lean = RollingDisk.uniform(1.3, 0.5), 1.2
    inertia, weight = disk.I1 + disk.m * disk.radius**2, disk.m * disk.g * disk.radius

    def normal(theta):
        square = 2.0 * weight * (math.sin(lean) - math.sin(theta)) / inertia
        bent = -weight * math.cos(theta) ** 2 / inertia - math.sin(theta) * square
        return disk.g + disk.radius * bent

    y = disk.state(q=leaning(lean))
    motion = disk.simulate(y, [0.0, 2.0], events=[lift_off(disk), flat()])
    assert disk.normal_force(y) == pytest.approx(disk.m * normal(lean), rel=1e-12)
    theta = brentq(normal, 0.3, lean, xtol=1e-14)  # on the way down; it would press again at 0.2
    assert motion.t_events[0] == pytest.approx([falling_time(disk, lean, theta)], abs=1e-9)
    assert len(motion.t_events[1]) == 0


def test_a_motion_that_ends_by_itself_is_returned_where_there_are_events_and_refused_where_not():
    disk, q = tipping()
    motion = disk.simulate(disk.state(q=q), [0.0, 0.05, 1.0], events=lambda t, y: t - 0.02)
    assert motion.status == -1
    assert motion.message.startswith("at t = 0.113")
    assert motion.t_events[0] == pytest.approx([0.02])
    assert motion.t[-1] == pytest.approx(falling_time(disk, 0.1, 1e-6), rel=1e-5)
    refuses("the motion ends", disk.simulate, disk.state(q=q), [0.0, 0.05, 1.0])


def test_a_motion_that_ends_before_its_first_node_is_its_beginning():
    disk, q = tipping(1.0001e-6)
    motion = disk.simulate(disk.state(q=q), [0.0, 1.0], events=lambda t, y: t - 0.5)
    assert motion.status == -1
    assert motion.t.tolist() == sorted(set(motion.t.tolist()))
    np.testing.assert_array_equal(motion.y[0], disk.state(q=q))


# Between the times
@each_system
@pytest.mark.parametrize("kind", ["none", "row", "rows", "function"])
def test_a_trajectory_gives_the_states_between_its_times(system, kind):
    rng = np.random.default_rng(82)
    y, u = states(system, rng, 2), inputs(system, rng, 3, 2)
    given = {"none": None, "row": u[0, 0], "rows": u, "function": lambda s: u[0] * math.cos(s)}[
        kind
    ]
    t = np.array([0.2, 0.25, 0.4, 0.45])
    motion = system.simulate(y, t, given)
    np.testing.assert_array_equal(motion(t), motion.y)
    between = np.array([[0.44, 0.21], [0.4, 0.31]])
    found = motion(between)
    assert found.shape == (2, 2, *motion.y.shape[1:])
    if kind != "rows":
        fine = system.simulate(y, [0.2, 0.21, 0.31, 0.4, 0.44], given).y
        expected = fine[[4, 1, 3, 2]].reshape(found.shape)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(motion(0.31), found[1, 1])
    refuses(r"^t = 0\.19; expected times of the trajectory, from 0\.2", motion, 0.19)


# What is refused
@pytest.mark.parametrize(
    ("events", "message"),
    [
        ("omega", r"^events = 'o'; expected functions"),
        ([None], r"^events = None; expected functions g\(t, y\)"),
        (lambda t, y: None, r"^g\(t, y\) = None; expected real numbers"),
        (lambda t, y: math.nan, r"^g\(t, y\) = nan; expected finite"),
        (lambda t, y: y, r"^shape of g\(t, y\) = \[7\]; expected one number"),
    ],
)
def test_events_that_are_none_are_refused(events, message):
    with pytest.raises(ValueError, match=message):
        RACKET.simulate(START, [0.0, 1.0], events=events)


def test_events_of_a_batch_and_of_unknown_names_are_refused():
    with pytest.raises(ValueError, match=r"^shape of y0 = \[2, 7\]; expected one state"):
        RACKET.simulate([START, START], [0.0, 1.0], events=lambda t, y: t)
    refuses(r"^name = 'tilt'; expected one of q, R", crossing, BODY, "tilt")
    with pytest.raises(ValueError, match=r"^entry = None; expected which of \(3,\) of omega_body"):
        BODY.simulate(BODY.state(), [0.0, 1.0], events=crossing(BODY, "omega_body"))
    for sine in (0.0, 1.0, 1e-7):
        refuses(r"^sine = ", flat, sine)
    refuses(r"^mu = -1\.0", slip, DISK, -1.0)


def test_an_event_is_a_function_for_scipy_too():
    event = Event(lambda t, y: y[0], terminal=True, direction=-1.0)
    assert (event(0.0, np.array([2.0])), event.terminal, event.direction) == (2.0, True, -1.0)
    assert PLATE.simulate(PLATE.state(), [0.0, 0.1], events=lift_off(PLATE)).status == 0
    assert ROLLER.simulate(ROLLER.state(), [0.0, 0.1], events=lift_off(ROLLER)).status == 0


def test_the_unstable_axis_has_the_growth_rate_of_its_linearisation():
    spin, T = 1.5, 60.0
    found = lyapunov_exponents(RACKET, RACKET.state(omega_body=(0.0, spin, 0.0)), T)
    growth = free_body.growth_rate(RACKET.moments, spin)
    # The first departure is that direction but for a factor, whose logarithm is left over T.
    np.testing.assert_allclose(found[[0, -1]], [growth, -growth], rtol=0, atol=2.0 / T)
    longer = lyapunov_exponents(RACKET, RACKET.state(omega_body=(0.0, spin, 0.0)), 2.0 * T)
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
    free = RACKET, RACKET.state(omega_body=(1.0, 0.4, 0.3))
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
    spun = lyapunov_exponents(RACKET, RACKET.state(), 10.0, u=(0.1, 0.0, 0.0))
    assert np.max(np.abs(spun)) <= 1.0  # a slow spin-up about a stable axis


def test_the_section_of_a_chaotic_top_keeps_the_energy_and_fills_an_area():
    top = HeavyTop(0.925, 1.15, 0.55)
    start = top.state(q=leaning(0.5), omega_body=(0.3, 0.2, 1.0))
    t, y = poincare_section(top, start, crossing(top, "gamma", 0, direction=1.0), 60.0)
    assert np.all(np.diff(t) > 0.0)
    np.testing.assert_allclose(top.energy(y), top.energy(start), rtol=0, atol=1e-8)
    np.testing.assert_allclose(top.accessors["gamma"](y)[:, 0], 0.0, rtol=0, atol=1e-14)
    assert np.linalg.matrix_rank(y[:, 4:7] - y[0, 4:7], tol=0.1) == 3


def test_bad_arguments_are_refused_by_name():
    y = RACKET.state()
    for call, message in (
        (lambda: lyapunov_exponents(RACKET, [y, y], 1.0), r"^shape of y0 = \[2, 7\]; expected one"),
        (lambda: lyapunov_exponents(RACKET, y, 0.0), r"^duration = 0\.0; expected a positive"),
        (lambda: lyapunov_exponents(RACKET, None, 1.0), r"^y = None; expected real numbers"),
        (
            lambda: poincare_section(RACKET, y, crossing(RACKET, "omega_body", 0), -1.0),
            r"^duration = ",
        ),
        (lambda: poincare_section(RACKET, y, "omega", 1.0), r"^events = 'o'; expected functions"),
    ):
        with pytest.raises(ValueError, match=message):
            call()
    disk = RollingDisk.uniform()
    with pytest.raises(ValueError, match=r"^motion = 'at t = .*; expected one that lasts"):
        poincare_section(disk, disk.state(q=leaning(0.1)), flat(0.5), 1.0)
