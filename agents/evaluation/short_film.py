"""Short film of a trained policy, in bounded time."""

from __future__ import annotations

import itertools
import math
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from gymnasium.error import DependencyNotInstalled

from rigid_envs import ENVIRONMENTS
from rigid_envs.scores.policies import from_predict
from rigid_envs.scores.starts import row_seeds

from ..policies.mlp import Policy

if TYPE_CHECKING:
    from rigid_envs.films import Look
    from rigid_envs.replays import Episode
    from rigid_envs.tasks import Task

__all__ = ["BUDGET", "NAME", "try_film"]

Image = npt.NDArray[np.uint8]

NAME = "film.mp4"

BUDGET = 4.0
"""Time [s] after which no picture is drawn any more."""

_SIZE = 360  # pixels along each side
_DRAWING = 0.7  # share of the time that drawing may plan with; encoding takes the rest
_SLOWEST = 15.0  # pictures per second, below which rather the end is left out
_TRIALS = 4


def try_film(policy: Policy, folder: Path, seed: int) -> Path | None:
    """Film the episode of the first start of an evaluation, in real time.

    It takes `BUDGET` seconds at most, and a moment more: a slow machine draws fewer pictures per
    second and, if that is not enough, leaves out the end. Nothing that goes wrong is raised; it is
    said in one line on standard error.

    Args:
        policy: The policy, with its document.
        folder: Where the film goes.
        seed: Seed that the starts are spawned from.

    Returns:
        The film; None if there is none, and then no older one either.
    """
    path = folder / NAME
    if policy.document["env_id"].rpartition(":")[2] not in ENVIRONMENTS:
        return None
    try:
        path.unlink(missing_ok=True)
        _film(policy, path, row_seeds(seed, 1, "test")[0])
    except DependencyNotInstalled as error:
        print(f"no film of the policy: {error}", file=sys.stderr)
        return None
    except Exception as error:  # a film is not worth the results of a training
        print(f"no film of the policy: {type(error).__name__}: {error}", file=sys.stderr)
        return None
    return path


def _film(policy: Policy, path: Path, seed: int) -> None:
    end = time.perf_counter() + BUDGET
    from rigid_envs.films import (
        Look,
        checked_film,
        episode_pictures,
        pictures_per_second,
        play_episode,
        write_film,
    )

    checked_film(path)
    document = policy.document
    env_id, config = document["env_id"].rpartition(":")[2], document["env_kwargs"]
    label = str(document["algo"]).upper()
    played = play_episode(from_predict(policy), env_id, seed, config, label)
    task, shown = played.task, [played.captioned()]
    best = pictures_per_second(task)
    look = Look(_SIZE, _SIZE)
    fps = best / _stride(shown, look, best, end)
    pictures = episode_pictures(shown, look, fps=fps)
    write_film(path, _until(end, pictures), fps)


def _stride(shown: list[tuple[Task, Episode]], look: Look, best: float, end: float) -> int:
    """Number of pictures of which one is drawn, so that the time is enough for the episode."""
    from rigid_envs.films import episode_pictures

    trial = episode_pictures(shown, look)
    next(trial)  # makes the scene
    begin = time.perf_counter()
    n = sum(1 for _ in itertools.islice(trial, _TRIALS))
    each = (time.perf_counter() - begin) / max(n, 1)
    affordable = max(_DRAWING * (end - time.perf_counter()) / each, 1.0)
    ((task, episode),) = shown
    stride = math.ceil((len(episode) * task.dt + 1.0) * best / affordable)
    return max(1, min(stride, int(best / _SLOWEST)))


def _until(end: float, pictures: Iterator[Image]) -> Iterator[Image]:
    """Pictures until the time is over, at least one."""
    for picture in pictures:
        yield picture
        if time.perf_counter() > end:
            return
