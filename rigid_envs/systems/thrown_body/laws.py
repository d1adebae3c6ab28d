"""Laws of a thrown body: its flight, its rotation, its twist and its wobble."""

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import laws
from rigid_envs.mechanics.integration import Trajectory
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.thrown_body import closed_forms as theory
from rigid_envs.systems.thrown_body.system import ThrownBody

SUBJECT = laws.Subject("thrown_body", "a rigid body that is thrown")

_BODY = ThrownBody(1.1, 1.7, 2.3, m=0.8, g=2.5)
_RACKET = ThrownBody(0.0012, 0.0164, 0.0176, m=0.33)
_Y, _U = laws.random_states(_BODY, 20)

_MODEL = laws.RigidBodyModel(
    mass=_BODY.m,
    moments=_BODY.moments,
    centre=_BODY.position,
    force=lambda y, u: u[..., 3:] - np.array([0.0, 0.0, _BODY.m * _BODY.g]),
    torque=lambda y, u: np.einsum("...ij,...j->...i", laws.attitudes(y), u[..., :3]),
    displacements=lambda y: (
        np.concatenate([np.zeros((3, 1, 3)), laws.VIRTUAL_ROTATIONS]),
        np.concatenate([laws.VIRTUAL_ROTATIONS, np.zeros((3, 1, 3))]),
    ),
)
laws.law_of_dalembert(SUBJECT, _BODY, _Y, _U, _MODEL)
laws.laws_of_every_system(SUBJECT, _BODY, _Y, _U)
laws.law_of_order(SUBJECT, _BODY, _Y, _U)


@SUBJECT.law("invariants with T + m g z and R L of NumPy", bound=1e-13, why=laws.ten_roundings(50))
def invariants_are_energy_and_momenta() -> float:
    """E = omega . I omega / 2 + m v^2 / 2 + m g z, L = R I omega, and the horizontal velocity."""
    omega, found, v = _BODY.omega_body(_Y), _BODY.invariants(_Y), _BODY.velocity(_Y)
    momentum = omega @ np.diag(_BODY.moments)
    L = np.einsum("nij,nj->ni", laws.attitudes(_Y), momentum)
    flight = 0.5 * np.sum(v * v, axis=-1) + _BODY.g * _BODY.position(_Y)[:, 2]
    energy = 0.5 * np.sum(momentum * omega, axis=-1) + _BODY.m * flight
    return laws.max_abs(
        found["energy"] - energy,
        _BODY.energy(_Y) - energy,
        found["L_squared"] - np.sum(L * L, axis=-1),
        np.stack([found[f"L_world_{k}"] for k in "xyz"], axis=-1) - L,
        np.stack([found[f"velocity_{k}"] for k in "xy"], axis=-1) - v[:, :2],
    )


@SUBJECT.law("rate of the energy with tau . omega + F . v", bound=1e-9, why=laws.AS_RHS)
def torque_and_force_do_their_work() -> float:
    """E' = tau . omega + F . v along simulated motions."""
    motion = laws.stencil(_BODY, _Y, _U)
    power = np.sum(_U[:, :3] * _BODY.omega_body(_Y), axis=-1)
    power += np.sum(_U[:, 3:] * _BODY.velocity(_Y), axis=-1)
    return laws.max_abs(motion.rate(_BODY.invariants(motion.y)["energy"]) - power)


@SUBJECT.law("simulate with a free body's", bound=0.0, why="the same numbers, in the same order")
def flight_does_not_change_the_rotation() -> float:
    """Attitude and omega for 5 s under a torque, whichever axis has the middle moment."""
    t, u = np.linspace(0.0, 5.0, 11), np.tile(_U[0], (10, 1))
    apart = []
    for moments in ((1.1, 1.7, 2.3), (2.3, 1.1, 1.7), (1.7, 2.3, 1.1)):
        thrown = ThrownBody(*moments).simulate(_Y, t, u, max_step=0.05).y
        turned = FreeBody(*moments).simulate(_Y[:, :7], t, u[:, :3], max_step=0.05).y
        apart.append(thrown[..., :7] - turned)
    return laws.max_abs(*apart)


@SUBJECT.law("advance with the parabola, 5 s", bound=1e-12, why=laws.HUNDREDS)
def the_centre_of_mass_flies_along_a_parabola() -> float:
    """Position and velocity of 20 throws, without and with a force along the vertical."""
    apart = []
    for lift in (0.0, 0.7):
        force = np.array([0.0, 0.0, 0.0, 0.0, 0.0, lift])
        for y in _Y:
            end = _BODY.advance(y, force, 5.0, 100)
            x, v = theory.parabola(
                5.0, _BODY.position(y), _BODY.velocity(y), g=_BODY.g - lift / _BODY.m
            )
            apart += [_BODY.position(end) - x, _BODY.velocity(end) - v]
    return laws.max_abs(*apart)


