"""Folders of runs: config, lock, manifest."""

import fcntl
import hashlib
import itertools
import os
import platform
import re
import shutil
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rigid_envs.base import files
from rigid_envs.base.checks import ConfigError, named_refusal
from rigid_envs.engine.provenance import versions

from ..config.entries import Config, config_from, config_to_dict
from ..config.reading import dump_yaml, parse_yaml, read_yaml

# `config.yaml` of a run: all entries, below a line with their digest.
#
# The line is a comment, so that the file is a config like any other: `train --config` starts a new
# run from it, changed by hand or not. Only the run itself must be what it was.

_MARK = "# sha256 of the entries: "


def write_config(path: Path, config: Config) -> None:
    """Write the config of a run, atomically.

    Args:
        path: File to write.
        config: The config.
    """
    text = dump_yaml(config_to_dict(config))
    files.write_atomic(path, f"{_MARK}{_digest(parse_yaml(text))}\n{text}")


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
    with named_refusal(path):
        return config_from(values)


def _digest(values: dict[str, Any]) -> str:
    """SHA-256 of the entries, whatever their order and spelling in the file."""
    try:
        text = files.canonical_json(values)
    except (TypeError, ValueError):  # NaN: no config has it
        return "none"
    return hashlib.sha256(text.encode()).hexdigest()


# Run folders, in the layout that SB3 and rl_zoo3 users know; one process at a time in each.
#
# logs/<algo>/<environment>_<n>/
#     config.yaml             all entries, defaults included, with their digest
#     progress.csv            one row per update          (times.csv: the clock, kept apart)
#     monitor.csv             one row per episode, as SB3's Monitor writes it
#     evaluations.npz         as SB3's EvalCallback writes it
#     tensorboard/            events
#     best_model/, last_model/    policy.safetensors, policy.json
#     checkpoints/            what `--resume` continues from
#     results.json, episodes.csv, learning_curve.png      the final evaluation
#     film.mp4                one episode of it, to look at
#     evaluated/              later evaluations, by `agents evaluate`: WHICH-EPISODES-SEED/

_LOCK = "run.lock"


class RunInUseError(RuntimeError):
    """Another process works in the folder."""


@dataclass(frozen=True)
class Run:
    """A run folder.

    Attributes:
        folder: Folder of its files.
        lock: Descriptor whose file lock keeps other processes out; None for a reader. The kernel
            drops the lock with the process, however that ends, so a lock is never stale.
        new: Config of a run that is yet to begin; None for one that has begun.
    """

    folder: Path
    lock: int | None = None
    new: Config | None = None

    def __truediv__(self, name: str) -> Path:
        """The path of a file of the run."""
        return self.folder / name

    def config(self) -> Config:
        """The config that the run is, or was, started with.

        Raises:
            ConfigError: `config.yaml` is no longer that.
        """
        return self.new or read_config(self / "config.yaml")

    def begin(self) -> None:
        """Delete what an earlier run left, and write `config.yaml`; nothing if not new."""
        if self.new is None:
            return
        for path in _content(self.folder):
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                path.unlink()
        write_config(self / "config.yaml", self.new)

    def discard(self) -> None:
        """Remove the folder of a new run, if nothing is in it."""
        if self.new is not None and not _content(self.folder):
            shutil.rmtree(self.folder)

    def close(self) -> None:
        """Let other processes in."""
        if self.lock is not None:
            os.close(self.lock)


def create_run(config: Config, overwrite: bool = False) -> Run:
    """Make the folder of a new run, and lock it. Nothing is deleted or written before `begin`.

    Args:
        config: Its config; `run_name` None takes the next free number.
        overwrite: Whether `begin` may delete an earlier run of the same name; never one that
            stands elsewhere, to which the name is a link.

    Raises:
        FileExistsError: A run of this name is there.
        RunInUseError: And another process works in it.
    """
    parent = config.folder.parent
    parent.mkdir(parents=True, exist_ok=True)
    # Made aside, locked, then named: nobody ever sees the folder of a run without its lock.
    hidden = parent / f".{os.urandom(8).hex()}.tmp"
    hidden.mkdir()
    lock = _acquire(hidden)
    for folder in _names(config):
        try:
            os.rename(hidden, folder)  # refused by the system if the folder has anything in it
            break
        except OSError:
            if not folder.exists():
                raise
    else:
        os.close(lock)
        shutil.rmtree(hidden)
        lock = _take_over(folder, overwrite)
    files.sync_folder(parent)
    return Run(folder, lock, config)


