"""Moments between the steps of an episode, so that motion is smooth and its paths are curves."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from rigid_envs.moment import Moment
from rigid_envs.render.motion import Motion
from rigid_envs.replays.episode import Episode
from rigid_envs.tasks import Task

__all__ = ["moment_at", "moments"]

_PERIOD = 0.04  # s between moments, at most
_TURN = 0.4  # rad between moments, at most
_MOST = 24  # moments in a step
_ROUNDING = 1e-6  # of a step


def moments(task: Task, episode: Episode, budget: int) -> list[Moment]:
    """Moments of an episode and between, in order; those of the steps are exact.

    Args:
        task: Its task.
        episode: The episode.
        budget: How many there may be; there are never fewer than T + 1.
    """
    system = task.system(episode.parameters)
    steps = [episode.moment(k, task) for k in range(len(episode) + 1)]
    motions = [Motion(system, one, other) for one, other in pairwise(steps)]
    angle = max((float(np.linalg.norm(motion.turn)) for motion in motions), default=0.0)
    wanted = max(math.ceil(task.dt / _PERIOD), math.ceil(angle / _TURN))
    n = max(1, min(wanted, _MOST, budget // max(len(episode), 1)))
    found = steps[:1]
    for motion in motions:
        found += [motion.at(j / n) for j in range(1, n + 1)]
    return found


def moment_at(task: Task, episode: Episode, time: float) -> Moment:
    """Moment of an episode at any time [s]; its end after that."""
    steps = min(time / task.dt, float(len(episode)))
    k = min(int(steps + _ROUNDING), len(episode))
    one = episode.moment(k, task)
    share = steps - k
    if share < _ROUNDING or k == len(episode):
        return one
    return Motion(task.system(episode.parameters), one, episode.moment(k + 1, task)).at(share)
