"""What success asks of a motion: errors, each a vector, that must stay within their tolerances.

A norm alone would not do: its derivative knows one direction only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.core import Core
from rigid_envs.systems import UprightCoin
from rigid_envs.tasks import Task

__all__ = ["Conditions", "conditions_of", "first_steps"]

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

_SHARPNESS = 10.0  # of the reward terms 1 / (1 + 10 error)
_ROUNDING = 1e-9  # of times, in control periods


@dataclass(frozen=True)
class Conditions:
    """Conditions of success of a task.

    Attributes:
        components: Of the state, those that the conditions depend on, now or later.
        errors: Function of rows that have just stepped to their errors, each over its tolerance,
            of shapes (N, q): a step counts as success where no norm is above 1.
        coordinates: Function of these components, shape (N, n), to as few numbers as the conditions
            need, shape (N, p); by default the components themselves.
        n_parts: Parts of the time of success whose largest errors are looked at. An error that
            grows is looked at in few places: its derivatives are much the same in all of them.
    """

    components: tuple[str, ...]
    errors: Callable[[Core], list[Array]]
    coordinates: Callable[[Array], Array] = np.asarray
    n_parts: int = 1


def conditions_of(task: Task) -> Conditions:
    """The conditions of a task.

    Raises:
        ValueError: None are declared.
    """
    for kind in type(task).__mro__:
        if kind.__name__ in _CONDITIONS:
            return _CONDITIONS[kind.__name__]
    raise ValueError(f"task = {type(task).__name__}; expected one of {sorted(_CONDITIONS)}")


def first_steps(core: Core, n_steps: int) -> Integers:
    """Number of the first step from which on conditions must hold, shape (N,), of rows at a start.

    Args:
        core: The rows.
        n_steps: Number of steps of a plan, the last of which is the last that must hold.
    """
    task: Any = core.task
    if "time_left" in task.aux_names:
        due: Integers = np.ceil(core.auxiliary("time_left") / task.dt - _ROUNDING).astype(np.int64)
        return due
    held = max(1, round(getattr(task, "hold", 0.0) / task.dt))
    return np.full(core.n_rows, n_steps - held + 1)


def _pose(y: Array, goal: Array | None, task: Any) -> list[Array]:
    """Offset and rotation vector from a goal, or from the origin, upright."""
    q, place = y[:, :4], y[:, 4:6]
    if goal is not None:
        q = rotations.multiply(q, rotations.conjugate(goal[:, :4]))
        place = place - goal[:, 4:6]
    return [place / task.position_tolerance, rotations.log(q) / task.angle_tolerance]


def _parked(core: Core) -> list[Array]:
    goal = core.auxiliary(*core.task.aux_names) if core.task.n_goal else None
    return _pose(core.y, goal, core.task)


def _stopped(core: Core) -> list[Array]:
    task: Any = core.task
    y = core.y
    return [*_pose(y, None, task), y[:, 6:8] / task.speed_tolerance]


def _coin_parked(core: Core) -> list[Array]:
    task: Any = core.task
    y, coin = core.y, UprightCoin()
    return [
        y[:, 4:6] / task.position_tolerance,
        coin.heading(y)[:, None] / task.heading_tolerance,
        coin.phase(y)[:, None] / task.phase_tolerance,
    ]


def _turned(core: Core) -> list[Array]:
    task: Any = core.task
    y, goal = core.y, core.auxiliary(*core.task.aux_names)
    off = rotations.log(rotations.multiply(rotations.conjugate(goal), y[:, :4]))
    return [off / task.largest_angle, y[:, 4:] / task.rate_tolerance]


def _spin(sense: float) -> Callable[[Core], list[Array]]:
    """The error of the spin from the rate Omega about e2, or about -e2."""

    def errors(core: Core) -> list[Array]:
        task: Any = core.task
        goal = np.array([0.0, sense * task.spin_rate, 0.0])
        return [(core.y[:, 4:] - goal) / (task.tolerance * task.spin_rate)]

    return errors


def _axis(core: Core) -> list[Array]:
    """The angle of the spin from e2 in two directions."""
    task: Any = core.task
    omega = core.y[:, 4:]
    across = omega[:, [0, 2]]
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    angle = np.arctan2(length, omega[:, 1:2])
    return [angle / task.tolerance * across / np.maximum(length, 1e-300)]


def _tilt(q: Array) -> Array:
    """The angle of the turned e3 from e3 in two directions [rad], shape (N, 2)."""
    axis = rotations.rotate(q, np.array([0.0, 0.0, 1.0]))
    length = np.linalg.norm(axis[:, :2], axis=-1, keepdims=True)
    return np.asarray(np.arctan2(length, axis[:, 2:]) * axis[:, :2] / np.maximum(length, 1e-300))


def _upright(core: Core) -> list[Array]:
    task: Any = core.task
    return [_tilt(core.y[:, :4]) / task.tolerance]


def _upright_in_body(core: Core) -> list[Array]:
    """The tilt as the vertical has it in the body, which no heading changes."""
    task: Any = core.task
    return [_tilt(rotations.conjugate(core.y[:, :4])) / task.tolerance]


def _balanced(core: Core) -> list[Array]:
    task: Any = core.task
    y = core.y
    return [_tilt(y[:, :4]) / task.tilt_tolerance, y[:, 7:9] / task.centre_tolerance]


def _precessing(core: Core) -> list[Array]:
    """Tilt and rate of precession off their goals; sizes from the terms, signs as observed."""
    task: Any = core.task
    shown = dict(zip(task.terms, core.results[1:], strict=False))
    tilt, rate = (1.0 / np.maximum(shown[name], 1e-300) - 1.0 for name in ("tilt", "rate"))
    signs = np.sign(core.observations[:, 3:5] - core.observations[:, 5:7]).T
    scale = _SHARPNESS * task.tolerance
    off = signs[0] * tilt / (scale * core.auxiliary("goal_tilt"))
    return [off[:, None], (signs[1] * rate / scale)[:, None]]


def _in_space(y: Array) -> Array:
    """Of a symmetric top whatever its phase: the axis, omega and the pivot in world axes."""
    q = rotations.normalize(y[:, :4])
    axis = rotations.rotate(q, np.array([0.0, 0.0, 1.0]))[:, :2]
    return np.concatenate([axis, rotations.rotate(q, y[:, 4:7]), y[:, 7:]], axis=1)


def _in_body(y: Array) -> Array:
    """Of a top whatever its heading: the vertical and omega in body axes."""
    q = rotations.conjugate(rotations.normalize(y[:, :4]))
    up = rotations.rotate(q, np.array([0.0, 0.0, 1.0]))[:, :2]
    return np.concatenate([up, y[:, 4:7]], axis=1)


_ATTITUDE, _RATES = ("w", "x", "y", "z"), ("omega1", "omega2", "omega3")
_POSE, _TOP = (*_ATTITUDE, "X", "Y"), (*_ATTITUDE, *_RATES)
_CONDITIONS = {
    "BallPark": Conditions(_POSE, _parked),
    "BallParkGoal": Conditions(_POSE, _parked),
    "BallParkDynamic": Conditions((*_POSE, "VX", "VY"), _stopped),
    "CoinPark": Conditions(_POSE, _coin_parked),
    "Reorient": Conditions((*_ATTITUDE, *_RATES), _turned),
    "IntermediateAxis": Conditions(_RATES, _spin(1.0)),
    "IntermediateAxisSingle": Conditions(_RATES, _axis),
    "SpinCapture": Conditions(_RATES, _spin(1.0)),
    "AxisFlip": Conditions(_RATES, _spin(-1.0)),
    "SleepingTop": Conditions(_TOP, _upright, _in_space),
    "TopRandom": Conditions(_TOP, _upright_in_body, _in_body),
    "TopPrecession": Conditions(_TOP, _precessing, _in_body, 10),
    "PivotTop": Conditions((*_TOP, "X", "Y", "VX", "VY"), _balanced, _in_space),
}
