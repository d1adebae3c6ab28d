"""Numerical optima: the least cost that a search over extremals found from each start.

They are no proof: a search may miss an extremal. So they refuse nobody, whereas the bounds of
theory do (`rigid_envs.scores.proof.refuse_impossible`). They are data, one file for each id, for
they take too long to be computed whenever they are read; `rigid-envs optima` writes them.
"""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from rigid_envs.base import files
from rigid_envs.base.checks import Array, require
from rigid_envs.engine.provenance import KINDS, provenance
from rigid_envs.scores.best import TheoreticalLimit
from rigid_envs.scores.proof import registered_rows
from rigid_envs.scores.starts import N_STARTS, TEST_SEED, VERSION, evaluation_seeds, metrics_of
from rigid_envs.tasks.registry import ENVIRONMENTS, load

FORMAT = "rigid-envs optima 1"
FOLDER = Path(__file__).with_name("optima")
"""The data."""

_LIMIT = 2**20  # bytes
_KINDS = {"env_id": str, "evaluation_set": dict, "provenance": KINDS, "cost": str}


def search_of(env_id: str) -> TheoreticalLimit | None:
    """The search for numerical optima of the cost of an id; None where there is none."""
    name = ENVIRONMENTS[env_id].optimum
    search: TheoreticalLimit | None = load(name) if name else None
    return search


def computed(env_id: str, n: int = N_STARTS) -> Array:
    """Optima from the first n starts of the evaluation set, searched for anew, shape (n,).

    Args:
        env_id: Gymnasium's id.
        n: Number of starts.

    Raises:
        ConfigError: There is no search.
        ArithmeticError: It found nothing from a start.
    """
    search = search_of(env_id)
    known = [name for name, record in ENVIRONMENTS.items() if record.optimum]
    require(search is not None, env_id, "env_id", f"one of {', '.join(known)}")
    assert search is not None
    envs = registered_rows(env_id, n, {})
    envs.reset(seed=evaluation_seeds(n))
    found = search.values(envs)
    if not np.isfinite(found).all():
        raise ArithmeticError(f"{env_id}: nothing found from {np.flatnonzero(~np.isfinite(found))}")
    return found


def file_of(env_id: str, folder: Path = FOLDER) -> Path:
    """File of an id: that of `RigidEnvs/BallPark-v0` is `BallPark-v0.json`."""
    return folder / f"{env_id.rpartition('/')[2]}.json"


@cache
def numerical_optima(env_id: str) -> Array | None:
    """The data of an id that come with the package, shape (n,); None where there are none.

    Args:
        env_id: Gymnasium's id.
    """
    file = file_of(env_id)
    return read_optima(file) if ENVIRONMENTS[env_id].optimum and file.exists() else None


def read_optima(file: Path) -> Array:
    """Read a file.

    Args:
        file: Its path.

    Raises:
        DamagedFileError: Of another format or evaluation set, changed, or not complete.
    """
    with files.read_document(file, FORMAT, _LIMIT, "write it anew: rigid-envs optima") as data:
        own, optima = files.checked_values(data, _KINDS), files.column(data["optima"], "optima")
        expected = _evaluation_set(len(optima))
        require(own["evaluation_set"] == expected, own["evaluation_set"], "evaluation_set",
                f"{expected}, as there are optima")  # fmt: skip
        require(bool((optima >= 0.0).all()), optima, "optima", "numbers from 0")
        return optima


def write_optima(file: Path, env_id: str, optima: Array) -> None:
    """Write a file, atomically; its folder is made if it is not there.

    Args:
        file: Its path.
        env_id: Gymnasium's id.
        optima: From each start, shape (n,).
    """
    data: dict[str, Any] = {
        "format": FORMAT,
        "env_id": env_id,
        "evaluation_set": _evaluation_set(len(optima)),
        "provenance": provenance(),
        "cost": metrics_of(env_id)[0].name,
        "optima": optima.tolist(),
    }
    file.parent.mkdir(parents=True, exist_ok=True)
    files.write_document(file, data)


def _evaluation_set(n: int) -> dict[str, int]:
    return {"version": VERSION, "seed": TEST_SEED, "starts": n}
