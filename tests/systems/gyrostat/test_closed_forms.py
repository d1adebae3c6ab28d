"""Closed forms of gyrostats, against references and against their equations, integrated."""

import itertools
import math
from functools import cache

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.laws import EPS
from rigid_envs.systems.free_body import closed_forms as rigid
from rigid_envs.systems.gyrostat import closed_forms as theory
from tests.reference import cases, every

KINDS = ("sn cn", "sn dn", "sn", "complex")
Q0 = np.array([0.5, -0.5, 0.1, 0.7])


def assert_near(found, expected, cond, size=1.0):
    """Equal but for roundings: of the start, which count `cond` times, and of the evaluation."""
    np.testing.assert_allclose(found, expected, rtol=0, atol=EPS * (8.0 * cond + 16.0 * size))


@every(cases("gyrostat_volterra"))
def test_the_free_motion_agrees_with_the_reference(case):
    given, out, cond, scalars = case["in"], case["out"], case["cond"], case["scalars"]
    start = given["I"], [0.0, 0.0, given["Js"]], given["w0"], given["s0"]
    rates, path = theory.omega(case["t"], *start), theory.volterra(*start)
    assert_near(rates[:, 2], out["w3"], cond["w3"])
    assert_near(rates[:, 0] ** 2, out["w1_squared"], cond["w1_squared"])
    assert_near(rates[:, 1] ** 2, out["w2_squared"], cond["w2_squared"])
    assert_near(theory.wheel_rate(case["t"], *start), out["s"], cond["s"])
    assert path.swing_period == pytest.approx(scalars["w3_period"], rel=1e-14)
    assert min(path.ends) == pytest.approx(scalars["w3_min"], rel=1e-14)
    assert max(path.ends) == pytest.approx(scalars["w3_max"], rel=1e-14)
    assert path.momentum**2 == pytest.approx(scalars["H2"], rel=1e-14)


def axis_of(rotor):
    return int(np.argmax(rotor["axis"]))


@every([case for case in cases("gyrostat") if case["id"] == "gyrostat-rate-1"])
def test_a_wheel_held_at_its_rate_is_as_one_of_constant_momentum_in_a_heavier_body(case):
    given, out, cond = case["in"], case["out"], case["cond"]
    (rotor,), (s,) = given["rotors"], given["s0"]
    axis, wheels = axis_of(rotor), np.zeros(3)
    wheels[axis] = rotor["Js"]
    # so that the carrier has the moments of the locked whole, and the wheel the momentum J s
    moments, rate = np.diag(given["I"]) + wheels, s - given["w0"][axis]
    q0 = rotations.normalize(np.array(given["q0"]))
    start = moments, wheels, given["w0"], rate
    assert_near(theory.omega(case["t"], *start), out["w"], cond["w"])
    found = rotations.matrix_from_quaternion(theory.attitude(case["t"], *start, q0))
    assert_near(found, np.reshape(out["R"], found.shape), cond["R"])


@every([case for case in cases("gyrostat") if case["id"] == "gyrostat-zero-momentum"])
def test_without_momentum_the_carrier_turns_against_the_wheels_as_in_the_reference(case):
    given, out, cond, t = case["in"], case["out"], case["cond"], np.array(case["t"])
    assert not np.any(case["scalars"]["H0"])
    moments, wheels = np.diag(given["I"]), np.array([r["Js"] for r in given["rotors"]])
    assert [axis_of(rotor) for rotor in given["rotors"]] == [0, 1, 2]
    momenta = np.stack([r["amp"] * np.sin(r["freq"] * t) / r["freq"] for r in given["torque"]], -1)
    rates = theory.carrier_rates(momenta, moments, wheels)
    assert_near(rates, out["w"], cond["w"])
    assert_near(theory.wheel_turns(rates, moments, wheels), out["s"], cond["s"], np.max(out["s"]))


@every(cases("dual_spin_limit"))
def test_the_stability_of_dual_spin_agrees_with_the_reference(case):
    given, out, cond = case["in"], case["out"], case["cond"]
    body = given["I"], [0.0, 0.0, given["Js"]], given["Omega"]
    found = [theory.transverse_growth(*body, s) for s in given["s_list"]]
    assert_near(found, out["lambda_squared"], cond["lambda_squared"])
    low, high = theory.unstable_wheel_rates(*body)
    assert_near((low, high), out["s_limits"], cond["s_limits"])
    stable = [not low < s < high for s in given["s_list"]]
    assert stable == case["scalars"]["stable"]


