"""What the value of a config entry may be, in words and as a test."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any, NamedTuple

from rigid_envs.errors import ConfigError

__all__ = [
    "Check",
    "ConfigError",
    "choice",
    "either",
    "flag",
    "keywords",
    "list_of",
    "matching",
    "nothing",
]
__all__ += ["matching", "nothing", "real", "whole"]


class Check(NamedTuple):
    """A kind of value.

    Attributes:
        expected: The kind in words, to follow "expected".
        convert: From what a file says to the value; raises ValueError or TypeError if it cannot.
    """

    expected: str
    convert: Callable[[Any], Any]


def real(low: float = -math.inf, high: float = math.inf, ends: str = "[]") -> Check:
    """A finite number.

    Args:
        low: Least value.
        high: Largest value.
        ends: "[" or "(" and "]" or ")": whether each end belongs to the range.
    """
    left = "(" if low == -math.inf else ends[0]
    right = ")" if high == math.inf else ends[1]

    def convert(value: Any) -> float:
        number = _number(value)
        above = number > low if left == "(" else number >= low
        below = number < high if right == ")" else number <= high
        if not (above and below):
            raise ValueError
        return number

    return Check(f"a number in {left}{low:g}, {high:g}{right}", convert)


def whole(low: int, high: int) -> Check:
    """An integer, both ends included; 3e6 is one.

    Args:
        low: Least value.
        high: Largest value.
    """

    def convert(value: Any) -> int:
        number = _number(value)
        if number != int(number) or not low <= number <= high:
            raise ValueError
        return int(number)

    return Check(f"an integer in [{low}, {high}]", convert)


def flag() -> Check:
    """True or false."""

    def convert(value: Any) -> bool:
        if not isinstance(value, bool):
            raise TypeError
        return value

    return Check("true or false", convert)


def choice(*words: str) -> Check:
    """One of some words.

    Args:
        *words: The words.
    """

    def convert(value: Any) -> str:
        return words[words.index(value)]

    return Check("one of " + ", ".join(words), convert)


def matching(expected: str, test: Callable[[str], object]) -> Check:
    """A text that passes a test.

    Args:
        expected: The test in words.
        test: Its answer is read as true or false.
    """

    def convert(value: Any) -> str:
        if not (isinstance(value, str) and test(value)):
            raise ValueError
        return value

    return Check(expected, convert)


def nothing() -> Check:
    """The value null."""

    def convert(value: Any) -> None:
        if value is not None:
            raise ValueError

    return Check("null", convert)


def list_of(check: Check, least: int, most: int) -> Check:
    """A list.

    Args:
        check: What each entry is.
        least: Least number of entries.
        most: Largest number of entries.
    """

    def convert(value: Any) -> tuple[Any, ...]:
        if not isinstance(value, (list, tuple)) or not least <= len(value) <= most:
            raise ValueError
        return tuple(check.convert(entry) for entry in value)

    count = f"{least}" if least == most else f"{least} to {most}"
    return Check(f"a list of {count} entries, each {check.expected}", convert)


def keywords() -> Check:
    """Keyword arguments: a mapping from names to JSON values."""

    def convert(value: Any) -> dict[str, Any]:
        if not isinstance(value, dict) or not all(isinstance(key, str) for key in value):
            raise TypeError
        copy: dict[str, Any] = json.loads(json.dumps(value, allow_nan=False))
        return copy

    return Check("a mapping from names to numbers, texts, booleans or lists", convert)


def either(*checks: Check) -> Check:
    """Any of several kinds, the first that fits.

    Args:
        *checks: The kinds.
    """

    def convert(value: Any) -> Any:
        for check in checks:
            try:
                return check.convert(value)
            except (TypeError, ValueError):
                continue
        raise ValueError

    return Check(", or ".join(check.expected for check in checks), convert)


def _number(value: Any) -> float:
    if isinstance(value, int) and not isinstance(value, bool):
        return value
    if isinstance(value, float) and math.isfinite(value):
        return value
    raise TypeError
