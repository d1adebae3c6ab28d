"""Films: pictures of episodes, and the files that they become."""

import functools
import io
import itertools
import math
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rigid_envs.base.checks import Image, integer, non_negative, positive
from rigid_envs.base.files import write_atomic
from rigid_envs.envs.display import needed
from rigid_envs.envs.lookup import task_of
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.policies import PolicyFactory
from rigid_envs.scores.starts import Tally, metrics_of, rollout
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tasks.task import Task
from rigid_envs.watch.drawing import Look, drawing_of
from rigid_envs.watch.pictures import lines_height, pillow, tiled, wrapped, write
from rigid_envs.watch.replays.replay import PastEpisode, moment_at, play_again
from rigid_envs.watch.views import cost_figure, three_digits

# Animated GIF and WebP, as small as asked for.

_GIF_FASTEST = 50.0  # pictures per second; browsers slow down what is faster
_SAMPLES = 16  # pictures that the palette of a GIF is made from
_COARSE = 200  # pixels of their longer side that it is made from


class _Level(NamedTuple):
    """A way to encode; later levels give smaller files."""

    scale: float
    fps: float
    quality: int  # of WebP, 0 to 100
    colors: int  # of GIF


_LEVELS = (
    _Level(1.0, 60.0, 82, 256),
    _Level(1.0, 30.0, 75, 192),
    _Level(1.0, 15.0, 60, 96),
    _Level(1.0, 12.0, 40, 64),
    _Level(1.0, 10.0, 25, 64),
    _Level(0.75, 15.0, 60, 96),
    _Level(0.5, 12.0, 50, 64),
    _Level(0.35, 8.0, 30, 32),
)


def write_animation(
    path: Path, pictures: Iterator[Image], fps: float, max_bytes: int | None
) -> tuple[int, int, float, int]:
    """Write an animation that repeats without end.

    Args:
        path: the file; its suffix names the format.
        pictures: at least one.
        fps: pictures per second.
        max_bytes: largest size; None for any.

    Returns:
        Width, height, pictures per second, number of pictures.

    Raises:
        ValueError: no level of quality is as small as that.
    """
    kept = list(pictures)
    for level in _LEVELS:
        data, width, height, n = _encoded(kept, fps, level, path.suffix.lower())
        if max_bytes is None or len(data) <= max_bytes:
            write_atomic(path, data)
            return width, height, n * fps / len(kept), n
    raise ValueError(
        f"max_bytes = {max_bytes}; expected at least {len(data)}, the size at the lowest "
        f"quality ({width} x {height}): make the film shorter"
    )


def _encoded(
    kept: Sequence[Image], fps: float, level: _Level, suffix: str
) -> tuple[bytes, int, int, int]:
    """The file, width, height, and number of pictures."""
    pictures, _, _ = pillow()
    fastest = min(level.fps, _GIF_FASTEST) if suffix == ".gif" else level.fps
    stride = max(1, int(np.ceil(fps / fastest - 1e-9)))
    chosen = kept[::stride]
    height, width, _ = chosen[0].shape
    size = (max(1, round(width * level.scale)), max(1, round(height * level.scale)))
    shrink = pictures.Resampling.LANCZOS
    frames = [pictures.fromarray(picture).resize(size, shrink) for picture in chosen]
    tick = 10 if suffix == ".gif" else 1  # [ms]
    times = _durations(len(kept), len(frames), stride, fps, tick)
    options: dict[str, Any] = {"quality": level.quality, "method": 4, "kmin": 9, "kmax": 60}
    if suffix == ".gif":
        palette, none = _palette(frames, level.colors), pictures.Dither.NONE
        frames = [frame.quantize(palette=palette, dither=none) for frame in frames]
        options = {"optimize": False, "disposal": 1}
    options |= {"append_images": frames[1:], "duration": times, "loop": 0}
    buffer = io.BytesIO()
    frames[0].save(buffer, suffix[1:].upper(), save_all=True, **options)
    return buffer.getvalue(), *size, len(frames)


