"""Animated GIF and WebP, as small as asked for."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.files import write_atomic
from rigid_envs.render.needed import needed

__all__ = ["library", "write"]

Image = npt.NDArray[np.uint8]

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
    _Level(1.0, 20.0, 70, 128),
    _Level(1.0, 15.0, 60, 96),
    _Level(0.75, 20.0, 65, 128),
    _Level(0.75, 15.0, 60, 96),
    _Level(0.75, 12.0, 50, 64),
    _Level(0.5, 15.0, 60, 96),
    _Level(0.5, 12.0, 50, 64),
    _Level(0.5, 10.0, 40, 48),
    _Level(0.35, 10.0, 45, 48),
    _Level(0.35, 8.0, 30, 32),
)


class _Draft(NamedTuple):
    data: bytes
    width: int
    height: int
    n: int


def library() -> Any:
    """The module `PIL.Image`.

    Raises:
        DependencyNotInstalled: Pillow is not installed.
    """
    return needed("PIL.Image", "films in gif and webp need Pillow")


def write(
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
    suffix = path.suffix.lower()
    kept = list(pictures)
    duration = len(kept) / fps
    draft = _encoded(kept, fps, _LEVELS[0], suffix)
    if max_bytes is not None and len(draft.data) > max_bytes:
        draft = _fitted(kept, fps, suffix, max_bytes)
    write_atomic(path, draft.data)
    return draft.width, draft.height, draft.n / duration, draft.n


def _fitted(kept: Sequence[Image], fps: float, suffix: str, max_bytes: int) -> _Draft:
    """The first level that is small enough, by bisection.

    Raises:
        ValueError: there is none.
    """
    low, high = 0, len(_LEVELS) - 1  # the first is too large; the last is to be tried
    best = _encoded(kept, fps, _LEVELS[high], suffix)
    if len(best.data) > max_bytes:
        raise ValueError(
            f"max_bytes = {max_bytes}; expected at least {len(best.data)}, the size at the lowest "
            f"quality ({best.width} x {best.height}): make the film shorter"
        )
    while high - low > 1:
        middle = (low + high) // 2
        draft = _encoded(kept, fps, _LEVELS[middle], suffix)
        if len(draft.data) <= max_bytes:
            high, best = middle, draft
        else:
            low = middle
    return best


def _encoded(kept: Sequence[Image], fps: float, level: _Level, suffix: str) -> _Draft:
    pillow = library()
    fastest = min(level.fps, _GIF_FASTEST) if suffix == ".gif" else level.fps
    stride = max(1, int(np.ceil(fps / fastest - 1e-9)))
    chosen = kept[::stride]
    height, width, _ = chosen[0].shape
    size = (max(1, round(width * level.scale)), max(1, round(height * level.scale)))
    frames = [pillow.fromarray(picture) for picture in chosen]
    if level.scale < 1.0:
        frames = [frame.resize(size, pillow.Resampling.LANCZOS) for frame in frames]
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
    pillow = library()
    palette = _palette(frames, colors)
    none = pillow.Dither.NONE
    paletted = [frame.quantize(palette=palette, dither=none) for frame in frames]
    return _saved(paletted, times, "GIF", optimize=False, disposal=1)


def _palette(frames: Sequence[Any], colors: int) -> Any:
    """Picture whose palette suits all pictures: it is made from some of them, side by side."""
    pillow = library()
    picks = np.unique(np.linspace(0, len(frames) - 1, _SAMPLES).astype(int))
    width, height = (max(1, length * _COARSE // max(frames[0].size)) for length in frames[0].size)
    chosen = [frames[k].resize((width, height), pillow.Resampling.NEAREST) for k in picks]
    sheet = pillow.new("RGB", (width, height * len(chosen)))
    for k, frame in enumerate(chosen):
        sheet.paste(frame, (0, k * height))
    return sheet.quantize(colors, method=pillow.Quantize.MAXCOVERAGE, kmeans=1)


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
