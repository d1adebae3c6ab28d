"""The equations of motion, symbol by symbol: what is compiled is fed to SymPy and derived anew.

The other side is Lagrange's: kinetic and potential energy in z-x-z Euler angles, where the kernels
know quaternions only.
"""

import pytest
import sympy as sp

from rigid_envs.systems.free_body.dynamics import FREE_BODY
from rigid_envs.systems.heavy_top.dynamics import HEAVY_TOP
from rigid_envs.systems.rolling_ball.dynamics import ROLLING_BALL
from tests.verification.symbols import (
    BY_RATES,
    HALF,
    OMEGA,
    RATES,
    R,
    in_time,
    integrals,
    quaternion,
    rates,
    reduced,
)

I1, I2, I3, m, g, ell, r = sp.symbols("I1 I2 I3 m g ell r", positive=True)
W = sp.Matrix(sp.symbols("w1 w2 w3"))
TAU = sp.Matrix(sp.symbols("tau1 tau2 tau3"))
INERTIA = sp.diag(I1, I2, I3)


def test_the_free_body_obeys_eulers_equations():
    q = sp.symbols("q0:4")
    found_rates = rates(FREE_BODY, (*q, *W), tuple(TAU), (I1, I2, I3))
    momentum = INERTIA * W
    found = INERTIA * sp.Matrix(found_rates[4:]) + W.cross(momentum) - TAU
    assert found.applyfunc(sp.simplify) == sp.zeros(3, 1)


@pytest.mark.parametrize("system", [FREE_BODY, HEAVY_TOP], ids=["free body", "heavy top"])
def test_the_quaternion_turns_with_the_angular_velocity_of_the_euler_angles(system):
    q = quaternion()
    found_rates = rates(system, (*q, *OMEGA), (), (I1, I2, I3, m, g, ell))
    for found, expected in zip(found_rates[:4], q.applyfunc(in_time), strict=True):
        assert reduced(found - expected) == 0


def test_the_heavy_top_obeys_lagranges_equations_with_torques_and_a_moving_pivot():
    tau_body, tau_world = sp.Matrix(sp.symbols("b1:4")), sp.Matrix(sp.symbols("s1:4"))
    VX, VY, aX, aY = sp.symbols("VX VY aX aY")
    # Kinetic energy about the pivot, and what the pivot's velocity adds: m V . (centre of mass)'.
    # Its own energy, m V^2 / 2, is a given function of time.
    centre = ell * R[:, 2]
    kinetic = (OMEGA.T * INERTIA * OMEGA)[0] / 2 + m * sp.Matrix([VX, VY, 0]).dot(
        centre.applyfunc(in_time)
    )
    lagrangian = kinetic - m * g * centre[2]
    found_rates = rates(
        HEAVY_TOP,
        (*quaternion(), *OMEGA, 0, 0, VX, VY),
        (*tau_body, *tau_world, aX, aY),
        (I1, I2, I3, m, g, ell),
    )
    assert found_rates[7:] == (VX, VY, aX, aY)
    # If Lagrange's equations are BY_RATES^T I (omega' - rhs) = 0 for whatever accelerations, the
    # two say the same wherever the angles are coordinates.
    excess = INERTIA * (OMEGA.applyfunc(in_time) - sp.Matrix(found_rates[4:7]))
    torque = tau_body + R.T * tau_world
    for k, (half, rate) in enumerate(zip(HALF, RATES, strict=True)):
        conjugate = sp.diff(lagrangian, rate)
        pushed = sp.diff(conjugate, VX) * aX + sp.diff(conjugate, VY) * aY
        by_angle = sp.diff(lagrangian, half) / 2
        equation = in_time(conjugate) + pushed - by_angle - BY_RATES[:, k].dot(torque)
        assert reduced(equation - BY_RATES[:, k].dot(excess)) == 0


def test_the_rolling_ball_obeys_the_no_slip_condition():
    q, (VX, VY, spin) = sp.symbols("q0:4"), sp.symbols("VX VY spin")
    found_rates = rates(ROLLING_BALL, q, (VX, VY, spin), (r, 1 / r))
    turn = sp.Quaternion(*found_rates[:4]) * sp.Quaternion(*q).conjugate() * 2
    norm = sum(x**2 for x in q)
    omega = sp.Matrix([turn.b, turn.c, turn.d]) / norm
    centre = sp.Matrix([found_rates[4], found_rates[5], 0])
    contact = centre + omega.cross(sp.Matrix([0, 0, -r]))
    assert contact.applyfunc(sp.simplify) == sp.zeros(3, 1)
    assert sp.simplify(omega[2] - spin) == 0
    assert sp.expand(turn.a) == 0  # the length of q stays


@pytest.mark.parametrize(
    ("system", "n_invariants"), [(FREE_BODY, 5), (HEAVY_TOP, 2)], ids=["free body", "heavy top"]
)
def test_energies_and_momenta_are_first_integrals(system, n_invariants):
    q = quaternion()
    symbols = sp.symbols(f"y0:{len(system.State._fields)}")
    p = (I1, I2, I3, m, g, ell)
    found_rates = rates(system, symbols, (), p)
    values = integrals(system, symbols, p)[:n_invariants]
    at = dict(zip(symbols[:4], q, strict=True))
    for value in values:
        change = sum(sp.diff(value, y) * rate for y, rate in zip(symbols, found_rates, strict=True))
        assert reduced(change.subs(at)) == 0
