"""What an actuator can do: actions brought into their space."""

import numpy as np
import numpy.typing as npt

__all__ = ["within_ball", "within_box"]

Array = npt.NDArray[np.float64]


def within_box(action: Array) -> Array:
    """Each entry into [-1, 1]; shape (..., m)."""
    return np.asarray(np.clip(action, -1.0, 1.0))


def within_ball(action: Array) -> Array:
    """Vectors that are longer than 1 made so long, in their direction; shape (..., m)."""
    size = np.linalg.norm(action, axis=-1, keepdims=True)
    return np.asarray(action / np.maximum(size, 1.0))
