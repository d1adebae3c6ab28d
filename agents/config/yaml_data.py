"""YAML as plain data: nothing in it is imported, no key stands twice."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import yaml

from rigid_envs.errors import ConfigError
from rigid_envs.files import read_bytes

__all__ = ["dump_yaml", "parse_yaml", "read_yaml"]

_LIMIT = 2**16


def _integer(text: str) -> int:
    return int(text, {"0o": 8, "0x": 16}.get(text[:2], 10))


def _float(text: str) -> float:
    return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))


_TAG = "tag:yaml.org,2002:"
_SCHEMA: dict[str, tuple[str, Callable[[str], Any]]] = {
    "null": (r"null|Null|NULL|~|", lambda text: None),
    "bool": (r"true|True|TRUE|false|False|FALSE", lambda text: text.lower() == "true"),
    # 1_000_000 goes beyond the schema: configs of before have it
    "int": (r"[-+]?[0-9]+(_[0-9]+)*|0o[0-7]+|0x[0-9a-fA-F]+", _integer),
    "float": (
        r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
        _float,
    ),
}
"""What a plain scalar is that is no text, in the core schema of YAML 1.2, section 10.3.2."""


class _Loader(yaml.SafeLoader):
    """Plain data of YAML 1.2, each key once, no aliases (they can grow like 2^n)."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("aliases (*name) are not read here; write the value out")
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        found = super().construct_mapping(node, deep)
        keys = [self.construct_object(key) for key, _ in node.value]
        if len(found) < len(keys):
            again = max(keys, key=keys.count)
            raise yaml.YAMLError(f"key {again!r} is there twice{node.start_mark}")
        return found

    def construct_schema(self, node: yaml.ScalarNode) -> Any:
        """A scalar of `_SCHEMA`; one with a tag need not look like it.

        Raises:
            YAMLError: It does not.
        """
        pattern, value = _SCHEMA[node.tag.removeprefix(_TAG)]
        text = self.construct_scalar(node)
        if not re.fullmatch(pattern, text):
            raise yaml.YAMLError(f"{text!r} is no {node.tag}{node.start_mark}")
        return value(text)


class _Dumper(yaml.SafeDumper):
    """Quotes every text that `_Loader`, or a reader of YAML 1.1, would not read as text."""


_Loader.yaml_implicit_resolvers = {}  # those of YAML 1.1: sexagesimal numbers, dates, yes and no
_Loader.yaml_constructors = {
    tag: yaml.SafeLoader.yaml_constructors[tag]
    for tag in (None, f"{_TAG}str", f"{_TAG}seq", f"{_TAG}map")
}
for _name, (_pattern, _) in _SCHEMA.items():
    for _kind in (_Loader, _Dumper):
        _kind.add_implicit_resolver(f"{_TAG}{_name}", re.compile(rf"(?:{_pattern})\Z"), None)
    _Loader.add_constructor(f"{_TAG}{_name}", _Loader.construct_schema)


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
