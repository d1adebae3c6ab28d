"""Allocation of the array that holds all rows and settings of a task."""

import numpy as np
import numpy.typing as npt

from rigid_envs.kernels.layout import CHANNEL, Settings, Slots, slots_of
from rigid_envs.kernels.rows import LANES
from rigid_envs.tasks.base import Task

__all__ = ["aligned_zeros", "new_buffer", "parameter_slot", "slots_for"]

_LINE = 8  # numbers in a cache line


def slots_for(task: Task) -> Slots:
    """Memory slots of a row of this task."""
    delay = int(task.ranges()["action_delay"][1])
    return Slots(*slots_of(task.compiled.prototypes, delay, len(task.observations())))


def parameter_slot(task: Task, position: int) -> int:
    """Slot of the parameter at a position of `Task.ranges`."""
    slots, n_raw = slots_for(task), len(task.episode.prototypes.raw)
    if position < n_raw:
        return slots.parameters + position
    return slots.channel + position - n_raw


def new_buffer(
    task: Task, n_rows: int, max_steps: int | None
) -> tuple[npt.NDArray[np.float64], Settings]:
    """Array of `n_rows` rows, zero except for the settings at its head; and the settings."""
    slots, ranges = slots_for(task), list(task.ranges().values())
    positions = task.parameter_positions()
    observed = [parameter_slot(task, positions[name][0]) for name in task.observed_parameters()]
    bounds = [end for entry in task.observations() for end in (entry.low, entry.high)]
    weights, constants = task.weights(), task.constants()
    tail = [*weights, *constants, *(end for ends in ranges for end in ends), *observed, *bounds]
    ends_on_slip, slip_penalty = task.slip_rule
    noise, blur, delay = (high for _, high in ranges[-len(CHANNEL) :])
    n_head = len(Settings._fields)
    blocks = _blocks_up(n_head + len(tail))
    actions = 2 * (blocks + _blocks_up(n_rows) * slots.total)
    end = actions + len(task.episode.prototypes.action) * n_rows
    settings = Settings(
        n_rows=n_rows,
        n_substeps=task.n_substeps,
        max_steps=np.inf if max_steps is None else max_steps,
        dt=task.dt,
        n_delays=int(delay),
        n_observed=len(observed),
        n_observation=len(bounds) // 2,
        n_exact=2 * task.n_goal,
        rotation=task.rotation_code,
        noisy_actions=int(noise > 0),
        noisy_observations=int(blur > 0),
        fastest=task.fastest,
        ends_on_slip=int(ends_on_slip),
        slip_penalty=slip_penalty,
        weights=n_head,
        constants=n_head + len(weights),
        ranges=n_head + len(weights) + len(constants),
        observed=n_head + len(weights) + len(constants) + 2 * len(ranges),
        bounds=n_head + len(weights) + len(constants) + 2 * len(ranges) + len(observed),
        blocks=blocks,
        actions=actions,
    )
    buffer = aligned_zeros(-(-end // 2))
    buffer[: n_head + len(tail)] = [*settings, *tail]
    return buffer, settings


def aligned_zeros(n: int) -> npt.NDArray[np.float64]:
    """Zeros that begin at a cache line, so that vectors of a block do not lie across two."""
    whole = np.zeros(n + _LINE)
    first = -whole.ctypes.data // whole.itemsize % _LINE
    return whole[first : first + n]


def _blocks_up(n: int) -> int:
    """Smallest multiple of LANES that is at least n."""
    return -(-n // LANES) * LANES
