"""Laws of the rolling ball with inertia on a plate that tilts or rotates."""

import math

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import laws
from rigid_envs.systems.dynamic_ball import closed_forms as theory
from rigid_envs.systems.dynamic_ball.system import DynamicBall

SUBJECT = laws.Subject(
    "dynamic_ball", "a ball with inertia that rolls on a plate that tilts and turns"
)

_BALL = DynamicBall(m=1.2, radius=0.8, beta=0.55, g=9.6, turntable_rate=0.7)
_INERTIA = 0.55 * 1.2 * 0.8**2
_FORCE, _TILT_ACCELERATION = slice(0, 2), slice(2, 4)  # of u
_Y, _U = laws.random_states(_BALL, 20)


def _plate(y: Array) -> Array:
    """P = Rx(alpha_x) Ry(alpha_y)."""
    half = 0.5 * _BALL.tilt(y)
    (cx, cy), (sx, sy) = np.moveaxis(np.cos(half), -1, 0), np.moveaxis(np.sin(half), -1, 0)
    return laws.matrices(np.stack([cx * cy, sx * cy, cx * sy, sx * sy], axis=-1))


def _world(y: Array, v: Array) -> Array:
    return np.asarray(np.einsum("...ij,...j->...i", _plate(y), v))


def _normal(y: Array) -> Array:
    return np.array(_plate(y)[..., :, 2])


def _centre(y: Array) -> Array:
    return _world(y, laws.horizontal(_BALL.position(y))) + 0.8 * _normal(y)


def _force(y: Array, u: Array) -> Array:
    return np.asarray(_world(y, laws.horizontal(u[..., _FORCE])) - np.array([0.0, 0.0, 1.2 * 9.6]))


_MODEL = laws.RigidBodyModel(
    *(1.2, np.full(3, _INERTIA), _centre, _force),
    laws.constant(0.0, 0.0, 0.0),
    laws.turns_about(lambda y: 0.8 * _normal(y)),
)
laws.law_of_dalembert(SUBJECT, _BALL, _Y, _U, _MODEL)


@SUBJECT.law(
    "velocity of the contact point of simulate with that of the plate",
    bound=1e-10,
    why=laws.SLOPES,
)
def the_contact_point_moves_with_the_plate() -> float:
    """There v + omega x (-r n) = (P x)' + Omega n x P x with x = (X, Y, 0) held in P."""
    motion = laws.stencil(_BALL, _Y, _U)
    v = motion.rate(_centre(motion.y)) + np.cross(motion.omega(), -0.8 * _normal(_Y))
    foot = laws.horizontal(_BALL.position(_Y))
    carried = motion.rate(_world(motion.y, np.broadcast_to(foot, (9, 20, 3))))
    table = 0.7 * np.cross(_normal(_Y), _world(_Y, foot))
    return laws.max_abs(v - carried - table)


laws.laws_of_every_system(SUBJECT, _BALL, _Y, _U)


@SUBJECT.law("invariants with T + m g z of NumPy", bound=1e-12, why=laws.ten_roundings(50))
def invariants_are_energy_and_spin() -> float:
    """E = (m v^2 + I omega^2) / 2 + m g z on a plate that leans but rests."""
    ball = DynamicBall(m=1.2, radius=0.8, beta=0.55, g=9.6)
    v, spin = _BALL.velocity(_Y), _BALL.spin(_Y)
    turning = np.sum((v / 0.8) ** 2, axis=-1) + spin**2
    kinetic = 0.5 * (1.2 * np.sum(v * v, axis=-1) + _INERTIA * turning)
    found = ball.invariants(_Y)
    return laws.max_abs(
        found["energy"] - kinetic - 1.2 * 9.6 * _centre(_Y)[:, 2], found["spin"] - spin
    )


@SUBJECT.law(
    "rate of the invariants of simulate with 0",
    bound=1e-9,
    why="as for rhs, times momenta up to 10 N s",
)
def invariants_are_kept_on_a_turntable_that_leans() -> float:
    """On a plate that leans at rest; its surface turns."""
    y = _Y.copy()
    y[:, _BALL.components["tilt_rate"]] = 0.0
    motion = laws.stencil(_BALL, y, np.zeros((20, 4)))
    return laws.max_abs(*(motion.rate(value) for value in _BALL.invariants(motion.y).values()))


