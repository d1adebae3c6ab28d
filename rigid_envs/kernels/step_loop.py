"""Loops that step and reset the rows of an environment, with the functions of an `Episode`.

Rows are independent, so the result is the same for any number of rows and threads.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from rigid_envs.kernels import randoms
from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.channel import (
    DRAW_PARAMETERS,
    DRAW_START,
    add_action_noise,
    delay_actions,
    stream_of,
)
from rigid_envs.kernels.compiler import phase, routine
from rigid_envs.kernels.elementary import fma, select
from rigid_envs.kernels.layout import (
    CHANNEL,
    CLOCK,
    FLAGS,
    Buffer,
    Prototypes,
    Settings,
    Slots,
    read_settings,
    slots_of,
)
from rigid_envs.kernels.observation import observe_rows, publish_rows
from rigid_envs.kernels.rows import (
    LANES,
    integrate,
    load,
    load_single,
    store,
    store_byte,
)

__all__ = ["BEGIN", "OBSERVE", "PARAMETERS_GIVEN", "reset_rows", "step_rows"]

BEGIN, PARAMETERS_GIVEN, OBSERVE = range(3)  # modes of `reset_rows`
_ONE = (0.0,)
_LARGEST = 1e9  # a larger state is a physics error and ends the episode

Function = Callable[..., Any]


@phase
def step_rows(
    advance: Function,
    restore: Function,
    stages: Row,
    clip: Function,
    actuate: Function,
    outcome: Function,
    observe: Function,
    prototypes: Prototypes,
    buffer: Buffer,
    first_block: int,
    last_block: int,
) -> int:
    """Step all rows of the given blocks by one control period.

    Returns 0 if no flag of any row is set, a positive number if one is. If action entry k is not
    finite, no row changes and -1 - k is returned.
    """
    s = read_settings(buffer)
    bad = _first_not_finite(buffer, s, len(prototypes.action))
    if bad >= 0:
        return -1 - bad
    slots = slots_of(prototypes, s.n_delays, s.n_observation)
    weights = load(buffer, s.weights, prototypes.terms, 1)
    c = load(buffer, s.constants, prototypes.constants, 1)
    n_raised = 0
    moving = (prototypes.state, prototypes.inputs, prototypes.parameters)
    for block in range(first_block, last_block):
        base = s.blocks + block * slots.total * LANES
        row = block * LANES
        n = min(LANES, s.n_rows - row)
        n_raised += _receive(clip, prototypes, buffer, s, slots, base, row, n)
        if s.noisy_actions:
            add_action_noise(clip, prototypes, buffer, slots, base, n)
        if s.n_delays:
            delay_actions(buffer, s, slots, base, n, len(prototypes.action))
        _actuate(actuate, prototypes, buffer, slots, base, n, c)
        h = s.dt / s.n_substeps
        integrate(advance, restore, stages, moving, buffer, base, n, h, s.n_substeps)
        n_raised += _conclude(outcome, prototypes, buffer, s, slots, base, row, n, weights, c)
        observe_rows(observe, prototypes, buffer, s, slots, base, 0, n, c)
        publish_rows(buffer, s, slots, base, row, 0, n)
    return n_raised


@phase
def reset_rows(
    derive: Function,
    start: Function,
    observe: Function,
    prototypes: Prototypes,
    buffer: Buffer,
    rows: Any,
    mode: int,
) -> None:
    """Begin a new episode in the given rows and write their observations.

    `BEGIN` draws parameters and an initial state. `PARAMETERS_GIVEN`, after it, keeps the
    parameters and draws the initial state again. `OBSERVE` draws nothing.
    """
    s = read_settings(buffer)
    slots = slots_of(prototypes, s.n_delays, s.n_observation)
    c = load(buffer, s.constants, prototypes.constants, 1)
    for row in rows:
        block, lane = row // LANES, row % LANES
        base = s.blocks + block * slots.total * LANES
        if mode == BEGIN:
            _new_episode(prototypes, buffer, s, slots, base + lane)
            _draw_parameters(prototypes, buffer, s, slots, base + lane)
        if mode != OBSERVE:
            _draw_start(derive, start, prototypes, buffer, slots, base + lane, c)
        observe_rows(observe, prototypes, buffer, s, slots, base, lane, lane + 1, c)
        publish_rows(buffer, s, slots, base, block * LANES, lane, lane + 1)


@routine
def _first_not_finite(buffer: Buffer, s: Settings, n_action: int) -> int:
    n_bad, size = 0, s.n_rows * n_action
    for k in range(size):
        n_bad += not abs(load_single(buffer, s.actions + k, _ONE, 1)[0]) < np.inf
    if n_bad:
        for k in range(size):
            if not abs(load_single(buffer, s.actions + k, _ONE, 1)[0]) < np.inf:
                return k
    return -1


@phase
def _receive(
    clip: Function,
    prototypes: Prototypes,
    buffer: Buffer,
    s: Settings,
    slots: Slots,
    base: int,
    row: int,
    n: int,
) -> int:
    """Read actions and clip them to their space; returns how many were clipped."""
    n_action = len(prototypes.action)
    at, flag = base + slots.action * LANES, s.flags + FLAGS.action_clipped * s.n_rows + row
    n_clipped = 0
    for i in range(n):
        given = load_single(buffer, s.actions + (row + i) * n_action, prototypes.action, 1)
        action, clipped = clip(given)
        store(buffer, at + i, action, LANES)
        store_byte(buffer, flag + i, (clipped,), 1)
        n_clipped += clipped
    for k in range(n_action):
        for i in range(n):
            buffer[at + k * LANES + i] += 0.0  # -0 becomes 0
    return n_clipped


@phase
def _actuate(
    actuate: Function,
    prototypes: Prototypes,
    buffer: Buffer,
    slots: Slots,
    base: int,
    n: int,
    c: Row,
) -> None:
    for i in range(n):
        y = load(buffer, base + i, prototypes.state, LANES)
        p = load(buffer, base + slots.parameters * LANES + i, prototypes.parameters, LANES)
        aux = load(buffer, base + slots.aux * LANES + i, prototypes.aux, LANES)
        a = load(buffer, base + slots.action * LANES + i, prototypes.action, LANES)
        y, u = actuate(a, y, aux, p, c)
        store(buffer, base + i, y, LANES)
        store(buffer, base + slots.inputs * LANES + i, u, LANES)


@phase
def _conclude(
    outcome: Function,
    prototypes: Prototypes,
    buffer: Buffer,
    s: Settings,
    slots: Slots,
    base: int,
    row: int,
    n: int,
    weights: Row,
    c: Row,
) -> int:
    """Write cost, reward terms, reward and flags, and advance the clock.

    Returns how many flags are set. A state that is not finite or too large ends the episode; see
    `_mend`.
    """
    results, flags = s.results + row, s.flags + row
    elapsed = base + (slots.clock + CLOCK.elapsed) * LANES
    running = base + (slots.clock + CLOCK.running) * LANES
    broken_flag = flags + FLAGS.physics_error * s.n_rows
    n_broken, n_raised = 0, 0
    for i in range(n):
        y = load(buffer, base + i, prototypes.state, LANES)
        u = load(buffer, base + slots.inputs * LANES + i, prototypes.inputs, LANES)
        p = load(buffer, base + slots.parameters * LANES + i, prototypes.parameters, LANES)
        aux = load(buffer, base + slots.aux * LANES + i, prototypes.aux, LANES)
        aux, terms, cost, success, done = outcome(y, u, aux, p, c, s.dt)
        store(buffer, base + slots.aux * LANES + i, aux, LANES)
        broken = 0
        for k in range(len(y)):
            broken |= not abs(y[k]) < _LARGEST
        reward = 0.0
        for k in range(len(terms)):
            reward = fma(weights[k], terms[k], reward)
        store(buffer, results + i, (cost,), 1)
        store(buffer, results + s.n_rows + i, terms, s.n_rows)
        store(buffer, results + (1 + len(terms)) * s.n_rows + i, (reward,), 1)
        steps = load(buffer, elapsed + i, _ONE, 1)[0] + 1.0
        store(buffer, elapsed + i, (steps,), 1)
        over, late = done | (broken != 0), steps >= s.max_steps
        store(buffer, running + i, (select(over | late, 0.0, 1.0),), 1)
        n_raised += over | late | success
        store_byte(buffer, flags + i, (over, late, success), s.n_rows)
        store_byte(buffer, broken_flag + i, (broken,), 1)
        n_broken += broken
    if n_broken:
        _mend(prototypes, buffer, s, slots, base, row, n)
    return n_raised


@routine
def _mend(
    prototypes: Prototypes, buffer: Buffer, s: Settings, slots: Slots, base: int, row: int, n: int
) -> None:
    """Set a row with a physics error to the rest state, without reward, cost and success."""
    byte = buffer.view(np.uint8)
    results, flags = s.results + row, s.flags + row
    for i in range(n):
        if byte[flags + FLAGS.physics_error * s.n_rows + i]:
            store(buffer, base + i, prototypes.state, LANES)
            store(buffer, base + slots.aux * LANES + i, prototypes.aux, LANES)
            byte[flags + FLAGS.is_success * s.n_rows + i] = 0
            for k in range(2 + s.n_terms):
                buffer[results + k * s.n_rows + i] = 0.0


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
def _draw_start(
    derive: Function,
    start: Function,
    prototypes: Prototypes,
    buffer: Buffer,
    slots: Slots,
    at: int,
    c: Row,
) -> None:
    parameters = at + slots.parameters * LANES
    p = derive(*load(buffer, parameters, prototypes.raw, LANES))
    store(buffer, parameters, p, LANES)
    p = load(buffer, parameters, prototypes.parameters, LANES)
    y, aux = start(stream_of(buffer, at + slots.clock * LANES, DRAW_START), p, c)
    store(buffer, at, y, LANES)
    store(buffer, at + slots.aux * LANES, aux, LANES)
