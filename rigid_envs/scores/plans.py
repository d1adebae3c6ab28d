"""Plans as data, one file for each id: what shows that a best known cost can be had.

`rigid-envs best --plan` writes them, `rigid-envs best` and `rigid-envs verify --scores` play them.
"""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from rigid_envs.archive import read_arrays
from rigid_envs.checks import integer, require
from rigid_envs.files import named_damage, write_atomic
from rigid_envs.scores.policies import PolicyFactory, recorded

__all__ = ["FOLDER", "PLANNER", "StoredPlans", "file_of_plans", "read_plans", "write_plans"]

PLANNER = "planner"
"""Name of the planner among those who found best known costs."""

FOLDER = Path(__file__).with_name("plans")
"""The data."""

_LIMIT = 2**25  # bytes, unpacked
_MOST_PERIODS = 10_000  # control periods that plans may last


class StoredPlans(NamedTuple):
    """Plans from the starts of the evaluation set.

    Attributes:
        actions: Shape (T, n, m), float32, each from -1 to 1.
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
    with named_damage(file, "write it anew: rigid-envs best --plan"):
        arrays = read_arrays(file, _LIMIT, ("octets", "hold"))
        octets, held = arrays["octets"], cast(Any, arrays["hold"])
        hold = integer(held, "hold", 1)
        if octets.dtype != np.uint8 or octets.ndim != 4 or len(octets) != 4 or not octets.size:
            raise ValueError(f"octets: {octets.dtype} of shape {octets.shape}; expected uint8 of "
                             "(4, n, m, T)")  # fmt: skip
        require(octets.shape[3] * hold <= _MOST_PERIODS, hold, "hold",
                f"plans of at most {_MOST_PERIODS} control periods")  # fmt: skip
        along = np.ascontiguousarray(np.moveaxis(octets, 0, -1)).view("<f4")[..., 0]
        require(np.abs(along) <= 1.0, along, "actions", "numbers from -1 to 1")  # and no NaN
        return StoredPlans(np.ascontiguousarray(along.transpose(2, 0, 1), np.float32), hold)
