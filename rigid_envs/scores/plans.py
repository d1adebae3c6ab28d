"""Plans as data, one file for each id: what shows that a best known cost can be had.

`rigid-envs best --plan` writes them, `rigid-envs best` and `rigid-envs verify --scores` play them.
"""

from __future__ import annotations

import io
import lzma
import zipfile
import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.files import DamagedFileError, read_bytes, write_atomic
from rigid_envs.scores.policies import PolicyFactory, recorded

__all__ = ["FOLDER", "PLANNER", "StoredPlans", "file_of_plans", "read_plans", "write_plans"]

PLANNER = "planner"
"""Name of the planner among those who found best known costs."""

FOLDER = Path(__file__).with_name("plans")
"""The data."""

_LIMIT = 2**22  # bytes
# what zipfile raises where bytes are wrong, also those that name the kind of compression
_DAMAGES = (
    KeyError,
    EOFError,
    ValueError,
    OSError,
    NotImplementedError,
    zipfile.BadZipFile,
    lzma.LZMAError,
    zlib.error,
)


class StoredPlans(NamedTuple):
    """Plans from the starts of the evaluation set.

    Attributes:
        actions: Shape (T, n, m), float32.
        hold: Number of control periods for which each is held.
    """

    actions: npt.NDArray[np.float32]
    hold: int

    def policy(self, n: int) -> PolicyFactory:
        """The policy that plays those of the first n starts, and rests after them."""
        actions = self.actions[:, :n].repeat(self.hold, axis=0)
        return recorded(np.concatenate([actions, np.zeros_like(actions[:1])]), PLANNER)


def file_of_plans(env_id: str, folder: Path = FOLDER) -> Path:
    """File of an id: that of `RigidEnvs/BallPark-v0` is `BallPark-v0.npz`."""
    return folder / f"{env_id.rpartition('/')[2]}.npz"


def write_plans(file: Path, plans: StoredPlans) -> None:
    """Write a file, atomically.

    The first bytes of all numbers come first, then the second ones, and so on, each along the time:
    compressed, they are a fifth smaller. By LZMA, which `numpy.load` reads too, they are smaller by
    another twentieth than from `numpy.savez_compressed`.

    Args:
        file: Its path.
        plans: The data.
    """
    along = np.ascontiguousarray(plans.actions.transpose(1, 2, 0)[..., None])
    octets = np.moveaxis(along.astype("<f4").view(np.uint8), -1, 0)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_LZMA) as archive:
        for name, part in {"octets": octets, "hold": np.array(plans.hold)}.items():
            entry = zipfile.ZipInfo(f"{name}.npy")  # without the time: the same bytes every time
            entry.compress_type = zipfile.ZIP_LZMA
            with archive.open(entry, "w") as stream:
                np.lib.format.write_array(stream, part, allow_pickle=False)
    write_atomic(file, buffer.getvalue())


def read_plans(file: Path) -> StoredPlans:
    """Read a file.

    Args:
        file: Its path.

    Raises:
        DamagedFileError: It holds something else.
    """
    content = read_bytes(file, _LIMIT)
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as data:
            octets, hold = data["octets"], int(data["hold"])
        if octets.dtype != np.uint8 or octets.ndim != 4 or len(octets) != 4 or hold < 1:
            raise ValueError("expected bytes of shape (4, n, m, T), and hold from 1")
        along = np.ascontiguousarray(np.moveaxis(octets, 0, -1)).view("<f4")[..., 0]
        actions = np.ascontiguousarray(along.transpose(2, 0, 1), dtype=np.float32)
        return StoredPlans(actions, hold)
    except _DAMAGES as error:
        raise DamagedFileError(f"{file}: {error}; write it anew: rigid-envs best --plan") from error
