"""Replay: episodes of one environment in a file that says what they are and runs no code."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs import catalogue
from rigid_envs.archive import read_arrays, write_arrays
from rigid_envs.checks import printable
from rigid_envs.errors import ConfigError
from rigid_envs.files import DamagedFileError, canonical_json
from rigid_envs.provenance import provenance
from rigid_envs.registry import ENVIRONMENTS, load
from rigid_envs.replays.checking import episodes_from, row_names
from rigid_envs.replays.episode import ARRAYS, Episode, checked_label
from rigid_envs.tasks import Task

__all__ = ["FORMAT", "VERSION", "Replay", "id_of", "load_replay"]

FORMAT, VERSION = "rigid-envs replay", 2
_HEADER = "header"
_KEYS = {"format", "version", "env_id", "config", "rows", "units", "episodes", "provenance"}


@dataclass(frozen=True, eq=False)
class Replay:
    """Episodes of one environment with the settings of its task.

    The file is a NumPy archive (.npz). ``header`` holds the bytes of a JSON document (UTF-8):
    ``format``, ``version``, ``env_id``, ``config`` (every setting of the task), ``rows`` (names of
    the entries of state, input, action, auxiliary state and parameters), ``units`` (of the cost;
    the metric that is its cost), ``provenance``, and for each episode k ``label``,
    ``terminated`` and ``truncated``. Its arrays are ``k/y``, ``k/u`` and so on, the attributes of
    `Episode`, with ``k/parameters`` and ``k/start/<part>``. No array is pickled.

    Attributes:
        env_id: Gymnasium's id.
        task: Its task.
        episodes: At least one.
        provenance: Versions, commit, machine and date that it comes from.
    """

    env_id: str
    task: Task
    episodes: tuple[Episode, ...]
    provenance: Mapping[str, Any] = field(default_factory=provenance)

    def __post_init__(self) -> None:
        """Refuse a replay of nothing, and text that cannot be shown."""
        if not self.episodes:
            raise ValueError("episodes = (); expected at least one: play an episode first")
        for k, episode in enumerate(self.episodes):
            checked_label(episode.label, f"episodes[{k}].label")
        printable(self.provenance, "provenance")

    def save(self, path: str | Path) -> Path:
        """Write the file, atomically.

        Args:
            path: Its path; ".npz" is added where it has no such ending, missing folders are made.

        Returns:
            The path that was written.
        """
        file = Path(path)
        file = file if file.suffix == ".npz" else file.with_name(f"{file.name}.npz")
        file.parent.mkdir(parents=True, exist_ok=True)
        header = np.frombuffer(canonical_json(self._header()).encode(), dtype=np.uint8)
        arrays: dict[str, npt.NDArray[Any]] = {_HEADER: header}
        for k, episode in enumerate(self.episodes):
            arrays |= {f"{k}/{name}": getattr(episode, name) for name in ARRAYS}
            arrays[f"{k}/parameters"] = np.array(list(episode.parameters.values()))
            arrays |= {f"{k}/start/{name}": part for name, part in episode.start.items()}
        write_arrays(file, arrays)
        return file

    def _header(self) -> dict[str, Any]:
        return {
            "format": FORMAT,
            "version": VERSION,
            "env_id": self.env_id,
            "config": dataclasses.asdict(self.task),
            "rows": row_names(self.task),
            "units": {"cost": self.task.cost_unit, "metric": ENVIRONMENTS[self.env_id].metrics[0]},
            "provenance": dict(self.provenance),
            "episodes": [
                {"label": e.label, "terminated": e.terminated, "truncated": e.truncated}
                for e in self.episodes
            ],
        }


def load_replay(path: str | Path) -> Replay:
    """Read a replay, and check everything in it.

    Args:
        path: The file.

    Raises:
        DamagedFileError: Not a replay, cut, changed, of another version or another environment;
            the message names the file, the entry and what was expected.
        FileNotFoundError: There is no such file.
    """
    file = Path(path)
    arrays = read_arrays(file)
    try:
        header = _read_header(arrays.pop(_HEADER, None))
        env_id = catalogue.checked_id(catalogue.id_in_file(header["env_id"]))
        config = {name: _setting(value) for name, value in header["config"].items()}
        task = catalogue.task_of(env_id, config)
        if header["rows"] != row_names(task):
            raise ValueError(
                f"rows = {header['rows']}; expected {row_names(task)}: it was written by another "
                f"version of the environment, {header['provenance'].get('versions')}"
            )
        episodes = episodes_from(task, header["episodes"], arrays)
        return Replay(env_id, task, episodes, header["provenance"])
    except (ConfigError, ValueError, TypeError) as error:
        raise DamagedFileError(f"{file}: {error}") from error


def id_of(env: Any, task: Task) -> str:
    """The registered id that an environment can be made again from.

    Args:
        env: An environment of either kind; its `spec` may be None.
        task: Its task.

    Raises:
        ValueError: None is registered for this task.
    """
    env_id = getattr(getattr(env, "spec", None), "id", None)
    if env_id in ENVIRONMENTS:
        return str(env_id)
    for record in ENVIRONMENTS.values():
        if load(record.task) is type(task):
            return record.id
    raise ValueError(
        f"env = {env_id or type(task).__name__}; expected an environment that is registered, so "
        "that its replay can be read: see rigid_envs.register"
    )


def _read_header(raw: npt.NDArray[Any] | None) -> dict[str, Any]:
    """The JSON document of a file, with all its keys.

    Raises:
        ValueError: It is none, or of another format or version.
    """
    if raw is None or raw.dtype != np.uint8 or raw.ndim != 1:
        raise ValueError("no header; expected a file that Replay.save wrote")
    try:
        header = json.loads(raw.tobytes().decode())
    except (ValueError, RecursionError):
        raise ValueError("header is no JSON; expected a file that Replay.save wrote") from None
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise ValueError(f"header has another format; expected {FORMAT!r}")
    if header.get("version") != VERSION:
        raise ValueError(
            f"version = {header.get('version')!r:.50}; expected {VERSION}: install the version of "
            "rigid-envs that wrote it"
        )
    if set(header) != _KEYS:
        raise ValueError(f"header has keys {sorted(header)}; expected {sorted(_KEYS)}")
    for name, kind in (("env_id", str), ("config", dict), ("provenance", dict), ("episodes", list)):
        if not isinstance(header[name], kind):
            raise ValueError(f"{name} = {header[name]!r:.100}; expected a {kind.__name__}")
    return header


def _setting(value: Any) -> Any:
    """A setting as the task takes it: JSON has lists for its tuples."""
    return tuple(map(_setting, value)) if isinstance(value, list) else value
