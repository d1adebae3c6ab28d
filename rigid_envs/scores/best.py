"""What a cost is compared with: the best that is known from each start, and limits of theory."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from rigid_envs.base import files
from rigid_envs.base.checks import Array, Bools, Singles, require
from rigid_envs.engine.provenance import KINDS
from rigid_envs.envs.lookup import full_id
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.scores.result import Evaluation
from rigid_envs.scores.starts import TEST_SEED, VERSION
from rigid_envs.tasks.registry import ENVIRONMENTS, load

# Theoretical limits of metrics: optima and bounds from each start, in closed form.


class TheoreticalLimit(NamedTuple):
    """Best value of a metric that theory allows.

    Attributes:
        kind: "exact", the optimum, or a "bound", which may be out of reach.
        text: Formula or reason.
        values: Value of every start, shape (N,), of rows that have just begun.
    """

    kind: Literal["exact", "bound"]
    text: str
    values: Callable[[RigidVectorEnv], Array]


def least_time(length: Array, acceleration: npt.ArrayLike, speed: npt.ArrayLike) -> Array:
    """Least time [s] over a length from rest to a speed of at most w: 2 sqrt(A / a) - w / a.

    The speed is ``a t`` at most, and ``w + a t`` at most at the time t before the end; the area
    under the smaller of the two is ``a (T + w / a)^2 / 4 - w^2 / (2 a)``, so that
    ``A = length + w^2 / (2 a)``. A length below ``w^2 / (2 a)`` is run through without braking.

    Args:
        length: Lengths [m or rad], shape (...).
        acceleration: Largest acceleration a.
        speed: Largest speed w at the end.
    """
    a, w = np.asarray(acceleration, dtype=np.float64), np.asarray(speed, dtype=np.float64)
    braked = 2.0 * np.sqrt((length + 0.5 * w * w / a) / a) - w / a
    return np.asarray(np.where(length > 0.5 * w * w / a, braked, np.sqrt(2.0 * length / a)))


def _rows(envs: RigidVectorEnv, name: str) -> Array:
    """A parameter of the system of every row, shape (N,)."""
    return np.array([getattr(system, name) for system in envs.systems])


def limit_of(env_id: str, metric: str) -> TheoreticalLimit | None:
    """The theoretical limit of a metric of an id; None where none is known."""
    name = ENVIRONMENTS[env_id].limits.get(metric)
    limit: TheoreticalLimit | None = None if name is None else load(name)
    return limit


# Best known cost from each start of the evaluation sets: data, one file for each id.
#
# `rigid-envs best` writes them. They are of the environments as they are registered.

FORMAT = "rigid-envs best 1"
FOLDER = Path(__file__).with_name("best")
"""The data."""

_LIMIT = 2**20  # bytes
_KINDS = {
    **{"env_id": str, "evaluation_set": dict, "provenance": KINDS},
    **{"cost": str, "policies": dict, "finders": list},
}
_SUMMARY = {
    **{"episodes": int, "success_rate": float, "efficiency": float, "metrics": dict},
    **dict.fromkeys(("return_mean", "length_mean"), float),
    **dict.fromkeys(("cost_mean", "best_mean", "bound_mean", "gap"), float | None),
}


@dataclass(frozen=True)
class Best:
    """Best known costs of an id.

    Attributes:
        env_id: Gymnasium's id.
        cost: Name of the metric.
        costs: Cost from each start, shape (n,); NaN where nobody is known to have succeeded.
        finders: Who found each, n names; empty where nobody has.
        policies: Summaries of untrained policies by name, against these costs.
        provenance: Versions, kernels, commit and date of the last change.
    """

    env_id: str
    cost: str
    costs: npt.NDArray[np.float64]
    finders: tuple[str, ...]
    policies: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)

    @property
    def shares(self) -> dict[str, int]:
        """Number of starts for which each finder is the best, the largest first."""
        names = [name for name in self.finders if name]
        return dict(sorted(((k, names.count(k)) for k in set(names)), key=lambda p: (-p[1], p[0])))

    def improved(self, found: Evaluation, finders: Sequence[str]) -> Best:
        """The best of these and of the first episodes of somebody; of a tie, the older one stays.

        Args:
            found: Episodes from the first k starts.
            finders: Who found each.
        """
        better, known = self.beaten(found), self.costs.copy()
        known[better] = found.costs[better[: found.n]]
        new = zip(better, [*finders, *self.finders[found.n :]], self.finders, strict=True)
        return replace(self, costs=known, finders=tuple(b if a else c for a, b, c in new))

    def beaten(self, found: Evaluation) -> Bools:
        """Starts from which somebody is better, shape (n,), by more than rounding."""
        beaten = np.zeros(len(self.costs), dtype=bool)
        beaten[: found.n] = found.against(self.costs[: found.n]).records
        return beaten


def nobody(env_id: str, cost: str, n: int) -> Best:
    """Nothing is known yet.

    Args:
        env_id: Gymnasium's id.
        cost: Name of the metric.
        n: Number of starts.
    """
    return Best(env_id, cost, np.full(n, np.nan), ("",) * n)


def file_of(env_id: str, folder: Path = FOLDER) -> Path:
    """File of an id: that of `RigidEnvs/BallPark-v0` is `BallPark-v0.json`."""
    return folder / f"{env_id.rpartition('/')[2]}.json"


@cache
def best_known(env_id: str) -> Best | None:
    """The data of an id that come with the package; None where there are none."""
    env_id = full_id(env_id)
    file = file_of(env_id)
    found = read_best(file) if file.exists() else None
    return found if found is not None and found.env_id == env_id else None


def read_best(file: Path) -> Best:
    """Read a file.

    Args:
        file: Its path.

    Raises:
        DamagedFileError: Of another format or evaluation set, changed, or not complete.
    """
    with files.read_document(file, FORMAT, _LIMIT, "write it anew: rigid-envs best") as data:
        own = files.checked_values(data, _KINDS)
        costs = files.column(data["costs"], "costs")
        expected = evaluation_set(len(costs))
        require(own["evaluation_set"] == expected, own["evaluation_set"], "evaluation_set",
                f"{expected}, as there are costs")  # fmt: skip
        names = dict(enumerate(own["finders"])) | {-1: ""}
        finders = tuple(names[k] for k in data["finder"])
        require(all(type(name) is str for name in finders), own["finders"], "finders", "names")
        if [name == "" for name in finders] != np.isnan(costs).tolist() or (costs < 0.0).any():
            raise ValueError("costs, finder: expected a cost from 0 and a finder, or neither")
        for summary in own["policies"].values():
            files.checked_values(summary, _SUMMARY)
            for name in ("success_rate_95", "efficiency_95"):
                low, high = files.column(summary[name], name)
                require(low <= high, summary[name], name, "an interval")
        return Best(own["env_id"], own["cost"], costs, finders, own["policies"], own["provenance"])


def evaluation_set(n: int) -> dict[str, int]:
    """What a file says of the starts that its n costs are of."""
    return {"version": VERSION, "seed": TEST_SEED, "starts": n}


def write_best(file: Path, known: Best) -> None:
    """Write a file, atomically; equal data give an equal file.

    Args:
        file: Its path.
        known: The data.
    """
    finders = list(known.shares)
    data: dict[str, Any] = {
        "format": FORMAT,
        "env_id": known.env_id,
        "evaluation_set": evaluation_set(len(known.costs)),
        "provenance": dict(known.provenance),
        "cost": known.cost,
        "policies": {name: dict(summary) for name, summary in known.policies.items()},
        "finders": finders,
        "finder": [finders.index(name) if name else -1 for name in known.finders],
        "costs": [None if np.isnan(cost) else cost for cost in known.costs.tolist()],
    }
    files.write_document(file, data)


# Plans as data, one file for each id: the actions that give the best known costs.
#
# `rigid-envs best` keeps those of whoever is the best from a start; it plays them again, as
# `rigid-envs verify --scores` does. They are in the repository and in the source package; wheels,
# many times as large with them, have none.

PLANNER = "planner"
"""Name of the planner among those who found best known costs."""

PLANS_FOLDER = Path(__file__).with_name("plans")
"""The data."""

_PLANS_LIMIT = 2**25  # bytes, unpacked
_MOST_PERIODS = 10_000  # control periods that plans may last


def file_of_plans(env_id: str, folder: Path = PLANS_FOLDER) -> Path:
    """File of an id: that of `RigidEnvs/BallPark-v0` is `BallPark-v0.npz`."""
    return folder / f"{env_id.rpartition('/')[2]}.npz"


def missing_plans(env_id: str) -> str | None:
    """What to do where the plans of best known costs are not here; None if nothing is missing.

    Args:
        env_id: Gymnasium's id.
    """
    known, file = best_known(env_id), file_of_plans(env_id)
    if known is None or file.exists():
        return None
    return (
        f"{env_id}: no {file}; expected the plans of {len(known.costs)} starts, which a wheel "
        "leaves out: copy it from a checkout, or from `pip download --no-deps --no-binary :all: "
        "rigid-envs`"
    )


def write_plans(file: Path, actions: Singles) -> None:
    """Write a file, atomically; its folder is made if it is not there.

    Args:
        file: Its path.
        actions: Shape (T, n, m), each from -1 to 1, or choices.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    files.write_arrays(file, {"actions": actions})


def read_plans(file: Path) -> Singles:
    """Read a file.

    Args:
        file: Its path.

    Raises:
        DamagedFileError: It holds something else.
    """
    with files.named_damage(file, "write it anew: rigid-envs best"):
        actions: Any = files.read_arrays(file, _PLANS_LIMIT, ("actions",))["actions"]
        if actions.dtype != np.float32 or actions.ndim != 3 or not actions.size:
            raise ValueError(f"actions: {actions.dtype} of shape {actions.shape}; expected float32 "
                             "of (T, n, m)")  # fmt: skip
        require(len(actions) <= _MOST_PERIODS, len(actions), "actions",
                f"plans of at most {_MOST_PERIODS} control periods")  # fmt: skip
        require(np.isfinite(actions).all(), actions, "actions", "finite numbers")
        return cast(Singles, actions)
