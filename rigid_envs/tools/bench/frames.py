"""Time of a picture: with and without shadows, and of the first one in a new process."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import gymnasium as gym

from rigid_envs.tools.bench.figures import seconds_told
from rigid_envs.watch.drawing import Drawing, Look, drawing_of

PACKAGES = ("panda3d", "pygame-ce", "pillow", "moviepy", "imageio-ffmpeg", "matplotlib")
"""What the extra "render" brings, without what these need."""

_PROGRAM = """
import time
import gymnasium
import rigid_envs
env = gymnasium.make({env_id!r}, render_mode="rgb_array")
env.reset(seed=0)
start = time.perf_counter()
env.render()
print(time.perf_counter() - start)
"""


@dataclass(frozen=True)
class FrameTimes:
    """Times of anti-aliased pictures of 480 x 480 pixels, on one thread.

    Attributes:
        env_id: the environment.
        frame: median of the pictures of episodes under random actions [s].
        without_shadows: the same without shadows [s].
        first: from the call of `render` to the first picture of a new process [s].
    """

    env_id: str
    frame: float
    without_shadows: float
    first: float


def frame_times(
    ids: Iterable[str],
    n_frames: int = 20,
    n_rounds: int = 5,
    report: Callable[[str], Any] = lambda _: None,
) -> list[FrameTimes]:
    """Measure environments in rounds, each one in each round, so that all meet the same machine.

    Args:
        ids: of the environments.
        n_frames: pictures of each in a round, with shadows and without by turns.
        n_rounds: number of rounds.
        report: called with a line before each measurement.
    """
    names = list(ids)
    samples: dict[str, tuple[list[float], list[float], list[float]]]
    samples = {env_id: ([], [], []) for env_id in names}
    for k in range(n_rounds):
        for env_id in names:
            report(f"round {k + 1} of {n_rounds}: {env_id}")
            shaded, plain = _times(env_id, n_frames)
            for kept, times in zip(
                samples[env_id],
                (shaded, plain, [seconds_told(_PROGRAM.format(env_id=env_id), {})]),
                strict=True,
            ):
                kept.extend(times)
    return [FrameTimes(env_id, *map(statistics.median, samples[env_id])) for env_id in names]


def installed_size(packages: Iterable[str] = PACKAGES) -> dict[str, int]:
    """Bytes that installed packages take."""
    sizes = {}
    for name in packages:
        files = metadata.files(name) or []
        places = (Path(str(file.locate())) for file in files)
        sizes[name] = sum(place.stat().st_size for place in places if place.is_file())
    return sizes


def _times(env_id: str, n_frames: int) -> list[list[float]]:
    env: Any = gym.make(env_id)
    env.reset(seed=0)
    env.action_space.seed(0)
    drawings = _drawings(env.unwrapped)
    times: list[list[float]] = [[], []]
    for _ in range(n_frames):
        moment = env.unwrapped.moment()
        for drawing, spent in zip(drawings, times, strict=True):
            start = time.perf_counter()
            drawing.picture(moment)
            spent.append(time.perf_counter() - start)
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        if terminated or truncated:
            env.reset()
            drawings = _drawings(env.unwrapped)
    return times


def _drawings(env: Any) -> list[Drawing]:
    """Of the episode of an environment, with shadows and without."""
    parameters = env.moment().parameters
    return [drawing_of(env.task, parameters, Look(shadows=shadows)) for shadows in (True, False)]
