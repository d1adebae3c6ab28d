"""Where two results of an environment differ, in every bit."""

from collections.abc import Mapping
from typing import Any

import numpy as np

__all__ = ["difference", "leaves"]

_NUMBERS = (bool, int, float, complex, np.generic, np.ndarray)
# seconds since the start, of gymnasium.wrappers.RecordEpisodeStatistics: the clock, not the episode
_CLOCK = "info['episode']['t']"


def difference(found: Any, expected: Any, where: str = "") -> str | None:
    """First difference in type or bits as "PLACE is X, expected Y"; None if there is none.

    Args:
        found: numbers, strings and arrays in dictionaries, lists and tuples.
        expected: the same; objects of other types are not compared.
        where: name of the place.
    """
    if where.endswith(_CLOCK):
        return None
    if type(found) is not type(expected):
        return f"{where} is of type {_type(found)}, expected {_type(expected)}"
    if isinstance(found, Mapping):
        return _difference_of_mappings(found, expected, where)
    if isinstance(found, list | tuple):
        if len(found) != len(expected):
            return f"{where} has length {len(found)}, expected {len(expected)}"
        return _first(found, expected, [f"{where}[{k}]" for k in range(len(found))])
    if isinstance(found, _NUMBERS):
        return _difference_of_arrays(np.asarray(found), np.asarray(expected), where)
    if isinstance(found, str | bytes) and found != expected:
        return f"{where} is {found!r}, expected {expected!r}"
    return None


def leaves(value: Any) -> list[np.ndarray[Any, Any]]:
    """All arrays in nested dictionaries, lists and tuples."""
    if isinstance(value, np.ndarray):
        return [value]
    if isinstance(value, Mapping):
        value = tuple(value.values())
    if isinstance(value, list | tuple):
        return [leaf for part in value for leaf in leaves(part)]
    return []


def _type(value: Any) -> str:
    return type(value).__name__


def _first(found: Any, expected: Any, places: list[str]) -> str | None:
    pairs = zip(found, expected, places, strict=True)
    return next(filter(None, (difference(*pair) for pair in pairs)), None)


def _difference_of_mappings(found: Any, expected: Any, where: str) -> str | None:
    if found.keys() != expected.keys():
        return f"{where} has the keys {list(found)}, expected {list(expected)}"
    # steps have names, their parts have keys
    places = [f"{where}[{key!r}]" if where else f"{key}" for key in found]
    return _first(list(found.values()), [expected[key] for key in found], places)


def _difference_of_arrays(
    found: np.ndarray[Any, Any], expected: np.ndarray[Any, Any], where: str
) -> str | None:
    if found.dtype != expected.dtype or found.shape != expected.shape:
        return (
            f"{where} has type {found.dtype} and shape {found.shape}, "
            f"expected {expected.dtype} and {expected.shape}"
        )
    if found.dtype == object:
        return difference(found.tolist(), expected.tolist(), where)
    if found.tobytes() == expected.tobytes():
        return None
    for index in np.ndindex(found.shape):
        if found[index].tobytes() != expected[index].tobytes():
            at = f"[{', '.join(map(str, index))}]" if index else ""
            return f"{where}{at} is {found[index]!r}, expected {expected[index]!r}"
    return None
