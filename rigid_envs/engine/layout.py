"""Memory layout of a batch of rows in one array of float64.

An environment keeps settings, rows and actions in a single array, because a call of a compiled
function takes tens of nanoseconds per array argument, as long as the physics of a row::

    settings | weights, constants, ranges, bounds | block 0 | block 1 | ... | actions

Each block holds `LANES` rows; the slots of a row are given by `slots_of`. Actions are float32, one
row after the other. What a step or a reset publishes is written to arrays of its own: see
`rigid_envs.engine.publication`.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.engine.algebra import Row
from rigid_envs.engine.compiler import scalar

Buffer = npt.NDArray[np.float64]


class Channel(NamedTuple):
    """Slots of noise and delay, relative to `Slots.channel`."""

    action_noise: int = 0
    observation_noise: int = 1
    action_delay: int = 2


class Clock(NamedTuple):
    """Slots of random stream and time of a row, relative to `Slots.clock`."""

    key_high: int = 0
    key_low: int = 1
    episode: int = 2
    elapsed: int = 3
    running: int = 4


class Flags(NamedTuple):
    """Index of each flag, 0 or 1 in the slots of a row."""

    terminated: int = 0
    truncated: int = 1
    is_success: int = 2
    action_clipped: int = 3
    physics_error: int = 4
    slips: int = 5


CHANNEL, CLOCK, FLAGS = Channel(), Clock(), Flags()


class Prototypes(NamedTuple):
    """Prototype rows, whose names and lengths the loops of an environment are compiled for."""

    state: Row
    inputs: Row
    parameters: Row
    raw: Row
    aux: Row
    frame: Row
    action: Row
    terms: Row
    grip: Row
    constants: Row


class Sizes(NamedTuple):
    """Numbers shared by all rows: sizes, and offsets of the parts of the array."""

    n_rows: int
    n_substeps: int
    max_steps: float
    dt: float
    n_delays: int
    n_observed: int
    n_observation: int
    n_exact: int
    rotation: int
    noisy_actions: int
    noisy_observations: int
    fastest: float
    ends_on_slip: int
    slip_penalty: float
    weights: int
    constants: int
    ranges: int
    observed: int
    bounds: int
    blocks: int
    actions: int


class Slots(NamedTuple):
    """First slot of every part of a row; results are cost, reward terms, grip and reward."""

    state: int
    inputs: int
    parameters: int
    channel: int
    aux: int
    clock: int
    frame: int
    action: int
    results: int
    flags: int
    observation: int
    history: int
    total: int


@scalar
def read_settings(buffer: Buffer) -> Sizes:
    """The settings at the head of the array."""
    return Sizes(
        int(buffer[0]),
        int(buffer[1]),
        buffer[2],
        buffer[3],
        int(buffer[4]),
        int(buffer[5]),
        int(buffer[6]),
        int(buffer[7]),
        int(buffer[8]),
        int(buffer[9]),
        int(buffer[10]),
        buffer[11],
        int(buffer[12]),
        buffer[13],
        int(buffer[14]),
        int(buffer[15]),
        int(buffer[16]),
        int(buffer[17]),
        int(buffer[18]),
        int(buffer[19]),
        int(buffer[20]),
    )


@scalar
def slots_of(prototypes: Prototypes, n_delays: int, n_observation: int) -> Slots:
    """Slots of a row: state, inputs and parameters first, where `integrate` expects them.

    The history, whose length is a setting, comes last: up to it the compiler knows all distances.
    """
    parameters = len(prototypes.state) + len(prototypes.inputs)
    channel = parameters + len(prototypes.parameters)
    aux = channel + len(CHANNEL)
    clock = aux + len(prototypes.aux)
    frame = clock + len(CLOCK)
    action = frame + len(prototypes.frame)
    results = action + len(prototypes.action)
    flags = results + 2 + len(prototypes.terms) + len(prototypes.grip)
    observation = flags + len(FLAGS)
    history = observation + n_observation
    return Slots(
        0,
        len(prototypes.state),
        parameters,
        channel,
        aux,
        clock,
        frame,
        action,
        results,
        flags,
        observation,
        history,
        history + len(prototypes.action) * n_delays,
    )
