"""Moments between the steps of an episode, so that motion is smooth and its paths are curves.

Only pictures are made from them. A step that turns the body further than half a turn is resolved by
its angular velocity. All other numbers change linearly within a step.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.moment import Moment
from rigid_envs.replays.episode import Episode
from rigid_envs.systems import System
from rigid_envs.tasks import Task

__all__ = ["moments"]

Array = npt.NDArray[np.float64]

_PERIOD = 0.04  # s between moments, at most
_TURN = 0.4  # rad between moments, at most
_MOST = 24  # moments in a step


def moments(task: Task, episode: Episode, budget: int) -> list[Moment]:
    """Moments of an episode and between, in order; those of the steps are exact.

    Args:
        task: Its task.
        episode: The episode.
        budget: How many there may be; there are never fewer than T + 1.
    """
    system = task.system(episode.parameters)
    turns = _turns(system, episode)
    angle = float(np.max(np.linalg.norm(turns, axis=-1), initial=0.0))
    wanted = max(math.ceil(task.dt / _PERIOD), math.ceil(angle / _TURN))
    n = max(1, min(wanted, _MOST, budget // max(len(episode), 1)))
    found = [episode.moment(0, task)]
    for k in range(len(episode)):
        before, after = episode.moment(k, task), episode.moment(k + 1, task)
        found += [_between(task, before, after, turns[k], j / n) for j in range(1, n)]
        found.append(after)
    return found


def _turns(system: System, episode: Episode) -> Array:
    """Rotation vector of every step in world axes [rad], shape (T, 3).

    Of those that lead from one attitude to the next, the nearest to the angular velocity times the
    duration.
    """
    if "q" not in system.components:
        return np.zeros((len(episode), 3))
    q = rotations.normalize(episode.y[:, :4])
    short = rotations.log(rotations.multiply(q[1:], rotations.conjugate(q[:-1])))
    expected = _omega_world(system, episode) * np.diff(episode.times)[:, None]
    angle = np.linalg.norm(short, axis=-1, keepdims=True)
    size = np.linalg.norm(expected, axis=-1, keepdims=True)
    along = np.where(angle > 1e-9, short, expected) / np.where(angle > 1e-9, angle, size + 1e-300)
    excess = np.sum(expected * along, axis=-1, keepdims=True) - angle
    turns: Array = short + 2.0 * np.pi * np.round(excess / (2.0 * np.pi)) * along
    return turns


def _omega_world(system: System, episode: Episode) -> Array:
    """Angular velocity at the end of every step in world axes [rad/s], shape (T, 3)."""
    accessor = system.accessors.get("omega_world")
    if accessor is not None:
        return accessor(episode.y[1:])
    of_input = getattr(system, "omega_world", None)  # of kinematic rolling
    zero: Array = np.zeros((len(episode), 3))
    return zero if of_input is None else np.asarray(of_input(episode.u), dtype=np.float64)


def _between(task: Task, before: Moment, after: Moment, turn: Array, share: float) -> Moment:
    """A moment within a step."""
    y = before.y + share * (after.y - before.y)
    if "q" in task.system_type.components:
        y[:4] = rotations.multiply(rotations.exp(share * turn), rotations.normalize(before.y[:4]))
    aux = {name: x + share * (after.aux[name] - x) for name, x in before.aux.items()}
    for name in aux:
        if name.endswith("_w") and all(name[:-1] + axis in aux for axis in "xyz"):
            quaternion = [name[:-1] + axis for axis in "wxyz"]
            start, end = ([m.aux[part] for part in quaternion] for m in (before, after))
            aux |= zip(quaternion, rotations.slerp(start, end, share).tolist(), strict=True)
    return Moment(
        y=y,
        u=after.u,
        parameters=after.parameters,
        aux=aux,
        action=after.action,
        time=before.time + share * (after.time - before.time),
        reward=after.reward,
        cost=after.cost,
        success=before.success,
    )
