"""Panels of a replay page: a scene with its frames, for the motion and for the insets beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from rigid_envs.render.scene import Frame, Scene

__all__ = ["Panel"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Panel:
    """A scene over time.

    Attributes:
        title: What it shows.
        scene: What there is.
        frames: Where it is, at each time.
        times: Times of the frames [s].
        whole: Points of traces of the scene that are shown from the start, by name, each (n, 3).
    """

    title: str
    scene: Scene
    frames: Sequence[Frame]
    times: Array
    whole: Mapping[str, npt.ArrayLike] = field(default_factory=dict)
