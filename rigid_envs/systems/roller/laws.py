"""Laws of a body that rolls on an incline or in a valley."""

import math

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.mechanics import laws
from rigid_envs.systems.roller import closed_forms as theory
from rigid_envs.systems.roller.system import Roller

SUBJECT = laws.Subject("roller", "a wheel that rolls on an incline or in a valley")

_ROLLER = Roller(m=1.1, radius=0.7, beta=0.45, g=9.5, slope=0.4, curvature=0.3, mu=0.6)
_BETA_CHANGE = 1  # of u
_Y, _U = laws.random_states(_ROLLER, 20)
_U[:, _BETA_CHANGE] = np.abs(_U[:, _BETA_CHANGE])  # inertia ratios are only increased
_FAR, _PUSHED = 4.0 * _Y, 4.0 * _U  # all round the circle
_FORCE, _BETA = _PUSHED[:, 0], 0.45 + _PUSHED[:, _BETA_CHANGE]
_UP = np.array([0.0, 1.0])


def _along(y: Array) -> Array:
    """Direction of the path, (x, z)."""
    descent = 0.4 - 0.3 * _ROLLER.arc_length(y)
    return np.stack([np.cos(descent), -np.sin(descent)], axis=-1)


@SUBJECT.law(
    "simulate with d'Alembert's principle",
    bound=1e-9,
    why="second differences in steps of 0.01 s: roundings 1e-14 / 1e-4, places of 10 m",
)
def motions_obey_dalemberts_principle() -> float:
    """(m x'' - m g) . dx + I turn'' dturn = force ds, with dturn = ds / r."""
    motion = laws.stencil(_ROLLER, _FAR, _PUSHED)
    push = 1.1 * (motion.acceleration(_ROLLER.place(motion.y)) + 9.5 * _UP)
    turn = _BETA * 1.1 * 0.7**2 * motion.acceleration(_ROLLER.turn(motion.y))
    return laws.max_abs(np.sum(push * _along(_FAR), axis=-1) + turn / 0.7 - _FORCE)


@SUBJECT.law(
    "velocity of the centre and turn of simulate with rolling", bound=1e-9, why=laws.SLOPES
)
def the_wheel_rolls() -> float:
    """The centre moves along its path at v, and the wheel turns at v / r."""
    motion = laws.stencil(_ROLLER, _FAR, _PUSHED)
    v = _ROLLER.velocity(_FAR)
    return laws.max_abs(
        motion.rate(_ROLLER.place(motion.y)) - v[:, None] * _along(_FAR),
        motion.rate(_ROLLER.turn(motion.y)) - v / 0.7,
    )


laws.laws_of_every_system(SUBJECT, _ROLLER, _FAR, _PUSHED)


@SUBJECT.law("invariants with T + m g z", bound=1e-12, why=laws.ten_roundings(100))
def the_invariant_is_the_energy() -> float:
    """E = (m v^2 + I (v / r)^2) / 2 + m g z, also where the path is straight."""
    errors = []
    for roller in (_ROLLER, Roller(m=1.1, radius=0.7, beta=0.45, g=9.5, slope=0.4)):
        kinetic = 0.5 * 1.1 * (1.0 + 0.45) * _ROLLER.velocity(_FAR) ** 2
        energy = kinetic + 1.1 * 9.5 * roller.place(_FAR)[:, 1]
        errors.append(roller.invariants(_FAR)["energy"] - energy)
    errors.append(_ROLLER.invariants(np.array([0.0, 2.0]))["energy"] - 1.1 * 1.45 * 2.0)
    return laws.max_abs(*errors)


@SUBJECT.law(
    "rhs with sines of NumPy, up to a million radians", bound=4 * laws.EPS, why=laws.ROUNDED
)
def gravity_pulls_by_the_sine_of_any_descent() -> float:
    """A block without inertia on a circle of radius 1, g = 1: the rate of v is sin(-s)."""
    block = Roller(m=1.0, radius=1.0, beta=0.0, g=1.0, curvature=1.0)
    small, large = np.linspace(-10.0, 10.0, 2001), np.geomspace(10.0, 1e6, 2001)
    s = np.concatenate([small, large, -large])
    y = np.stack([s, np.zeros_like(s)], axis=-1)
    return laws.max_abs(block.rhs(y)[:, 1] - np.sin(-s))


laws.law_of_order(SUBJECT, _ROLLER, _Y, _U, 2.5)


@SUBJECT.law(
    "contact_force with what Newton's law lacks",
    bound=1e-8,
    why="as for d'Alembert's principle",
)
def the_contact_force_makes_the_balance() -> float:
    """C = m x'' - m g - force, and r times its part along the path turns the wheel back."""
    motion, along = laws.stencil(_ROLLER, _FAR, _PUSHED), _along(_FAR)
    force = 1.1 * (motion.acceleration(_ROLLER.place(motion.y)) + 9.5 * _UP)
    force -= _FORCE[:, None] * along
    turn = _BETA * 1.1 * 0.7**2 * motion.acceleration(_ROLLER.turn(motion.y))
    friction, normal = np.moveaxis(_ROLLER.contact_force(_FAR, _PUSHED), -1, 0)
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    found = friction[:, None] * along + normal[:, None] * across
    return laws.max_abs(found - force, turn + 0.7 * friction)


@SUBJECT.law(
    "simulate down an incline with the closed form",
    bound=1e-12,
    why="steps are exact there: some hundred roundings",
)
def races_are_won_by_the_smaller_inertia() -> float:
    """v^2 = 2 g h / (1 + beta) after sinking by h, at the time of the theory, for four bodies."""
    errors = []
    for beta in (0.4, 0.5, 2.0 / 3.0, 1.0):
        way = 1.2 / math.sin(0.3)
        end = theory.descend(1.2, slope=0.3, beta=beta, radius=0.7, g=9.5)
        motion = Roller(m=1.1, radius=0.7, beta=beta, g=9.5, slope=0.3).simulate(
            (0.0, 0.0), [0.0, end.time]
        )
        errors.append(motion.y[-1] - [way, end.speed])
    return laws.max_abs(*errors)


@SUBJECT.law(
    "simulate through a valley with elliptic functions",
    bound=1e-8,
    why="1e-11 per radian, some 30 radians, times places of 100 m",
)
def rolling_pendulums_follow_jacobi() -> float:
    """Place and velocity of what swings and of what runs round, counted from the bottom."""
    t, bottom, errors = np.linspace(0.0, 15.0, 31), 0.4 / 0.3, []
    for s, v in ((2.0, -1.0), (0.1, 6.0), (-3.0, 20.0)):
        motion = _ROLLER.simulate((bottom + s, v), t)
        place, speed = theory.valley(t, s, v, curvature=0.3, beta=0.45, g=9.5)
        errors += [motion["arc_length"] - bottom - place, motion["velocity"] - speed]
    return laws.max_abs(*errors)