@every(cases("dual_spin_damped"))
def test_the_damped_nutation_agrees_with_the_reference(case):
    given, out, cond = case["in"], case["out"], case["cond"]
    parts = [given["Cp"], given["Cr"]], [given["wP"], given["wR"]]
    slugs, drags = [given["jp"], given["jr"]], [given["cp"], given["cr"]]
    found = theory.damped_nutation(*parts, slugs, drags, i_perp=given["A"])
    growth = out["nutation_growth"]
    assert_near(found.real, growth, cond["nutation_growth"], abs(growth))
    assert_near(found.imag, out["nutation_freq"], cond["nutation_freq"])
    assert (found.real < 0.0) == case["scalars"]["stable"]
    seen = theory.nutation_rates(*parts, i_perp=given["A"])
    assert_near(seen, (out["lambda_P"], out["lambda_R"]), cond["lambda_P"] + cond["lambda_R"])


# The free motion against its equations.


def integrated(t, moments, wheels, omega0, wheel_rate0, q0):
    """Rates (n, 3) and attitude (n, 4) by an embedded pair of order eight."""
    carrier = np.asarray(moments) - wheels
    spin = wheels * (np.asarray(omega0) + wheel_rate0)

    def slope(_, y):
        p, rates = y[:4], y[4:]
        turned = np.array(
            [
                -p[1] * rates[0] - p[2] * rates[1] - p[3] * rates[2],
                p[0] * rates[0] + p[2] * rates[2] - p[3] * rates[1],
                p[0] * rates[1] + p[3] * rates[0] - p[1] * rates[2],
                p[0] * rates[2] + p[1] * rates[1] - p[2] * rates[0],
            ]
        )
        return np.concatenate([0.5 * turned, np.cross(carrier * rates + spin, rates) / carrier])

    accuracy = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
    found = solve_ivp(slope, (t[0], t[-1]), [*q0, *omega0], t_eval=t, **accuracy).y.T
    return found[:, 4:], found[:, :4]


def one_wheel(axis, moment):
    return moment * np.eye(3)[axis]


@cache
def motions():
    """Starts of 90 free motions, the wheel along each axis in turn, and slow or fast."""
    rng, starts = np.random.default_rng(0), []
    for axis, _ in itertools.product(range(3), range(30)):
        moments = rng.uniform(1.0, 3.0, 3)
        wheels = one_wheel(axis, moments[axis] * rng.uniform(0.05, 0.9))
        rate = rng.normal() * rng.choice([0.1, 1.0, 5.0])
        starts.append((moments, wheels, rng.normal(size=3), rate))
    return starts


def of_kind(kind):
    return [start for start in motions() if theory.volterra(*start).kind == kind]


@pytest.mark.parametrize("kind", KINDS)
def test_the_free_motion_solves_its_equations_whatever_the_roots(kind):
    t, found = np.linspace(0.0, 10.0, 21), of_kind(kind)
    assert len(found) >= 4
    paths = [theory.volterra(*start) for start in found]
    senses = {(path.axes, path.ends[0] < path.ends[1]) for path in paths}
    assert len(senses) >= 4
    for start in found[::3]:
        rates, q = integrated(t, *start, Q0)
        # 100 rad at most, each with the accuracy of the integrator
        np.testing.assert_allclose(theory.omega(t, *start), rates, rtol=0, atol=1e-10)
        np.testing.assert_allclose(theory.attitude(t, *start, Q0), q, rtol=0, atol=1e-10)


@pytest.mark.parametrize("kind", KINDS)
def test_omega_returns_after_its_period_and_across_the_wheel_reversed_after_half_of_it(kind):
    for start in of_kind(kind):
        path = theory.volterra(*start)
        whole, half = (theory.omega(T, *start) for T in (path.period, path.swing_period))
        np.testing.assert_allclose(whole, start[2], rtol=0, atol=1e-13)
        reversed_across = -1.0 if kind in ("sn", "sn dn") else 1.0
        signs = np.full(3, reversed_across)
        signs[path.axes[2]] = 1.0
        np.testing.assert_allclose(half, signs * start[2], rtol=0, atol=1e-13)


@pytest.mark.parametrize("axis", range(3))
def test_a_wheel_without_momentum_is_a_rigid_body(axis):
    rng, t = np.random.default_rng(axis), np.linspace(-5.0, 50.0, 23)
    for _ in range(20):
        moments, rates = rng.uniform(1.0, 3.0, 3), rng.normal(size=3)
        wheels = one_wheel(axis, 0.3)
        start = moments, wheels, rates, -rates[axis]
        body = moments - wheels, rates
        expected, q = rigid.omega(t, *body), rigid.attitude(t, *body, Q0)
        # 50 s of a few rad/s, each rounded
        np.testing.assert_allclose(theory.omega(t, *start), expected, rtol=0, atol=2e-13)
        np.testing.assert_allclose(theory.attitude(t, *start, Q0), q, rtol=0, atol=2e-13)


