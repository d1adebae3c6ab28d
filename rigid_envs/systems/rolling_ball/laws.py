"""Laws of the kinematic rolling ball, whose velocity is the input."""

import math

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import laws
from rigid_envs.systems.rolling_ball import closed_forms as theory
from rigid_envs.systems.rolling_ball.system import RollingBall

SUBJECT = laws.Subject("rolling_ball", "a ball that rolls without slip, its velocity given")

_BALL = RollingBall(0.7)
_Y, _U = laws.random_states(_BALL, 20)
_Q = _BALL.components["q"]


@SUBJECT.law(
    "velocity of the contact point of simulate with 0",
    bound=1e-11,
    why="differences of order 8 in steps of 0.01 s: roundings 1e-15 / 0.01",
)
def the_contact_point_is_at_rest() -> float:
    """V + omega x (-r e_z) = 0, omega from R' R^T; v and omega_z are what was asked for."""
    motion = laws.stencil(_BALL, _Y, _U)
    omega = motion.omega()
    v = motion.rate(_BALL.position(motion.y))
    contact = np.pad(v, ((0, 0), (0, 1))) + np.cross(omega, [0.0, 0.0, -_BALL.radius])
    return laws.max_abs(contact, np.concatenate([v, omega[:, 2:]], axis=-1) - _U)


laws.laws_of_every_system(SUBJECT, _BALL, _Y, _U)


@SUBJECT.law(
    "invariants with the squared length of q",
    bound=8 * laws.EPS,
    why="some roundings of a number near 1",
)
def the_invariant_is_the_length_of_the_quaternion() -> float:
    """|q|^2, of quaternions up to 1e-6 away from unit ones."""
    y = _Y.copy()
    y[:, _Q] *= np.linspace(1.0 - 9e-7, 1.0 + 9e-7, 20)[:, None]
    return laws.max_abs(_BALL.invariants(y)["q_squared"] - np.linalg.norm(y[:, _Q], axis=-1) ** 2)


@SUBJECT.law(
    "advance from quaternions that are not quite unit ones with unit ones",
    bound=2e-12,
    why="one step of Newton's: 1.5 e^2 is left of an error e of 1e-6",
)
def quaternions_are_kept_unit() -> float:
    """|q| after one step from |q| = 1 -+ 9e-7, and the attitude that belongs to it."""
    y = _Y.copy()
    y[:, _Q] *= np.linspace(1.0 - 9e-7, 1.0 + 9e-7, 20)[:, None]
    found, expected = _BALL.advance(y, _U, 0.5), _BALL.advance(_Y, _U, 0.5)
    return laws.max_abs(np.linalg.norm(found[:, _Q], axis=-1) - 1.0, found[:, _Q] - expected[:, _Q])


@SUBJECT.law(
    "a step of advance with the rotation by an exact quarter turn",
    bound=4 * laws.EPS,
    why="roundings: the polynomials are exact to one over a quarter turn",
)
def a_step_of_a_quarter_turn_is_exact() -> float:
    """R = exp([omega] h), about 1000 axes, with cosines and sines of NumPy."""
    v = np.random.default_rng(4).normal(size=(1000, 3))
    ball = RollingBall(1.0)
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    h = 0.5 * math.pi * (1.0 - 4.0 * laws.EPS)
    omega = np.stack([-v[:, 1], v[:, 0], v[:, 2]], axis=-1)
    exact = np.pad(math.sin(0.5 * h) * omega, ((0, 0), (1, 0)), constant_values=math.cos(0.5 * h))
    return laws.max_abs(ball.advance(ball.state(), v, h)[:, _Q] - exact)


@SUBJECT.law(
    "advance in a million quarter turns with the rotation about the same axis",
    bound=1e6 * laws.EPS,
    why="the angle of every step is rounded the same way: a million times eps at most",
)
def a_million_quarter_turns_add_up() -> float:
    """The angle turned about a fixed axis, 1.5e6 rad: what is wrong in every step adds up."""
    ball, n = RollingBall(1.0), 2**20  # a power of two: n h is exact
    angle = n * 0.5 * math.pi * (1.0 - 4.0 * laws.EPS)
    end = ball.advance(ball.state(), (0.6, 0.0, 0.8), angle, n)
    axis = np.array([0.0, 0.6, 0.8])
    return laws.max_abs(end[_Q] - [math.cos(0.5 * angle), *(math.sin(0.5 * angle) * axis)])


