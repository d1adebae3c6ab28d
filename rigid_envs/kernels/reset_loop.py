"""Loop that resets rows of an environment, with the functions of an `Episode`."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rigid_envs.kernels import randoms
from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.channel import DRAW_PARAMETERS, DRAW_START, stream_of
from rigid_envs.kernels.compiler import phase, routine
from rigid_envs.kernels.elementary import fma
from rigid_envs.kernels.layout import (
    CHANNEL,
    CLOCK,
    Buffer,
    Prototypes,
    Settings,
    Slots,
    read_settings,
    slots_of,
)
from rigid_envs.kernels.observation import complete_observations, observe_features
from rigid_envs.kernels.publication import (
    Bools,
    Observations,
    Results,
    Span,
    publish_flags,
    publish_observations,
    publish_results,
)
from rigid_envs.kernels.rows import LANES, load, store

__all__ = ["BEGIN", "BEGIN_UNSEEN", "OBSERVE", "PARAMETERS_GIVEN", "Reset", "reset_rows"]

BEGIN, BEGIN_UNSEEN, PARAMETERS_GIVEN, OBSERVE = range(4)  # modes of `reset_rows`

Function = Callable[..., Any]
Reset = Callable[[Buffer, Any, int, Results, Observations, Bools], int]


def reset_rows(
    derive: Function,
    start: Function,
    rate: Function,
    observe: Function,
    frame_of: Function,
    disturb: Function,
    prototypes: Prototypes,
) -> Reset:
    """Loop ``reset(buffer, rows, mode, results, observations, flags)`` of some functions.

    It begins a new episode in the given rows and publishes their observations. `BEGIN` draws
    parameters and an initial state. `BEGIN_UNSEEN` does the same and sets the results of the last
    step to zero. `PARAMETERS_GIVEN`, after one of these, keeps the parameters and draws the initial
    state again. `OBSERVE` draws nothing. It returns the last one of the rows whose rate is outside
    the envelope of the integrator, or -1.
    """

    def reset(
        buffer: Buffer,
        rows: Any,
        mode: int,
        results: Results,
        observations: Observations,
        flags: Bools,
    ) -> int:
        s = read_settings(buffer)
        slots = slots_of(prototypes, s.n_delays, s.n_observation)
        c = load(buffer, s.constants, prototypes.constants, 1)
        outside = -1
        for row in rows:
            block, lane = row // LANES, row % LANES
            base = s.blocks + block * slots.total * LANES
            span = Span(base, block * LANES, lane, lane + 1)
            if mode == BEGIN_UNSEEN:
                _clear_results(prototypes, buffer, slots, base, lane)
                publish_results(buffer, s, slots, span, results)
                publish_flags(buffer, s, slots, span, flags)
            if mode <= BEGIN_UNSEEN:
                _new_episode(prototypes, buffer, s, slots, base + lane)
                _draw_parameters(prototypes, buffer, s, slots, base + lane)
            _derive_parameters(derive, prototypes, buffer, slots, base + lane)
            if mode != OBSERVE:
                _draw_start(start, prototypes, buffer, slots, base + lane, c)
            if _is_outside(rate, prototypes, buffer, s, slots, base + lane):
                outside = row
            observe_features(observe, frame_of, prototypes, buffer, slots, base, lane, lane + 1, c)
            complete_observations(disturb, buffer, s, slots, base, lane, lane + 1)
            publish_observations(buffer, s, slots, span, observations)
        return outside

    return reset


@routine
def _new_episode(
    prototypes: Prototypes, buffer: Buffer, s: Settings, slots: Slots, at: int
) -> None:
    """Set the clock of a new episode and clear past actions."""
    clock = at + slots.clock * LANES
    buffer[clock + CLOCK.episode * LANES] += 1.0
    buffer[clock + CLOCK.elapsed * LANES] = 0.0
    buffer[clock + CLOCK.running * LANES] = 1.0
    for k in range(len(prototypes.action) * s.n_delays):
        buffer[at + (slots.history + k) * LANES] = 0.0


@routine
def _clear_results(
    prototypes: Prototypes, buffer: Buffer, slots: Slots, base: int, lane: int
) -> None:
    for k in range(slots.observation - slots.results):
        buffer[base + (slots.results + k) * LANES + lane] = 0.0


@routine
def _draw_parameters(
    prototypes: Prototypes, buffer: Buffer, s: Settings, slots: Slots, at: int
) -> None:
    """Draw every parameter of system and channel, uniform in its range; the delay is an integer."""
    n_raw = len(prototypes.raw)
    draws = stream_of(buffer, at + slots.clock * LANES, DRAW_PARAMETERS)
    for k in range(n_raw + len(CHANNEL)):
        low, high = buffer[s.ranges + 2 * k], buffer[s.ranges + 2 * k + 1]
        share = randoms.uniform(draws, k)
        if k == n_raw + CHANNEL.action_delay:
            value = low + np.floor((high - low + 1.0) * share)
        else:
            value = fma(high - low, share, low)
        slot = slots.parameters + k if k < n_raw else slots.channel + k - n_raw
        buffer[at + slot * LANES] = value


@phase
def _derive_parameters(
    derive: Function, prototypes: Prototypes, buffer: Buffer, slots: Slots, at: int
) -> None:
    parameters = at + slots.parameters * LANES
    p = derive(*load(buffer, parameters, prototypes.raw, LANES))
    store(buffer, parameters, p, LANES)


@phase
def _draw_start(
    start: Function, prototypes: Prototypes, buffer: Buffer, slots: Slots, at: int, c: Row
) -> None:
    p = load(buffer, at + slots.parameters * LANES, prototypes.parameters, LANES)
    y, aux = start(stream_of(buffer, at + slots.clock * LANES, DRAW_START), p, c)
    store(buffer, at, y, LANES)
    store(buffer, at + slots.aux * LANES, aux, LANES)


@phase
def _is_outside(
    rate: Function, prototypes: Prototypes, buffer: Buffer, s: Settings, slots: Slots, at: int
) -> bool:
    """Whether the rate of a row is outside the envelope of the integrator."""
    y = load(buffer, at, prototypes.state, LANES)
    p = load(buffer, at + slots.parameters * LANES, prototypes.parameters, LANES)
    return not rate(y, p) <= s.fastest
