"""Numerical optima, and lower bounds that are proven, from each start of the evaluation set.

A numerical optimum is the least cost that a search over extremals found. It is no proof: a search
may miss an extremal. It begins with the best known plans too, and where it finds nothing shorter,
the best known cost stands. Optima refuse nobody, whereas bounds do (`rigid_envs.scores.proof`). A
bound is proven by excluding all extremals of a lower cost; what is tried is a share of the optimum.
Both are data, one file for each id, for they take too long to be computed whenever they are read;
`rigid-envs optima` writes them.
"""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rigid_envs.base import files
from rigid_envs.base.checks import Array, Bools, Singles, require
from rigid_envs.engine.provenance import KINDS, provenance
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.scores.best import evaluation_set, file_of
from rigid_envs.scores.starts import evaluation_seeds, metrics_of, registered_rows
from rigid_envs.tasks.registry import ENVIRONMENTS, load

FORMAT = "rigid-envs optima 2"
FOLDER = Path(__file__).with_name("optima")
"""The data."""

SHARE = 0.994
"""Share of a numerical optimum that is tried as a bound."""

_LIMIT = 2**20  # bytes
_KINDS = {"env_id": str, "evaluation_set": dict, "provenance": KINDS, "cost": str}


Search = Callable[[RigidVectorEnv, Array], tuple[Array, Array]]
"""Function of rows that have just begun, and of plans that succeed, shape (T, n, m), zeros where
there is none, to the least costs that are found, shape (n,), none above that of its plan and
infinite where there are none, and to plans along them, shape (T', n, m)."""

Proof = Callable[[RigidVectorEnv, Array], Bools]
"""Function of rows that have just begun, and of costs, shape (n,), to whether it is proven that
there is no lower one."""


class Optima(NamedTuple):
    """What is known of the least cost from each start.

    Attributes:
        costs: Numerical optima, shape (n,).
        proven: Costs that none is below, shape (n,); 0 where nothing is proven.
    """

    costs: Array
    proven: Array


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
    search: Search = _loaded(env_id, "optimum")
    return search(_started(env_id, known.shape[1]), known.astype(np.float64))


def proven(env_id: str, share: float | Array) -> Array:
    """Shares of the stored optima that are proven to be bounds, shape (n,); 0 for the others.

    Args:
        env_id: Gymnasium's id.
        share: One of all optima, or one of each, shape (n,).

    Raises:
        ValueError: There is no proof, or no optimum is stored.
    """
    proof: Proof = _loaded(env_id, "proof")
    stored = stored_optima(env_id)
    if stored is None:
        raise ValueError(f"{env_id}: no optima; write them first: rigid-envs optima {env_id}")
    costs = share * stored.costs
    return np.where(proof(_started(env_id, len(costs)), costs), costs, 0.0)


def _loaded(env_id: str, entry: str) -> Any:
    """The function of an entry of the registry, for ids that have one."""
    codes = {name: getattr(record, entry) for name, record in ENVIRONMENTS.items()}
    with_one = [name for name, code in codes.items() if code]
    require(env_id in with_one, env_id, "env_id", f"one of {', '.join(with_one)}")
    return load(codes[env_id])


def _started(env_id: str, n: int) -> RigidVectorEnv:
    envs = registered_rows(env_id, n, {})
    envs.reset(seed=evaluation_seeds(n))
    return envs


@cache
def stored_optima(env_id: str) -> Optima | None:
    """The data of an id that come with the package; None where there are none.

    Args:
        env_id: Gymnasium's id.
    """
    file = file_of(env_id, FOLDER)
    has_some = env_id in ENVIRONMENTS and ENVIRONMENTS[env_id].optimum
    return read_optima(file) if has_some and file.exists() else None


def read_optima(file: Path) -> Optima:
    """Read a file.

    Args:
        file: Its path.

    Raises:
        DamagedFileError: Of another format or evaluation set, changed, or not complete.
    """
    with files.read_document(file, FORMAT, _LIMIT, "write it anew: rigid-envs optima") as data:
        own = files.checked_values(data, _KINDS)
        optima = Optima(*(files.column(data[name], name) for name in ("optima", "proven")))
        expected = evaluation_set(len(optima.costs))
        require(own["evaluation_set"] == expected, own["evaluation_set"], "evaluation_set",
                f"{expected}, as there are optima")  # fmt: skip
        require(bool((optima.costs >= 0.0).all()), optima.costs, "optima", "numbers from 0")
        between = optima.proven.shape == optima.costs.shape
        between = between and bool(((0.0 <= optima.proven) & (optima.proven <= optima.costs)).all())
        require(between, optima.proven, "proven", "numbers from 0 to the optima")
        return optima


def write_optima(file: Path, env_id: str, optima: Optima) -> None:
    """Write a file, atomically; its folder is made if it is not there.

    Args:
        file: Its path.
        env_id: Gymnasium's id.
        optima: From each start.
    """
    data: dict[str, Any] = {
        "format": FORMAT,
        "env_id": env_id,
        "evaluation_set": evaluation_set(len(optima.costs)),
        "provenance": provenance(),
        "cost": metrics_of(env_id)[0].name,
        "optima": optima.costs.tolist(),
        "proven": optima.proven.tolist(),
    }
    file.parent.mkdir(parents=True, exist_ok=True)
    files.write_document(file, data)
