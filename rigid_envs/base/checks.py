"""Checks of arguments, and the errors of what a user asked for."""

import difflib
import math
import sys
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from typing import Annotated, Any, get_origin, get_type_hints

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Errors about what a user asked for. A refusal reads ``name = value; expected what it can be``.


class ConfigError(ValueError):
    """A hyperparameter or setting that is unknown or outside its range."""


@contextmanager
def named_refusal(name: Any) -> Iterator[None]:
    """Give refusals the name of what they are about.

    Args:
        name: With which their message then begins.

    Raises:
        ConfigError: In place of a ValueError.
    """
    try:
        yield
    except ValueError as error:
        raise ConfigError(f"{name}: {error}") from None


def one_named(name: str, known: Collection[str], what: str) -> str:
    """The name itself, if it is known.

    Args:
        name: What was asked for.
        known: All names.
        what: Of what they are.

    Raises:
        ConfigError: Names the nearest one and lists all.
    """
    if name in known:
        return name
    (near,) = difflib.get_close_matches(name.lower(), known, n=1, cutoff=0.0)
    expected = f"one of {', '.join(known)}: did you mean {near!r}?"
    raise ConfigError(f"{what} = {name!r}; expected {expected}")


class MissingPackageError(ImportError):
    """A package of an extra that is not installed."""


class UnknownKeywordError(ConfigError, TypeError):
    """A keyword that an environment does not take.

    It is a `TypeError` too, as for any Python call: programs that probe what an environment takes
    (Stable-Baselines3 with ``render_mode``, TorchRL with ``frameskip``) go on without the keyword.
    """


# Argument checks: each returns the checked value or raises a ValueError in one grammar.
#
# A refusal reads ``name = value; expected what it can be``, for a wrong shape ``name has shape
# (3,); expected (..., 4)``, followed where useful by ``: how to mend it``. Booleans are no numbers.

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Image = NDArray[np.uint8]
Integers = NDArray[np.int64]
Singles = NDArray[np.float32]

TOLERANCE = 1e-6
"""Of unit quaternions and rotation matrices: rounding to float32 passes, no other error does."""

_LONGEST = 300  # characters of a value that a message shows, and of a text that is shown


