"""Pictures, where they are offered, and what the metadata says of them."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from rigid_envs.testing.deep.subject import Check, Subject, begin, mismatch, proceed

__all__ = ["CHECKS", "REPRODUCIBLE"]

EVERY = 15  # steps


def the_metadata_says_how_it_renders(subject: Subject) -> Iterator[str]:
    """The metadata has `render_modes`, and `render_fps` where it renders."""
    with subject.open() as env:
        metadata = env.metadata
    modes: Any = metadata.get("render_modes")
    if isinstance(modes, str) or not hasattr(modes, "__iter__"):
        yield f"metadata['render_modes'] is {modes!r}, expected a list of modes"
        return
    fps: Any = metadata.get("render_fps")
    real = isinstance(fps, int | float | np.integer | np.floating)
    if list(modes) and not (real and fps > 0):
        yield f"metadata['render_fps'] is {fps!r}, expected a number above 0"


def pictures_are_rgb_arrays_and_change_nothing(subject: Subject) -> Iterator[str]:
    """``render_mode="rgb_array"`` gives uint8 (h, w, 3), and the same episode."""
    if not (_offered(subject) and _possible(subject)):
        return
    found, frames = _watched(subject)
    for k, frame in enumerate(frames):
        if told := _no_picture(frame):
            yield f"render() after {k * EVERY} steps {told}, expected uint8 of shape (h, w, 3)"
            break
    yield from mismatch(found, subject.reference, "with render() in between")


CHECKS: tuple[Check, ...] = (the_metadata_says_how_it_renders,)
REPRODUCIBLE: tuple[Check, ...] = (pictures_are_rgb_arrays_and_change_nothing,)


def _offered(subject: Subject) -> bool:
    with subject.open() as env:
        modes = env.metadata.get("render_modes") or ()
    given = "render_mode" in subject.kwargs
    return "rgb_array" in modes and not given and subject.accepts("render_mode")


def _possible(subject: Subject) -> bool:
    """Whether a first picture can be made here: packages and drivers may be missing."""
    try:
        with subject.open(render_mode="rgb_array") as env:
            begin(env, subject.seed)
            env.render()
    except Exception:  # each driver has errors of its own; `check_env` shows them
        return False
    return True


def _watched(subject: Subject) -> tuple[list[dict[str, Any]], list[Any]]:
    """The episodes, and a picture now and then."""
    with subject.open(render_mode="rgb_array") as env:
        found, frames = [begin(env, subject.seed)], [env.render()]
        for k in range(0, len(subject.actions), EVERY):
            found += proceed(env, subject.actions[k : k + EVERY])
            frames.append(env.render())
    return found, frames


def _no_picture(frame: Any) -> str | None:
    if not isinstance(frame, np.ndarray):
        return f"is of type {type(frame).__name__}"
    if frame.dtype != np.uint8 or frame.ndim != 3 or frame.shape[2] != 3:
        return f"has type {frame.dtype} and shape {frame.shape}"
    return None
