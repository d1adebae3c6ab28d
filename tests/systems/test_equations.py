"""The equations of what rolls, symbol by symbol: compiled, fed to SymPy and derived anew.

The other side is d'Alembert and Lagrange's, with multipliers for the point that must not slip, and
Newton and Euler's for the ball. All rates, inputs and parameters are symbols; the angles are taken
where their sines and cosines are rational.
"""

from collections.abc import Callable
from typing import Any

import pytest
import sympy as sp

from rigid_envs.engine.dynamics import Dynamics
from rigid_envs.systems.dynamic_ball.dynamics import DYNAMIC_BALL
from rigid_envs.systems.free_body.dynamics import FREE_BODY
from rigid_envs.systems.heavy_top.dynamics import HEAVY_TOP
from rigid_envs.systems.roller.dynamics import ROLLER
from rigid_envs.systems.rolling_ball.dynamics import ROLLING_BALL
from rigid_envs.systems.rolling_disk.dynamics import ROLLING_DISK
from rigid_envs.systems.upright_coin.dynamics import UPRIGHT_COIN
from tests.systems import symbols
from tests.systems.symbols import (
    ACCELERATIONS,
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

I1, I3, m, g, r = sp.symbols("I1 I3 m g r", positive=True)
E_X, E_Z = sp.Matrix([1, 0, 0]), sp.Matrix([0, 0, 1])
A, B, C = HALF  # of phi, theta and psi
OMEGA_WORLD = R * OMEGA
AXIS = R[:, 2]


# The radius that points up: square to the axis, and as steep as that allows.
UP = sp.Matrix([-sp.sin(2 * A) * sp.cos(2 * B), sp.cos(2 * A) * sp.cos(2 * B), sp.sin(2 * B)])
ALONG = AXIS.cross(UP)


def turns(*triples: tuple[int, int, int]) -> dict[Any, Any]:
    """Sines and cosines of half angles, from Pythagorean triples (a, b, c): a / c and b / c."""
    values = {}
    for half, (a, b, c) in zip(HALF, triples, strict=True):
        values |= {sp.sin(half): sp.Rational(a, c), sp.cos(half): sp.Rational(b, c)}
    return values


PLACES = [
    turns((3, 4, 5), (5, 12, 13), (20, -21, 29)),
    turns((-8, 15, 17), (21, 20, 29), (12, 5, 13)),
]
at_places = pytest.mark.parametrize("place", PLACES, ids=["low", "high"])


def at(place: dict[Any, Any], expression: Any) -> Any:
    """A function of the angles there."""
    return sp.expand_trig(expression).subs(place)


def vanishes(expression: Any) -> bool:
    """Whether a rational function is zero."""
    return bool(sp.expand(sp.numer(sp.together(expression))) == 0)


def exact(expression: Any) -> Any:
    """The same with fractions for the halves and twos of the kernels, which are floats."""
    return sp.nsimplify(expression, rational=True)


def compiled(
    function: Callable[..., Any], system: Dynamics, roots: dict[Any, Any], *rows: tuple[Any, ...]
) -> sp.Matrix:
    """What `rates` or `integrals` make of symbols; `roots` names what square roots are of what."""

    def root(square: Any) -> Any:
        name = sp.Symbol("root")
        roots[name] = exact(square)
        return name

    def circular(x: Any) -> tuple[Any, Any]:
        return sp.sin(x), sp.cos(x)

    found = function(system, *rows, sqrt=root, sincos=circular)
    return sp.Matrix(found).applyfunc(exact)


RIM = m * r**2
MU = sp.Symbol("mu")  # without effect on the motion
DISK = (m, r, I1, I3, g, MU, I1 + RIM, I3 + RIM, 1 / I1, 1 / (I1 + RIM), 1 / (I3 + RIM))
STATE = sp.symbols("y0:9")


def placed(place: dict[Any, Any], expressions: sp.Matrix, roots: dict[Any, Any]) -> sp.Matrix:
    """Functions of a disk's state at the Euler angles there, with their rates."""
    for square in roots.values():  # no other root is taken than that of sin(theta)^2
        assert vanishes(at(place, square.subs(state_of_angles()) - sp.sin(2 * B) ** 2))
    known = dict.fromkeys(roots, sp.sin(2 * B)) | state_of_angles()
    return expressions.subs(known).applyfunc(lambda entry: at(place, entry))


def state_of_angles() -> dict[Any, Any]:
    """The state of a disk, its contact at 0, by Euler angles and their rates."""
    return dict(zip(STATE, (*quaternion(), *OMEGA, 0, 0), strict=True))


def disk_rates(place: dict[Any, Any], torques: Any) -> sp.Matrix:
    roots: dict[Any, Any] = {}
    found = compiled(symbols.rates, ROLLING_DISK, roots, STATE, tuple(torques), DISK)
    return placed(place, found, roots)


@at_places
def test_the_rolling_disk_obeys_lagranges_equations_with_multipliers(place):
    torques = sp.Matrix(sp.symbols("tau_n tau_l tau_3"))
    rates = disk_rates(place, torques)
    # Coordinates are the centre (x, y) and the angles; its height r sin(theta) goes with them.
    height = r * sp.sin(2 * B)
    spin = I1 * (OMEGA[0] ** 2 + OMEGA[1] ** 2) + I3 * OMEGA[2] ** 2
    lagrangian = (spin + m * in_time(height) ** 2) / 2 - m * g * height
    # No slip: the velocity of the centre is omega x r n. Its third component asks for nothing.
    velocity = OMEGA_WORLD.cross(r * UP)
    assert vanishes(at(place, velocity[2] - in_time(height)))
    multipliers = m * velocity[:2, :].applyfunc(in_time)  # m x'', m y''
    torque = torques[0] * UP + torques[1] * ALONG + torques[2] * AXIS
    # Accelerations of the angles, from those of omega.
    rest = OMEGA.applyfunc(in_time).subs(dict.fromkeys(ACCELERATIONS, 0))
    turned = rates[4:7, :] - rest.applyfunc(lambda entry: at(place, entry))
    by_rates = BY_RATES.applyfunc(lambda entry: at(place, entry))
    accelerations = dict(zip(ACCELERATIONS, by_rates.LUsolve(turned), strict=True))
    for half, rate in zip(HALF, RATES, strict=True):
        equation = (
            in_time(sp.diff(lagrangian, rate))
            - sp.diff(lagrangian, half) / 2
            - torque.dot(OMEGA_WORLD.diff(rate))
            + multipliers.dot(velocity[:2, :].diff(rate))
        )
        assert vanishes(at(place, equation).subs(accelerations))


@at_places
def test_the_contact_of_the_disk_runs_below_its_centre_and_its_quaternion_turns(place):
    rates = disk_rates(place, (0, 0, 0))
    contact = OMEGA_WORLD.cross(r * UP) - r * UP.applyfunc(in_time)
    expected = (*quaternion().applyfunc(in_time), *contact)
    for found, entry in zip((*rates[:4], *rates[7:], 0), expected, strict=True):
        assert vanishes(found - at(place, entry))


@at_places
def test_the_energy_of_the_disk_is_a_first_integral(place):
    roots: dict[Any, Any] = {}
    energy = compiled(integrals, ROLLING_DISK, roots, STATE, DISK)[0]
    (root, square), rates = next(iter(roots.items())), disk_rates(place, (0, 0, 0))
    # The root changes by half the change of its square over itself.
    slopes = [
        sp.diff(energy, y) + sp.diff(energy, root) * sp.diff(square, y) / (2 * root) for y in STATE
    ]
    slopes = placed(place, sp.Matrix(slopes), roots)
    assert vanishes(slopes.dot(rates))
    height = r * sp.sin(2 * B)
    velocity = OMEGA_WORLD.cross(r * UP)
    spin = I1 * (OMEGA[0] ** 2 + OMEGA[1] ** 2) + I3 * OMEGA[2] ** 2
    expected = (spin + m * velocity.dot(velocity)) / 2 + m * g * height
    assert vanishes(placed(place, sp.Matrix([energy]), roots)[0] - at(place, expected))


@pytest.mark.parametrize("place", [0, 1])
def test_the_upright_coin_obeys_lagranges_equations_on_a_slope(place):
    slope, steer, drive, phi_t, psi_t = sp.symbols("slope tau_phi tau_psi phi_t psi_t")
    where = PLACES[place] | {sp.sin(B): sp.sqrt(2) / 2, sp.cos(B): sp.sqrt(2) / 2}
    inertia = I3 + RIM
    p = (m, r, I1, I3, g, slope, MU, 1 / I1, 1 / inertia, m * g * sp.sin(slope) * r / inertia)
    y = sp.symbols("y0:8")
    rates = compiled(symbols.rates, UPRIGHT_COIN, {}, y, (steer, drive), p)
    upright = {RATES[1]: 0, RATES[0]: phi_t, RATES[2]: psi_t}
    state = dict(zip(y, (*quaternion(), 0, 0, phi_t, psi_t), strict=True))
    found = rates.subs(state).applyfunc(lambda entry: at(where, entry))
    # Coordinates x, y, phi and psi; the wheel rolls: (x', y') = omega x r e_z.
    velocity = OMEGA_WORLD.cross(r * E_Z).subs(upright)
    assert vanishes(at(where, velocity[0] - found[4]))
    assert vanishes(at(where, velocity[1] - found[5]))
    accelerations = {ACCELERATIONS[0]: found[6], ACCELERATIONS[1]: 0, ACCELERATIONS[2]: found[7]}
    grown = OMEGA_WORLD.cross(r * E_Z).applyfunc(in_time).subs(upright)
    force = m * grown[:2, :] - m * g * sp.sin(slope) * E_X[:2, :]  # of the contact
    for rate, inert, torque, k in ((phi_t, I1, steer, 6), (psi_t, I3, drive, 7)):
        equation = inert * found[k] - torque + force.dot(velocity[:2, :].diff(rate))
        assert vanishes(at(where, equation).subs(accelerations))
    for entry, q in zip(found[:4], quaternion().applyfunc(in_time).subs(upright), strict=True):
        assert vanishes(entry - at(where, q))
    kinetic = (I1 * phi_t**2 + I3 * psi_t**2 + m * velocity.dot(velocity)) / 2
    energy = compiled(integrals, UPRIGHT_COIN, {}, y, p)[0]
    x = y[4]
    expected = at(where, kinetic) - m * g * sp.sin(slope) * x
    assert vanishes(energy.subs({y[6]: phi_t, y[7]: psi_t}) - expected)


def test_the_roller_obeys_lagranges_equation_on_its_path():
    beta, slope, curvature, mu, s, v = sp.symbols("beta slope curvature mu s v")
    push, change = sp.symbols("push change")
    p = (m, r, beta, g, slope, curvature, mu, 1 / (1 + beta), 1 / m)
    rates = compiled(symbols.rates, ROLLER, {}, (s, v), (push, change), p)
    # How far the centre has sunk: where it goes down by that angle.
    sunk = (sp.cos(slope - curvature * s) - sp.cos(slope)) / curvature
    assert sp.simplify(sp.diff(sunk, s) - sp.sin(slope - curvature * s)) == 0
    kinetic = m * v**2 / 2 + (beta + change) * m * r**2 * (v / r) ** 2 / 2
    pulled = sp.diff(m * g * sunk, s)
    equation = sp.diff(kinetic, v, 2) * rates[1] - pulled - push
    assert sp.simplify(equation) == 0
    assert rates[0] == v
    energy = compiled(integrals, ROLLER, {}, (s, v), p)[0]
    assert sp.simplify(sp.expand_trig(energy - kinetic.subs(change, 0) + m * g * sunk)) == 0


def test_the_ball_on_its_plate_obeys_newtons_and_eulers_laws():
    beta, table = sp.symbols("beta Omega")
    q = sp.symbols("q0:4")
    motion = sp.symbols("X Y VX VY spin ax ay rate_x rate_y")
    u = sp.symbols("FX FY a_x a_y")
    (X, Y), spin, (ax, ay), (FX, FY) = motion[:2], motion[4], motion[5:7], u[:2]
    p = (m, r, beta, g, table, MU, 1 / m, 1 / r, 1 / (1 + beta))
    rates = compiled(symbols.rates, DYNAMIC_BALL, {}, (*q, *motion), u, p)

    def in_time(vector):
        return sum(
            (vector.diff(y) * rate for y, rate in zip(motion, rates[4:], strict=True)), vector * 0
        )

    sx, cx, sy, cy = sp.sin(ax), sp.cos(ax), sp.sin(ay), sp.cos(ay)
    P = sp.Matrix([[1, 0, 0], [0, cx, -sx], [0, sx, cx]]) * sp.Matrix(
        [[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]
    )
    n, centre = P[:, 2], P * sp.Matrix([X, Y, r])
    velocity = in_time(centre)
    # Angular velocity from q' itself: (0, omega) = 2 q' conj(q), whatever q of unit length is.
    unit = dict(zip(q, (sp.Rational(k, 5) for k in (1, 2, 2, 4)), strict=True))
    w, v = q[0], sp.Matrix(q[1:])
    w_t, v_t = rates[0], rates[1:4, :]
    omega = (2 * (w * v_t - w_t * v + v.cross(v_t))).subs(unit)
    tip = in_time(P) * P.T
    plate = sp.Matrix([tip[2, 1], tip[0, 2], tip[1, 0]])
    slip = velocity - omega.cross(r * n) - (plate + table * n).cross(centre - r * n)
    # Newton: what the contact must push; Euler: how that turns the ball.
    push = P * sp.Matrix([FX, FY, 0]) - m * g * E_Z
    contact = m * in_time(velocity) - push
    turned = beta * m * r**2 * in_time(omega) + (r * n).cross(contact)
    somewhere = {
        sx: sp.Rational(3, 5),
        cx: sp.Rational(4, 5),
        sy: sp.Rational(5, 13),
        cy: sp.Rational(12, 13),
    }
    for entry in (*slip, *turned, omega.dot(n) - spin):
        assert vanishes(entry.subs(somewhere))
    assert vanishes((w * w_t + v.dot(v_t)).subs(somewhere))


I2, ell = sp.symbols("I2 ell", positive=True)
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
