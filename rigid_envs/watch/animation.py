"""Animated files of pictures."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import closing
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rigid_envs.base.checks import Image
from rigid_envs.base.files import write_atomic
from rigid_envs.envs.display import needed
from rigid_envs.watch.lettering import pillow

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
    _Level(0.75, 15.0, 60, 96),
    _Level(0.5, 12.0, 50, 64),
    _Level(0.35, 8.0, 30, 32),
)


class _Draft(NamedTuple):
    data: bytes
    width: int
    height: int
    n: int


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
        draft = _encoded(kept, fps, level, path.suffix.lower())
        if max_bytes is None or len(draft.data) <= max_bytes:
            write_atomic(path, draft.data)
            return draft.width, draft.height, draft.n * fps / len(kept), draft.n
    raise ValueError(
        f"max_bytes = {max_bytes}; expected at least {len(draft.data)}, the size at the lowest "
        f"quality ({draft.width} x {draft.height}): make the film shorter"
    )


def _encoded(kept: Sequence[Image], fps: float, level: _Level, suffix: str) -> _Draft:
    pictures, _, _ = pillow()
    fastest = min(level.fps, _GIF_FASTEST) if suffix == ".gif" else level.fps
    stride = max(1, int(np.ceil(fps / fastest - 1e-9)))
    chosen = kept[::stride]
    height, width, _ = chosen[0].shape
    size = (max(1, round(width * level.scale)), max(1, round(height * level.scale)))
    frames = [pictures.fromarray(picture) for picture in chosen]
    if level.scale < 1.0:
        frames = [frame.resize(size, pictures.Resampling.LANCZOS) for frame in frames]
    tick = 10 if suffix == ".gif" else 1  # [ms]
    times = _durations(len(kept), len(frames), stride, fps, tick)
    if suffix == ".gif":
        data = _gif(frames, times, level.colors)
    else:
        data = _webp(frames, times, level.quality)
    return _Draft(data, *size, len(frames))


def _durations(n: int, n_kept: int, stride: int, fps: float, tick: int) -> list[int]:
    """Times [ms] of the pictures that are kept, in whole ticks, whose sums do not drift."""
    ends = [min((k + 1) * stride, n) for k in range(n_kept)]
    marks = [0, *(round(1000.0 * end / fps / tick) for end in ends)]
    return [tick * max(1, marks[k + 1] - marks[k]) for k in range(n_kept)]


def _gif(frames: Sequence[Any], times: Sequence[int], colors: int) -> bytes:
    """One palette for all pictures, without dithering: what does not move stays the same."""
    pictures, _, _ = pillow()
    palette = _palette(frames, colors)
    none = pictures.Dither.NONE
    paletted = [frame.quantize(palette=palette, dither=none) for frame in frames]
    return _saved(paletted, times, "GIF", optimize=False, disposal=1)


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


def _webp(frames: Sequence[Any], times: Sequence[int], quality: int) -> bytes:
    return _saved(frames, times, "WEBP", quality=quality, method=4, kmin=9, kmax=60)


def _saved(frames: Sequence[Any], times: Sequence[int], kind: str, **options: Any) -> bytes:
    buffer = io.BytesIO()
    frames[0].save(
        buffer,
        kind,
        save_all=True,
        append_images=frames[1:],
        duration=list(times),
        loop=0,
        **options,
    )
    return buffer.getvalue()


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
        if not draft.is_file() or not draft.stat().st_size:
            raise OSError(f"{path}: ffmpeg wrote nothing; it says why above")
        write_atomic(path, draft.read_bytes())
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
