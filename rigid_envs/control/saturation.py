"""Saturation: actions projected onto the action space."""

import numpy as np
import numpy.typing as npt

__all__ = ["clip_to_ball", "clip_to_box"]

Array = npt.NDArray[np.float64]


def clip_to_box(action: Array) -> Array:
    """Actions, shape (..., m), with each entry clipped to [-1, 1]."""
    return np.asarray(np.clip(action, -1.0, 1.0))


def clip_to_ball(action: Array) -> Array:
    """Actions, shape (..., m), with vectors longer than 1 scaled to length 1."""
    size = np.linalg.norm(action, axis=-1, keepdims=True)
    return np.asarray(action / np.maximum(size, 1.0))