@SUBJECT.law(
    "simulate with products of straight rolls",
    bound=1e-13,
    why="steps are exact: roundings of some hundred turns",
)
def rolls_along_segments_follow_their_closed_form() -> float:
    """Place and attitude after ten velocities and spins, each held for 0.7 s."""
    u = np.random.default_rng(5).uniform(-1.0, 1.0, (10, 3))
    t = 0.7 * np.arange(11)
    segments = np.column_stack([u, np.full(10, 0.7)])
    way, turn = theory.roll_segments(np.minimum(t, segments[:, 3].sum()), segments, _BALL.radius)
    motion = _BALL.simulate(_Y[0], t, u)
    R = laws.matrices(turn) @ laws.attitudes(_Y[0])
    return laws.max_abs(motion["position"] - _BALL.position(_Y[0]) - way, motion["R"] - R)


@SUBJECT.law(
    "simulate, its velocity a function of time, with two rotations in closed form",
    bound=1e-10,
    why="2000 steps of fourth order, 0.01 rad each",
)
def rolls_round_a_circle_follow_their_closed_form() -> float:
    """Place and attitude at eleven moments of a round and a half, with spin."""
    rho, rate, phase, spin = 0.9, 2.0, 0.4, 0.3
    t = np.linspace(0.0, 4.5, 11)
    place, turn = theory.roll_circle(
        t, radius=0.7, circle_radius=rho, rate=rate, phase=phase, spin=spin
    )

    def velocity(s: float) -> tuple[float, float, float]:
        angle = phase + rate * s
        return (-rho * rate * math.sin(angle), rho * rate * math.cos(angle), spin)

    start = _BALL.state(q=_Y[0, _Q], position=place[0])
    motion = _BALL.simulate(start, t, velocity)
    R = laws.matrices(turn) @ laws.attitudes(_Y[0])
    return laws.max_abs(motion["position"] - place, motion["R"] - R)


@SUBJECT.law(
    "simulate round closed squares with -A / r^2",
    bound=2e-3,
    why="the leading term of the holonomy: the next is one order of the side, 1e-3 r, higher",
)
def small_loops_turn_the_ball_by_their_area() -> float:
    """Turn about the vertical after a square, counter-clockwise and clockwise, over its area."""
    side = 1e-3 * _BALL.radius
    errors = []
    for sense in (1.0, -1.0):
        u = side * np.array([(1, 0, 0), (0, sense, 0), (-1, 0, 0), (0, -sense, 0)])
        R = _BALL.simulate(_BALL.state(), np.arange(5.0), u)["R"][-1]
        turn = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2.0
        errors.append(turn / 1e-6 + [0.0, 0.0, sense])
    return laws.max_abs(*errors)


@SUBJECT.law(
    "brackets of the fields of linearize with the growth vector (2, 3, 5)",
    bound=1e-12,
    why="some ten roundings: the fields are linear in q, their slopes exact",
)
def rolling_brackets_reach_every_direction() -> float:
    """[X1, X2] is spin by -1 / r^2; with [X1, [X1, X2]] and [X2, [X1, X2]] the rank is 5."""
    y = _Y[0]
    left = _BALL.linearize(y, np.eye(3))[0]  # rhs is linear in q, and free of the position
    moves = np.pad(np.eye(3)[:, :2], ((0, 0), (4, 0)))

    def bracket(f: tuple[Array, Array], g: tuple[Array, Array]) -> tuple[Array, Array]:
        """Of the affine fields y -> A y + b: [f, g] = Dg f - Df g."""
        return g[0] @ f[0] - f[0] @ g[0], g[0] @ f[1] - f[0] @ g[1]

    x1, x2, spin = ((left[k], moves[k]) for k in range(3))
    x12 = bracket(x1, x2)
    fields = [x1, x2, x12, bracket(x1, x12), bracket(x2, x12)]
    rows = np.array([A @ y + b for A, b in fields])
    if np.linalg.matrix_rank(rows, tol=1e-6) != 5:
        return math.inf
    return laws.max_abs(x12[0] @ y + x12[1] + (spin[0] @ y) / _BALL.radius**2)
