"""Observations of rows, computed from the state."""

from collections.abc import Callable
from typing import Any

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.attitude import write_attitude
from rigid_envs.kernels.compiler import phase
from rigid_envs.kernels.layout import Buffer, Prototypes, Settings, Slots
from rigid_envs.kernels.rows import LANES, load, store

__all__ = ["observe_rows"]

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
