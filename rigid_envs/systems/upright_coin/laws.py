"""Laws of the upright rolling coin, steered and driven, level or on a slope."""

import math

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import laws
from rigid_envs.systems.upright_coin import closed_forms as theory
from rigid_envs.systems.upright_coin.system import UprightCoin

SUBJECT = laws.Subject("upright_coin", "a coin held upright that rolls and is steered on a slope")

_COIN = UprightCoin(m=1.1, radius=0.7, I1=0.3, I3=0.4, g=9.5, slope=0.3)
_Y, _U = laws.random_states(_COIN, 20)
_Y[:, _COIN.components["q"]] = _COIN.attitude(*np.random.default_rng(9).uniform(-3.0, 3.0, (2, 20)))
_NORMAL = np.array([0.0, 0.0, 1.0])
_WEIGHT = 1.1 * 9.5 * np.array([math.sin(0.3), 0.0, -math.cos(0.3)])


def _centre(y: Array) -> Array:
    return laws.horizontal(_COIN.contact(y), 0.7)


def _steer_and_roll(y: Array) -> tuple[Array, Array]:
    axis = laws.axis(y)
    along = 0.7 * np.cross(axis, _NORMAL)
    return np.stack([0.0 * along, along]), np.stack([0.0 * axis + _NORMAL, axis])


def _torque(y: Array, u: Array) -> Array:
    """Torque of the inputs."""
    return np.asarray(u[..., :1] * _NORMAL + u[..., 1:] * laws.axis(y))


def _held_torque(y: Array, u: Array) -> Array:
    """Torque of the inputs and of the constraint that holds the coin upright."""
    along = np.cross(laws.axis(y), _NORMAL)
    return np.asarray(_torque(y, u) + _COIN.upright_torque(y, u)[..., None] * along)


_MOMENTS = np.array([0.3, 0.3, 0.4])
_WEIGHS = laws.constant(*_WEIGHT)
_MODEL = laws.RigidBodyModel(1.1, _MOMENTS, _centre, _WEIGHS, _torque, _steer_and_roll)
_HELD_MODEL = laws.RigidBodyModel(1.1, _MOMENTS, _centre, _WEIGHS, _held_torque, _steer_and_roll)
laws.law_of_dalembert(SUBJECT, _COIN, _Y, _U, _MODEL)


@SUBJECT.law("velocity of the contact point of simulate with 0", bound=1e-10, why=laws.SLOPES)
def the_contact_point_is_at_rest() -> float:
    """The point at -r n: v + omega x (-r n) = 0, omega from R' R^T; the axis is level."""
    motion = laws.stencil(_COIN, _Y, _U)
    omega, axis = motion.omega(), laws.axis(motion.y)
    return laws.max_abs(
        motion.rate(_centre(motion.y)) + np.cross(omega, -0.7 * _NORMAL),
        axis[..., 2],
        omega[:, 2] - _COIN.steer_rate(_Y),
        np.sum(omega * laws.axis(_Y), axis=-1) - _COIN.roll_rate(_Y),
    )


laws.laws_of_every_system(SUBJECT, _COIN, _Y, _U)


@SUBJECT.law(
    "invariants with T - m g . x of NumPy",
    bound=1e-13,
    why="some ten roundings of numbers near 1",
)
def invariants_are_energy_and_steer_rate() -> float:
    """E = (m v^2 + I1 phi'^2 + I3 psi'^2) / 2 - m g sin(slope) X."""
    steer, roll = _COIN.steer_rate(_Y), _COIN.roll_rate(_Y)
    kinetic = 0.5 * (1.1 * (0.7 * roll) ** 2 + 0.3 * steer**2 + 0.4 * roll**2)
    found = _COIN.invariants(_Y)
    energy = kinetic - _WEIGHT[0] * _COIN.contact(_Y)[:, 0]
    return laws.max_abs(found["energy"] - energy, found["steer_rate"] - steer)


laws.law_of_order(SUBJECT, _COIN, _Y, _U, 1.5)
laws.law_of_contact_force(
    SUBJECT, _COIN, _Y, _U, _HELD_MODEL, lambda y, u: (_COIN.contact_force(y, u), -0.7 * _NORMAL)
)


@SUBJECT.law(
    "advance in steps of 0.1 s with arcs in closed form",
    bound=1e-12,
    why="roundings of some thousand turns: at constant rates a step is the exact arc",
)
def arcs_are_exact() -> float:
    """Place and attitude after 10 s at constant rates."""
    level = UprightCoin(m=1.1, radius=0.7, I1=0.3, I3=0.4, g=9.5)
    exact = theory.roll_coin(
        10.0, radius=0.7, phi_rate=0.8, psi_rate=-1.1, phi=0.7, psi=-0.4, place=(0.3, 0.2)
    )
    start = level.state(
        q=level.attitude(0.7, -0.4), contact=(0.3, 0.2), steer_rate=0.8, roll_rate=-1.1
    )
    end = level.advance(start, None, 10.0, 100)
    return laws.max_abs(
        level.contact(end) - exact.place, laws.attitudes(end) - laws.matrices(exact.attitude)
    )


@SUBJECT.law(
    "simulate under constant torques with Fresnel's integrals", bound=1e-9, why=laws.RADIANS
)
def a_driven_coin_follows_its_closed_form() -> float:
    """Place and attitude on a level plane, steered and driven for 6 s."""
    level = UprightCoin(m=1.1, radius=0.7, I1=0.3, I3=0.4, g=9.5)
    t, torques = np.linspace(0.0, 6.0, 13), (0.2, -0.3)
    exact = theory.drive_coin(
        t,
        m=1.1,
        radius=0.7,
        i_perp=0.3,
        i3=0.4,
        torques=torques,
        phi_rate=0.6,
        psi_rate=1.1,
        phi=0.7,
        psi=-0.4,
        place=(0.3, 0.2),
    )
    start = level.state(
        q=level.attitude(0.7, -0.4), contact=(0.3, 0.2), steer_rate=0.6, roll_rate=1.1
    )
    motion = level.simulate(start, t, torques)
    return laws.max_abs(
        motion["contact"] - exact.place, motion["R"] - laws.matrices(exact.attitude)
    )


@SUBJECT.law("simulate on the slope with the closed form", bound=1e-9, why=laws.RADIANS)
def a_steered_coin_drifts_across_the_slope() -> float:
    """Place and speed while the heading turns at a constant rate: it never runs away downhill."""
    t, beta = np.linspace(0.0, 8.0, 17), 0.4 / (1.1 * 0.7**2)
    phi, steer, roll = 0.7, 1.3, 0.9
    exact = theory.steer_on_incline(
        t,
        **{"slope": 0.3, "beta": beta, "g": 9.5, "steering_rate": steer},
        **{"speed": 0.7 * roll, "heading": phi + math.pi},  # it heads for -(cos phi, sin phi)
    )
    start = _COIN.state(q=_COIN.attitude(phi, 0.2), steer_rate=steer, roll_rate=roll)
    motion = _COIN.simulate(start, t)
    return laws.max_abs(motion["contact"] - exact.place, 0.7 * motion["roll_rate"] - exact.speed)
