"""Checks at the boundary of the systems: what is refused, and in what words."""

import numpy as np
import numpy.typing as npt

__all__ = ["array_of", "positive", "principal_moments", "unit_attitude"]

Array = npt.NDArray[np.float64]


def array_of(value: npt.ArrayLike, n: int, name: str, entries: str) -> Array:
    """`value` as float64 of shape (..., n), all finite.

    Raises:
        ValueError: if it is not of real numbers, has another last axis, or holds NaN or inf.
    """
    try:
        raw = np.asarray(value)
    except ValueError:  # nested sequences of different lengths
        raw = np.array(None)
    if raw.dtype.kind not in "biuf":  # text would be parsed, complex numbers lose their half
        raise ValueError(f"{name} = {value!r}; expected real numbers ({entries})")
    array = np.asarray(raw, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != n:
        raise ValueError(
            f"{name} has shape {array.shape}; expected (..., {n}), the last axis ({entries})"
        )
    if not np.isfinite(array).all():
        index = tuple(int(k) for k in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{name}{list(index)} = {array[index]}; expected finite numbers")
    return array


def unit_attitude(y: Array, name: str) -> None:
    """Refuse states whose quaternion (the first four entries) is not a unit one.

    Raises:
        ValueError: if a norm differs from 1 by more than 1e-6.
    """
    norm = np.sqrt(np.sum(y[..., :4] ** 2, axis=-1))
    worst = float(np.ravel(norm)[np.argmax(np.abs(norm - 1.0))]) if norm.size else 1.0
    if abs(worst - 1.0) > 1e-6:
        raise ValueError(
            f"{name} holds a quaternion of norm {worst:.9g}; expected 1 within 1e-6: "
            "divide q = (w, x, y, z) by its norm"
        )


def positive(value: float, name: str, unit: str) -> None:
    """Refuse numbers that are not positive and finite.

    Raises:
        ValueError: names the value and its unit.
    """
    if not (_is_finite(value) and value > 0):
        raise ValueError(f"{name} = {value!r}; expected a positive finite number [{unit}]")


def non_negative(value: float, name: str, unit: str) -> None:
    """Refuse numbers that are negative or not finite.

    Raises:
        ValueError: names the value and its unit.
    """
    if not (_is_finite(value) and value >= 0):
        raise ValueError(f"{name} = {value!r}; expected a finite number of at least 0 [{unit}]")


def finite(value: float, name: str, unit: str) -> None:
    """Refuse numbers that are not finite.

    Raises:
        ValueError: names the value and its unit.
    """
    if not _is_finite(value):
        raise ValueError(f"{name} = {value!r}; expected a finite number [{unit}]")


def ball_ratio(beta: float) -> None:
    """Refuse ratios I / (m radius^2) that no ball has: all mass lies within the radius.

    Raises:
        ValueError: not between 0 and 2/3.
    """
    if not (_is_finite(beta) and 0 <= beta <= 2.0 / 3.0 + 1e-9):
        raise ValueError(
            f"beta = {beta!r}; expected I / (m radius^2) of a ball, between 0 (all mass at the "
            "centre) and 2/3 (all on the surface)"
        )


def _is_finite(value: float) -> bool:
    is_number = isinstance(value, int | float | np.floating | np.integer)
    return is_number and not isinstance(value, bool) and bool(np.isfinite(value))


def principal_moments(I1: float, I2: float, I3: float) -> None:
    """Refuse moments that no distribution of mass has.

    Each moment is at most the sum of the other two (Landau & Lifshitz, *Mechanics*, section 32).

    Raises:
        ValueError: if a moment is not positive, or breaks the triangle inequality by more than
            rounding; says which and by how much.
    """
    moments = {"I1": I1, "I2": I2, "I3": I3}
    for name, value in moments.items():
        positive(value, name, "kg m^2")
    for name, value in moments.items():
        excess = 2.0 * value - (I1 + I2 + I3)
        if excess > 1e-9 * value:
            others = " + ".join(other for other in moments if other != name)
            raise ValueError(
                f"{name} = {value} exceeds {others} by {excess:.6g}; expected {name} <= {others}: "
                "no rigid body has such principal moments"
            )
