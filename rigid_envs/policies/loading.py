"""Policies from files: those that come with the package by name, others by path."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from rigid_envs.errors import ConfigError
from rigid_envs.files import DamagedFileError, named_damage
from rigid_envs.policies.compiled import CompiledPolicy
from rigid_envs.tensorfile import load_tensors, save_tensors

__all__ = [
    "FOLDER",
    "FORMAT",
    "file_of",
    "load",
    "path_of",
    "published",
    "read_policy",
    "write_policy",
]

FORMAT = "rigid-envs policy 1"
FOLDER = Path(__file__).parent
"""Published policies, each with a record of its evaluation beside it."""

_SIZE_LIMIT = 256 * 2**20


def published(folder: Path = FOLDER) -> list[str]:
    """Names of the published policies: that of `RigidEnvs/BallPark-v0` is "BallPark-v0"."""
    return sorted(path.stem for path in folder.glob("*.safetensors"))


def file_of(name: str, folder: Path = FOLDER) -> Path:
    """File of a published policy.

    Args:
        name: An id, "RigidEnvs/BallPark-v0", or what is left of it: "BallPark-v0", "BallPark".
        folder: Where they are.

    Raises:
        ConfigError: None is published of that name; names those that are.
    """
    names = published(folder)
    stem = name.removeprefix("RigidEnvs/")
    for chosen in (stem, f"{stem}-v0"):
        if chosen in names:
            return folder / f"{chosen}.safetensors"
    raise ConfigError(
        f"name = {name!r}; expected the path of a policy.safetensors, or a published policy: "
        f"{', '.join(names) or 'there is none yet'}"
    )


def load(name: str | Path) -> CompiledPolicy:
    """A trained policy that runs without torch, to the same bits on every x86-64 processor.

    Args:
        name: A published one, "BallPark" or "RigidEnvs/BallPark-v0"; or the path of a
            `policy.safetensors`, or of the folder that it is in.

    Raises:
        ConfigError: None of that name; names those that there are.
        DamagedFileError: The file is no policy; says why.
    """
    path = path_of(name)
    document, arrays = read_policy(path)
    with named_damage(path, "it is not a policy"):
        return CompiledPolicy(document, arrays)


def path_of(name: str | Path) -> Path:
    """The file of a policy; see `load`.

    Raises:
        ConfigError: None of that name; names those that there are.
    """
    path = Path(name)
    if path.is_dir():
        path = path / "policy.safetensors"
    return path if path.is_file() else file_of(str(name))


def read_policy(path: Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Document and arrays of a policy file. Nothing in it is run.

    Args:
        path: The file.

    Raises:
        DamagedFileError: Another format.
        FileNotFoundError: There is no such file.
    """
    arrays, document = load_tensors(path, _SIZE_LIMIT)
    if document.get("format") != FORMAT:
        raise DamagedFileError(
            f"{path}: expected format {FORMAT!r}, got {document.get('format')!r}"
        )
    return document, arrays


def write_policy(
    file: Path, document: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]
) -> Path:
    """Write a policy file, atomically.

    Args:
        file: Its path; the folder exists.
        document: JSON values; see `StoredPolicy`.
        arrays: See `StoredPolicy`.

    Returns:
        The file.
    """
    save_tensors(file, arrays, {"format": FORMAT, **document})
    return file
