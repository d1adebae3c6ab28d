"""What a cost is compared with: the best that is known from each start, and limits of theory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from rigid_envs.base import files
from rigid_envs.base.checks import Array, integer, require
from rigid_envs.engine.provenance import KINDS
from rigid_envs.envs.lookup import full_id
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.scores.policies import PolicyFactory, recorded
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
_ROUNDING = 1e-9  # share of a cost by which another machine may differ: that is no improvement


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

    def improved(self, finder: str, successes: npt.ArrayLike, costs: npt.ArrayLike) -> Best:
        """The best of these and of the episodes of a finder; of a tie, the older one stays.

        Args:
            finder: Its name.
            successes: Whether the first episodes succeeded, shape (k,).
            costs: What they cost, shape (k,).
        """
        known, names = self.costs.copy(), list(self.finders)
        for k, (won, cost) in enumerate(zip(np.asarray(successes), np.asarray(costs), strict=True)):
            if won and not known[k] <= cost * (1.0 + _ROUNDING):
                known[k], names[k] = cost, finder
        return Best(self.env_id, self.cost, known, tuple(names), self.policies, self.provenance)


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
        evaluation_set = _evaluation_set(len(costs))
        require(own["evaluation_set"] == evaluation_set, own["evaluation_set"], "evaluation_set",
                f"{evaluation_set}, as there are costs")  # fmt: skip
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


def _evaluation_set(n: int) -> dict[str, int]:
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
        "evaluation_set": _evaluation_set(len(known.costs)),
        "provenance": dict(known.provenance),
        "cost": known.cost,
        "policies": {name: dict(summary) for name, summary in known.policies.items()},
        "finders": finders,
        "finder": [finders.index(name) if name else -1 for name in known.finders],
        "costs": [None if np.isnan(cost) else cost for cost in known.costs.tolist()],
    }
    files.write_document(file, data)


# Plans as data, one file for each id: what shows that a best known cost can be had.
#
# `rigid-envs best --plan` writes them, `rigid-envs best` and `rigid-envs verify --scores` play
# them. They are in the repository and in the source package; wheels, four times as large with them,
# have none.

PLANNER = "planner"
"""Name of the planner among those who found best known costs."""

PLANS_FOLDER = Path(__file__).with_name("plans")
"""The data."""

_PLANS_LIMIT = 2**25  # bytes, unpacked
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


def file_of_plans(env_id: str, folder: Path = PLANS_FOLDER) -> Path:
    """File of an id: that of `RigidEnvs/BallPark-v0` is `BallPark-v0.npz`."""
    return folder / f"{env_id.rpartition('/')[2]}.npz"


def missing_plans(env_id: str) -> str | None:
    """What to do where best known costs are of plans that are not here; None if nothing is missing.

    Args:
        env_id: Gymnasium's id.
    """
    known, file = best_known(env_id), file_of_plans(env_id)
    if known is None or PLANNER not in known.finders or file.exists():
        return None
    return (
        f"{env_id}: no {file}; expected the plans of {known.finders.count(PLANNER)} starts, which "
        "a wheel leaves out: copy it from a checkout, or from `pip download --no-deps --no-binary "
        ":all: rigid-envs`"
    )


def write_plans(file: Path, plans: StoredPlans) -> None:
    """Write a file, atomically; its folder is made if it is not there.

    Args:
        file: Its path.
        plans: The data.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    files.write_arrays(file, {"actions": plans.actions, "hold": np.array(plans.hold)})


def read_plans(file: Path) -> StoredPlans:
    """Read a file.

    Args:
        file: Its path.

    Raises:
        DamagedFileError: It holds something else.
    """
    with files.named_damage(file, "write it anew: rigid-envs best --plan"):
        arrays = files.read_arrays(file, _PLANS_LIMIT, ("actions", "hold"))
        actions, held = arrays["actions"], cast(Any, arrays["hold"])
        hold = integer(held, "hold", 1)
        if actions.dtype != np.float32 or actions.ndim != 3 or not actions.size:
            raise ValueError(f"actions: {actions.dtype} of shape {actions.shape}; expected float32 "
                             "of (T, n, m)")  # fmt: skip
        require(len(actions) * hold <= _MOST_PERIODS, hold, "hold",
                f"plans of at most {_MOST_PERIODS} control periods")  # fmt: skip
        require(np.abs(actions) <= 1.0, actions, "actions", "numbers from -1 to 1")  # and no NaN
        return StoredPlans(actions, hold)
