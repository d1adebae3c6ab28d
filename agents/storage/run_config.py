"""`config.yaml` of a run: all entries, below a line with their digest.

The line is a comment, so that the file is a config like any other: `train --config` starts a new
run from it, changed by hand or not. Only the run itself must be what it was.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from rigid_envs.errors import ConfigError
from rigid_envs.files import canonical_json, write_atomic

from ..config.by_algorithm import Config, config_from, config_to_dict
from ..config.yaml_data import dump_yaml, parse_yaml, read_yaml

__all__ = ["read_config", "write_config"]

_MARK = "# sha256 of the entries: "


def write_config(path: Path, config: Config) -> None:
    """Write the config of a run, atomically.

    Args:
        path: File to write.
        config: The config.
    """
    text = dump_yaml(config_to_dict(config))
    write_atomic(path, f"{_MARK}{_digest(parse_yaml(text))}\n{text}")


def read_config(path: Path) -> Config:
    """Read the config of a run. One of an older version, without a digest, is taken as it is.

    Args:
        path: File to read.

    Raises:
        ConfigError: Its entries are not those that were written, or none that can be.
        FileNotFoundError: There is no such file.
    """
    values = read_yaml(path)
    first = path.read_text(encoding="utf-8").partition("\n")[0]
    if first.startswith(_MARK) and first != f"{_MARK}{_digest(values)}":
        raise ConfigError(
            f"{path}: its entries do not match their digest, so they are not what the run was "
            "started with; put them back, or start a new run with them: "
            f"python -m agents train --config {path} --run_name NAME"
        )
    try:
        return config_from(values)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None


def _digest(values: dict[str, Any]) -> str:
    """SHA-256 of the entries, whatever their order and spelling in the file."""
    try:
        text = canonical_json(values)
    except (TypeError, ValueError):  # NaN: no config has it
        return "none"
    return hashlib.sha256(text.encode()).hexdigest()
