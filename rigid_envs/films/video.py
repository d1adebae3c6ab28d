"""MP4 with H.264, encoded by ffmpeg while the pictures come."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import closing
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.files import write_atomic
from rigid_envs.render.needed import needed

__all__ = ["library", "write"]

Image = npt.NDArray[np.uint8]

_QUALITY = (
    *("-crf", "20", "-preset", "veryfast"),
    # the matrix that players assume, and says so; the default is that of old television
    *("-vf", "scale=out_color_matrix=bt709:out_range=tv"),
    *("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709"),
    *("-movflags", "+faststart"),  # a browser begins before it has the whole file
)


def library() -> Any:
    """The module `imageio_ffmpeg`.

    Raises:
        DependencyNotInstalled: it is not installed.
    """
    return needed("imageio_ffmpeg", "films in mp4 need ffmpeg (imageio-ffmpeg)")


def write(path: Path, pictures: Iterator[Image], fps: float) -> tuple[int, int, float, int]:
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
    writer = library().write_frames(
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