@SUBJECT.law("height after the flight time with that of the catch", bound=1e-12, why=laws.HUNDREDS)
def what_is_thrown_comes_down_in_time() -> float:
    """Throws up and down, to catches above and below the hand; all fall when they are caught."""
    apart = []
    for rise, velocity in ((0.0, 6.0), (1.2, 6.0), (-1.5, 6.0), (-0.4, -2.0), (-2.0, 0.0)):
        start = _BODY.state(velocity=(1.0, -2.0, velocity))
        end = _BODY.advance(start, None, theory.flight_time(rise, velocity, g=_BODY.g), 20)
        apart += [_BODY.position(end)[2] - rise, max(_BODY.velocity(end)[2], 0.0)]
    return laws.max_abs(*apart)


def _turned(directions: Array, about: Array) -> Array:
    """Angles by which directions have turned about the unit vector of each, shape (n,) [rad].

    The angles are those from a vector that moves along: the first direction, when `about` rests.
    """
    first = directions[0] - np.sum(about[0] * directions[0]) * about[0]
    beside = np.cross(about, first)
    angles = np.arctan2(np.sum(directions * beside, axis=-1), directions @ first)
    return np.asarray(np.unwrap(angles))


def _flown(theta0: float, psi0: float, time: float) -> Trajectory:
    """Flight of a racket with |L| = 0.15 N m s, at 401 times."""
    L = np.array([np.cos(theta0), np.sin(theta0) * np.sin(psi0), np.sin(theta0) * np.cos(psi0)])
    start = _RACKET.state(omega_body=0.15 * L / _RACKET.moments)
    return _RACKET.simulate(start, np.linspace(0.0, time, 401))


@SUBJECT.law(
    "simulate with the twist of the theory",
    bound=1e-8,
    why="1e-11 per radian, 20 radians, times the growth beside the unstable axis, up to 100",
)
def a_racket_twists_as_the_theory_says() -> float:
    """Turn of the handle, twist and tilt at the time of a turn: on and on, and to and fro."""
    apart = []
    for theta0, psi0 in ((1.5, 1.4708), (1.64, 1.5708), (1.5608, 1.57), (1.55, 0.9), (1.6, 2.4)):
        twist = theory.racket_twist(1.0, _RACKET.moments, 0.15, theta0, psi0)
        flight = _flown(theta0, psi0, twist.time)
        L = flight["L_body"] / 0.15
        psi = np.unwrap(np.arctan2(L[:, 1], L[:, 2]))
        up = flight["L_world"] / 0.15
        turn = _turned(flight["R"][:, :, 0], up)[-1]
        found = (
            turn - 2.0 * np.pi,
            psi[-1] - psi[0] - twist.psi,
            np.arccos(L[-1, 0]) - twist.theta,
        )
        apart.append(found)
    return laws.max_abs(*apart)


def _reflected(directions: Array, at: Array) -> Array:
    """Directions less twice their components along other vectors, shape (n, 3)."""
    along = np.sum(directions * at, axis=-1) / np.sum(at * at, axis=-1)
    return np.asarray(directions - 2.0 * along[:, None] * at)


@SUBJECT.law("simulate with the wobble of the theory", bound=1e-9, why=laws.RADIANS)
def a_plate_wobbles_twice_as_fast_as_it_spins() -> float:
    """Azimuth of the axis about L and the turn that a mark shows, of plates and of a football.

    A mark shows the turn of the body about its axis, beyond what the shortest turn from L to the
    axis would give: the azimuth of the vector that this brings to the mark.
    """
    apart = []
    for moments, tilt in (((1.0, 1.0, 2.0), 0.01), ((1.0, 1.0, 2.0), 0.3), ((1.0, 1.0, 0.6), 0.2)):
        L = 2.0 * np.array([np.sin(tilt), 0.0, np.cos(tilt)])
        body, t = ThrownBody(*moments), np.linspace(0.0, 5.0, 101)
        R = body.simulate(body.state(omega_body=L / moments), t)["R"]
        up = np.tile(L / np.linalg.norm(L), (len(t), 1))
        axis, mark = R[:, :, 2], R[:, :, 0]
        # reflections at the bisector and at L make the shortest turn from the axis to L
        brought = _reflected(_reflected(mark, up + axis), up)
        ratio = theory.wobble_ratio(tilt, i_perp=moments[0], i3=moments[2])
        apart.append(_turned(axis, up) - ratio * _turned(brought, up))
    return laws.max_abs(*apart)