SADDLES = {  # moments of the carrier along e1, e2, e3, spin momentum, and a steady rotation
    "about the wheel": ((1.0, 2.0, 1.5), 0.0625, (0.0, 0.0, 1.0)),
    "about the wheel, backwards": ((2.0, 1.0, 1.5), 0.0625, (0.0, 0.0, -1.0)),
    "across the wheel": ((2.5, 4.5, 2.0), 0.3125, (1.25, 0.0, 0.625)),
    "across the wheel, on e2": ((4.0, 3.0, 2.0), -0.25, (0.0, 0.75, -0.25)),
}


def start_of(carrier, p, rates):
    """A gyrostat with a wheel of 1/2 along e3."""
    wheels = one_wheel(2, 0.5)
    return np.array(carrier) + wheels, wheels, np.array(rates), 2.0 * p - rates[2]


@pytest.mark.parametrize("size", [1e-3, 1e-9, 1e-15])
@pytest.mark.parametrize("name", SADDLES)
def test_what_is_kept_is_kept_beside_the_separatrix(name, size):
    carrier, p, steady = SADDLES[name]
    start = start_of(carrier, p, np.array(steady) + size * np.array([0.6, -0.8, 0.5]))
    path = theory.volterra(*start)
    assert path.m1 < 10.0 * size
    t = np.linspace(0.0, 3.0 * path.period, 1001)
    rates, q = theory.omega(t, *start), theory.attitude(t, *start, Q0)
    L = np.array(carrier) * rates + [0.0, 0.0, p]
    energy = np.square(rates) @ carrier
    world = np.einsum("nij,nj->ni", rotations.matrix_from_quaternion(q), L)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(L, axis=1), path.momentum, rtol=1e-13)
    # a thousand seconds, each rounded
    np.testing.assert_allclose(world, world[:1].repeat(len(t), 0), rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, rtol=1e-14)


SEPARATRICES = {  # moments of the carrier, spin momentum, start, where it ends
    "about the wheel": ((1.0, 2.0, 1.0), 0.5, (0.5, 0.5, 0.5), (0.0, 0.0, 1.0)),
    "about the wheel, linear": ((1.0, 1.5, 1.5), -0.375, (0.75, 0.25, 0.75), (0.0, 0.0, 1.0)),
    "across the wheel": ((2.5, 4.5, 2.0), 0.3125, (0.5, 0.25, 1.375), (1.25, 0.0, 0.625)),
}


@pytest.mark.parametrize("name", SEPARATRICES)
def test_on_the_separatrix_the_motion_ends_in_an_unstable_rotation(name):
    carrier, p, rates, end = SEPARATRICES[name]
    start = start_of(carrier, p, rates)
    path, t = theory.volterra(*start), np.linspace(0.0, 10.0, 11)
    assert path.m1 == 0.0 and path.period == math.inf
    expected, q = integrated(t, *start, Q0)
    # errors of the integrator grow as departures from the unstable rotation do
    np.testing.assert_allclose(theory.omega(t, *start), expected, rtol=0, atol=1e-8)
    np.testing.assert_allclose(theory.attitude(t, *start, Q0), q, rtol=0, atol=1e-8)
    for late in (-400.0, 400.0):
        np.testing.assert_allclose(np.abs(theory.omega(late, *start)), end, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    "rates",
    [(0.3, -0.4, 0.5), (0.0, 0.0, 0.5), (0.0, 0.0, -0.5), (0.0, 0.0, 0.0), (0.7, 0.0, 0.2)],
)
def test_a_symmetric_carrier_turns_uniformly_about_the_wheel(rates):
    start = np.array([2.0, 2.0, 3.0]), one_wheel(2, 0.5), np.array(rates), 1.3
    t = np.linspace(0.0, 10.0, 11)
    expected, q = integrated(t, *start, Q0)
    np.testing.assert_allclose(theory.omega(t, *start), expected, rtol=0, atol=1e-11)
    np.testing.assert_allclose(theory.attitude(t, *start, Q0), q, rtol=0, atol=1e-11)