def open_run(folder: Path) -> Run:
    """Lock the folder of an existing run, to resume it.

    Raises:
        FileNotFoundError: There is no run.
        RunInUseError: Another process works in it.
    """
    find_run(folder)
    return Run(folder, _acquire(folder))


def find_run(folder: Path) -> Run:
    """The run in a folder, to read.

    Raises:
        FileNotFoundError: There is no run.
    """
    if not is_run(folder):
        raise FileNotFoundError(f"{folder}: no run here (no config.yaml)")
    return Run(folder)


def is_run(folder: Path) -> bool:
    """Whether a folder is that of a run, begun or over."""
    return (folder / "config.yaml").is_file()


def is_in_use(folder: Path) -> bool:
    """Whether a process works in the folder of a run."""
    try:
        lock = os.open(folder / _LOCK, os.O_RDONLY)
    except FileNotFoundError:
        return False
    try:
        fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(lock)
    return False


def _names(config: Config) -> Iterable[Path]:
    """The folder of a run that has a name; else those of the environment's name and a number."""
    if config.run_name is not None:
        return [config.folder]
    stem = re.sub(r"[^A-Za-z0-9._-]", "-", re.split("[:/]", config.env_id)[-1])[:60]
    parent = config.folder.parent
    numbers = [path.name.removeprefix(f"{stem}_") for path in parent.glob(f"{stem}_*")]
    number = max([int(text) for text in numbers if text.isdecimal()], default=0)
    return (parent / f"{stem}_{k}" for k in itertools.count(number + 1))


def _take_over(folder: Path, overwrite: bool) -> int:
    lock = _acquire(folder)
    own = is_run(folder) and not folder.is_symlink()
    if not _content(folder) or (overwrite and own):
        return lock
    os.close(lock)
    mend = f"--overwrite deletes it; --resume {folder} goes on with it"
    hint = mend if own else "it is no run, or a link to one"
    raise FileExistsError(f"{folder} exists; {hint}; --run_name gives the new run another name")


def _content(folder: Path) -> list[Path]:
    return [path for path in folder.iterdir() if path.name != _LOCK]


def _acquire(folder: Path) -> int:
    path = folder / _LOCK
    lock = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(lock)
        raise RunInUseError(f"{folder} is in use by {_owner(path)}") from None
    os.truncate(lock, 0)
    os.write(lock, files.canonical_json({"pid": os.getpid(), "host": platform.node()}).encode())
    return lock


def _owner(path: Path) -> str:
    try:
        owner = files.read_json(path, 4096)
        return f"process {owner['pid']} on {owner['host']}"
    except (OSError, ValueError, LookupError, TypeError):
        return "another process"


# The machine and the versions that the bits of a training run depend on.

_PACKAGES = ("gymnasium", "numba", "numpy", "stable-baselines3", "torch")


def manifest() -> dict[str, Any]:
    """Versions and machine that the bits of a training run depend on, besides its config.

    Returns:
        Versions, processor and threads, as JSON values.
    """
    import torch  # slow to import: commands that look at no run do without

    return {
        "versions": versions(_PACKAGES),
        "machine": platform.machine(),
        "system": platform.system(),
        "cpu_capability": torch.backends.cpu.get_cpu_capability(),
        "torch_threads": torch.get_num_threads(),
    }


def differences(before: dict[str, Any], now: dict[str, Any]) -> list[str]:
    """The entries in which two manifests differ.

    Args:
        before: Older manifest.
        now: Newer manifest.

    Returns:
        A line "key: before -> now" for each.
    """
    lines = []
    for key in sorted(before.keys() | now.keys()):
        old, new = before.get(key), now.get(key)
        if isinstance(old, dict) and isinstance(new, dict):
            lines += [f"{key}.{line}" for line in differences(old, new)]
        elif old != new:
            lines.append(f"{key}: {old} -> {new}")
    return lines
