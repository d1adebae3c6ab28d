"""The memory of off-policy algorithms as arrays, and back, to the bit."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.buffers import ReplayBuffer

__all__ = ["memory_arrays", "restore_memory"]

Arrays = dict[str, NDArray[Any]]
# The last two are of hindsight: where the episode of each step starts, and how long it was.
_TABLES = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts",
           "ep_start", "ep_length")  # fmt: skip


def memory_arrays(memory: ReplayBuffer) -> Arrays:
    """All that a memory holds; of one that is not full yet, the part that is.

    Args:
        memory: The memory.
    """
    arrays = {name: table[: memory.size()] for name, table in _tables(memory).items()}
    arrays["place"] = np.array([memory.pos, memory.full], dtype=np.int64)
    if hasattr(memory, "_current_ep_start"):
        arrays["current_start"] = memory._current_ep_start
    return arrays


def restore_memory(memory: ReplayBuffer, arrays: Arrays) -> None:
    """Fill an empty memory of the same size.

    Args:
        memory: The memory.
        arrays: From `memory_arrays`.
    """
    position, full = arrays["place"].tolist()
    memory.pos, memory.full = position, bool(full)
    for name, table in _tables(memory).items():
        table[: memory.size()] = arrays[name]
    if hasattr(memory, "_current_ep_start"):
        memory._current_ep_start = arrays["current_start"]


def _tables(memory: ReplayBuffer) -> Arrays:
    """The arrays of a memory, by name, with one row for each step; those of a dictionary apart."""
    tables: Arrays = {}
    for name in _TABLES:
        table: Any = getattr(memory, name, None)
        if isinstance(table, dict):
            tables |= {f"{name}/{key}": part for key, part in table.items()}
        elif table is not None:
            tables[name] = table
    return tables