@pytest.mark.parametrize("axis", range(3))
def test_a_body_without_momentum_turns_against_its_wheel_for_ever(axis):
    moments, wheels, rates = np.full(3, 2.0), one_wheel(axis, 0.5), -0.25 * np.eye(3)[axis]
    start, t = (moments, wheels, rates, 1.0), np.linspace(0.0, 10.0, 5)
    assert theory.volterra(*start).momentum == 0.0
    np.testing.assert_array_equal(theory.omega(t, *start), np.broadcast_to(rates, (5, 3)))
    expected = rotations.multiply(Q0, rotations.exp(t[:, None] * rates))
    np.testing.assert_allclose(theory.attitude(t, *start, Q0), expected, rtol=0, atol=1e-15)


# Steady rotations.


def departures(carrier, spin, L):
    """Eigenvalues of L' = L x (L - l) / A, linear in departures from L."""

    def slope(momentum):
        return np.cross(momentum, (momentum - spin) / carrier)

    # a quadratic: its central differences are exact
    return np.linalg.eigvals([slope(L + e) - slope(L - e) for e in 0.5 * np.eye(3)])


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(("share", "number"), [(0.5, 6), (-0.5, 6), (1.5, 4), (-3.0, 2), (0.0, 6)])
def test_all_steady_rotations_are_found_and_their_growth_is_that_of_departures(axis, share, number):
    moments, wheels = np.roll([2.0, 2.5, 4.0], axis + 1), one_wheel(axis, 0.8)
    carrier, H = moments - wheels, 1.7
    low, high = theory.separatrix_limits(moments, wheels, H)
    assert low < 1.5 * low < high < 3.0 * low
    found = theory.steady_rotations(moments, wheels, H, share * low)
    assert len(found) == number
    assert len({tuple(np.round(each.omega, 6)) for each in found}) == number
    spin = share * low * np.eye(3)[axis]
    for each in found:
        L = carrier * each.omega + spin
        np.testing.assert_allclose(np.linalg.norm(L), H, rtol=1e-14)
        np.testing.assert_allclose(np.cross(L, each.omega), 0.0, atol=1e-14)
        squares = departures(carrier, spin, L) ** 2
        assert each.growth == pytest.approx(squares[np.argmax(np.abs(squares))].real, rel=1e-12)
    # Euler's number of a sphere: two more are stable than are not
    unstable = sum(each.growth > 0.0 for each in found)
    assert number - 2 * unstable == 2


@pytest.mark.parametrize("axis", range(3))
def test_at_a_limit_a_rotation_about_the_wheel_throws_off_two_others(axis):
    moments, wheels = np.roll([2.0, 2.5, 4.0], axis + 1), one_wheel(axis, 0.8)
    for limit in theory.separatrix_limits(moments, wheels, 1.7):
        below, above = (
            theory.steady_rotations(moments, wheels, 1.7, limit * (1.0 + x)) for x in (-1e-6, 1e-6)
        )
        assert len(below) == len(above) + 2
        (parent,) = (k for k in (0, 1) if below[k].growth * above[k].growth < 0.0)
        near = [np.linalg.norm(each.omega - below[parent].omega) < 5e-3 for each in below]
        assert sum(near) == 3


@pytest.mark.parametrize("axis", range(3))
def test_spin_about_the_wheel_is_unstable_between_the_limits_and_only_there(axis):
    moments, wheels = np.roll([2.0, 2.5, 4.0], axis), one_wheel(axis, 0.3)
    for spin in (0.7, -0.7):
        low, high = theory.unstable_wheel_rates(moments, wheels, spin)
        inside, outside = np.linspace(low, high, 7)[1:-1], (low - 1e-3, high + 1e-3)
        assert all(theory.transverse_growth(moments, wheels, spin, s) > 0.0 for s in inside)
        assert all(theory.transverse_growth(moments, wheels, spin, s) < 0.0 for s in outside)


# Damping of dual spin.


@pytest.mark.parametrize("rates", [(0.0, 6.0), (3.0, 0.5), (-2.0, 5.0)])
def test_the_energy_sink_is_the_limit_of_small_slugs(rates):
    axial, A = np.array([3.0, 4.0]), 10.0
    seen = np.array(theory.nutation_rates(axial, rates, i_perp=A))
    free = seen[0] + rates[0]
    slugs, drags = 1e-7 * np.array([2.0, 1.0]), 1e-7 * np.array([0.5, 3.0])
    # power that a slug takes up of a nutation with omega1^2 + omega2^2 = 1
    losses = drags * (slugs * seen) ** 2 / ((slugs * free) ** 2 + drags**2)
    sink = theory.energy_sink(axial, rates, losses, i_perp=A)
    growth = theory.damped_nutation(axial, rates, slugs, drags, i_perp=A).real
    assert growth == pytest.approx(sink / A, rel=1e-6)


