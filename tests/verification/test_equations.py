"""The equations of motion, symbol by symbol: what is compiled is fed to SymPy and derived anew.

The other side is Lagrange's: kinetic and potential energy in z-x-z Euler angles, where the kernels
know quaternions only.
"""

import types
from typing import Any

import pytest
import sympy as sp
from numba.core.dispatcher import Dispatcher

from rigid_envs.kernels import free_body, heavy_top, rolling_ball

I1, I2, I3, m, g, ell, r = sp.symbols("I1 I2 I3 m g ell r", positive=True)
W = sp.Matrix(sp.symbols("w1 w2 w3"))
TAU = sp.Matrix(sp.symbols("tau1 tau2 tau3"))
INERTIA = sp.diag(I1, I2, I3)
# Half angles, so that the quaternion is a polynomial in their sines and cosines.
HALF = sp.symbols("a b c")
ANGLES = sp.Matrix([2 * half for half in HALF])  # phi, theta, psi
RATES = sp.Matrix(sp.symbols("phi_t theta_t psi_t"))
ACCELERATIONS = sp.Matrix(sp.symbols("phi_tt theta_tt psi_tt"))


def plain(function: Any) -> Any:
    """A compiled function as Python, and so everything that it calls."""
    source = getattr(function, "py_func", function)
    names = source.__code__.co_names
    scope = {
        name: plain(value) if isinstance(value, Dispatcher) else value
        for name, value in source.__globals__.items()
        if name in names
    }
    return types.FunctionType(source.__code__, {**scope, "__builtins__": __builtins__})


def reduced(expression: Any) -> Any:
    """The one polynomial in sines and cosines of the half angles that has no cosine squared."""
    expression = sp.expand(sp.expand_trig(expression))
    s, c = sp.Dummy("s"), sp.Dummy("c")
    for half in HALF:
        polynomial = sp.Poly(expression.subs({sp.sin(half): s, sp.cos(half): c}), c)
        rest = sp.rem(polynomial, sp.Poly(c**2 + s**2 - 1, c))
        expression = sp.expand(rest.as_expr().subs({s: sp.sin(half), c: sp.cos(half)}))
    return expression


def in_time(expression: Any) -> Any:
    """Total time derivative of a function of angles and their rates."""
    by_angle = sum(
        sp.diff(expression, half) * rate / 2 for half, rate in zip(HALF, RATES, strict=True)
    )
    by_rate = sum(
        sp.diff(expression, rate) * acceleration
        for rate, acceleration in zip(RATES, ACCELERATIONS, strict=True)
    )
    return by_angle + by_rate


def rotation() -> sp.Matrix:
    """R = Rz(phi) Rx(theta) Rz(psi)."""

    def about_z(angle):
        s, c = sp.sin(angle), sp.cos(angle)
        return sp.Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    s, c = sp.sin(ANGLES[1]), sp.cos(ANGLES[1])
    about_x = sp.Matrix([[1, 0, 0], [0, c, -s], [0, s, c]])
    return about_z(ANGLES[0]) * about_x * about_z(ANGLES[2])


def quaternion() -> sp.Matrix:
    """The textbook quaternion of z-x-z Euler angles."""
    a, b, c = HALF
    return sp.Matrix(
        [
            sp.cos(b) * sp.cos(a + c),
            sp.sin(b) * sp.cos(a - c),
            sp.sin(b) * sp.sin(a - c),
            sp.cos(b) * sp.sin(a + c),
        ]
    )


R = rotation()
SPIN = R.T * R.applyfunc(in_time)  # [omega_body] x
OMEGA = sp.Matrix([SPIN[2, 1], SPIN[0, 2], SPIN[1, 0]]).applyfunc(reduced)
BY_RATES = OMEGA.jacobian(RATES)  # omega_body = BY_RATES (phi', theta', psi')


def test_the_free_body_obeys_eulers_equations():
    q = sp.symbols("q0:4")
    rates = plain(free_body.rhs)((*q, *W), tuple(TAU), (I1, I2, I3))
    momentum = INERTIA * W
    found = INERTIA * sp.Matrix(rates[4:]) + W.cross(momentum) - TAU
    assert found.applyfunc(sp.simplify) == sp.zeros(3, 1)


@pytest.mark.parametrize("kernels", [free_body, heavy_top], ids=["free body", "heavy top"])
def test_the_quaternion_turns_with_the_angular_velocity_of_the_euler_angles(kernels):
    q = quaternion()
    state = (*q, *OMEGA, 0, 0, 0, 0)[: len(kernels.STATE)]
    rates = plain(kernels.rhs)(state, (0,) * 8, (I1, I2, I3, m, g, ell))
    for found, expected in zip(rates[:4], q.applyfunc(in_time), strict=True):
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
    rates = plain(heavy_top.rhs)(
        (*quaternion(), *OMEGA, 0, 0, VX, VY),
        (*tau_body, *tau_world, aX, aY),
        (I1, I2, I3, m, g, ell),
    )
    assert rates[7:] == (VX, VY, aX, aY)
    # If Lagrange's equations are BY_RATES^T I (omega' - rhs) = 0 for whatever accelerations, the
    # two say the same wherever the angles are coordinates.
    excess = INERTIA * (OMEGA.applyfunc(in_time) - sp.Matrix(rates[4:7]))
    torque = tau_body + R.T * tau_world
    for k, (half, rate) in enumerate(zip(HALF, RATES, strict=True)):
        conjugate = sp.diff(lagrangian, rate)
        pushed = sp.diff(conjugate, VX) * aX + sp.diff(conjugate, VY) * aY
        by_angle = sp.diff(lagrangian, half) / 2
        equation = in_time(conjugate) + pushed - by_angle - BY_RATES[:, k].dot(torque)
        assert reduced(equation - BY_RATES[:, k].dot(excess)) == 0


def test_the_rolling_ball_obeys_the_no_slip_condition():
    q, (VX, VY, spin) = sp.symbols("q0:4"), sp.symbols("VX VY spin")
    rates = plain(rolling_ball.rhs)((*q, 0, 0), (VX, VY, spin), (r, 1 / r))
    turn = sp.Quaternion(*rates[:4]) * sp.Quaternion(*q).conjugate() * 2
    norm = sum(x**2 for x in q)
    omega = sp.Matrix([turn.b, turn.c, turn.d]) / norm
    centre = sp.Matrix([rates[4], rates[5], 0])
    contact = centre + omega.cross(sp.Matrix([0, 0, -r]))
    assert contact.applyfunc(sp.simplify) == sp.zeros(3, 1)
    assert sp.simplify(omega[2] - spin) == 0
    assert sp.expand(turn.a) == 0  # the length of q stays


@pytest.mark.parametrize(
    ("kernels", "n_invariants"), [(free_body, 5), (heavy_top, 2)], ids=["free body", "heavy top"]
)
def test_energies_and_momenta_are_first_integrals(kernels, n_invariants):
    q = quaternion()
    symbols = sp.symbols(f"y0:{len(kernels.STATE)}")
    p = (I1, I2, I3, m, g, ell)
    rates = plain(kernels.rhs)(symbols, (0,) * 8, p)
    values = plain(kernels.invariants)(symbols, p)[:n_invariants]
    at = dict(zip(symbols[:4], q, strict=True))
    for value in values:
        change = sum(sp.diff(value, y) * rate for y, rate in zip(symbols, rates, strict=True))
        assert reduced(change.subs(at)) == 0