def _durations(n: int, n_kept: int, stride: int, fps: float, tick: int) -> list[int]:
    """Times [ms] of the pictures that are kept, in two whole ticks or more, without a drift."""
    ends = [min((k + 1) * stride, n) for k in range(n_kept)]
    marks = [0, *(round(1000.0 * end / fps / tick) for end in ends)]
    return [tick * max(2, marks[k + 1] - marks[k]) for k in range(n_kept)]


def _palette(frames: Sequence[Any], colors: int) -> Any:
    """Picture whose palette suits all pictures: it is made from some of them, side by side."""
    pictures, _, _ = pillow()
    picks = np.unique(np.linspace(0, len(frames) - 1, _SAMPLES).astype(int))
    width, height = (max(1, length * _COARSE // max(frames[0].size)) for length in frames[0].size)
    chosen = [frames[k].resize((width, height), pictures.Resampling.NEAREST) for k in picks]
    sheet = pictures.new("RGB", (width, height * len(chosen)))
    for k, frame in enumerate(chosen):
        sheet.paste(frame, (0, k * height))
    return sheet.quantize(colors, method=pictures.Quantize.MAXCOVERAGE, kmeans=1)


# MP4 with H.264, encoded by ffmpeg while the pictures come.

_QUALITY = (
    *("-crf", "20", "-preset", "veryfast"),
    # the matrix that players assume, and says so; the default is that of old television
    *("-vf", "scale=out_color_matrix=bt709:out_range=tv"),
    *("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709"),
    *("-movflags", "+faststart"),  # a browser begins before it has the whole file
)


def load_ffmpeg() -> Any:
    """The module `imageio_ffmpeg`.

    Raises:
        DependencyNotInstalled: it is not installed.
    """
    return needed("imageio_ffmpeg", "films in mp4 need ffmpeg (imageio-ffmpeg)")


def write_mp4(path: Path, pictures: Iterator[Image], fps: float) -> tuple[int, int, float, int]:
    """Encode pictures; a line or column is repeated where their number is odd, as 4:2:0 asks for.

    Args:
        path: the file; it appears when it is complete.
        pictures: at least one.
        fps: pictures per second.

    Returns:
        Width, height, pictures per second, number of pictures.

    Raises:
        OSError: ffmpeg failed.
    """
    even, n = map(_even, pictures), 0
    first = next(even)
    height, width, _ = first.shape
    with tempfile.TemporaryDirectory(prefix="rigid-envs-") as folder:
        draft = Path(folder) / "film.mp4"
        with closing(_writer(draft, width, height, fps)) as writer:
            for picture in chain([first], even):
                writer.send(picture)
                n += 1
        data = draft.read_bytes() if draft.is_file() else b""
        if not data:
            raise OSError(f"{path}: ffmpeg wrote nothing; it says why above")
        write_atomic(path, data)
    return width, height, fps, n


def _writer(path: Path, width: int, height: int, fps: float) -> Any:
    writer = load_ffmpeg().write_frames(
        str(path),
        (width, height),
        fps=fps,
        codec="libx264",
        quality=None,
        macro_block_size=2,
        ffmpeg_log_level="error",
        output_params=list(_QUALITY),
    )
    writer.send(None)
    return writer


def _even(picture: Image) -> Image:
    height, width, _ = picture.shape
    sides = [(0, height % 2), (0, width % 2), (0, 0)]
    return np.ascontiguousarray(np.pad(picture, sides, mode="edge"))


# Episodes of policies and controllers, recorded to be looked at.


class Played(NamedTuple):
    """An episode that was played.

    Attributes:
        env_id: Gymnasium's id.
        task: The task.
        episode: What happened.
        tally: Its figures.
    """

    env_id: str
    task: Task
    episode: PastEpisode
    tally: Tally

    @property
    def value(self) -> float:
        """The cost of this id, its first metric, also where the episode failed."""
        return self.tally.value(metrics_of(self.env_id)[0], self.task)

    def captioned(self) -> tuple[Task, PastEpisode]:
        """The task, and the episode with its result in the label: ``PPO: path 8.31 m``."""
        text = figure(self.env_id, self.task, self.value) if self.tally.success else "no success"
        return self.task, replace(self.episode, label=f"{self.episode.label}: {text}")


def play_episode(
    policy: PolicyFactory,
    env_id: str,
    seed: int,
    config: Mapping[str, Any] | None = None,
    label: str = "",
) -> Played:
    """Play one episode to its end, from the start that `reset(seed=seed)` gives.

    Args:
        policy: From `rigid_envs.scores.from_controller` or `from_predict`, for example.
        env_id: Gymnasium's id.
        seed: Of the start.
        config: Hyperparameters of the task.
        label: Who acts.
    """
    task_of(env_id, config)  # refuses what is no setting
    envs = make_rows(env_id, 1, config)
    record = ENVIRONMENTS[env_id]
    tally = Tally([seed], record.error, record.max_episode_steps)
    actions, over = [], (False, False)
    try:
        envs.reset(seed=[seed])
        start = {name: part[0].copy() for name, part in envs.get_state().items()}
        for step in rollout(policy(envs), envs, [seed], tally.keys):
            actions.append(step.actions[0])
            over = bool(step.terminated[0]), bool(step.truncated[0])
            tally.add(step.rewards, step.terminated, step.truncated, step.infos)
    finally:
        envs.close()
    episode = play_again(envs.task, start, actions, label, terminated=over[0], truncated=over[1])
    return Played(env_id, envs.task, episode, tally)


def figure(env_id: str, task: Task, value: float) -> str:
    """A value of the first metric of an id, its cost, in words: ``path 8.31 m``."""
    metric = metrics_of(env_id)[0]
    text = cost_figure(task, value) if metric.is_cost else three_digits(value)
    return f"{metric.name} {text} {metric.unit(task)}".rstrip()


# Pictures of several episodes side by side, each under its label.

_RULE = (208, 213, 221)
LETTERS = 13
"""Least height of a letter above a picture, in pixels."""


def labelled(pictures: Sequence[Image], labels: Sequence[str]) -> Image:
    """Pictures of one size side by side, each under its text where there is any.

    Args:
        pictures: at least one.
        labels: one each; if all are empty there is no text.
    """
    width = pictures[0].shape[1]
    if any(labels):
        high = labels_height(labels, width)
        pictures = [
            np.concatenate([_strip(label, width, high), picture])
            for label, picture in zip(labels, pictures, strict=True)
        ]
    page = tiled(pictures)
    page[:, width::width] = _RULE  # between neighbours
    return page


def labels_height(labels: Iterable[str], width: int) -> int:
    """Height of the text above pictures of this width, in pixels."""
    size = _letter_size(width)
    return lines_height(max(len(wrapped(label, width, size)) for label in labels), size)


def _letter_size(width: int) -> int:
    return max(LETTERS, width // 26)


@functools.lru_cache(64)
def _strip(label: str, width: int, high: int) -> Image:
    """Text as wide as a picture, in lines; a long word has smaller letters, and then is cut."""
    size = _letter_size(width)
    strip = np.full((high, width, 3), 255, dtype=np.uint8)
    write(strip, wrapped(label, width, size), size)
    strip[-1] = _RULE
    return strip


# Pictures of recorded episodes, in real time.

_ROUNDING = 1e-6  # share of a step or picture that is none
_SMOOTH = 24.0  # pictures per second that the eye takes for a motion


def pictures_per_second(*tasks: Task) -> float:
    """Least multiple of the rate of control that is at least 24 [1/s]; the largest of several."""
    return max(math.ceil(_SMOOTH * task.dt - 1e-9) / task.dt for task in tasks)


def episode_pictures(
    episodes: Sequence[tuple[Task, PastEpisode]],
    look: Look | None = None,
    *,
    fps: float | None = None,
    speed: float = 1.0,
    hold: float = 1.0,
) -> Iterator[Image]:
    """Pictures of episodes side by side, each under its label, until the longest one has ended.

    Between the moments of two steps, motion is interpolated (`rigid_envs.watch.views`).

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
    drawings = [drawing_of(task, e.parameters, look or Look()) for task, e in episodes]
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


# Film: a file of pictures in one of three formats.

SUFFIXES = (".mp4", ".gif", ".webp")
"""Formats: H.264 in MP4, animated GIF, animated WebP."""


class Film(NamedTuple):
    """What was written.

    Attributes:
        path: the file.
        width: of a picture, in pixels.
        height: of a picture, in pixels.
        fps: pictures per second.
        n_pictures: number of pictures.
        n_bytes: size of the file.
    """

    path: Path
    width: int
    height: int
    fps: float
    n_pictures: int
    n_bytes: int

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return self.n_pictures / self.fps

    def __str__(self) -> str:
        """In words: file, duration, size."""
        return (
            f"{self.path} ({self.duration:.1f} s, {self.width} x {self.height}, "
            f"{self.fps:.3g} pictures/s, {self.n_bytes / 1000:.0f} kB)"
        )


def checked_film(path: str | Path) -> Path:
    """The path of a film that can be written here, before there are pictures.

    Args:
        path: the file.

    Raises:
        ValueError: another suffix, or a folder that is not there.
        DependencyNotInstalled: the package that writes the format is not installed.
    """
    file = Path(path)
    if file.suffix.lower() not in SUFFIXES:
        raise ValueError(f"film = {str(file)!r}; expected a name that ends in .mp4, .gif or .webp")
    if not file.parent.is_dir():
        raise ValueError(f"film = {str(file)!r}; expected a file in a folder that exists")
    if file.is_dir():
        raise ValueError(f"film = {str(file)!r}; expected a file: this is a folder")
    if file.suffix.lower() == ".mp4":
        load_ffmpeg()
    else:
        pillow()
    return file


def write_film(
    path: str | Path, pictures: Iterable[Image], fps: float, max_bytes: int | None = None
) -> Film:
    """Write pictures as a film; the suffix of the file names the format.

    ``.mp4`` is H.264 with 4:2:0 chroma (yuv420p), which browsers play; its pictures are encoded as
    they come, and are never all in memory. ``.gif`` and ``.webp`` repeat without end. The file
    appears when it is complete, at once in place of what was there before.

    Args:
        path: the file, in a folder that exists.
        pictures: RGB, all of the same shape (height, width, 3); at least one.
        fps: pictures per second. GIF counts time in 1/100 s and shows a picture for 2/100 s at
            least: times are rounded without drift, and pictures are left out above 50 a second.
        max_bytes: largest size of a GIF or WebP, which is reached by fewer pictures per second,
            fewer colours or lower quality, and a smaller size; the duration stays. None: best
            quality.

    Returns:
        What was written: its size and pictures per second, which `max_bytes` may have lowered.

    Raises:
        ValueError: another suffix, no or unlike pictures, or a limit that cannot be met.
        DependencyNotInstalled: the package that writes the format is not installed.
        OSError: the file cannot be written.
    """
    file = checked_film(path)
    positive(fps, "fps", "1/s")
    if max_bytes is not None:
        integer(max_bytes, "max_bytes", 1)
        if file.suffix.lower() == ".mp4":
            expected = "None for an mp4: write a gif or webp"
            raise ValueError(f"max_bytes = {max_bytes}; expected {expected}")
    source = _checked(pictures)
    first = next(source, None)
    if first is None:
        raise ValueError("pictures = (); expected at least one")
    whole = itertools.chain([first], source)
    if file.suffix.lower() == ".mp4":
        shape = write_mp4(file, whole, fps)
    else:
        shape = write_animation(file, whole, fps, max_bytes)
    return Film(file, *shape, file.stat().st_size)


def _checked(pictures: Iterable[Image]) -> Iterator[Image]:
    """The pictures, each refused unless it is like the first.

    Raises:
        ValueError: no RGB picture, or one of another size.
    """
    shape = None
    for k, picture in enumerate(pictures):
        given: Any = picture
        if not isinstance(given, np.ndarray) or given.dtype != np.uint8:
            raise ValueError(f"pictures[{k}] = {type(given).__name__}; expected uint8 arrays")
        if given.ndim != 3 or given.shape[2] != 3 or not given.size:
            expected = "(height, width, 3), RGB"
            raise ValueError(f"pictures[{k}] has shape {given.shape}; expected {expected}")
        if shape not in (None, given.shape):
            raise ValueError(f"pictures[{k}] has shape {given.shape}; expected {shape} as before")
        shape = given.shape
        yield picture
