"""Laws of a satellite: mass points in gravity, poles of the Earth's field, what is conserved."""

import itertools
import math
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import laws
from rigid_envs.mechanics.integration import Trajectory
from rigid_envs.systems.free_body.system import FreeBody
from rigid_envs.systems.satellite import closed_forms as theory
from rigid_envs.systems.satellite.system import Satellite

SUBJECT = laws.Subject("satellite", "a body on a circular orbit, turned by gravity and field")

_SATELLITE = Satellite(1.1, 1.7, 2.3, n=0.9, b=0.7, inclination=1.2)
_Y, _U = laws.random_states(_SATELLITE, 20)
_NO_DIPOLE = np.zeros(3)


# Gravity of mass points, and the field of two poles. In the Earth's axes z is its axis, x the node.


def _to_earth(v: Array) -> Array:
    """Vectors in world axes, shape (..., 3), turned about the line of nodes by the inclination."""
    tilt = Rotation.from_euler("x", _SATELLITE.inclination).as_matrix()
    return np.asarray(np.einsum("ij,...j->...i", tilt, v))


def _centre(y: Array) -> Array:
    """The satellite on its orbit, of radius 1, world axes."""
    return laws.horizontal(np.stack([np.cos(y[..., 7]), np.sin(y[..., 7])], axis=-1))


def _gravity(y: Array, size: float) -> Array:
    """Torque on six mass points by the mass n^2 in the middle of the orbit of radius 1, world axes.

    They are +-size a e_k with moments size^2 I; the torque is over size^2.
    """
    arms = np.sqrt(0.5 * (0.5 * np.sum(_SATELLITE.moments) - _SATELLITE.moments))
    total = np.zeros((*y.shape[:-1], 3))
    for sign, arm in itertools.product((-1.0, 1.0), np.diag(arms)):
        x = sign * size * np.einsum("...ij,j->...i", laws.attitudes(y), arm)
        place = _centre(y) + x
        distance = np.linalg.norm(place, axis=-1, keepdims=True)
        total -= np.cross(x, (_SATELLITE.n**2 / distance**3) * place)
    return total / size**2


def _poles(y: Array, size: float) -> Array:
    """Field of two poles on the Earth's axis, `size` from its centre: the north of it is south."""
    total, place = np.zeros((*y.shape[:-1], 3)), _to_earth(_centre(y))
    for sign in (-1.0, 1.0):
        x = place - [0.0, 0.0, sign * size]
        total -= sign * x / np.linalg.norm(x, axis=-1, keepdims=True) ** 3
    tilt = Rotation.from_euler("x", -_SATELLITE.inclination).as_matrix()
    return np.asarray(np.einsum("ij,...j->...i", tilt, _SATELLITE.b * total / (2.0 * size)))


def _small(value: Array, half: Array) -> Array:
    """The limit for small bodies, of values at a size and half of it, with errors of its square."""
    return (4.0 * half - value) / 3.0


def _field(y: Array) -> Array:
    return _small(_poles(y, 1e-3), _poles(y, 5e-4))


def _dipole_torque(y: Array, u: Array) -> Array:
    return np.cross(np.einsum("...ij,...j->...i", laws.attitudes(y), u), _field(y))


_BODY = laws.RigidBodyModel(
    mass=1.0,
    moments=_SATELLITE.moments,
    centre=lambda y: np.zeros((*y.shape[:-1], 3)),
    force=laws.constant(0.0, 0.0, 0.0),
    torque=lambda y, u: _small(_gravity(y, 2e-3), _gravity(y, 1e-3)) + _dipole_torque(y, u),
    displacements=lambda y: (np.zeros((3, 1, 3)), laws.VIRTUAL_ROTATIONS),
)
laws.law_of_dalembert(SUBJECT, _SATELLITE, _Y, _U, _BODY)


def _torque() -> Array:
    """What the equations say of the torque at 20 states without dipole, world axes."""
    omega, rates = _Y[:, 4:7], _SATELLITE.rhs(_Y)[:, 4:7]
    I = _SATELLITE.moments  # noqa: E741
    torque = I * rates + np.cross(omega, I * omega)
    return np.asarray(np.einsum("nij,nj->ni", laws.attitudes(_Y), torque))


