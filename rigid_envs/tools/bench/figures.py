"""Figures of speed: ratios, start-up, pictures."""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

import rigid_envs
from rigid_envs.tools.bench.accuracy import FreeRun, MujocoSetting
from rigid_envs.tools.bench.measuring import FREE_BODY, ON_REQUEST, StepTime, Throughput, costs
from rigid_envs.watch.drawing import Drawing, Look, drawing_of

# Speed of some environments against peers in the same run.

_BALL, _TOP = "BallPark-v0", "SleepingTop-v0"
_SINGLE, _ROWS = "CartPole-v1", "CartPole-v1, NumPy"
_PEERS = (
    (FREE_BODY, "made", _SINGLE, "made"),
    (FREE_BODY, "bare", _SINGLE, "bare"),
    (FREE_BODY, "16", _ROWS, "16"),
    (FREE_BODY, "256", _ROWS, "256"),
    *((FREE_BODY, column, _ROWS, str(n)) for column, n in ON_REQUEST.items()),
    *((name, "4096", _ROWS, "4096") for name in (FREE_BODY, _BALL, _TOP)),
    *((name, "2 threads", name, "4096") for name in (FREE_BODY, _BALL, _TOP)),
)
_FORMS = {
    "made": "single, made",
    "bare": "single, bare",
    "16": "N = 16",
    "256": "N = 256",
    **{column: f"N = {column}" for column in ON_REQUEST},
    "4096": "N = 4096",
    "2 threads": "N = 4096, 2 threads",
}


class Ratio(NamedTuple):
    """Steps per second over those of a peer.

    Attributes:
        name: of the environment.
        form: of the environment, in words.
        peer: name of the peer; itself in one thread, where its form is 2 threads.
        median: over the rounds.
        quartiles: first and third, over the rounds.
    """

    name: str
    form: str
    peer: str
    median: float
    quartiles: tuple[float, float]


def ratios(speeds: Sequence[Throughput], mujoco: Sequence[MujocoSetting]) -> list[Ratio]:
    """Ratios to every peer that was measured.

    Of MuJoCo's settings the last RK4 counts: it holds our energy error for longest.
    """
    equal = [setting.name for setting in mujoco if setting.integrator == "RK4"][-1:]
    peers = [*_PEERS, *((FREE_BODY, "4096", peer, "4096") for peer in equal)]
    found = {(speed.name, speed.column): speed for speed in speeds}
    made = []
    for name, column, peer, peer_column in peers:
        ours, theirs = found.get((name, column)), found.get((peer, peer_column))
        if ours and theirs:
            low, median, high = np.percentile(ours.ratio(theirs), (25, 50, 75)).tolist()
            form = _FORMS[column] + (", equal energy error" if peer in equal else "")
            made.append(Ratio(name, form, peer, median, (low, high)))
    return made


# Time from the import to the first step in a new process.

_PROGRAM = """
import time
start = time.perf_counter()
import gymnasium
import rigid_envs
env = gymnasium.make({env_id!r})
env.reset(seed=0)
env.step(env.action_space.sample())
print(time.perf_counter() - start)
"""


class Startup(NamedTuple):
    """Times from the import to the first step, one for each new process.

    Attributes:
        env_id: the environment that takes the step.
        cold: with an empty kernel cache [s].
        warm: with the kernels in the cache [s].
    """

    env_id: str
    cold: tuple[float, ...]
    warm: tuple[float, ...]

    @property
    def medians(self) -> tuple[float, float]:
        """Medians of the cold and of the warm times [s]."""
        return statistics.median(self.cold), statistics.median(self.warm)


def startup(env_id: str, n_cold: int, n_warm: int) -> Startup:
    """Start processes one by one: cold ones, each with its own empty cache, then warm ones."""
    with tempfile.TemporaryDirectory() as folder:
        caches = [*(f"{folder}/{k}" for k in range(n_cold)), *[f"{folder}/0"] * n_warm]
        program = _PROGRAM.format(env_id=env_id)
        times = [seconds_told(program, {"NUMBA_CACHE_DIR": cache}) for cache in caches]
    return Startup(env_id, tuple(times[:n_cold]), tuple(times[n_cold:]))


def seconds_told(program: str, environment: Mapping[str, str]) -> float:
    """The number that a program prints, run in a new process with this library.

    Args:
        program: source text.
        environment: variables that are added to those of this process.
    """
    root = str(Path(rigid_envs.__file__).resolve().parents[1])
    path = os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH"))))
    done = subprocess.run(
        [sys.executable, "-P", "-c", program],
        env={**os.environ, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return float(done.stdout)


# The figures of one benchmark run.


class Figures(NamedTuple):
    """All measurements of a run, and what is computed from them.

    Attributes:
        rounds: rounds of the interleaved timing.
        seconds: aimed time of a workload per round [s].
        speeds: throughput of every workload.
        mujoco: settings of the MuJoCo body; empty if MuJoCo is not installed.
        runs: errors of torque-free runs.
        startups: times from import to first step.
    """

    rounds: int
    seconds: float
    speeds: Sequence[Throughput]
    mujoco: Sequence[MujocoSetting]
    runs: Sequence[FreeRun]
    startups: Sequence[Startup]

    @property
    def costs(self) -> list[StepTime]:
        """Time per step of every environment, against the median of all."""
        return costs(self.speeds)

    @property
    def ratios(self) -> list[Ratio]:
        """Speed against the peers."""
        return ratios(self.speeds, self.mujoco)

    def as_json(self) -> dict[str, Any]:
        """JSON values, with every sample."""
        return {
            "rounds": self.rounds,
            "seconds_per_turn": self.seconds,
            "steps_per_second": [
                {**s._asdict(), "median": s.median, "quartiles": s.quartiles} for s in self.speeds
            ],
            "mujoco": [
                {"name": each.name, **each._asdict(), "errors": each.errors._asdict()}
                for each in self.mujoco
            ],
            "costs": [cost._asdict() for cost in self.costs],
            "accuracy": [run._asdict() for run in self.runs],
            "import_to_first_step": [startup._asdict() for startup in self.startups],
            "ratios": [ratio._asdict() for ratio in self.ratios],
        }


# Time of a picture: with and without shadows, and of the first one in a new process.

PACKAGES = ("panda3d", "pygame-ce", "pillow", "moviepy", "imageio-ffmpeg", "matplotlib")
"""What the extra "render" brings, without what these need."""

_FIRST_PICTURE = """
import time
import gymnasium
import rigid_envs
env = gymnasium.make({env_id!r}, render_mode="rgb_array")
env.reset(seed=0)
start = time.perf_counter()
env.render()
print(time.perf_counter() - start)
"""


class FrameTimes(NamedTuple):
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
    samples: dict[str, list[list[float]]] = {env_id: [[], [], []] for env_id in ids}
    for k in range(n_rounds):
        for env_id, kept in samples.items():
            report(f"round {k + 1} of {n_rounds}: {env_id}")
            first = seconds_told(_FIRST_PICTURE.format(env_id=env_id), {})
            for each, times in zip(kept, [*_times(env_id, n_frames), [first]], strict=True):
                each += times
    return [FrameTimes(env_id, *map(statistics.median, kept)) for env_id, kept in samples.items()]


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
