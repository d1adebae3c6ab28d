"""Where everything of a batch of rows stands in its one array of float64.

An environment keeps settings, rows, actions, observations and results in a single array, because
a compiled function costs 45 ns per array that is handed to it, as much as the physics of a row::

    settings | constants, ranges, bounds | block 0 | block 1 | ... | results | flags | actions | ...

Each block holds `LANES` rows; the slots of a row are given by `slots_of`. Results (float64) and
flags (bytes) hold the first number of all rows, then the second, and so on. Actions and
observations are float32, one row after the other.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.compiler import scalar

__all__ = [
    "CHANNEL",
    "CLOCK",
    "FLAGS",
    "Settings",
    "Shapes",
    "Slots",
    "read_settings",
    "slots_of",
]

Memory = npt.NDArray[np.float64]

CHANNEL = ("action_noise", "observation_noise", "action_delay")
CLOCK = ("key_high", "key_low", "episode", "elapsed", "running")
FLAGS = ("terminated", "truncated", "is_success", "action_clipped", "physics_error")


class Shapes(NamedTuple):
    """One tuple of the right length for every part of a row whose length the physics fixes."""

    state: Row
    inputs: Row
    parameters: Row
    raw: Row
    memo: Row
    action: Row
    constants: Row


class Settings(NamedTuple):
    """Numbers shared by all rows: sizes, and where the parts of the array start."""

    n_rows: int
    n_substeps: int
    max_steps: float
    dt: float
    n_terms: int
    n_delays: int
    n_observed: int
    n_observation: int
    n_exact: int
    rotation: int
    noisy_actions: int
    noisy_observations: int
    constants: int
    ranges: int
    observed: int
    bounds: int
    blocks: int
    results: int
    flags: int
    actions: int
    observations: int


class Slots(NamedTuple):
    """First slot of every part of a row."""

    state: int
    inputs: int
    parameters: int
    channel: int
    memo: int
    clock: int
    action: int
    history: int
    observation: int
    total: int


@scalar
def read_settings(memory: Memory) -> Settings:
    """The settings at the head of the array."""
    return Settings(
        int(memory[0]),
        int(memory[1]),
        memory[2],
        memory[3],
        int(memory[4]),
        int(memory[5]),
        int(memory[6]),
        int(memory[7]),
        int(memory[8]),
        int(memory[9]),
        int(memory[10]),
        int(memory[11]),
        int(memory[12]),
        int(memory[13]),
        int(memory[14]),
        int(memory[15]),
        int(memory[16]),
        int(memory[17]),
        int(memory[18]),
        int(memory[19]),
        int(memory[20]),
    )


@scalar
def slots_of(shapes: Shapes, n_delays: int, n_observation: int) -> Slots:
    """Slots of a row: state, inputs and parameters first, where `integrate` expects them."""
    parameters = len(shapes.state) + len(shapes.inputs)
    channel = parameters + len(shapes.parameters)
    memo = channel + 3
    clock = memo + len(shapes.memo)
    action = clock + 5
    history = action + len(shapes.action)
    observation = history + len(shapes.action) * n_delays
    return Slots(
        0,
        len(shapes.state),
        parameters,
        channel,
        memo,
        clock,
        action,
        history,
        observation,
        observation + n_observation,
    )