def safe_repr(value: Any) -> str:
    """The `repr` of anything, no more of it than fits a line or two."""
    try:
        text = repr(value)
    except Exception:  # of an object whose own code fails
        text = object.__repr__(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."


def shown(text: str) -> str:
    """A text as a terminal may be given it: control characters are spelt out, line breaks stay.

    Args:
        text: Any text; parts of it may come from a file.
    """
    return "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in text)


def as_array(value: Any) -> NDArray[Any]:
    """The value as NumPy makes an array of it; of objects where it cannot."""
    try:
        return np.asarray(value)
    except Exception:  # sequences of different lengths, objects whose own code fails
        return np.asarray(None)


def require(ok: bool | NDArray[np.bool_], value: Any, name: str, expected: str) -> None:
    """Refuse a value unless the condition holds, in the words of this module.

    Args:
        ok: the condition, or one for each entry along the leading axes of `value`; the first entry
            that breaks it is shown with its index.
        value: any value; an array where `ok` is one.
        name: of the argument.
        expected: what the value can be, and how to mend it.

    Raises:
        ValueError: the condition does not hold.
    """
    if ok is True or np.all(ok):
        return
    index = np.argwhere(~np.asarray(ok))[0].tolist()
    entry = np.asarray(value)[tuple(index)] if index else value
    raise ValueError(f"{name}{index or ''} = {_text(entry)}; expected {expected}")


def real_numbers(value: ArrayLike, name: str, entries: str = "") -> Array:
    """Real numbers as float64, NaN and infinity among them.

    Text would be parsed, and complex numbers would lose their imaginary part.

    Raises:
        ValueError: no real numbers.
    """
    raw = as_array(value)
    if raw.dtype.kind not in "iuf" or _holds_boolean(value):
        layout = f" ({entries})" if entries else ""
        raise ValueError(f"{name} = {_text(value)}; expected real numbers{layout}")
    return np.asarray(raw, dtype=np.float64)


def array(value: ArrayLike, name: str, *shape: int, entries: str = "") -> Array:
    """Finite float64 numbers of shape (..., *shape).

    Args:
        value: any array-like.
        name: of the argument.
        *shape: the last axes.
        entries: names of the entries of the last axis, for the message.

    Raises:
        ValueError: no real numbers, another shape, NaN or infinity.
    """
    rows = real_numbers(value, name, entries)
    if shape and rows.shape[-len(shape) :] != shape:
        expected = ", ".join(["...", *map(str, shape)])
        layout = f": the last axis is ({entries})" if entries else ""
        raise ValueError(f"{name} has shape {rows.shape}; expected ({expected}){layout}")
    require(np.isfinite(rows), rows, name, "finite numbers")
    return rows


def exact_array(value: ArrayLike, name: str, *shape: int | str) -> Array:
    """Finite float64 numbers of this shape and no other.

    Args:
        value: any array-like.
        name: of the argument.
        *shape: lengths of the axes; a letter stands for any length but 0.

    Raises:
        ValueError: no real numbers, another shape, NaN or infinity.
    """
    rows = array(value, name)
    fits = len(shape) == rows.ndim and all(
        n > 0 if isinstance(length, str) else n == length
        for n, length in zip(rows.shape, shape, strict=True)
    )
    if not fits:
        expected = ", ".join(map(str, shape)) + ("," if len(shape) == 1 else "")
        raise ValueError(f"{name} has shape {rows.shape}; expected ({expected})")
    return rows


def positive_array(value: ArrayLike, name: str, unit: str = "", *shape: int) -> Array:
    """Positive finite float64 numbers, of any shape or of the one given.

    Raises:
        ValueError: no real numbers, or one that is not positive and finite.
    """
    rows = exact_array(value, name, *shape) if shape else array(value, name)
    require(rows > 0.0, rows, name, f"positive finite numbers{_in(unit)}")
    return rows


def between(value: ArrayLike, name: str, low: float, high: float) -> Array:
    """Float64 numbers of any shape, inside an open interval.

    Raises:
        ValueError: no real numbers, or one that is not above `low` and below `high`.
    """
    rows = array(value, name)
    expected = f"numbers above {low:.9g} and below {high:.9g}"
    require((rows > low) & (rows < high), rows, name, expected)
    return rows


def number(value: float, name: str, unit: str = "") -> float:
    """A finite number.

    Raises:
        ValueError: a boolean, no real number, NaN or infinity.
    """
    return _number(value, name, f"a finite number{_in(unit)}")


def positive(value: float, name: str, unit: str = "") -> float:
    """A positive finite number.

    Raises:
        ValueError: a boolean, no real number, or one that is not positive and finite.
    """
    expected = f"a positive finite number{_in(unit)}"
    checked = _number(value, name, expected)
    require(checked > 0.0, value, name, expected)
    return checked


def non_negative(value: float, name: str, unit: str = "") -> float:
    """A finite number of at least 0.

    Raises:
        ValueError: a boolean, no real number, or one that is negative or not finite.
    """
    expected = f"a finite number of at least 0{_in(unit)}"
    checked = _number(value, name, expected)
    require(checked >= 0.0, value, name, expected)
    return checked


def all_finite(**values: float) -> None:
    """Refuse parameters that are not finite numbers.

    Raises:
        ValueError: the first that is not, by name.
    """
    for name, value in values.items():
        number(value, name)


def all_positive(**values: float) -> None:
    """Refuse parameters that are not positive finite numbers.

    Raises:
        ValueError: the first that is not, by name.
    """
    for name, value in values.items():
        positive(value, name)


def all_non_negative(**values: float) -> None:
    """Refuse parameters that are not finite numbers of at least 0.

    Raises:
        ValueError: the first that is not, by name.
    """
    for name, value in values.items():
        non_negative(value, name)


def positive_fields(owner: object, **units: str) -> None:
    """Refuse fields of an object that are not positive finite numbers.

    Args:
        owner: the object.
        **units: unit of each field, by its name.

    Raises:
        ValueError: the first that is not, by name.
    """
    for name, unit in units.items():
        positive(getattr(owner, name), name, unit)


class CheckedFields:
    """Base of dataclasses that checks every field like ``Annotated[float, positive, "N m"]``."""

    def __post_init__(self) -> None:
        """Check every field that says how.

        Raises:
            ValueError: the first that its check refuses, by name.
        """
        for name, hint in get_type_hints(type(self), include_extras=True).items():
            if get_origin(hint) is Annotated:
                check, *more = hint.__metadata__
                check(getattr(self, name), name, *more)


def one_of(value: Any, known: Collection[str], name: str) -> str:
    """One of some names.

    Raises:
        ValueError: something else.
    """
    require(isinstance(value, str) and value in known, value, name, f"one of {list(known)}")
    return str(value)


def printable(value: Any, name: str) -> Any:
    """JSON values of which every text, also of a key, is one line that can be shown.

    What a file says is printed, drawn and written into tables: a control character would steer the
    terminal, a line break begin a row of its own.

    Args:
        value: Any value; of mappings and lists all texts in them are checked.
        name: of the value.

    Raises:
        ValueError: a text with a character that cannot be printed, or one that is too long.
    """
    rest = [value]
    while rest:
        each = rest.pop()
        if isinstance(each, str):
            ok = each.isprintable() and len(each) <= _LONGEST
            expected = f"one line of at most {_LONGEST} characters that can be printed"
            require(ok, each, name, expected)
        elif isinstance(each, Mapping):
            rest += [*each.keys(), *each.values()]
        elif isinstance(each, list | tuple):
            rest += each
    return value


def integer(value: float, name: str, least: int) -> int:
    """An integer of at least `least`; 2.0 is one, as NumPy yields it.

    Raises:
        ValueError: a boolean, no integer, one that is too small, or one beyond those of doubles.
    """
    expected = f"an integer of at least {least}"
    checked = _number(value, name, expected)
    require(checked.is_integer() and checked >= least, value, name, expected)
    require(checked < 2.0**53, value, name, f"{expected}, and below 2^53")
    return int(value)


def unit_length(length: Array, rows: Array, name: str) -> None:
    """Refuse vectors, shape (..., n), unless their lengths (...) are 1 within `TOLERANCE`.

    Raises:
        ValueError: the first that is not a unit vector.
    """
    expected = f"length 1 within {TOLERANCE:g}: divide it by its length"
    require(np.abs(length - 1.0) <= TOLERANCE, rows, name, expected)


def unit_quaternion(value: ArrayLike, name: str) -> Array:
    """Unit quaternions (w, x, y, z), shape (..., 4), as they are: not normalised.

    Raises:
        ValueError: another shape, no finite numbers, or a length that is not 1 within `TOLERANCE`.
    """
    rows = array(value, name, 4, entries="w, x, y, z")
    with np.errstate(over="ignore"):
        unit_length(np.sqrt(np.einsum("...i,...i->...", rows, rows)), rows, name)
    return rows


def rotation_matrix(value: ArrayLike, name: str) -> Array:
    """Rotation matrices, shape (..., 3, 3), R^T R = 1 within `TOLERANCE` and det R = 1.

    Raises:
        ValueError: another shape, no finite numbers, not orthonormal, or a reflection.
    """
    rows = array(value, name, 3, 3)
    with np.errstate(over="ignore", invalid="ignore"):
        error = np.max(np.abs(np.swapaxes(rows, -1, -2) @ rows - np.eye(3)), axis=(-1, -2))
    expected = f"orthonormal columns within {TOLERANCE:g}: make them so with matrix_from_rot6d"
    require(error <= TOLERANCE, rows, name, expected)
    handed = "a right-handed matrix, det = 1: this is a reflection, swap or negate an axis"
    require(np.linalg.det(rows) >= 0.0, rows, name, handed)
    return rows


def _number(value: Any, name: str, expected: str) -> float:
    checked = math.nan
    if isinstance(value, int | float) and not isinstance(value, bool):
        checked = float(value) if abs(value) <= sys.float_info.max else math.nan
    elif isinstance(value, np.generic | np.ndarray) and value.dtype.kind in "iuf":
        checked = math.nan if value.shape else float(value)
    require(math.isfinite(checked), value, name, expected)
    return checked


def _holds_boolean(value: Any) -> bool:
    """Whether a nested sequence has a boolean in it, which NumPy would take for 0 or 1."""
    if isinstance(value, list | tuple):
        return any(map(_holds_boolean, value))
    return isinstance(value, bool | np.bool_) or getattr(value, "dtype", None) == np.bool_


def _in(unit: str) -> str:
    return f" [{unit}]" if unit else ""


def _text(value: Any) -> str:
    """How a message shows a value: numbers of NumPy as plain ones."""
    return safe_repr(value.tolist() if isinstance(value, np.generic | np.ndarray) else value)
