"""Observations of rows and frames of their next actions, computed from the state."""

from collections.abc import Callable
from typing import Any

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.attitude import write_attitude
from rigid_envs.kernels.compiler import phase
from rigid_envs.kernels.layout import Buffer, Prototypes, Settings, Slots
from rigid_envs.kernels.rows import LANES, load, store

__all__ = ["complete_observations", "observe_features"]

Function = Callable[..., Any]


@phase
def observe_features(
    observe: Function,
    frame_of: Function,
    prototypes: Prototypes,
    buffer: Buffer,
    slots: Slots,
    base: int,
    first: int,
    last: int,
    c: Row,
) -> None:
    """Write features and frame of rows ``first .. last - 1``."""
    at = base + slots.observation * LANES
    for i in range(first, last):
        y = load(buffer, base + i, prototypes.state, LANES)
        p = load(buffer, base + slots.parameters * LANES + i, prototypes.parameters, LANES)
        aux = load(buffer, base + slots.aux * LANES + i, prototypes.aux, LANES)
        store(buffer, at + i, observe(y, aux, p, c), LANES)
        store(buffer, base + slots.frame * LANES + i, frame_of(y, aux, p, c), LANES)


@phase
def complete_observations(
    disturb: Function,
    buffer: Buffer,
    s: Settings,
    slots: Slots,
    base: int,
    first: int,
    last: int,
) -> None:
    """Write what follows the features: attitude, drawn parameters, noise."""
    end = base + (slots.observation + s.n_observation - s.n_observed) * LANES  # of the attitude
    write_attitude(buffer, base, end, first, last, s.rotation)
    for k in range(s.n_observed):
        source = base + int(buffer[s.observed + k]) * LANES
        for i in range(first, last):
            buffer[end + k * LANES + i] = buffer[source + i]
    disturb(buffer, s, slots, base, first, last)
