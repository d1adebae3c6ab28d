"""Film: a file of pictures in one of three formats."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.checks import integer, positive
from rigid_envs.films import animation, video

__all__ = ["SUFFIXES", "Film", "checked_film", "write_film"]

Image = npt.NDArray[np.uint8]

SUFFIXES = (".mp4", ".gif", ".webp")
"""Formats: H.264 in MP4, animated GIF, animated WebP."""


@dataclass(frozen=True)
class Film:
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
        raise ValueError(f"film = {str(file)!r}; expected a name that ends in {_either(SUFFIXES)}")
    if not file.parent.is_dir():
        raise ValueError(f"film = {str(file)!r}; expected a file in a folder that exists")
    if file.is_dir():
        raise ValueError(f"film = {str(file)!r}; expected a file: this is a folder")
    if file.suffix.lower() == ".mp4":
        video.library()
    else:
        animation.library()
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
            raise ValueError(
                f"max_bytes = {max_bytes}; expected None for an mp4: write a gif or webp"
            )
    source = _checked(pictures)
    first = next(source, None)
    if first is None:
        raise ValueError("pictures = (); expected at least one")
    whole = itertools.chain([first], source)
    if file.suffix.lower() == ".mp4":
        shape = video.write(file, whole, fps)
    else:
        shape = animation.write(file, whole, fps, max_bytes)
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
            raise ValueError(
                f"pictures[{k}] has shape {given.shape}; expected (height, width, 3), RGB"
            )
        if shape not in (None, given.shape):
            raise ValueError(f"pictures[{k}] has shape {given.shape}; expected {shape} as before")
        shape = given.shape
        yield picture


def _either(words: Iterable[str]) -> str:
    *most, last = words
    return f"{', '.join(most)} or {last}"
