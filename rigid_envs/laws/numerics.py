"""Numerical helpers of the laws: largest error, rotation matrices by SciPy, random states."""

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from rigid_envs.systems import System

__all__ = ["EPS", "attitudes", "matrices", "max_abs", "quaternion", "random_states"]

Array = npt.NDArray[np.float64]
EPS = float(np.finfo(np.float64).eps)


def max_abs(*values: npt.ArrayLike) -> float:
    """Largest absolute value of all arrays; NaN if one has a NaN."""
    return float(np.max([np.max(np.abs(value)) for value in values]))


def matrices(q: npt.ArrayLike) -> Array:
    """Rotation matrices of quaternions (w, x, y, z) by SciPy, shape (..., 4) to (..., 3, 3)."""
    rows = np.asarray(q, dtype=np.float64)
    found = Rotation.from_quat(rows.reshape(-1, 4), scalar_first=True).as_matrix()
    return np.asarray(found.reshape(*rows.shape[:-1], 3, 3))


def quaternion(y: Array) -> Array:
    """The attitude q, with which states begin, shape (..., 4)."""
    return y[..., :4]


def attitudes(y: Array) -> Array:
    """Rotation matrices of states that begin with q, shape (..., 3, 3)."""
    return matrices(quaternion(y))


def random_states(system: System, n: int, size: float = 1.0) -> tuple[Array, Array]:
    """Random states and inputs, without any symmetry.

    Args:
        system: its states and inputs.
        n: number of states; also the seed.
        size: standard deviation of the normal state entries, bound of the uniform inputs.

    Returns:
        y of shape (n, n_state), attitudes uniform over all rotations, and u of shape (n, n_input).
    """
    rng = np.random.default_rng(n)
    y = size * rng.normal(size=(n, len(system.state_entries)))
    if "q" in system.components:
        q = y[:, system.components["q"]]
        q /= np.linalg.norm(q, axis=-1, keepdims=True)
    return y, size * rng.uniform(-1.0, 1.0, (n, len(system.input_entries)))
