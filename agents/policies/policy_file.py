"""Policies in files: weights and statistics as safetensors, the rest as JSON, no code in either.

`policy.safetensors` holds all of it; `policy.json` beside it is the same JSON for people to read.
"""

from __future__ import annotations

from pathlib import Path

from rigid_envs.files import DamagedFileError, canonical_json, write_atomic
from rigid_envs.policies import read_policy, write_policy
from rigid_envs.policies.loading import FORMAT

from .mlp import Policy

__all__ = ["load_policy", "save_policy"]


def save_policy(policy: Policy, folder: Path) -> Path:
    """Write a policy, atomically.

    Args:
        policy: Network and document to write.
        folder: Folder of the files; made if it is not there.

    Returns:
        The file that `load_policy` reads.
    """
    folder.mkdir(exist_ok=True)
    path = write_policy(folder / "policy.safetensors", policy.document, policy.arrays)
    document = {"format": FORMAT, **policy.document}
    write_atomic(folder / "policy.json", canonical_json(document, indent=2) + "\n")
    return path


def load_policy(path: str | Path) -> Policy:
    """Read a policy. Nothing in the file is run.

    Args:
        path: `policy.safetensors`, or the folder that it is in.

    Raises:
        DamagedFileError: It is not what `save_policy` wrote; the message says why.
        FileNotFoundError: There is no such file.
    """
    path = Path(path)
    if path.is_dir():
        path = path / "policy.safetensors"
    document, arrays = read_policy(path)
    try:
        return Policy(document, arrays)
    except (ValueError, LookupError, TypeError, RuntimeError) as error:
        raise DamagedFileError(f"{path}: not a policy: {error!r:.200}") from error