@SUBJECT.law(
    "order of the torque on mass points with 2",
    bound=0.01,
    why="terms of the fourth power of sizes up to 0.04 of the orbit",
)
def gravity_of_a_small_body_is_its_gradient() -> float:
    """The torque in an inverse-square field tends to 3 n^2 r x I r as the square of the size."""
    errors = [laws.max_abs(_gravity(_Y, 0.04 / k) - _torque()) for k in (1.0, 2.0, 4.0)]
    return laws.max_abs(np.log2(np.divide(errors[:-1], errors[1:])) - 2.0)


laws.laws_of_every_system(SUBJECT, _SATELLITE, _Y, _U)


@SUBJECT.law("invariants and accessors with NumPy", bound=1e-13, why=laws.ten_roundings(50))
def invariants_are_energy_and_spin_momentum() -> float:
    """Energy of rotation and gravity less n L_z, I3 omega3; r of the accessor."""
    R, omega, found = laws.attitudes(_Y), _Y[:, 4:7], _SATELLITE.invariants(_Y)
    I, r = _SATELLITE.moments, np.einsum("nij,ni->nj", R, _centre(_Y))  # noqa: E741
    L = np.einsum("nij,nj->ni", R, I * omega)
    energy = 0.5 * np.sum(I * omega**2 + 3.0 * _SATELLITE.n**2 * I * r**2, axis=-1)
    return laws.max_abs(
        found["energy"] - energy + _SATELLITE.n * L[:, 2],
        _SATELLITE.energy(_Y) - found["energy"],
        _SATELLITE.kinetic_energy(_Y) - 0.5 * np.sum(I * omega**2, axis=-1),
        found["L_spin"] - I[2] * omega[:, 2],
        _SATELLITE.radial_body(_Y) - r,
    )


@SUBJECT.law(
    "field_body with that of two poles",
    bound=1e-11,
    why="poles 1e-3 of the radius from the centre: (1e-3)^4, roundings 1e-15 / 1e-3",
)
def the_earth_is_a_dipole_along_its_axis() -> float:
    """B in body axes, at 20 states: the pole in the north attracts the north of a compass."""
    exact = np.einsum("nij,ni->nj", laws.attitudes(_Y), _field(_Y))
    return laws.max_abs(_SATELLITE.field_body(_Y) - exact)


@SUBJECT.law("rate of the energy with that of the dipole's torque", bound=1e-9, why=laws.AS_RHS)
def a_dipole_works_on_the_energy_in_the_orbit() -> float:
    """E' = (m x B) . (omega - n e_z): the work on the rate that is seen in the orbit."""
    motion = laws.stencil(_SATELLITE, _Y, _U)
    relative = motion.omega() - [0.0, 0.0, _SATELLITE.n]
    power = np.sum(_dipole_torque(motion.middle, _U) * relative, axis=-1)
    return laws.max_abs(motion.rate(_SATELLITE.invariants(motion.y)["energy"]) - power)


@SUBJECT.law("rate of the kinetic energy with the theory", bound=1e-9, why=laws.AS_RHS)
def a_dipole_against_the_change_of_the_field_takes_energy() -> float:
    """T' of m = -k dB/dt seen in the body, and of m = k omega x B: less what gravity gives."""
    y, gain, found = _Y, 0.3, []
    motion = laws.stencil(_SATELLITE, y, _NO_DIPOLE)
    R = laws.attitudes(y)
    B = np.einsum("nij,ni->nj", R, _field(y))
    turning = np.einsum("nij,ni->nj", R, motion.rate(_field(motion.y)))
    omega, seen = y[:, 4:7], np.cross(y[:, 4:7], B)
    for D in (turning, 0.0 * turning):
        given = _SATELLITE.rhs(y, -gain * (D - seen)) - _SATELLITE.rhs(y)
        power = np.sum(_SATELLITE.moments * given[:, 4:7] * omega, axis=-1)
        found.append(power - gain * theory.detumbling_power(omega, B, D))
    return laws.max_abs(*found)


laws.law_of_order(SUBJECT, _SATELLITE, _Y, _U)


