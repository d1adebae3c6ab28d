"""Observations of rows: computed from the state, and copied to the float32 part of the buffer."""

from collections.abc import Callable
from typing import Any

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.attitude import write_attitude
from rigid_envs.kernels.compiler import phase, routine
from rigid_envs.kernels.elementary import select
from rigid_envs.kernels.layout import Buffer, Prototypes, Settings, Slots
from rigid_envs.kernels.rows import LANES, load, store, store_single, store_tile

__all__ = ["observe_rows", "publish_rows"]

_ONE = (0.0,)

Function = Callable[..., Any]


@phase
def observe_rows(
    observe: Function,
    disturb: Function,
    prototypes: Prototypes,
    buffer: Buffer,
    s: Settings,
    slots: Slots,
    base: int,
    first: int,
    last: int,
    c: Row,
) -> None:
    """Write the observation slots: features, attitude, drawn parameters, noise."""
    at = base + slots.observation * LANES
    n_features = 0
    for i in range(first, last):
        y = load(buffer, base + i, prototypes.state, LANES)
        p = load(buffer, base + slots.parameters * LANES + i, prototypes.parameters, LANES)
        aux = load(buffer, base + slots.aux * LANES + i, prototypes.aux, LANES)
        features = observe(y, aux, p, c)
        n_features = len(features)
        store(buffer, at + i, features, LANES)
    at = at + n_features * LANES
    at = at + write_attitude(buffer, base, at, first, last, s.rotation) * LANES
    for k in range(s.n_observed):
        source = base + int(buffer[s.observed + k]) * LANES
        for i in range(first, last):
            buffer[at + k * LANES + i] = buffer[source + i]
    disturb(buffer, s, slots, base, first, last)


@routine
def publish_rows(
    buffer: Buffer, s: Settings, slots: Slots, base: int, row: int, first: int, last: int
) -> None:
    """Copy the observations to the float32 part of the buffer."""
    at = base + slots.observation * LANES
    width = s.n_observation
    target = s.observations + row * width
    rest = first
    if width >= 4:
        rest = last - (last - first) % 8
        for i in range(first, rest, 8):
            for start in range(0, width, 4):
                k = select(start < width - 4, start, width - 4)  # the last tile overlaps another
                store_tile(buffer, at + k * LANES + i, target + i * width + k, width)
    for k in range(width):
        for i in range(rest, last):
            value = load(buffer, at + k * LANES + i, _ONE, 1)
            store_single(buffer, target + i * width + k, value, 1)
