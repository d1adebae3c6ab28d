"""What a step or a reset publishes: results, observations and flags, in three arrays.

Results are float64, shape (n, N): cost, reward terms, grip and reward of every row; observations
float32, shape (N, n_observation); flags bool, in the order of `FLAGS`, shape (6, N). A step writes
to arrays that nobody holds yet, block by block, while the block is in the first-level cache: so
nothing has to be copied afterwards, and each thread writes the part of its rows.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.kernels.compiler import routine
from rigid_envs.kernels.elementary import select
from rigid_envs.kernels.layout import FLAGS, Buffer, Settings, Slots
from rigid_envs.kernels.rows import (
    LANES,
    load,
    store,
    store_byte,
    store_nonzero,
    store_single,
    store_tile,
)

__all__ = [
    "Bools",
    "Observations",
    "Outputs",
    "Results",
    "Span",
    "publish_flags",
    "publish_observations",
    "publish_results",
]

_ONE, _EIGHT = (0.0,), (0.0,) * 8

Results = npt.NDArray[np.float64]
Observations = npt.NDArray[np.float32]
Bools = npt.NDArray[np.bool_]
Outputs = tuple[Results, Observations, Bools]


class Span(NamedTuple):
    """Rows ``first .. last - 1`` of the block that begins at `base`, whose first row is `row`."""

    base: int
    row: int
    first: int
    last: int


@routine
def publish_results(
    buffer: Buffer, s: Settings, slots: Slots, span: Span, results: Results
) -> None:
    """Publish the results of some rows of a block."""
    base, row, first, last = span
    at, n = base + slots.results * LANES, slots.flags - slots.results
    rest = last - (last - first) % 8
    for k in range(n):
        for i in range(first, rest, 8):
            values = load(buffer, at + k * LANES + i, _EIGHT, 1)
            store(results, k * s.n_rows + row + i, values, 1)
    for i in range(rest, last):
        for k in range(n):
            value = load(buffer, at + k * LANES + i, _ONE, 1)
            store(results, k * s.n_rows + row + i, value, 1)


@routine
def publish_observations(
    buffer: Buffer, s: Settings, slots: Slots, span: Span, observations: Observations
) -> None:
    """Publish the observations of some rows of a block."""
    base, row, first, last = span
    at, width = base + slots.observation * LANES, s.n_observation
    target = row * width
    rest = first
    if width >= 4:
        rest = last - (last - first) % 8
        for i in range(first, rest, 8):
            for start in range(0, width, 4):
                k = select(start < width - 4, start, width - 4)  # the last tile overlaps another
                store_tile(buffer, at + k * LANES + i, observations, target + i * width + k, width)
    for k in range(width):
        for i in range(rest, last):
            value = load(buffer, at + k * LANES + i, _ONE, 1)
            store_single(observations, target + i * width + k, value, 1)


@routine
def publish_flags(buffer: Buffer, s: Settings, slots: Slots, span: Span, flags: Bools) -> None:
    """Publish the flags of some rows of a block."""
    base, row, first, last = span
    at = base + slots.flags * LANES
    rest = last - (last - first) % 8
    for k in range(len(FLAGS)):
        for i in range(first, rest, 8):
            store_nonzero(buffer, at + k * LANES + i, flags, k * s.n_rows + row + i)
    for i in range(rest, last):
        for k in range(len(FLAGS)):
            flag = buffer[at + k * LANES + i] != 0.0
            store_byte(flags, k * s.n_rows + row + i, (flag,), 1)
