"""Changes of the content of a checkpoint."""

from collections.abc import Callable
from typing import Any

import numpy as np

Arrays = dict[str, Any]
Change = Callable[[Arrays, dict[str, Any]], Any]


def swap(member: str, change: Callable[[Any], Any]) -> Change:
    """Put what becomes of an array in its place."""
    return lambda arrays, _: arrays.update({member: change(arrays[member])})


def put(member: str, value: float, place: Any = ...) -> Change:
    """Put a value into an array."""
    return lambda arrays, _: arrays[member].__setitem__(place, value)


def shape(member: str, *sizes: int) -> Change:
    """Cut an array to a shape, which numbers of the old shape may broadcast to."""
    return swap(member, lambda array: np.resize(array, sizes))


def cast(member: str, kind: str) -> Change:
    """Give an array another type."""
    return swap(member, lambda array: array.astype(kind))


def drop(member: str) -> Change:
    """Leave an array out."""
    return lambda arrays, _: arrays.pop(member)


def add(member: str) -> Change:
    """Add an array."""
    return lambda arrays, _: arrays.update({member: np.zeros(3)})


def say(place: str, value: Any) -> Change:
    """Put a value into the document; a function is given the old one."""

    def change(_: Arrays, document: dict[str, Any]) -> None:
        inner, last = _found(document, place)
        inner[last] = value(inner[last]) if callable(value) else value

    return change


def forget(place: str) -> Change:
    """Leave an entry of the document out."""

    def change(_: Arrays, document: dict[str, Any]) -> None:
        inner, last = _found(document, place)
        del inner[last]

    return change


def both(*changes: Change) -> Change:
    """Make several changes."""
    return lambda arrays, document: [each(arrays, document) for each in changes]


def _found(document: Any, place: str) -> tuple[Any, Any]:
    """What holds an entry, and its key or number there."""
    *path, last = (int(key) if key.isdecimal() else key for key in place.split("."))
    for key in path:
        document = document[key]
    return document, last
