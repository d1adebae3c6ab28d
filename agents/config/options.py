"""Config entries as options of the command line, put over those of a file."""

# Own options: jsonargparse words refusals itself, and can import classes that YAML names.

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Mapping, Sequence
from typing import Any

from rigid_envs.errors import ConfigError
from rigid_envs.settings import unknown_key

from .by_algorithm import ALGORITHMS, Config, config_from
from .yaml_data import parse_yaml

__all__ = ["add_config_options", "entry_value", "env_keywords", "load_config"]


def add_config_options(parser: argparse.ArgumentParser) -> None:
    """Give a parser one option per config entry, with its help, default and range."""
    groups: dict[tuple[str, ...], Any] = {}
    for name, fields in _fields_by_name().items():
        algos = tuple(fields)
        if algos not in groups:
            whose = "all algorithms" if len(algos) == len(ALGORITHMS) else ", ".join(algos)
            groups[algos] = parser.add_argument_group(f"config, {whose}")
        groups[algos].add_argument(
            f"--{name}", default=argparse.SUPPRESS, metavar="VALUE", help=_help(fields)
        )


def _fields_by_name() -> dict[str, dict[str, dataclasses.Field[Any]]]:
    """Every config entry, as each algorithm that has it defines it."""
    by_name: dict[str, dict[str, dataclasses.Field[Any]]] = {}
    for algo, kind in ALGORITHMS.items():
        for field in dataclasses.fields(kind):
            by_name.setdefault(field.name, {})[algo] = field
    return by_name


def _help(fields: Mapping[str, dataclasses.Field[Any]]) -> str:
    """Help of an entry; for each algorithm by itself where they differ."""
    algos_by_text: dict[str, list[str]] = {}
    for algo, field in fields.items():
        default = {} if field.default is dataclasses.MISSING else field.default
        shown = json.dumps(default)  # as YAML would have it
        rule = field.metadata["rule"]
        text = f"{rule.text} ({rule}; default {shown})".replace("%", "%%")
        algos_by_text.setdefault(text, []).append(algo)
    if len(algos_by_text) == 1:
        return next(iter(algos_by_text))
    return "; ".join(f"{', '.join(algos)}: {text}" for text, algos in algos_by_text.items())


def load_config(
    recipe: Mapping[str, Any], options: Mapping[str, str], rest: Sequence[str]
) -> Config:
    """The config of a recipe, with entries of the command line put over it.

    Args:
        recipe: Entries, as a YAML file gives them.
        options: Entries given as options, each value as YAML text.
        rest: What no option was known for: `--env_kwargs.NAME VALUE`, or a mistake.

    Raises:
        ConfigError: "config.<key>: ...", or the file and what is wrong with it.
    """
    values = {**recipe, **{key: entry_value(key, text) for key, text in options.items()}}
    keywords = env_keywords(rest)
    if keywords:
        values["env_kwargs"] = {**config_from(values).env_kwargs, **keywords}
    return config_from(values)


def env_keywords(rest: Sequence[str]) -> dict[str, Any]:
    """Hyperparameters of the task from `--env_kwargs.NAME VALUE` or `--env_kwargs.NAME=VALUE`.

    Args:
        rest: What no option was known for.

    Raises:
        ConfigError: Something else, or a value that is not YAML.
    """
    keywords: dict[str, Any] = {}
    words = iter(rest)
    for word in words:
        option, equals, value = word.partition("=")
        key = option.removeprefix("--")
        if not key.startswith("env_kwargs."):
            raise unknown_key(key, _fields_by_name())
        text = value if equals else next(words, None)
        if text is None:
            raise ConfigError(f"config.{key}: expected a value after --{key}")
        keywords[key.removeprefix("env_kwargs.")] = entry_value(key, text)
    return keywords


def entry_value(key: str, text: str) -> Any:
    """Value of an entry from the text of an option.

    Args:
        key: The entry.
        text: What was given for it.

    Raises:
        ConfigError: "config.<key>: ...", for text that is not YAML.
    """
    try:
        return parse_yaml(text)
    except ValueError as error:
        raise ConfigError(f"config.{key}: {error}") from None
