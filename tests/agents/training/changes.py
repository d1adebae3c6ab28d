"""Changes of the content of a checkpoint."""

from collections.abc import Callable
from typing import Any

import numpy as np

__all__ = ["Change", "add", "both", "cast", "drop", "forget", "put", "say", "shape"]

Arrays = dict[str, Any]
Change = Callable[[Arrays, dict[str, Any]], None]


def put(member: str, value: float, place: Any = ...) -> Change:
    """Put a value into an array."""

    def change(arrays: Arrays, _: dict[str, Any]) -> None:
        arrays[member][place] = value

    return change


def shape(member: str, *sizes: int) -> Change:
    """Cut an array to a shape, which numbers of the old shape may broadcast to."""

    def change(arrays: Arrays, _: dict[str, Any]) -> None:
        arrays[member] = np.resize(arrays[member], sizes)

    return change


def cast(member: str, kind: str) -> Change:
    """Give an array another type."""

    def change(arrays: Arrays, _: dict[str, Any]) -> None:
        arrays[member] = arrays[member].astype(kind)

    return change


def drop(member: str) -> Change:
    """Leave an array out."""

    def change(arrays: Arrays, _: dict[str, Any]) -> None:
        del arrays[member]

    return change


def add(member: str) -> Change:
    """Add an array."""

    def change(arrays: Arrays, _: dict[str, Any]) -> None:
        arrays[member] = np.zeros(3)

    return change


def say(place: str, value: Any) -> Change:
    """Put a value into the document; a function is given the old one."""

    def change(_: Arrays, document: dict[str, Any]) -> None:
        *path, last = (int(key) if key.isdecimal() else key for key in place.split("."))
        inner: Any = document
        for key in path:
            inner = inner[key]
        inner[last] = value(inner[last]) if callable(value) else value

    return change


def forget(place: str) -> Change:
    """Leave an entry of the document out."""

    def change(_: Arrays, document: dict[str, Any]) -> None:
        *path, last = place.split(".")
        inner = document
        for key in path:
            inner = inner[key]
        del inner[last]

    return change


def both(*changes: Change) -> Change:
    """Make several changes."""

    def change(arrays: Arrays, document: dict[str, Any]) -> None:
        for each in changes:
            each(arrays, document)

    return change
