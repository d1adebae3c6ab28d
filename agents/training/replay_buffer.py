"""Replay buffers as arrays, and back, to the bit."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.buffers import ReplayBuffer

__all__ = ["buffer_arrays", "restore_buffer"]

Arrays = dict[str, NDArray[Any]]
# The last two are those of HER: start and length of the episode of each step.
_TABLES = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts",
           "ep_start", "ep_length")  # fmt: skip


def buffer_arrays(buffer: ReplayBuffer) -> Arrays:
    """Content of a replay buffer; of one that is not full, the part that is filled."""
    arrays = {name: table[: buffer.size()] for name, table in _tables(buffer).items()}
    arrays["place"] = np.array([buffer.pos, buffer.full], dtype=np.int64)
    if hasattr(buffer, "_current_ep_start"):
        arrays["current_start"] = buffer._current_ep_start
    return arrays


def restore_buffer(buffer: ReplayBuffer, arrays: Arrays) -> None:
    """Fill an empty replay buffer of the same size with the arrays of `buffer_arrays`."""
    position, full = arrays["place"].tolist()
    buffer.pos, buffer.full = position, bool(full)
    for name, table in _tables(buffer).items():
        table[: buffer.size()] = arrays[name]
    if hasattr(buffer, "_current_ep_start"):
        buffer._current_ep_start = arrays["current_start"]


def _tables(buffer: ReplayBuffer) -> Arrays:
    """Arrays of a buffer by name, one row per step; each part of a dictionary by itself."""
    tables: Arrays = {}
    for name in _TABLES:
        table: Any = getattr(buffer, name, None)
        if isinstance(table, dict):
            tables |= {f"{name}/{key}": part for key, part in table.items()}
        elif table is not None:
            tables[name] = table
    return tables