@SUBJECT.law("simulate with a free body's, 5 s", bound=1e-9, why=laws.RADIANS)
def without_orbit_and_field_it_is_a_free_body() -> float:
    """N = b = 0: q and omega are those of a `FreeBody`, and the satellite stays at its place."""
    alone, body, t = replace(_SATELLITE, n=0.0, b=0.0), FreeBody(1.1, 1.7, 2.3), np.arange(6.0)
    found, freely = alone.simulate(_Y, t, _U[0]).y, body.simulate(_Y[:, :7], t).y
    return laws.max_abs(found[..., :7] - freely, found[..., 7] - _Y[:, 7])


# Rest in the orbit: the body axes `roll`, `pitch` and `yaw`, in cyclic order, are along velocity,
# normal and vertical.


def _at_rest(roll: int) -> Array:
    """Attitude at latitude 0 of a body whose axis `roll` is along the velocity, y of the world."""
    axes = np.zeros((3, 3))
    axes[[1, 2, 0], [roll, (roll + 1) % 3, (roll + 2) % 3]] = 1.0
    return np.asarray(Rotation.from_matrix(axes).as_quat(scalar_first=True))


@SUBJECT.law(
    "simulate with Jacobi functions, 12 s", bound=1e-9, why="1e-11 per radian, some 50 radians"
)
def pitch_librates_and_rotates_as_jacobi_functions() -> float:
    """Turn about the normal of the orbit, beyond n t, of each axis of the body, slow and fast."""
    t, found = np.linspace(0.0, 12.0, 25), []
    for roll, (angle, rate) in itertools.product(range(3), ((0.4, 0.1), (-1.2, -0.3), (0.3, 2.5))):
        turn = Rotation.from_euler("z", angle)
        rest = Rotation.from_quat(_at_rest(roll), scalar_first=True)
        q = (turn * rest).as_quat(scalar_first=True)
        normal = np.eye(3)[(roll + 1) % 3]
        y = _SATELLITE.state(q=q, omega_body=(_SATELLITE.n + rate) * normal)
        moments = np.roll(_SATELLITE.moments, -roll)
        theta, speed = theory.pitch(t, angle, rate, moments=moments, n=_SATELLITE.n)
        motion = _SATELLITE.simulate(y, t).y
        exact = (
            Rotation.from_rotvec(np.multiply.outer(theta + _SATELLITE.n * t, [0.0, 0.0, 1.0]))
            * rest
        )
        found += [
            laws.attitudes(motion) - exact.as_matrix(),
            motion[:, 4:7] - np.multiply.outer(_SATELLITE.n + speed, normal),
        ]
    return laws.max_abs(*found)


def _departures(body: Satellite, y: Array, turning: float) -> Array:
    """Matrix of small turns of the body and of its rates, in axes that turn in it at `turning`.

    With departures q (1, d / 2) of the attitude, d' = d x omega + departure of omega. The axes
    turn about e3, to stay in the orbit where a symmetric body spins.
    """
    A, omega = body.linearize(y)[0], y[4:7]
    w, v = y[0], y[1:4]
    turns = 0.5 * np.vstack([-v, w * np.eye(3) + _cross(v)])
    spin = turning * _cross(np.array([0.0, 0.0, 1.0]))
    upper = np.hstack([spin - _cross(omega), np.eye(3)])
    return np.vstack([upper, np.hstack([A[4:7, :4] @ turns, A[4:7, 4:7] + spin])])


def _cross(v: Array) -> Array:
    """Matrix of v x."""
    return np.cross(v, np.eye(3)).T


def _of_squares(*coefficients: complex) -> Array:
    """Coefficients of a polynomial of x^2, of those of x."""
    found = np.zeros(2 * len(coefficients) - 1)
    found[::2] = np.real(coefficients)
    return found


@SUBJECT.law("linearize with the exponents of the theory", bound=1e-12, why=laws.ten_roundings(100))
def rest_in_the_orbit_is_stable_as_debra_and_delp_say() -> float:
    """Characteristic polynomials of departures from rest, of 40 bodies in all orientations."""
    found, names = [], ("I1", "I2", "I3")
    for seed in range(40):
        second = np.random.default_rng(seed).uniform(0.1, 1.0, 3)
        body = replace(_SATELLITE, **dict(zip(names, sum(second) - second, strict=True)))
        for roll in range(3):
            rest = theory.librations(np.roll(body.moments, -roll), body.n)
            normal = np.eye(3)[(roll + 1) % 3]
            y = body.state(q=_at_rest(roll), omega_body=body.n * normal)
            across = _of_squares(*np.poly(rest.roll_yaw_squared))
            exact = np.polymul(_of_squares(1.0, -rest.pitch_squared), across)
            found.append(np.poly(_departures(body, y, 0.0)) - exact)
    return laws.max_abs(*found)


