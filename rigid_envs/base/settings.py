"""Frozen dataclasses whose every field has a rule: what a value may be, and how it is refused."""

import abc
import dataclasses
import difflib
import inspect
import json
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar, get_origin

import numpy as np

from rigid_envs.base.checks import ConfigError, UnknownKeywordError, safe_repr

# Rules of settings: what a value may be, in words and as a check.

# Own rules: pydantic and msgspec are no dependencies of the library, and one set serves all.


@dataclass(frozen=True)
class Rule(abc.ABC):
    """What a setting may be; ``str(rule)`` are the allowed values in words.

    Attributes:
        text: What the setting is.
        unit: Its unit; "1" if it has none, "" if it is no number.
    """

    text: str
    unit: str = dataclasses.field(default="", kw_only=True)

    @abc.abstractmethod
    def check(self, value: Any) -> Any:
        """The value, converted.

        Raises:
            ValueError, TypeError, OverflowError, RecursionError: It is not allowed.
        """


@dataclass(frozen=True)
class Number(Rule):
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
        _require(not _is_bool(value) and isinstance(value, int | float | np.integer | np.floating))
        number = float(value)
        _require(math.isfinite(number) and self.low <= number <= self.high)
        _require(not (self.above and number == self.low))
        return number


@dataclass(frozen=True)
class Integer(Rule):
    """An integer in [low, high]; may be a range if `drawn`."""

    low: int
    high: int
    unit: str = dataclasses.field(default="1", kw_only=True)
    drawn: bool = False

    def __str__(self) -> str:
        """The allowed values in words."""
        words = f"an integer in [{self.low}, {self.high}]"
        return words + (" or a pair (low, high) of such integers" if self.drawn else "")

    def check(self, value: Any) -> Any:
        """The value as int, or as a pair of ints."""
        return _pair(value, self._single) if self.drawn and _is_pair(value) else self._single(value)

    def _single(self, value: Any) -> int:
        _require(not _is_bool(value) and isinstance(value, int | np.integer))
        _require(self.low <= value <= self.high)
        return int(value)


@dataclass(frozen=True)
class Choice(Rule):
    """One of several words."""

    options: tuple[str, ...]

    def __str__(self) -> str:
        """The allowed values in words."""
        return "one of " + ", ".join(repr(option) for option in self.options)

    def check(self, value: Any) -> str:
        """The word itself."""
        _require(isinstance(value, str) and value in self.options)
        return str(value)


@dataclass(frozen=True)
class Flag(Rule):
    """True or False."""

    def __str__(self) -> str:
        """The allowed values in words."""
        return "True or False"

    def check(self, value: Any) -> bool:
        """The truth value itself."""
        _require(_is_bool(value))
        return bool(value)


@dataclass(frozen=True)
class Text(Rule):
    """A string of one line that can be printed and passes a test; `words` says which."""

    words: str
    test: Callable[[str], object]

    def __str__(self) -> str:
        """The allowed values in words."""
        return self.words

    def check(self, value: Any) -> str:
        """The string itself."""
        _require(isinstance(value, str) and value.isprintable() and bool(self.test(value)))
        return str(value)


@dataclass(frozen=True)
class Null(Rule):
    """No value: None, null in YAML."""

    text: str = ""

    def __str__(self) -> str:
        """The allowed value in words."""
        return "null"

    def check(self, value: Any) -> None:
        """None itself."""
        _require(value is None)


@dataclass(frozen=True)
class List(Rule):
    """A list of `least` to `most` entries that obey one rule."""

    rule: Rule
    least: int
    most: int

    def __str__(self) -> str:
        """The allowed values in words."""
        count = f"{self.least}" if self.least == self.most else f"{self.least} to {self.most}"
        return f"a list of {count} entries, each {self.rule}"

    def check(self, value: Any) -> tuple[Any, ...]:
        """The entries as a tuple."""
        _require(isinstance(value, list | tuple) and self.least <= len(value) <= self.most)
        return tuple(self.rule.check(entry) for entry in value)


@dataclass(frozen=True)
class Keywords(Rule):
    """A mapping from names to JSON values."""

    def __str__(self) -> str:
        """The allowed values in words."""
        return "a mapping from names to numbers, texts, booleans or lists"

    def check(self, value: Any) -> dict[str, Any]:
        """A deep copy."""
        _require(isinstance(value, dict) and all(isinstance(key, str) for key in value))
        copy: dict[str, Any] = json.loads(json.dumps(value, allow_nan=False))
        return copy


@dataclass(frozen=True)
class Either(Rule):
    """What any of several rules allows; the first that fits converts it."""

    rules: tuple[Rule, ...]

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


def _require(ok: bool) -> None:
    if not ok:
        raise ValueError


def _is_bool(value: Any) -> bool:
    return isinstance(value, bool | np.bool_)


def _is_pair(value: Any) -> bool:
    return isinstance(value, list | tuple) and len(value) == 2


def _pair(value: Any, single: Callable[[Any], float]) -> tuple[float, float]:
    low, high = single(value[0]), single(value[1])
    _require(low <= high)
    return (low, high)


