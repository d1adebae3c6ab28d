"""Configs in YAML files, options of the command line, shipped recipes."""

import argparse
import dataclasses
import json
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml
from gymnasium import spaces

from rigid_envs.base.checks import ConfigError, named_refusal
from rigid_envs.base.files import read_bytes
from rigid_envs.base.settings import unknown_key
from rigid_envs.envs.lookup import full_id

from ..environments import make
from .entries import ALGORITHMS, Config, config_from

# YAML as plain data: nothing in it is imported, no key stands twice.

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
    with named_refusal(path):
        values = parse_yaml(data.decode())
    if not isinstance(values, dict):
        raise ConfigError(f"{path}: expected a mapping `key: value`, got {type(values).__name__}")
    return values


def dump_yaml(values: Mapping[str, Any]) -> str:
    """Plain data as the text of a YAML file that `read_yaml` takes back."""
    text: str = yaml.dump(dict(values), Dumper=_Dumper, sort_keys=False, default_flow_style=None)
    return text


# Config entries as options of the command line, put over those of a file.

# Own options: jsonargparse words refusals itself, and can import classes that YAML names.


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
        if not word.startswith("--"):
            expected = f"options alone: to train in an environment, --env_id {word}"
            raise ConfigError(f"argument = {word!r}; expected {expected}")
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
    with named_refusal(f"config.{key}"):
        return parse_yaml(text)


# Shipped config of each environment.

_OF_ANY_ALGORITHM = ("train_kwargs", "cost_price", "success_bonus")
_CONFIGS = Path(__file__).resolve().parents[2] / "configs"


def config_for(env_id: str, entries: Mapping[str, Any], frame: str | None = None) -> Config:
    """The shipped config of an environment, with other entries over it.

    Args:
        env_id: A registered id, or its short form: "BallPark".
        entries: Config entries that go over those of the file.
        frame: Frame of the recipe; None takes that of the entries, or any.

    Raises:
        ConfigError: No such environment, or an entry that cannot be.
    """
    recipe = recipe_for(env_id, entries.get("algo"), frame or frame_of(entries, {}))
    return config_from({**recipe, **entries})


def config_file(path: Path) -> Path:
    """A config file, or the shipped one of a name without folder and ending: `ball_park_ppo`.

    Args:
        path: The file, which goes before a shipped one, or the name.
    """
    file = _CONFIGS / f"{path}.yaml"
    return path if path.exists() or len(path.parts) > 1 or not file.is_file() else file


def frame_of(entries: Mapping[str, Any], keywords: Mapping[str, Any]) -> str | None:
    """The frame that a recipe has to be for; None where any will do.

    Args:
        entries: Config entries that go over those of the recipe.
        keywords: Hyperparameters of the task that go over its `env_kwargs`.
    """
    if "frame" in keywords:
        return str(keywords["frame"])
    if "env_kwargs" not in entries:
        return None
    given = entries["env_kwargs"]  # all of them, which leaves nothing of the recipe's
    return str(given.get("frame", "world")) if isinstance(given, Mapping) else "world"


def recipe_for(env_id: str, algo: str | None = None, frame: str | None = None) -> dict[str, Any]:
    """Entries of the shipped config of an environment.

    They are `configs/<name>_reduced_<algo>.yaml` in the reduced frame, `configs/<name>_<algo>.yaml`
    in that of the world. Where none is shipped: the id, the algorithm and the frame, and, unless a
    law teaches, what the config of another algorithm in this frame says of rewards and period in
    training; for all else the defaults of the algorithm hold.

    Args:
        env_id: A registered id, or its short form: "BallPark".
        algo: Name of the algorithm; None takes the most suitable one that has a config.
        frame: Frame of observations and actions, "world" or "reduced"; None takes the reduced one
            where it has a config.

    Raises:
        ConfigError: No such environment.
    """
    env_id = full_id(env_id)
    plain: dict[str, Any] = {}
    for each in ("reduced", "world") if frame is None else (frame,):
        suitable = _suitable(env_id, each == "reduced")
        algos = suitable if algo is None else (algo,)
        for values in (_shipped(env_id, kind, each) for kind in algos):
            if values:
                return values
        plain = {"env_id": env_id, "algo": algos[0]}
        plain |= {"env_kwargs": {"frame": each}} if each == "reduced" else {}
        if algo == "dagger":
            continue
        others = next(filter(None, (_shipped(env_id, kind, each) for kind in suitable)), {})
        plain |= {key: others[key] for key in _OF_ANY_ALGORITHM if key in others}
    return plain


def _shipped(env_id: str, algo: str, frame: str) -> dict[str, Any]:
    """Entries of the config of an environment, an algorithm and a frame; nothing without one."""
    name = re.sub(r"-v\d+$", "", re.split("[:/]", env_id)[-1])
    stem = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
    path = _CONFIGS / f"{stem}{'_reduced' if frame == 'reduced' else ''}_{algo}.yaml"
    values = read_yaml(path) if path.is_file() else {}
    return values if values.get("env_id") == env_id else {}


def _suitable(env_id: str, reduced: bool) -> tuple[str, ...]:
    """The algorithms that fit an environment, best first.

    PPO makes the most of many cheap steps. In the frame of the world, rewards that are only paid at
    a goal are found in hindsight, and values of a few choices are learnt as such; in the reduced
    frame goals and choices are simple enough for PPO.
    """
    venv = make(env_id, {}, 1)
    goals = isinstance(venv.single_observation_space, spaces.Dict)
    choices = isinstance(venv.single_action_space, spaces.Discrete)
    venv.close()
    if choices:
        return ("ppo", "dqn") if reduced else ("dqn", "ppo")
    return ("sac", "ppo") if goals and not reduced else ("ppo", "sac")