@SUBJECT.law(
    "linearize with the exponents of the theory", bound=1e-11, why=laws.ten_roundings(1000)
)
def spin_about_the_normal_is_stable_as_thomson_says() -> float:
    """Characteristic polynomials of departures of symmetric bodies, of all spins."""
    found, n = [], _SATELLITE.n
    for ratio, spin in itertools.product((0.3, 0.8, 1.0, 1.3, 1.9), np.linspace(-3.0, 3.0, 7)):
        body = replace(_SATELLITE, I1=1.2, I2=1.2, I3=1.2 * ratio)
        y = body.state(omega_body=[0.0, 0.0, spin])
        axis = theory.normal_spin(i_perp=1.2, i3=1.2 * ratio, omega3=spin, n=n)
        exact = np.polymul(_of_squares(*np.poly(axis.squares)), [1.0, 0.0, 0.0])
        found.append(np.poly(_departures(body, y, spin - n)) - exact)
    return laws.max_abs(*found)


@SUBJECT.law(
    "mean rate of the axis with the theory, relative",
    bound=1e-4,
    why="neglected parts are of the square of n / omega3 = 1 / 300, in the mean of both spins",
)
def a_fast_top_regresses() -> float:
    """The axis of an oblate and a prolate body goes round the normal, averaged over two orbits."""
    found = []
    for C, tilt in itertools.product((1.6, 0.7), (0.4, 1.1, 2.4)):
        body = Satellite(1.0, 1.0, C, n=0.01, b=0.0)
        y, orbits = body.state(tilt=tilt, spin=[3.0, -3.0]), 4.0 * math.pi / body.n
        L = body.simulate(y, [0.0, orbits])["L_world"]
        turned = np.diff(np.arctan2(L[..., 1], L[..., 0]), axis=0)[0]
        rate = float(theory.regression(tilt, i_perp=1.0, i3=C, omega3=3.0, n=body.n))
        found.append(np.mean(turned * [-1.0, 1.0]) / orbits / rate - 1.0)
    return laws.max_abs(*found)


def _long_run(body: Satellite) -> Trajectory:
    """A satellite that tumbles slowly, at 5001 times of 5000 s."""
    start = body.state(tilt=1.0, omega_body=(0.1, 0.5, 0.2))
    return body.simulate(start, np.linspace(0.0, 5000.0, 5001), max_step=0.05)


@SUBJECT.law(
    "energy with its start, a hundred thousand steps",
    bound=1e-8,
    why="bounded for ever by some (rate x step)^4",
)
def energy_in_the_orbit_goes_nowhere() -> float:
    """Jacobi's integral without dipole, relative; attitudes stay unit."""
    motion = _long_run(replace(_SATELLITE, n=0.3))
    energy = motion.invariants["energy"]
    return laws.max_abs(energy / energy[0] - 1.0, np.linalg.norm(motion["q"], axis=-1) - 1.0)


@SUBJECT.law("omega3 with its start, a hundred thousand steps", bound=0.0, why="nothing is added")
def a_symmetric_satellite_keeps_its_spin() -> float:
    """I1 = I2: neither gravity nor the free rotation changes omega3."""
    spin = _long_run(replace(_SATELLITE, I1=1.7, n=0.3))["omega_body"][:, 2]
    return laws.max_abs(spin - spin[0])


@SUBJECT.law(
    "latitude with n t, a hundred thousand steps, relative",
    bound=4e-11,
    why="each of 5 stages of a step rounds by up to half a unit, 1e-13 of 1500 rad",
)
def the_orbit_goes_round_at_the_mean_motion() -> float:
    """Argument of latitude, which grows without limit."""
    motion = _long_run(replace(_SATELLITE, n=0.3))
    return laws.max_abs(motion["latitude"] - 0.3 * motion.t) / 1500.0
