"""Theoretical limits of metrics: optima and bounds from each start, in closed form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.control.grid import QuarterRolls
from rigid_envs.control.momentum import MomentumRegulator
from rigid_envs.control.slewing import slew_acceleration
from rigid_envs.envs import RigidVectorEnv
from rigid_envs.registry import ENVIRONMENTS, load
from rigid_envs.systems import UprightCoin

__all__ = [
    "BALL_PATH",
    "BALL_STEER_ERROR",
    "COIN_PATH",
    "DETUMBLE_LOSS",
    "DETUMBLE_TIME",
    "GRID_PATH",
    "GRID_TIME",
    "PUSHED_BALL_TIME",
    "REORIENT_TIME",
    "ROLL_PUMP_TIME",
    "TheoreticalLimit",
    "least_time",
    "limit_of",
]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class TheoreticalLimit:
    """Best value of a metric that theory allows.

    Attributes:
        kind: "exact", the optimum, or a "bound", which may be out of reach.
        text: Formula or reason.
        values: Value of every start, shape (N,), of rows that have just begun.
    """

    kind: Literal["exact", "bound"]
    text: str
    values: Callable[[RigidVectorEnv], Array]


def least_time(length: Array, acceleration: npt.ArrayLike, speed: npt.ArrayLike) -> Array:
    """Least time [s] over a length from rest to a speed of at most w: 2 sqrt(A / a) - w / a.

    The speed is ``a t`` at most, and ``w + a t`` at most at the time t before the end; the area
    under the smaller of the two is ``a (T + w / a)^2 / 4 - w^2 / (2 a)``, so that
    ``A = length + w^2 / (2 a)``. A length below ``w^2 / (2 a)`` is run through without braking.

    Args:
        length: Lengths [m or rad], shape (...).
        acceleration: Largest acceleration a.
        speed: Largest speed w at the end.
    """
    a, w = np.asarray(acceleration, dtype=np.float64), np.asarray(speed, dtype=np.float64)
    braked = 2.0 * np.sqrt((length + 0.5 * w * w / a) / a) - w / a
    return np.asarray(np.where(length > 0.5 * w * w / a, braked, np.sqrt(2.0 * length / a)))


def _rows(envs: RigidVectorEnv, name: str) -> Array:
    """A parameter of the system of every row, shape (N,)."""
    return np.array([getattr(system, name) for system in envs.systems])


def _roll(envs: RigidVectorEnv) -> Array:
    """Least length [m] of a path of a ball from its pose to within tolerance of its goal."""
    task: Any = envs.task
    home = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    goal = envs.auxiliary(*task.aux_names) if task.n_goal else home
    y = envs.y
    distance = np.linalg.norm(y[:, 4:6] - goal[..., 4:6], axis=-1) - task.position_tolerance
    angle = rotations.distance(y[:, :4], goal[..., :4]) - task.angle_tolerance
    return np.asarray(np.maximum(np.maximum(distance, _rows(envs, "radius") * angle), 0.0))


def _push(envs: RigidVectorEnv) -> Array:
    """Least time [s] to push a ball along the length of `_roll`, with its inertia."""
    task: Any = envs.task
    inertia = _rows(envs, "m") * (1.0 + _rows(envs, "beta"))
    return least_time(_roll(envs), task.force / inertia, task.speed_tolerance)


def _coin(envs: RigidVectorEnv) -> Array:
    """Least length [m] of a path of a coin to within tolerance of place and phase."""
    task: Any = envs.task
    distance = np.hypot(envs.y[:, 4], envs.y[:, 5]) - task.position_tolerance
    roll = _rows(envs, "radius") * (np.abs(UprightCoin().phase(envs.y)) - task.phase_tolerance)
    return np.asarray(np.maximum(np.maximum(distance, roll), 0.0))


def _turn(envs: RigidVectorEnv) -> Array:
    """Least time [s] of a turn from rest to within tolerance of the goal.

    With e = sqrt(2 T / I_min), which is at least the rate, ``|e'| <= a`` (`slew_acceleration`); at
    the end it is sqrt(I_max / I_min) times the tolerated rate at most.
    """
    task: Any = envs.task
    moments = np.stack([_rows(envs, name) for name in ("I1", "I2", "I3")])
    angle = (
        rotations.distance(envs.y[:, :4], envs.auxiliary(*task.aux_names)) - task.angle_tolerance
    )
    rate = np.sqrt(moments.max(axis=0) / moments.min(axis=0)) * task.rate_tolerance
    return least_time(np.maximum(angle, 0.0), slew_acceleration(moments, task.torque), rate)


def _momentum(envs: RigidVectorEnv) -> Array:
    """|L| [N m s]."""
    return np.array(
        [
            np.linalg.norm(system.L_body(y))  # type: ignore[attr-defined]
            for system, y in zip(envs.systems, envs.y, strict=True)
        ]
    )


def _impulses(envs: RigidVectorEnv) -> Array:
    """Least number of largest impulses until |L| is within tolerance, as a time [s]."""
    task: Any = envs.task
    rest = _momentum(envs) - task.tolerance * task.start_momentum
    return np.asarray(task.dt * np.maximum(np.ceil(rest / task.impulse), 1.0))


def _riccati(envs: RigidVectorEnv) -> Array:
    """Loss of the optimal law over an infinite horizon; after 50 steps 1e-7 of it is left."""
    task: Any = envs.task
    law = MomentumRegulator(
        task.system(),
        task.impulse,
        task.weight_momentum / task.start_momentum**2,
        task.weight_impulse / task.impulse**2,
    )
    return law.riccati * _momentum(envs) ** 2


def _zero(envs: RigidVectorEnv) -> Array:
    return np.zeros(envs.num_envs)


def _moves(envs: RigidVectorEnv) -> Array:
    """Fewest quarter rolls home; a ball that is home already rolls out and back."""
    task: Any = envs.task
    moves = QuarterRolls(task.system(), task.start_cells).moves(envs.y)
    return np.where(moves == 0, 2.0, moves)


def _rolled(envs: RigidVectorEnv) -> Array:
    return np.asarray(0.5 * np.pi * _rows(envs, "radius") * _moves(envs))


def _moved(envs: RigidVectorEnv) -> Array:
    return np.asarray(envs.task.dt * _moves(envs))


def _pump(envs: RigidVectorEnv) -> Array:
    task: Any = envs.task
    return np.asarray(task.lower_bound(envs.y))


DETUMBLE_LOSS = TheoreticalLimit("exact", "the root of the scalar Riccati equation", _riccati)
DETUMBLE_TIME = TheoreticalLimit("exact", "|L| over the largest impulse, rounded up", _impulses)
REORIENT_TIME = TheoreticalLimit(
    "bound", "2 sqrt(angle / a), a the largest angular acceleration, less tolerances", _turn
)
BALL_PATH = TheoreticalLimit("bound", "max(distance, radius angle), less the tolerances", _roll)
PUSHED_BALL_TIME = TheoreticalLimit(
    "bound", "2 sqrt(length (1 + beta) m / F), less the tolerances", _push
)
BALL_STEER_ERROR = TheoreticalLimit("bound", "no error; feasible from no offset only", _zero)
GRID_PATH = TheoreticalLimit("exact", "the fewest moves, by breadth-first search", _rolled)
GRID_TIME = TheoreticalLimit("exact", "the fewest moves, by breadth-first search", _moved)
ROLL_PUMP_TIME = TheoreticalLimit("bound", "(n - 1/2) half swings, n the least passes", _pump)
COIN_PATH = TheoreticalLimit("bound", "max(distance, radius |phase|), less tolerances", _coin)


def limit_of(env_id: str, metric: str) -> TheoreticalLimit | None:
    """The theoretical limit of a metric of an id; None where none is known."""
    name = ENVIRONMENTS[env_id].limits.get(metric)
    limit: TheoreticalLimit | None = None if name is None else load(name)
    return limit
