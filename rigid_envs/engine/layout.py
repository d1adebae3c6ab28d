"""Memory layout of a batch of rows in one array of float64.

An environment keeps settings, rows and actions in a single array, because a call of a compiled
function takes tens of nanoseconds per array argument, as long as the physics of a row::

    settings | weights, constants, ranges, bounds | block 0 | block 1 | ... | actions

Each block holds `LANES` rows; the slots of a row are given by `slots_of`. Actions are float32, one
row after the other. What a step or a reset publishes is written to arrays of its own: see
`rigid_envs.engine.publication`.
"""

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba import types
from numba.core.typing.templates import Signature

from rigid_envs.engine.algebra import Row
from rigid_envs.engine.compiler import instruction
from rigid_envs.engine.rows import elements

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
    """Numbers shared by all rows: sizes, and offsets of the parts of the array.

    The past actions of a row are in its slots from `history` to `total`, its last ones.
    """

    n_rows: int
    n_substeps: int
    max_steps: float
    dt: float
    history: int
    total: int
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
    """First slot of every part of a row; results are cost, reward terms, grip and reward.

    All that compiled loops depend on: parts whose length is a setting come last.
    """

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


@instruction
def read_settings(_context: Any, buffer: Any) -> tuple[Signature, Callable[..., Any]]:
    """The settings at the head of the array."""
    numbers = {int: types.intp, float: types.float64}
    kinds = [numbers[kind] for kind in Sizes.__annotations__.values()]
    result = types.NamedTuple(kinds, Sizes)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        places = elements(context, builder, signature.args[0], arguments[0], range(len(kinds)))
        row = [
            context.cast(builder, builder.load(at), types.float64, kind)
            for at, kind in zip(places, kinds, strict=True)
        ]
        return context.make_tuple(builder, result, row)

    return result(buffer), generate


def slots_of(prototypes: Prototypes) -> Slots:
    """Slots of a row: state, inputs and parameters first, where `integrate` expects them."""
    state, inputs, parameters, _, aux, frame, action, terms, grip, _ = map(len, prototypes)
    results = 2 + terms + grip
    sizes = (state, inputs, parameters, len(CHANNEL), aux, len(CLOCK), frame, action, results)
    return Slots(0, *itertools.accumulate((*sizes, len(FLAGS))))