# Settings: frozen dataclasses whose every field has a rule, for tasks and for training.
#
# Every refusal starts with ``config.<key>:`` and states the allowed range.


class Settings:
    """Base of frozen dataclasses in which every field has a rule.

    A subclass that overrides a default, ``radius: float = 2.0``, keeps the rule of the field.
    """

    def __init_subclass__(cls) -> None:
        """Give every field its rule.

        Raises:
            TypeError: A field has none.
        """
        rules = _inherited(cls)
        own = inspect.get_annotations(cls)
        for name in rules.keys() & vars(cls).keys() - own.keys():
            raise TypeError(
                f"{cls.__qualname__}.{name} = {vars(cls)[name]!r:.100}; expected an annotation, "
                f"without which it is no field: {name}: ... = ..."
            )
        for name in (name for name, kind in own.items() if not _is_class_variable(kind)):
            default = getattr(cls, name, dataclasses.MISSING)
            if isinstance(default, dataclasses.Field) and "rule" in default.metadata:
                continue
            if name not in rules or isinstance(default, dataclasses.Field):
                raise TypeError(
                    f"{cls.__qualname__}.{name} has no rule; expected {name}: float = "
                    'setting(1.0, Number("what it is", "m", 0.0, 10.0)) or the like'
                )
            setattr(cls, name, setting(default, rules[name]))


def setting(default: Any, rule: Rule) -> Any:
    """A dataclass field with its rule."""
    if isinstance(default, dict):
        return dataclasses.field(default_factory=default.copy, metadata={"rule": rule})
    return dataclasses.field(default=default, metadata={"rule": rule})


def check_fields(settings: Any) -> None:
    """Replace every field of a frozen dataclass by its checked value.

    Raises:
        ConfigError: names the key, the value and the allowed range.
        TypeError: a subclass with fields of its own is not decorated as a dataclass.
    """
    kind = type(settings)
    if any(isinstance(value, dataclasses.Field) for value in vars(kind).values()):
        raise TypeError(f"{kind.__qualname__} is no dataclass; expected @dataclass(frozen=True)")
    for field in dataclasses.fields(settings):
        value = checked(field.name, getattr(settings, field.name), field.metadata["rule"])
        object.__setattr__(settings, field.name, value)


def checked(key: str, value: Any, rule: Rule) -> Any:
    """The value as its rule has it.

    Raises:
        ConfigError: the rule does not allow it.
    """
    try:
        return rule.check(value)
    except (ValueError, TypeError, OverflowError, RecursionError):
        unit = "" if rule.unit in ("", "1") else f" [{rule.unit}]"
        raise refusal(key, value, f"{rule}{unit}") from None


Kind = TypeVar("Kind", bound=Settings)


def from_config(kind: type[Kind], config: Mapping[str, Any]) -> Kind:
    """An instance of the dataclass `kind`, unknown keys refused.

    Raises:
        UnknownKeywordError: an unknown key; names the nearest known one.
        ConfigError: a value out of range, or no mapping.
    """
    if not isinstance(config, Mapping):
        raise ConfigError(f"config = {safe_repr(config)}; expected a dict of hyperparameters")
    known = [field.name for field in dataclasses.fields(kind)]  # type: ignore[arg-type]
    for key in config:
        if key not in known:
            raise unknown_key(str(key), known)
    return kind(**config)


def refusal(key: str, value: Any, expected: str) -> ConfigError:
    """The error for a value that is not allowed.

    Args:
        key: Dotted key of the setting.
        value: What it was given.
        expected: The allowed values in words, and where useful how to mend it.
    """
    given = safe_repr(value)[:100]
    return ConfigError(f"config.{key}: {key.split('.')[-1]} = {given}; expected {expected}")


def unknown_key(key: str, known: Iterable[str]) -> UnknownKeywordError:
    """The error for a key that does not exist.

    Args:
        key: The key.
        known: Those that do.
    """
    keys = list(known)
    given = key.replace("-", "_")
    near = difflib.get_close_matches(given, keys)
    near.sort(key=lambda other: sorted(other) != sorted(given))  # letters that were swapped
    hint = f"did you mean {near[0]!r}? " if near else ""
    return UnknownKeywordError(
        f"config.{key}: unknown key; {hint}expected one of {', '.join(keys)} "
        f"(unexpected keyword argument {key!r})"  # TorchRL looks for these words
    )


def _inherited(kind: type[Any]) -> dict[str, Rule]:
    """Rules of the fields of all base classes, the nearest first."""
    rules: dict[str, Rule] = {}
    for base in reversed(kind.__mro__[1:]):
        fields = vars(base).get("__dataclass_fields__", {}).values()
        rules |= {f.name: f.metadata["rule"] for f in fields if "rule" in f.metadata}
    return rules


def _is_class_variable(annotation: Any) -> bool:
    if isinstance(annotation, str):
        return re.match(r"(\w+\.)?ClassVar\b", annotation) is not None
    return annotation is ClassVar or get_origin(annotation) is ClassVar
