"""State and parameters given to `reset`, checked before anything changes."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, real_numbers, require, safe_repr
from rigid_envs.mechanics.rotations import direction, norm
from rigid_envs.tasks.fields import span
from rigid_envs.tasks.task import Task

_NEAR = 1e-9  # of a length: entries of a matrix are then at most 1 in float32, as observed


@dataclass(frozen=True)
class Start:
    """Given initial values, which replace drawn ones; each of shape () or one for each row.

    Attributes:
        state: entries of y, by index.
        parameters: parameters of the system, by field of the task.
    """

    state: Mapping[int, Array] = field(default_factory=dict)
    parameters: Mapping[str, Array] = field(default_factory=dict)


def start_from(
    task: Task,
    n_rows: int,
    state: npt.ArrayLike | Mapping[str, npt.ArrayLike] | None,
    params: Mapping[str, npt.ArrayLike] | None,
) -> Start:
    """Check a state and parameters for `n_rows` rows.

    Args:
        task: task of the rows.
        n_rows: number of rows to reset.
        state: y of shape (n_state,) or (n_rows, n_state), or named components of it; the others
            are drawn.
        params: parameters of the system by field, numbers or one for each row.

    Raises:
        ValueError: unknown names, wrong shapes, values out of range.
    """
    return Start(
        {} if state is None else _state(task, n_rows, state),
        {} if params is None else _parameters(task, n_rows, params),
    )


def _state(
    task: Task, n: int, state: npt.ArrayLike | Mapping[str, npt.ArrayLike]
) -> dict[int, Array]:
    system = task.system_type
    if isinstance(state, Mapping):
        known = f"some of {list(system.components)}"
        for name in state:
            require(name in system.components, name, "component of the state", known)
    try:
        y = system.state(**state) if isinstance(state, Mapping) else system.checked_state(state)
    except ValueError as error:
        raise ValueError(f"state: {error}") from None
    columns = [*range(y.shape[-1])]
    if isinstance(state, Mapping):
        columns = [k for name in state for k in columns[system.components[name]]]
    if y.shape[:-1] not in ((), (n,)):
        raise ValueError(
            f"state has shape {y.shape}; expected ({y.shape[-1]},) or ({n}, {y.shape[-1]})"
        )
    for name in task.fixed_components:
        if np.any(part := y[..., system.components[name]]):
            raise ValueError(f"{name} = {part}; expected 0, its constant value in this task")
    if "q" in system.components:
        y = np.concatenate([of_unit_length(y[..., :4]), y[..., 4:]], axis=-1)
    return {k: y[..., k] for k in columns}


def of_unit_length(rows: Array) -> Array:
    """Vectors (..., n), none of them zero, brought to length 1; what is near it keeps its bits."""
    with np.errstate(over="ignore"):  # of the length
        near = np.abs(norm(rows) - 1.0) <= _NEAR
    return np.where(near, rows, direction(rows))


def _parameters(task: Task, n: int, params: Mapping[str, npt.ArrayLike]) -> dict[str, Array]:
    if not isinstance(params, Mapping):
        raise ValueError(f"params = {safe_repr(params)}; expected numbers by name")
    known, values = task.physical_parameters(), {}
    for name, value in params.items():
        if name not in known:
            raise ValueError(f"params has key {safe_repr(name)}; expected some of {list(known)}")
        values[name] = real_numbers(value, f"params[{name!r}]")
        if values[name].shape not in ((), (n,)):
            raise ValueError(
                f"params[{name!r}] has shape {values[name].shape}; expected () or ({n},)"
            )
    rows = {tuple(float(np.broadcast_to(v, n)[k]) for v in values.values()) for k in range(n)}
    for row in rows:
        changes: dict[str, Any] = dict(zip(values, row, strict=True))
        replace(task, **changes)  # refuses what is not allowed
    for name in set(values) & set(task.observed_parameters()):
        low, high = span(getattr(task, name))
        if not np.all((low <= values[name]) & (values[name] <= high)):
            raise ValueError(
                f"params[{name!r}] = {values[name]}; expected a value in [{low}, {high}], "
                "in which it is observed: give a wider range in the configuration"
            )
    return values