def test_a_prolate_body_is_damped_by_its_platform_at_rest_and_not_by_its_rotor():
    for rates in ([0.0, 6.0], [0.0, -6.0]):
        parts, slugs = ([3.0, 4.0], rates), np.array([0.05, 0.05])
        growth = [
            theory.damped_nutation(*parts, slugs * side, [0.02, 0.02], i_perp=10.0).real
            for side in np.eye(2)
        ]
        sinks = [theory.energy_sink(*parts, side, i_perp=10.0) for side in np.eye(2)]
        assert growth[0] < 0.0 < growth[1] and sinks[0] < 0.0 < sinks[1]


def test_slugs_that_stick_are_part_of_the_body_and_those_without_drag_are_not():
    parts, slugs = ([3.0, 4.0], [1.0, 6.0]), np.array([0.3, 0.2])
    stuck = theory.damped_nutation(*parts, slugs, [1e12, 1e12], i_perp=10.0)
    expected = (3.3 * 1.0 + 4.2 * 6.0) / 10.5
    assert stuck.imag == pytest.approx(expected, rel=1e-10) and abs(stuck.real) < 1e-9
    loose = theory.damped_nutation(*parts, slugs, [0.0, 0.0], i_perp=10.0)
    assert loose == pytest.approx(2.7j, rel=1e-14)


# Turns without momentum.


def test_a_loop_of_four_turns_is_their_product():
    rng = np.random.default_rng(0)
    for a, b in rng.uniform(-4.0, 4.0, (50, 2)):
        expected = rotations.identity()
        for turn in ([a, 0.0, 0.0], [0.0, b, 0.0], [-a, 0.0, 0.0], [0.0, -b, 0.0]):
            expected = rotations.multiply(expected, rotations.exp(np.array(turn)))
        np.testing.assert_allclose(theory.commutator(a, b), expected, rtol=0, atol=4.0 * EPS)


def test_a_small_loop_turns_about_the_axis_without_a_wheel_by_the_product_of_its_angles():
    turned = rotations.log(theory.commutator(1e-3, [2e-3, -2e-3]))
    np.testing.assert_allclose(turned[:, 2], [2e-6, -2e-6], rtol=1e-5)
    assert np.max(np.abs(turned[:, :2])) < 3e-9


def test_without_momentum_wheels_are_where_they_were_when_a_loop_is_closed():
    moments, wheels = np.array([2.0, 2.5, 4.0]), np.array([0.3, 0.2, 0.0])
    loop = np.array([[0.7, 0.0, 0.0], [0.0, 0.9, 0.0], [-0.7, 0.0, 0.0], [0.0, -0.9, 0.0]])
    turns = theory.wheel_turns(loop, moments, wheels)
    np.testing.assert_array_equal(turns.sum(axis=0), 0.0)
    # A omega + J (omega + s) = 0, integrated
    np.testing.assert_allclose(
        (moments - wheels) * loop + wheels * (loop + turns), 0.0, rtol=0, atol=1e-15
    )


@pytest.mark.parametrize("theta", [0.2, 1.0, -3.0])
def test_the_fastest_turn_takes_the_time_in_which_its_rates_add_up_to_its_angle(theta):
    limits = {"carrier": 1.2, "torque": 0.3, "momentum": 0.4}
    T = float(theory.slew_time(theta, **limits))

    def rate(t):  # on the way up, at the limit, on the way down
        return min(0.3 * t, 0.4, 0.3 * (T - t)) / 1.2

    switches = [t for t in (0.4 / 0.3, 0.5 * T, T - 0.4 / 0.3) if 0.0 < t < T]
    turned = quad(rate, 0.0, T, points=switches, epsabs=0.0, epsrel=1e-13)[0]
    assert turned == pytest.approx(abs(theta), rel=1e-12)


def test_the_time_of_turns_is_smooth_where_they_begin_to_coast():
    limits = {"carrier": 1.2, "torque": 0.3, "momentum": 0.4}
    edge = 0.4**2 / (1.2 * 0.3)
    at = theory.slew_time(edge * np.array([1.0 - 1e-6, 1.0, 1.0 + 1e-6]), **limits)
    assert np.diff(at)[1] == pytest.approx(np.diff(at)[0], rel=1e-5)
    assert float(theory.slew_time(0.0, **limits)) == 0.0