@SUBJECT.law(
    "rhs with cosines of NumPy, up to a million radians", bound=4 * laws.EPS, why=laws.ROUNDED
)
def gravity_pulls_by_the_cosine_of_any_angle() -> float:
    """X'' = g cos(alpha_x) sin(alpha_y) with alpha_y a right angle, of a ball without inertia."""
    ball = DynamicBall(m=1.0, radius=1.0, beta=0.0, g=1.0)
    small, large = np.linspace(-10.0, 10.0, 2001), np.geomspace(10.0, 1e6, 2001)
    alpha = np.concatenate([small, large, -large])
    y = ball.state(tilt=np.stack([alpha, np.full_like(alpha, 0.5 * math.pi)], axis=-1))
    return laws.max_abs(ball.velocity(ball.rhs(y))[:, 0] - np.cos(alpha))


@SUBJECT.law("simulate with uniform acceleration", bound=1e-12, why=laws.HUNDREDS)
def the_plate_moves_as_it_is_told() -> float:
    """Both angles of the plate are parabolas in time."""
    t, a, rate = 0.7, _U[:, _TILT_ACCELERATION], _BALL.tilt_rate(_Y)
    end = _BALL.simulate(_Y, [0.0, t], _U[None]).y[-1]
    angles = _BALL.tilt(_Y) + t * rate + 0.5 * t * t * a
    return laws.max_abs(_BALL.tilt(end) - angles, _BALL.tilt_rate(end) - rate - t * a)


laws.law_of_order(SUBJECT, _BALL, _Y, _U, 0.5)
laws.law_of_contact_force(
    SUBJECT,
    *(_BALL, _Y, _U, _MODEL),
    lambda y, u: (_world(y, _BALL.contact_force(y, u)), -0.8 * _normal(y)),
)


@SUBJECT.law(
    "advance in steps of 0.05 s with exp(i k Omega t)",
    bound=1e-12,
    why="roundings of some thousand turns: a kick is the exact turn",
)
def turntables_turn_the_velocity_exactly() -> float:
    """V' = k Omega n x V with k = beta / (1 + beta), at any step, for 10 s."""
    ball = DynamicBall(m=1.2, radius=0.8, beta=0.55, g=0.1, turntable_rate=2.0)
    v = 0.3 * _BALL.velocity(_Y)
    end = ball.advance(ball.state(velocity=v), None, 10.0, 200)
    turned = np.exp(10.0j * 0.55 / 1.55 * 2.0) * (v[:, 0] + 1j * v[:, 1])
    return laws.max_abs(ball.velocity(end) - np.stack([turned.real, turned.imag], axis=-1))


@SUBJECT.law(
    "simulate with trochoids",
    bound=1e-9,
    why="1e-11 per radian, some 50 radians, times places of 10 m",
)
def balls_on_a_leaning_turntable_follow_trochoids() -> float:
    """Centre, velocity and angular velocity on a turntable that leans by 0.2 rad about x."""
    t, errors = np.linspace(0.0, 8.0, 17), []
    for y in _Y[:5]:
        start = y.copy()
        start[_BALL.components["tilt"]], start[_BALL.components["tilt_rate"]] = (0.2, 0.0), 0.0
        exact = theory.roll_on_plate(
            t,
            *(_BALL.position(start), _BALL.omega_world(start)),
            **{"beta": 0.55, "radius": 0.8, "turntable_rate": 0.7, "tilt": 0.2, "g": 9.6},
        )
        motion = _BALL.simulate(start, t)
        errors += [
            motion["centre"] - exact.centre,
            motion["velocity_world"] - exact.velocity,
            motion["omega_world"] - exact.omega,
        ]
    return laws.max_abs(*errors)


@SUBJECT.law(
    "simulate round the axis of a turntable with two rotations in closed form",
    bound=1e-9,
    why=laws.RADIANS,
)
def a_ball_round_the_axis_turns_as_in_closed_form() -> float:
    """Place and attitude of a ball that runs round the middle of a level turntable."""
    t, rate = np.linspace(0.0, 20.0, 21), 0.55 / 1.55 * 0.7
    exact, turn = theory.roll_round_axis(
        t,
        **{"circle_radius": 1.3, "phase": 0.4, "spin": 0.6, "beta": 0.55, "radius": 0.8},
        turntable_rate=0.7,
    )
    place = 1.3 * np.array([math.cos(0.4), math.sin(0.4)])
    start = _BALL.state(
        q=laws.quaternion(_Y[0]),
        position=place,
        velocity=rate * np.array([-place[1], place[0]]),
        spin=0.6,
    )
    motion = _BALL.simulate(start, t)
    R = laws.matrices(turn) @ laws.attitudes(_Y[0])
    return laws.max_abs(motion["centre"] - exact.centre, motion["R"] - R)
