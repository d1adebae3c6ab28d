"""Settings: frozen dataclasses whose every field has a rule, for tasks and for training.

Every refusal starts with ``config.<key>:`` and states the allowed range.
"""

import dataclasses
import difflib
import inspect
import re
from collections.abc import Iterable, Mapping
from typing import Any, ClassVar, get_origin

from rigid_envs.checks import safe_repr
from rigid_envs.errors import ConfigError, UnknownKeywordError
from rigid_envs.rules import Rule

__all__ = ["Settings", "check_fields", "from_config", "refusal", "setting", "unknown_key"]


class Settings:
    """Base of frozen dataclasses in which every field has a rule.

    A subclass that overrides a default, ``radius: float = 2.0``, keeps the rule of the field.
    """

    def __init_subclass__(cls, **keywords: Any) -> None:
        """Give every field its rule.

        Raises:
            TypeError: A field has none.
        """
        super().__init_subclass__(**keywords)
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


def from_config(kind: type[Any], config: Mapping[str, Any]) -> Any:
    """An instance of the dataclass `kind`, unknown keys refused.

    Raises:
        UnknownKeywordError: an unknown key; names the nearest known one.
        ConfigError: a value out of range, or no mapping.
    """
    if not isinstance(config, Mapping):
        raise ConfigError(f"config = {safe_repr(config)}; expected a dict of hyperparameters")
    known = [field.name for field in dataclasses.fields(kind)]
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
    near = difflib.get_close_matches(key.replace("-", "_"), keys)
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
