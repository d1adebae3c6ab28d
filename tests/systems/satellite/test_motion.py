"""Motion of satellites in gravity gradient and magnetic field, against references."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from scipy.special import ellipk

from rigid_envs.systems.satellite import closed_forms as theory
from rigid_envs.systems.satellite.system import Satellite
from tests.reference import cases, every
from tests.systems.measures import assert_energy_stays, million_steps, orders, refined

REST = (0.5, 0.5, 0.5, 0.5)  # at latitude 0: e1 along the velocity, e2 the normal, e3 the vertical


def unit(q):
    return np.array(q) / np.linalg.norm(q)


def about_normal(angle):
    return Rotation.from_rotvec(np.multiply.outer(angle, [0.0, 0.0, 1.0]))


# Gravity gradient.


@every(cases("gravity_gradient"))
def test_a_satellite_in_gravity_gradient_agrees_with_the_reference(case):
    given, out, cond = case["in"], case["out"], case["cond"]
    system = Satellite(*given["I"], n=given["n"], b=0.0)
    y = system.state(q=unit(given["q0"]), omega_body=given["w0"])
    motion = refined(system, y, np.array([0.0, *case["t"]]))
    found = motion.trajectory
    rates, R = found["omega_body"][1:], found["R"][1:]
    atol = motion.tolerance("omega_body", motion.rate, cond["w"])
    np.testing.assert_allclose(rates, out["w"], rtol=0, atol=atol)
    atol = motion.tolerance("R", motion.turned, cond["R"])
    np.testing.assert_allclose(R, np.reshape(out["R"], R.shape), rtol=0, atol=atol)
    assert float(system.energy(y)) == pytest.approx(case["scalars"]["jacobi"], rel=1e-14)


@every(cases("gg_pitch"))
def test_pitch_in_the_plane_of_the_orbit_agrees_with_the_reference(case):
    given = case["in"]
    system, n = Satellite(*given["I"], n=given["n"], b=0.0), given["n"]
    start = about_normal(given["theta0"]) * Rotation.from_quat(REST, scalar_first=True)
    rates = [0.0, n + given["thetad0"], 0.0]
    y = system.state(q=start.as_quat(scalar_first=True), omega_body=rates)
    motion = refined(system, y, np.array([0.0, *case["t"]]))
    vertical = motion.trajectory["R"][1:, :, 2]  # e3 in the world
    angle = np.arctan2(vertical[:, 1], vertical[:, 0]) - n * np.array(case["t"])
    missed = np.remainder(angle - case["out"]["theta"] + np.pi, 2.0 * np.pi) - np.pi
    atol = motion.tolerance("R", motion.turned, case["cond"]["theta"])
    np.testing.assert_allclose(missed, 0.0, rtol=0, atol=2.0 * atol)


@every(cases("gg_stability"))
def test_departures_from_rest_grow_where_the_reference_says_and_stay_elsewhere(case):
    n, growth = case["in"]["n"], case["scalars"]["max_growth"]
    system, size = Satellite(*case["in"]["I"], n=n, b=0.0), 1e-8 if growth else 1e-6
    rest = Rotation.from_quat(REST, scalar_first=True)
    q = rest * Rotation.from_rotvec(size * np.array([0.6, 0.5, -0.7]))
    y = system.state(q=q.as_quat(scalar_first=True), omega_body=[0.0, n, 0.0])
    late = 14.0 / growth if growth else 400.0 * math.pi / n  # to some percent, or 200 orbits
    t = np.linspace(0.0, late, 2001)
    there = (about_normal(n * t) * rest).as_matrix()
    far = np.linalg.norm(system.simulate(y, t)["R"] - there, axis=(1, 2))
    if case["out"]["stable"]:
        assert far.max() < 20.0 * size
    else:
        # between spans of half an oscillation at least; what does not grow is still there
        grown = math.log(far[1500:].max() / far[1000:1501].max())
        assert grown == pytest.approx(growth * late / 4.0, rel=0.05)


def test_a_million_steps_keep_the_energy_in_the_orbit():
    system = Satellite(1.1, 1.7, 2.3, n=0.3, b=0.7, inclination=1.2)
    start = system.state(tilt=1.0, omega_body=(0.2, 1.0, 0.4))
    assert_energy_stays(million_steps(system, start, 0.05), 2e-8)


def test_librations_in_the_orbit_are_bounded_for_ever_by_the_energy():
    system = Satellite(n=0.0011)
    y = system.state(q=REST, omega_body=[1e-4, 0.0013, -1e-4])
    motion = system.simulate(y, np.linspace(0.0, 5e5, 2001))
    least = 0.5 * 0.0011**2 * (3.0 * system.I3 - system.I2)  # of rest
    room = float(system.energy(y)) - least
    outward = motion.system.radial_body(motion.y)[:, 2]
    # 3 n^2 (I1 - I3) (1 - r3^2) / 2 is the least energy of that tilt
    assert np.max(1.0 - outward**2) <= room / (1.5 * 0.0011**2 * (system.I1 - system.I3))
    assert np.max(1.0 - outward**2) > 0.01


# Magnetic torque.


def test_a_dipole_swings_about_the_field_as_the_needle_of_a_compass():
    moment, b, m, size = 2.0, 3e-5, 5.0, 0.8
    system = Satellite(moment, moment, moment, n=0.0, b=b, inclination=0.0)  # the field is along z
    y = system.state(tilt=size)
    quarter = ellipk(math.sin(0.5 * size) ** 2) / math.sqrt(m * b / moment)  # of a pendulum
    tilt = system.tilt(system.simulate(y, [0.0, quarter, 4.0 * quarter], [0.0, 0.0, m]).y)
    np.testing.assert_allclose(tilt, [size, 0.0, size], rtol=0, atol=1e-9)


def test_the_field_is_twice_as_strong_over_the_poles_and_opposite():
    system = Satellite(b=3e-5, inclination=0.5 * math.pi)
    y = system.state(latitude=np.array([0.0, 0.5, 1.0]) * math.pi)
    # over a polar orbit: to the north at the equator, down over the north pole
    expected = 3e-5 * np.array([[0.0, 1.0, 0.0], [0.0, -2.0, 0.0], [0.0, 1.0, 0.0]])
    np.testing.assert_allclose(system.field_body(y), expected, rtol=0, atol=1e-19)


class Detumbling:
    """A case of feedback by the magnetic field, in its world, whose z is the Earth's axis.

    The law is m = -k dB/dt as seen in the body, or m = k omega x B. The case knows no gravity.
    """

    def __init__(self, case):
        given = case["in"]
        cube, self.gain, self.turns = given["a"] ** 3, given["k"], given["law"] == "bdot"
        field, n = given["D"] / cube, math.sqrt(given["mu"] / cube)
        self.system = Satellite(*given["I"], n=n, b=field, inclination=given["inc"])
        self.to_earth = Rotation.from_euler("x", given["inc"])
        q = self.to_earth.inv() * Rotation.from_quat(given["q0"], scalar_first=True)
        q = q.as_quat(scalar_first=True)
        self.start = self.system.state(q=q, omega_body=given["w0"], latitude=given["u0"])
        self.t = np.array([0.0, *case["t"]])

    def turn(self, y):
        return self.to_earth * Rotation.from_quat(y[..., :4], scalar_first=True)

    def dipole(self, y):
        s, c, i = math.sin(y[7]), math.cos(y[7]), self.system.inclination
        r = np.array([c, s * math.cos(i), s * math.sin(i)])
        onward = self.system.n * np.array([-s, c * math.cos(i), c * math.sin(i)])
        axis, b = np.array([0.0, 0.0, 1.0]), self.system.b
        B, turning = b * (axis - 3.0 * r[2] * r), -3.0 * b * (onward[2] * r + r[2] * onward)
        B, turning = self.turn(y).inv().apply([B, self.turns * turning])
        return -self.gain * (turning - np.cross(y[4:7], B))

    def integrated(self, end, gravity):
        """States as a function of time, by an embedded pair of order eight on the equations.

        Without gravity, those of a satellite that is held at each place of the orbit.
        """
        system = self.system if gravity else replace(self.system, n=0.0)
        onward = np.array([0, 0, 0, 0, 0, 0, 0, 0.0 if gravity else self.system.n])

        def slope(_, y):
            return system.rhs(y, self.dipole(y)) + onward

        accuracy = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-15}
        return solve_ivp(slope, (0.0, end), self.start, dense_output=True, **accuracy)

    def held(self, end, period):
        """The state of the kernel, with the dipole held for a period at a time."""
        y = self.start
        for _ in range(round(end / period)):
            y = self.system.advance(y, self.dipole(y), period)
        return y


@every(cases("detumble_bdot"))
def test_feedback_by_the_magnetic_field_agrees_with_the_reference(case):
    it, out, cond = Detumbling(case), case["out"], case["cond"]
    motion = it.integrated(it.t[-1], gravity=False)
    y = motion.sol(it.t[1:]).T
    # errors of the dense output of order seven, 1e-12 in each of some thousand steps, in a
    # random walk: of rates of 0.1 rad/s, and of attitudes by `cond` of the rates' errors
    np.testing.assert_allclose(y[:, 4:7], out["w"], rtol=0, atol=1e-12)
    R = it.turn(y).as_matrix()
    np.testing.assert_allclose(R, np.reshape(out["R"], R.shape), rtol=0, atol=1e-12 * cond["R"])
    energy = 0.5 * np.square(y[:, 4:7]) @ it.system.moments
    np.testing.assert_allclose(energy, out["energy"], rtol=1e-9)


@every(cases("detumble_bdot"))
def test_a_dipole_that_changes_all_the_time_is_followed_to_fourth_order(case):
    it, end = Detumbling(case), 200.0
    truth = it.integrated(end, gravity=True).sol

    def dipole(t):
        return it.dipole(truth(t))

    ends = [
        it.system.simulate(it.start, [0.0, end], dipole, max_step=h).y[-1] for h in (2.0, 1.0, 0.5)
    ]
    exact = truth(end)
    errors = [np.max(np.abs(y[:7] - exact[:7])) for y in ends]
    np.testing.assert_allclose(orders(errors), 4.0, atol=0.3)


@every([case for case in cases("detumble_bdot") if np.ptp(case["in"]["I"]) == 0.0])
def test_a_dipole_held_for_short_periods_tends_to_the_reference_to_first_order(case):
    it, exact = Detumbling(case), np.array(case["out"]["w"][0])  # of a sphere: without gravity
    found = np.array([it.held(it.t[1], period)[4:7] for period in (2.0, 1.0, 0.5)])
    errors = np.max(np.abs(found - exact), axis=1)
    np.testing.assert_allclose(orders(errors), 1.0, atol=0.12)
    once = 2.0 * found[1:] - found[:-1]  # without the error of first order
    left = np.max(np.abs(once - exact), axis=1)
    np.testing.assert_allclose(orders(left), 2.0, atol=0.1)
    twice = (4.0 * once[1] - once[0]) / 3.0  # and without that of second
    assert np.max(np.abs(twice - exact)) < 1e-7  # of 0.04 rad/s


def test_what_is_across_a_field_decays_and_what_is_along_stays():
    B, k, moment, rates = 3e-5, 4e4, 0.05, np.array([0.02, -0.03, 0.05])
    system = Satellite(moment, moment, moment, n=0.0, b=B, inclination=0.0)  # the field is along z

    def held(period):
        y = system.state(omega_body=rates)
        for _ in range(round(800.0 / period)):
            m = k * np.cross(y[4:7], system.field_body(y))
            y = system.advance(y, m, period)
        return system.omega_world(y)

    exact = theory.detumble(800.0, rates, [0.0, 0.0, B], gain=k, moment=moment)
    found = np.array([held(period) for period in (2.0, 1.0)])
    errors = np.max(np.abs(found - exact), axis=1)
    np.testing.assert_allclose(orders(errors), 1.0, atol=0.05)
    once = 2.0 * found[1] - found[0]  # without the error of first order
    assert np.max(np.abs(once - exact)) < errors[1] / 30.0 < 1e-5
