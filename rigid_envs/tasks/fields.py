"""Typed fields of a task: what values a hyperparameter takes, and how a wrong one is refused.

Every message starts with ``config.<key>:`` and states the allowed range.
"""

import dataclasses
import difflib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid_envs.errors import ConfigError, UnknownKeywordError

__all__ = [
    "Choice",
    "Flag",
    "Integer",
    "Number",
    "Range",
    "check_fields",
    "from_config",
    "physical",
    "setting",
    "span",
]

Range = float | tuple[float, float]


@dataclass(frozen=True)
class Number:
    """A number in [low, high]; may be a range if `drawn`."""

    text: str
    unit: str = "1"
    low: float = -math.inf
    high: float = math.inf
    drawn: bool = False

    def __str__(self) -> str:
        """The allowed values in words."""
        words = f"a number in [{self.low:g}, {self.high:g}]"
        return words + (" or a pair (low, high) of such numbers" if self.drawn else "")

    def check(self, value: Any) -> Any:
        """The value as float, or as a pair of floats.

        Raises:
            ValueError: anything else.
        """
        return _pair(value, self._single) if self.drawn and _is_pair(value) else self._single(value)

    def _single(self, value: Any) -> float:
        if isinstance(value, bool | np.bool_) or not isinstance(
            value, int | float | np.integer | np.floating
        ):
            raise ValueError
        number = float(value)
        if not (math.isfinite(number) and self.low <= number <= self.high):
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
        """The value as int, or as a pair of ints.

        Raises:
            ValueError: anything else.
        """
        return _pair(value, self._single) if self.drawn and _is_pair(value) else self._single(value)

    def _single(self, value: Any) -> int:
        if isinstance(value, bool | np.bool_) or not isinstance(value, int | np.integer):
            raise ValueError
        if not self.low <= value <= self.high:
            raise ValueError
        return int(value)


def _is_pair(value: Any) -> bool:
    return isinstance(value, list | tuple) and len(value) == 2


def _pair(value: Any, single: Callable[[Any], float]) -> tuple[float, float]:
    low, high = single(value[0]), single(value[1])
    if low > high:
        raise ValueError
    return (low, high)


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
        """The word itself.

        Raises:
            ValueError: any other value.
        """
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
        """The truth value itself.

        Raises:
            ValueError: anything that is not a bool.
        """
        if not isinstance(value, bool | np.bool_):
            raise ValueError
        return bool(value)


def setting(default: Any, rule: Number | Integer | Choice | Flag) -> Any:
    """A dataclass field with its rule."""
    return dataclasses.field(default=default, metadata={"rule": rule})


def physical(default: Range, text: str, unit: str) -> Any:
    """A positive physical parameter: a number, or a range it is drawn from at reset.

    From a grain to a ship: within these bounds no product or quotient of parameters overflows.
    """
    return setting(default, Number(text, unit, 1e-9, 1e6, drawn=True))


def check_fields(task: Any) -> None:
    """Replace every field of a frozen dataclass by its checked value.

    Raises:
        ConfigError: names the key, the value and the allowed range.
    """
    for field in dataclasses.fields(task):
        rule, value = field.metadata["rule"], getattr(task, field.name)
        try:
            checked = rule.check(value)
        except (ValueError, OverflowError):
            raise ConfigError(
                f"config.{field.name}: {value!r} is not allowed; expected {rule} [{rule.unit}]"
                if rule.unit
                else f"config.{field.name}: {value!r} is not allowed; expected {rule}"
            ) from None
        object.__setattr__(task, field.name, checked)


def from_config(kind: type[Any], config: Mapping[str, Any]) -> Any:
    """An instance of the dataclass `kind`, unknown keys refused.

    Raises:
        UnknownKeywordError: an unknown key; names the nearest known one.
        ConfigError: a value out of range.
    """
    known = [field.name for field in dataclasses.fields(kind)]
    for key in config:
        if key not in known:
            near = difflib.get_close_matches(str(key), known, n=1)
            hint = f"did you mean {near[0]!r}? " if near else ""
            raise UnknownKeywordError(
                f"config.{key}: unknown key; {hint}expected one of {', '.join(known)} "
                f"(unexpected keyword argument {key!r})"  # TorchRL looks for these words
            )
    return kind(**config)


def span(value: Range) -> tuple[float, float]:
    """Lower and upper end of a number or range."""
    return value if isinstance(value, tuple) else (value, value)
