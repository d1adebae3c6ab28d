"""Pictures of recorded episodes, in real time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import non_negative, positive
from rigid_envs.films.labels import labelled
from rigid_envs.render.drawing import Drawing, Look
from rigid_envs.replays import Episode
from rigid_envs.replays.inbetween import moment_at
from rigid_envs.tasks import Task

__all__ = ["Look", "episode_pictures", "pictures_per_second"]

Image = npt.NDArray[np.uint8]

_ROUNDING = 1e-6  # share of a step or picture that is none
_SMOOTH = 24.0  # pictures per second that the eye takes for a motion


def pictures_per_second(*tasks: Task) -> float:
    """Least multiple of the rate of control that is at least 24 [1/s]; the largest of several."""
    return max(math.ceil(_SMOOTH * task.dt - 1e-9) / task.dt for task in tasks)


def episode_pictures(
    episodes: Sequence[tuple[Task, Episode]],
    look: Look | None = None,
    *,
    fps: float | None = None,
    speed: float = 1.0,
    hold: float = 1.0,
) -> Iterator[Image]:
    """Pictures of episodes side by side, each under its label, until the longest one has ended.

    Between the moments of two steps, motion is interpolated (`rigid_envs.render.motion`).

    Args:
        episodes: each with its task; at least one.
        look: size of a picture of one episode, and point of view.
        fps: pictures per second; None for `pictures_per_second`.
        speed: 1 for real time, 0.5 for half as fast.
        hold: time for which the end stays [s].

    Yields:
        RGB, all of one shape.

    Raises:
        ValueError: no episode, or a number that cannot be.
        DependencyNotInstalled: a package that draws is not installed.
    """
    if not episodes:
        raise ValueError("episodes = (); expected at least one")
    tasks = [task for task, _ in episodes]
    rate = pictures_per_second(*tasks) if fps is None else positive(fps, "fps", "1/s")
    positive(speed, "speed")
    n_held = round(non_negative(hold, "hold", "s") * rate)
    longest = max(len(episode) * task.dt for task, episode in episodes)
    n = math.ceil(longest / speed * rate - _ROUNDING)
    drawings = [Drawing(task, e.parameters, look or Look()) for task, e in episodes]
    labels = [episode.label for _, episode in episodes]
    try:
        for k in range(n + 1):
            time = k * speed / rate
            page = labelled(
                [
                    drawing.picture(moment_at(task, episode, time))
                    for drawing, (task, episode) in zip(drawings, episodes, strict=True)
                ],
                labels,
            )
            yield page
        for _ in range(n_held):
            yield page
    finally:
        for drawing in drawings:
            drawing.close()
