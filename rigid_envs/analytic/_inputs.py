"""What is refused at the boundary of the oracles, and the sentence that says why."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "FloatArray",
    "finite",
    "non_negative",
    "positive",
    "strictly_between",
    "unit_quaternion",
    "vector",
]

FloatArray = NDArray[np.float64]

# A quaternion printed with 10 digits is still taken; one forgotten to be normalised is not.
_UNIT_TOLERANCE = 1e-9


def finite(name: str, value: ArrayLike) -> FloatArray:
    """Return `value`, any shape, as finite float64 numbers.

    Raises:
        ValueError: NaN or infinity.
    """
    array = np.asarray(value, dtype=np.float64)
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{name} is {array.tolist()}; expected finite numbers")
    return array


def positive(**values: ArrayLike) -> None:
    """Refuse parameters that are not finite and above zero.

    Raises:
        ValueError: the first that is not, by name.
    """
    for name, value in values.items():
        array = finite(name, value)
        if not np.all(array > 0.0):
            raise ValueError(f"{name} is {array.tolist()}; expected above 0")


def non_negative(**values: ArrayLike) -> None:
    """Refuse parameters that are not finite and at least zero.

    Raises:
        ValueError: the first that is not, by name.
    """
    for name, value in values.items():
        array = finite(name, value)
        if not np.all(array >= 0.0):
            raise ValueError(f"{name} is {array.tolist()}; expected 0 or above")


def strictly_between(low: float, high: float, **values: ArrayLike) -> None:
    """Refuse parameters outside the open interval from low to high.

    Raises:
        ValueError: the first that is not inside, by name.
    """
    for name, value in values.items():
        array = finite(name, value)
        if not np.all((array > low) & (array < high)):
            raise ValueError(f"{name} is {array.tolist()}; expected between {low} and {high}")


def vector(name: str, value: ArrayLike, size: int) -> FloatArray:
    """Return `value` as `size` finite float64 numbers.

    Raises:
        ValueError: wrong shape, NaN or infinity.
    """
    array = finite(name, value)
    if array.shape != (size,):
        raise ValueError(f"{name} has shape {array.shape}; expected ({size},): one body at a time")
    return array


def unit_quaternion(name: str, value: ArrayLike) -> FloatArray:
    """Return `value` normalised to rounding.

    Raises:
        ValueError: wrong shape, not finite, or further than 1e-9 from unit length.
    """
    array = vector(name, value, 4)
    length = float(np.linalg.norm(array))
    if abs(length - 1.0) > _UNIT_TOLERANCE:
        raise ValueError(f"{name} has length {length!r}; expected 1: divide it by its norm")
    return array / length
