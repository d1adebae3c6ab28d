"""Motion of gyrostats, with wheels along any axes, against references."""

import numpy as np
import pytest

from rigid_envs.mechanics import rotations
from rigid_envs.systems.gyrostat.system import Gyrostat
from tests.reference import cases, every
from tests.systems.measures import million_steps, refined


class Satellite:
    """A carrier with wheels along any axes, as one with wheels along its principal axes.

    Only the sum of the spin momenta acts on the carrier, and its moments without the axial ones of
    the wheels, A. So wheels along the principal axes of A do the same as those of a case, if their
    spin momenta, and the torques of their motors, have the same sum.
    """

    def __init__(self, case):
        given = case["in"]
        self.J = np.array([rotor["Js"] for rotor in given["rotors"]])
        axes = np.array([rotor["axis"] for rotor in given["rotors"]])
        self.axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
        self.driven = given["drive"] == "rate"  # relative rates are held: the wheels are locked
        I = np.array(given["I"])  # noqa: E741
        A = I if self.driven else I - np.einsum("k,ki,kj->ij", self.J, self.axes, self.axes)
        moments, self.frame = np.linalg.eigh(A)
        self.frame *= np.linalg.det(self.frame)
        self.system = Gyrostat(*(moments + 0.1), J1=0.1, J2=0.1, J3=0.1)
        self.w0, self.s0 = np.array(given["w0"]), np.array(given["s0"])
        self.motors = given.get("torque")
        self.tau = np.array(given.get("tau_body", np.zeros(3))) @ self.frame

    def start(self, q0):
        spins = self.J * (self.s0 if self.driven else self.axes @ self.w0 + self.s0)
        l, omega = spins @ self.axes @ self.frame, self.w0 @ self.frame  # noqa: E741
        turn = rotations.quaternion_from_matrix(self.frame)
        q = rotations.multiply(rotations.normalize(np.array(q0)), turn)
        return self.system.state(q=q, omega_body=omega, wheel_rates=l / 0.1 - omega)

    def input(self, t):
        motors = self.motors or [{"amp": 0.0, "freq": 0.0}] * len(self.J)
        u = np.array([motor["amp"] * np.cos(motor["freq"] * t) for motor in motors])
        return np.concatenate([u @ self.axes @ self.frame, self.tau])


@every(cases("gyrostat"))
def test_a_gyrostat_agrees_with_the_reference(case):
    satellite, out, cond = Satellite(case), case["out"], case["cond"]
    y, t = satellite.start(case["in"]["q0"]), np.array([0.0, *case["t"]])
    motion = refined(satellite.system, y, t, satellite.input)
    found, frame = motion.trajectory, satellite.frame
    rates, R = found["omega_body"][1:] @ frame.T, found["R"][1:] @ frame.T
    atol = motion.tolerance("omega_body", motion.rate, cond["w"])
    np.testing.assert_allclose(rates, out["w"], rtol=0, atol=atol)
    expected = np.reshape(out["R"], R.shape)
    atol = motion.tolerance("R", motion.turned, cond["R"])
    np.testing.assert_allclose(R, expected, rtol=0, atol=atol)
    L = found["L_world"][1:]
    size = np.abs(found["spin_momenta"]).max()  # of what L is a sum of, though it may be 0
    atol = motion.tolerance("L_world", size, cond["H_space"])
    np.testing.assert_allclose(L, np.reshape(out["H_space"], L.shape), rtol=0, atol=atol)


@every(cases("gyrostat_volterra"))
def test_a_gyrostat_with_one_free_wheel_agrees_with_the_reference(case):
    given, out, cond = case["in"], case["out"], case["cond"]
    system = Gyrostat(*given["I"], J3=given["Js"])
    y = system.state(omega_body=given["w0"], wheel_rates=[0.0, 0.0, given["s0"]])
    motion = refined(system, y, np.array([0.0, *case["t"]]))
    rates = motion.trajectory["omega_body"][1:]
    atol = motion.tolerance("omega_body", 2.0 * motion.rate**2, max(cond.values()))
    for name, values in (("w3", rates[:, 2]), ("w1_squared", rates[:, 0] ** 2)):
        np.testing.assert_allclose(values, out[name], rtol=0, atol=3.0 * atol)
    wheel = motion.trajectory["wheel_rates"][1:, 2]
    np.testing.assert_allclose(wheel, out["s"], rtol=0, atol=3.0 * atol)


def test_a_million_steps_keep_every_momentum():
    system = Gyrostat(1.1, 1.7, 2.3, J1=0.1, J2=0.25, J3=0.2)
    start = system.state(omega_body=(0.2, 1.0, 0.4), wheel_rates=(3.0, -2.0, 5.0))
    motion = million_steps(system, start, 0.05)
    for name in ("L_world", "spin_momenta"):
        drift = np.abs(motion[name] - motion[name][0]).max()
        assert drift <= 1e-11, name  # a random walk of 2e7 roundings is 1e-12 or less
    energy = motion["kinetic_energy"]
    assert np.abs(energy / energy[0] - 1.0).max() < 1e-5
    np.testing.assert_allclose(np.linalg.norm(motion["q"], axis=-1), 1.0, rtol=0, atol=1e-15)


def test_a_wheel_that_is_turned_and_stopped_turns_the_carrier_the_other_way():
    system = Gyrostat(2.0, 2.5, 3.0, J1=0.02)
    u = np.array([[0.3, 0, 0, 0, 0, 0], [-0.3, 0, 0, 0, 0, 0]])
    motion = system.simulate(system.state(), [0.0, 2.0, 4.0], u)
    turned = 2.0 * np.arctan2(-motion["q"][-1, 1], motion["q"][-1, 0])
    assert turned == pytest.approx(0.3 * 2.0**2 / 1.98, rel=1e-12)  # J of the wheel does not count
    np.testing.assert_allclose(motion["omega_body"][-1], 0.0, atol=1e-14)
