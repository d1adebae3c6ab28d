"""Numerical optima: the least cost that a search over extremals found from each start.

They are no proof: a search may miss an extremal. It begins with the best known plans too, and where
it finds nothing shorter, the best known cost stands. They refuse nobody, whereas the bounds of
theory do (`rigid_envs.scores.proof.refuse_impossible`). They are data, one file for each id, for
they take too long to be computed whenever they are read; `rigid-envs optima` writes them.
"""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from rigid_envs.base import files
from rigid_envs.base.checks import Array, Singles, require
from rigid_envs.engine.provenance import KINDS, provenance
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.scores.best import evaluation_set, file_of
from rigid_envs.scores.proof import registered_rows
from rigid_envs.scores.starts import evaluation_seeds, metrics_of
from rigid_envs.tasks.registry import ENVIRONMENTS, load

FORMAT = "rigid-envs optima 1"
FOLDER = Path(__file__).with_name("optima")
"""The data."""

_LIMIT = 2**20  # bytes
_KINDS = {"env_id": str, "evaluation_set": dict, "provenance": KINDS, "cost": str}


Search = Callable[[RigidVectorEnv, Array], tuple[Array, Array]]
"""Function of rows that have just begun, and of plans that succeed, shape (T, n, m), zeros where
there is none, to the least costs that are found, shape (n,), none above that of its plan and
infinite where there are none, and to plans along them, shape (T', n, m)."""


def searched(env_id: str, known: Singles) -> tuple[Array, Array]:
    """Optima from the first starts of the evaluation set, searched for anew, and plans near them.

    Args:
        env_id: Gymnasium's id.
        known: The best plans that are known, shape (T, n, m).

    Returns:
        Costs, shape (n,), and actions, shape (T', n, m), which nearly succeed.

    Raises:
        ValueError: There is no search.
    """
    with_one = [name for name, record in ENVIRONMENTS.items() if record.optimum]
    require(env_id in with_one, env_id, "env_id", f"one of {', '.join(with_one)}")
    search: Search = load(ENVIRONMENTS[env_id].optimum)
    n = known.shape[1]
    envs = registered_rows(env_id, n, {})
    envs.reset(seed=evaluation_seeds(n))
    return search(envs, known.astype(np.float64))


@cache
def numerical_optima(env_id: str) -> Array | None:
    """The data of an id that come with the package, shape (n,); None where there are none.

    Args:
        env_id: Gymnasium's id.
    """
    file = file_of(env_id, FOLDER)
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
        expected = evaluation_set(len(optima))
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
        "evaluation_set": evaluation_set(len(optima)),
        "provenance": provenance(),
        "cost": metrics_of(env_id)[0].name,
        "optima": optima.tolist(),
    }
    file.parent.mkdir(parents=True, exist_ok=True)
    files.write_document(file, data)
