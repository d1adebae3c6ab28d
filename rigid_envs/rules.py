"""Rules of settings: what a value may be, in words and as a check."""

# Own rules: pydantic and msgspec are no dependencies of the library, and one set serves all.

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

__all__ = [
    "Choice",
    "Either",
    "Flag",
    "Integer",
    "Keywords",
    "List",
    "Null",
    "Number",
    "Rule",
    "Text",
]


class Rule(Protocol):
    """What a setting may be; ``str(rule)`` are the allowed values in words.

    Attributes:
        text: What the setting is.
        unit: Its unit; "1" if it has none, "" if it is no number.
    """

    @property
    def text(self) -> str:
        """See the attributes."""

    @property
    def unit(self) -> str:
        """See the attributes."""

    def check(self, value: Any) -> Any:
        """The value, converted.

        Raises:
            ValueError, TypeError, OverflowError, RecursionError: It is not allowed.
        """


@dataclass(frozen=True)
class Number:
    """A number in [low, high], or ]low, high] if `above`; may be a range if `drawn`."""

    text: str = ""
    unit: str = "1"
    low: float = -math.inf
    high: float = math.inf
    drawn: bool = False
    above: bool = False

    def __str__(self) -> str:
        """The allowed values in words."""
        words = f"a number in {'(' if self.above else '['}{self.low:g}, {self.high:g}]"
        return words + (" or a pair (low, high) of such numbers" if self.drawn else "")

    def check(self, value: Any) -> Any:
        """The value as float, or as a pair of floats."""
        return _pair(value, self._single) if self.drawn and _is_pair(value) else self._single(value)

    def _single(self, value: Any) -> float:
        if _is_bool(value) or not isinstance(value, int | float | np.integer | np.floating):
            raise ValueError
        number = float(value)
        if not (math.isfinite(number) and self.low <= number <= self.high):
            raise ValueError
        if self.above and number == self.low:
            raise ValueError
        return number


@dataclass(frozen=True)
class Integer:
    """An integer in [low, high]; may be a range if `drawn`."""

    text: str
    low: int
    high: int
    unit: str = "1"
    drawn: bool = False

    def __str__(self) -> str:
        """The allowed values in words."""
        words = f"an integer in [{self.low}, {self.high}]"
        return words + (" or a pair (low, high) of such integers" if self.drawn else "")

    def check(self, value: Any) -> Any:
        """The value as int, or as a pair of ints."""
        return _pair(value, self._single) if self.drawn and _is_pair(value) else self._single(value)

    def _single(self, value: Any) -> int:
        if _is_bool(value) or not isinstance(value, int | np.integer):
            raise ValueError
        if not self.low <= value <= self.high:
            raise ValueError
        return int(value)


@dataclass(frozen=True)
class Choice:
    """One of several words."""

    text: str
    options: tuple[str, ...]
    unit: str = ""

    def __str__(self) -> str:
        """The allowed values in words."""
        return "one of " + ", ".join(repr(option) for option in self.options)

    def check(self, value: Any) -> str:
        """The word itself."""
        if not isinstance(value, str) or value not in self.options:
            raise ValueError
        return value


@dataclass(frozen=True)
class Flag:
    """True or False."""

    text: str
    unit: str = ""

    def __str__(self) -> str:
        """The allowed values in words."""
        return "True or False"

    def check(self, value: Any) -> bool:
        """The truth value itself."""
        if not _is_bool(value):
            raise ValueError
        return bool(value)


@dataclass(frozen=True)
class Text:
    """A string of one line that can be printed and passes a test; `words` says which."""

    text: str
    words: str
    test: Callable[[str], object]
    unit: str = ""

    def __str__(self) -> str:
        """The allowed values in words."""
        return self.words

    def check(self, value: Any) -> str:
        """The string itself."""
        if not (isinstance(value, str) and value.isprintable() and self.test(value)):
            raise ValueError
        return value


@dataclass(frozen=True)
class Null:
    """No value: None, null in YAML."""

    text: str = ""
    unit: str = ""

    def __str__(self) -> str:
        """The allowed value in words."""
        return "null"

    def check(self, value: Any) -> None:
        """None itself."""
        if value is not None:
            raise ValueError


@dataclass(frozen=True)
class List:
    """A list of `least` to `most` entries that obey one rule."""

    text: str
    rule: Rule
    least: int
    most: int
    unit: str = ""

    def __str__(self) -> str:
        """The allowed values in words."""
        count = f"{self.least}" if self.least == self.most else f"{self.least} to {self.most}"
        return f"a list of {count} entries, each {self.rule}"

    def check(self, value: Any) -> tuple[Any, ...]:
        """The entries as a tuple."""
        if not isinstance(value, list | tuple) or not self.least <= len(value) <= self.most:
            raise ValueError
        return tuple(self.rule.check(entry) for entry in value)


@dataclass(frozen=True)
class Keywords:
    """A mapping from names to JSON values."""

    text: str
    unit: str = ""

    def __str__(self) -> str:
        """The allowed values in words."""
        return "a mapping from names to numbers, texts, booleans or lists"

    def check(self, value: Any) -> dict[str, Any]:
        """A deep copy."""
        if not isinstance(value, dict) or not all(isinstance(key, str) for key in value):
            raise ValueError
        copy: dict[str, Any] = json.loads(json.dumps(value, allow_nan=False))
        return copy


@dataclass(frozen=True)
class Either:
    """What any of several rules allows; the first that fits converts it."""

    text: str
    rules: tuple[Rule, ...]
    unit: str = ""

    def __str__(self) -> str:
        """The allowed values in words."""
        return ", or ".join(map(str, self.rules))

    def check(self, value: Any) -> Any:
        """The value, converted."""
        for rule in self.rules:
            try:
                return rule.check(value)
            except (ValueError, TypeError, OverflowError):
                continue
        raise ValueError


def _is_bool(value: Any) -> bool:
    return isinstance(value, bool | np.bool_)


def _is_pair(value: Any) -> bool:
    return isinstance(value, list | tuple) and len(value) == 2


def _pair(value: Any, single: Callable[[Any], float]) -> tuple[float, float]:
    low, high = single(value[0]), single(value[1])
    if low > high:
        raise ValueError
    return (low, high)
