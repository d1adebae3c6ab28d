"""Piecewise constant plans."""

import numpy as np
import numpy.typing as npt

__all__ = ["piecewise_constant"]

Array = npt.NDArray[np.float64]


def piecewise_constant(values: Array, counts: npt.NDArray[np.int64]) -> Array:
    """Piecewise constant sequence: each value repeated for its number of steps, then zero.

    Args:
        values: K of them for each row, shape (..., K, m).
        counts: shape (..., K).

    Returns:
        Shape (T + 1, ..., m), T the steps of the longest row: the last step is zero for all.
    """
    lead, m = counts.shape[:-1], values.shape[-1]
    last = int(np.max(np.sum(counts, axis=-1), initial=0))
    steps = np.zeros((last + 1, *lead, m))
    for row in np.ndindex(lead):
        whole = np.repeat(values[row], counts[row], axis=0)
        steps[: len(whole), *row] = whole
    return steps
