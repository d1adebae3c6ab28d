"""YAML as plain data: nothing in it is imported, no key stands twice."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from rigid_envs.errors import ConfigError
from rigid_envs.files import read_bytes

__all__ = ["dump_yaml", "parse_yaml", "read_yaml"]

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
    """Data of a YAML text.

    Raises:
        ConfigError: No YAML, a key given twice, an alias, or more depth than makes sense.
    """
    try:
        return _Loader(text).get_single_data()
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        why = " ".join(str(error).split()) or "nested too deeply"  # in one line
        raise ConfigError(f"not readable as YAML: {why:.300}") from None


def read_yaml(path: Path) -> dict[str, Any]:
    """The entries of a YAML file.

    Args:
        path: The file, at most 64 KiB.

    Raises:
        ConfigError: No mapping in readable YAML; the message names the file.
        FileNotFoundError: There is no such file.
    """
    data = read_bytes(path, _LIMIT)
    try:
        values = parse_yaml(data.decode())
    except ValueError as error:
        raise ConfigError(f"{path}: {error}") from None
    if not isinstance(values, dict):
        raise ConfigError(f"{path}: expected a mapping `key: value`, got {type(values).__name__}")
    return values


def dump_yaml(values: Mapping[str, Any]) -> str:
    """Plain data as the text of a YAML file that `read_yaml` takes back."""
    text: str = yaml.dump(dict(values), Dumper=_Dumper, sort_keys=False, default_flow_style=None)
    return text
