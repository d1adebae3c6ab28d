"""The boundary: every argument becomes a new, finite float64 array of the right shape, or fails."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
TOLERANCE = 1e-6  # admits attitudes that went through float32, refuses what is no attitude
ROUNDING = 4 * np.finfo(np.float64).eps  # of a length computed in float64
NUMBERS = "expected real numbers; convert it with np.asarray(..., dtype=np.float64)"


def refuse(bad: NDArray[np.bool_], value: Array, name: str, expected: str) -> None:
    """Raise a ValueError that shows the first entry of `value` at which `bad` is true."""
    if np.any(bad):
        index = np.argwhere(bad)[0].tolist()
        where = str(index) if index else ""
        raise ValueError(f"{name}{where} = {value[tuple(index)].tolist()}: expected {expected}")


def real(value: ArrayLike, name: str, *trailing: int) -> Array:
    """Return a float64 copy of `value`, finite and of shape (..., *trailing)."""
    try:
        raw = np.asarray(value)
    except ValueError as error:  # rows of different length
        raise ValueError(f"{name}: {error}; {NUMBERS}") from error
    if raw.dtype.kind not in "iuf":
        raise ValueError(f"{name} = {value!r} has dtype {raw.dtype}: {NUMBERS}")
    if raw.shape[max(raw.ndim - len(trailing), 0) :] != trailing:
        shape = ", ".join(["...", *map(str, trailing)])
        raise ValueError(f"{name} has shape {raw.shape}: expected ({shape}); components come last")
    rows = raw.astype(np.float64)
    refuse(~np.isfinite(rows), rows, name, "finite numbers; find out where this one arose")
    return rows


def norm(rows: Array) -> Array:
    """Return the lengths of the last axis, (..., 1), without overflow or underflow."""
    length: Array = np.hypot.reduce(rows, axis=-1, keepdims=True)
    return length


def direction(rows: Array) -> Array:
    """Return rows / |rows| for rows of any length but zero."""
    _, exponent = np.frexp(np.max(np.abs(rows), axis=-1, keepdims=True))
    scaled: Array = np.ldexp(rows, -exponent)  # exact, and its length is representable
    return scaled / norm(scaled)


def unit(value: ArrayLike, name: str, size: int) -> Array:
    """Return vectors of length 1 within TOLERANCE, normalised unless they are so to rounding."""
    rows = real(value, name, size)
    with np.errstate(over="ignore"):
        length = norm(rows)
    expected = f"length 1 within {TOLERANCE:g}; divide it by its length, unless that is 0"
    refuse(np.abs(length[..., 0] - 1.0) > TOLERANCE, rows, name, expected)
    return np.where(np.abs(length - 1.0) <= ROUNDING, rows, rows / length)


def rotation_matrix(value: ArrayLike, name: str) -> Array:
    """Return matrices with R^T R = 1 within TOLERANCE and det R > 0."""
    rows = real(value, name, 3, 3)
    with np.errstate(over="ignore", invalid="ignore"):
        error = np.max(np.abs(np.swapaxes(rows, -1, -2) @ rows - np.eye(3)), axis=(-1, -2))
    columns = f"orthonormal columns within {TOLERANCE:g}; make them so with matrix_from_rot6d"
    refuse(~(error <= TOLERANCE), rows, name, columns)
    handed = "a right-handed matrix, det = 1; this one has a reflection: swap or negate an axis"
    refuse(np.linalg.det(rows) < 0.0, rows, name, handed)
    return rows
