"""Configs from YAML files and the command line. YAML is data: nothing in it is imported."""

# Own loading: jsonargparse words its refusals itself and can import classes that YAML names.

from __future__ import annotations

import argparse
import dataclasses
import json
import re
from collections.abc import Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

import yaml

from rigid_envs.errors import ConfigError
from rigid_envs.files import read_bytes
from rigid_envs.settings import unknown_key

from .config import ALGORITHMS, Config, config_from, config_to_dict

__all__ = ["add_config_options", "dump_yaml", "load_config", "parse_yaml", "read_yaml"]

_LIMIT = 2**16


class _Loader(yaml.SafeLoader):
    """Plain data, each key once, 1e-3 a number (YAML 1.2), no aliases (they can grow like 2^n)."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("aliases (*name) are not read here; write the value out")
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[Any] = set()
        for key_node, _ in node.value:
            key = key_node.value
            if key in seen:
                raise yaml.YAMLError(f"key {key!r} is there twice{key_node.start_mark}")
            seen.add(key)
        return super().construct_mapping(node, deep)


class _Dumper(yaml.SafeDumper):
    """Quotes every text that `_Loader` would read as a number."""


for kind in (_Loader, _Dumper):
    kind.add_implicit_resolver(
        "tag:yaml.org,2002:float",
        re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?$"),
        list("-+.0123456789"),
    )


def parse_yaml(text: str) -> Any:
    """The data that a YAML text stands for.

    Args:
        text: The text.

    Raises:
        ConfigError: No YAML, a key given twice, an alias, or more depth than makes sense.
    """
    try:
        return _Loader(text).get_single_data()
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        why = str(error) or "nested too deeply"
        raise ConfigError(f"not readable as YAML: {why:.300}") from None


def read_yaml(path: Path) -> dict[str, Any]:
    """The entries of a YAML file.

    Args:
        path: The file, at most 64 KiB.

    Raises:
        ConfigError: No mapping in readable YAML; the message names the file.
        FileNotFoundError: No file.
    """
    data = read_bytes(path, _LIMIT)
    try:
        values = parse_yaml(data.decode())
    except ValueError as error:
        raise ConfigError(f"{path}: {error}") from None
    if not isinstance(values, dict):
        raise ConfigError(f"{path}: expected a mapping `key: value`, got {type(values).__name__}")
    return values


def dump_yaml(config: Config) -> str:
    """A config as a YAML file that `read_yaml` and `config_from` take back."""
    document = config_to_dict(config)
    text: str = yaml.dump(document, Dumper=_Dumper, sort_keys=False, default_flow_style=None)
    return text


def add_config_options(parser: argparse.ArgumentParser) -> None:
    """Give a parser one option per config entry, with its help, default and range.

    Args:
        parser: The parser.
    """
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
    """What an entry is; for each algorithm by itself where they differ."""
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
    values = {**recipe, **{key: _value(key, text) for key, text in options.items()}}
    keywords = _keywords(rest)
    if keywords:
        values["env_kwargs"] = {**config_from(values).env_kwargs, **keywords}
    return config_from(values)


def _keywords(rest: Sequence[str]) -> dict[str, Any]:
    """The pairs `--env_kwargs.NAME VALUE` or `--env_kwargs.NAME=VALUE`."""
    keywords: dict[str, Any] = {}
    words = [part for word in rest for part in word.split("=", 1)]
    for option, text in zip_longest(words[::2], words[1::2]):
        key = option.removeprefix("--")
        if not key.startswith("env_kwargs."):
            raise unknown_key(key, _fields_by_name())
        if text is None:
            raise ConfigError(f"config.{key}: expected a value after --{key}")
        keywords[key.removeprefix("env_kwargs.")] = _value(key, text)
    return keywords


def _value(key: str, text: str) -> Any:
    try:
        return parse_yaml(text)
    except ValueError as error:
        raise ConfigError(f"config.{key}: {error}") from None
