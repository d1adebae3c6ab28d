"""The step and the reset of an environment, over all its rows: the only step loop there is.

A task gives five functions of one row; the two loops here are the same for all of them.

``start(stream, p, c) -> (y, memo)``           first state of an episode
``clip(a) -> (a, clipped)``                    action brought into the action space
``actuate(a, y, memo, p, c) -> (y, u)``        state after what acts at once, and input held
``judge(y, u, memo, p, c, dt) -> (memo, terms, cost, success, done)``
``observe(y, memo, p, c) -> features``         what is observed besides the attitude

A row never depends on another row, so the result is the same for any number of rows and threads.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from rigid_envs.kernels import randoms
from rigid_envs.kernels.algebra import Row
from rigid_envs.kernels.attitude import write_attitude
from rigid_envs.kernels.channel import (
    DRAW_PARAMETERS,
    DRAW_START,
    add_action_noise,
    add_observation_noise,
    delay_actions,
    stream_of,
)
from rigid_envs.kernels.compiler import phase, routine
from rigid_envs.kernels.elementary import fma, select
from rigid_envs.kernels.layout import Memory, Settings, Shapes, Slots, read_settings, slots_of
from rigid_envs.kernels.rows import (
    LANES,
    integrate,
    load,
    load_single,
    store,
    store_byte,
    store_single,
)

__all__ = ["BEGIN", "OBSERVE", "PARAMETERS_GIVEN", "reset", "step"]

BEGIN, PARAMETERS_GIVEN, OBSERVE = range(3)  # what `reset` does, see there
_ONE = (0.0,)
_LARGEST = 1e9  # a state beyond this is no longer physics: the episode is ended

Function = Callable[..., Any]


@phase
def step(
    advance: Function,
    restore: Function,
    weights: Row,
    clip: Function,
    actuate: Function,
    judge: Function,
    observe: Function,
    shapes: Shapes,
    memory: Memory,
    first_block: int,
    last_block: int,
) -> int:
    """One control step of all rows of the given blocks.

    Returns 0 if no flag of any row is up, a positive number if one is. If action entry k is not
    finite, nothing at all changes, in any row, and -1 - k is returned.
    """
    s = read_settings(memory)
    bad = _first_not_finite(memory, s, len(shapes.action))
    if bad >= 0:
        return -1 - bad
    slots = slots_of(shapes, s.n_delays, s.n_observation)
    c = load(memory, s.constants, shapes.constants, 1)
    n_raised = 0
    system_shapes = (shapes.state, shapes.inputs, shapes.parameters)
    for block in range(first_block, last_block):
        base = s.blocks + block * slots.total * LANES
        row = block * LANES
        n = min(LANES, s.n_rows - row)
        n_raised += _receive(clip, shapes, memory, s, slots, base, row, n)
        if s.noisy_actions:
            add_action_noise(clip, shapes, memory, slots, base, n)
        if s.n_delays:
            delay_actions(memory, s, slots, base, n, len(shapes.action))
        _actuate(actuate, shapes, memory, slots, base, n, c)
        h = s.dt / s.n_substeps
        integrate(advance, restore, weights, system_shapes, memory, base, n, h, s.n_substeps)
        n_raised += _judge(judge, shapes, memory, s, slots, base, row, n, c)
        _observe(observe, shapes, memory, s, slots, base, 0, n, c)
        _publish(memory, s, slots, base, row, 0, n)
    return n_raised


@phase
def reset(
    derive: Function,
    start: Function,
    observe: Function,
    shapes: Shapes,
    memory: Memory,
    rows: Any,
    mode: int,
) -> None:
    """Begin a new episode in the given rows and publish their observations.

    `BEGIN` draws parameters and a start. `PARAMETERS_GIVEN`, after it, takes the parameters as
    they stand and draws the start again. `OBSERVE` draws nothing.
    """
    s = read_settings(memory)
    slots = slots_of(shapes, s.n_delays, s.n_observation)
    c = load(memory, s.constants, shapes.constants, 1)
    for row in rows:
        block, lane = row // LANES, row % LANES
        base = s.blocks + block * slots.total * LANES
        if mode == BEGIN:
            _new_episode(shapes, memory, s, slots, base + lane)
            _draw_parameters(shapes, memory, s, slots, base + lane)
        if mode != OBSERVE:
            _draw_start(derive, start, shapes, memory, slots, base + lane, c)
        _observe(observe, shapes, memory, s, slots, base, lane, lane + 1, c)
        _publish(memory, s, slots, base, block * LANES, lane, lane + 1)


@routine
def _first_not_finite(memory: Memory, s: Settings, n_action: int) -> int:
    n_bad, size = 0, s.n_rows * n_action
    for k in range(size):
        n_bad += not abs(load_single(memory, s.actions + k, _ONE, 1)[0]) < np.inf
    if n_bad:
        for k in range(size):
            if not abs(load_single(memory, s.actions + k, _ONE, 1)[0]) < np.inf:
                return k
    return -1


@phase
def _receive(
    clip: Function,
    shapes: Shapes,
    memory: Memory,
    s: Settings,
    slots: Slots,
    base: int,
    row: int,
    n: int,
) -> int:
    """Actions as they come, brought into their space; returns how many were outside."""
    n_action = len(shapes.action)
    at, flag = base + slots.action * LANES, s.flags + 3 * s.n_rows + row
    n_clipped = 0
    for i in range(n):
        given = load_single(memory, s.actions + (row + i) * n_action, shapes.action, 1)
        action, clipped = clip(given)
        store(memory, at + i, action, LANES)
        store_byte(memory, flag + i, (clipped,), 1)
        n_clipped += clipped
    for k in range(n_action):
        for i in range(n):
            memory[at + k * LANES + i] += 0.0  # -0 becomes 0
    return n_clipped


@phase
def _actuate(
    actuate: Function, shapes: Shapes, memory: Memory, slots: Slots, base: int, n: int, c: Row
) -> None:
    for i in range(n):
        y = load(memory, base + i, shapes.state, LANES)
        p = load(memory, base + slots.parameters * LANES + i, shapes.parameters, LANES)
        memo = load(memory, base + slots.memo * LANES + i, shapes.memo, LANES)
        a = load(memory, base + slots.action * LANES + i, shapes.action, LANES)
        y, u = actuate(a, y, memo, p, c)
        store(memory, base + i, y, LANES)
        store(memory, base + slots.inputs * LANES + i, u, LANES)


@phase
def _judge(
    judge: Function,
    shapes: Shapes,
    memory: Memory,
    s: Settings,
    slots: Slots,
    base: int,
    row: int,
    n: int,
    c: Row,
) -> int:
    """Cost, reward terms, reward, success and ends of the episode; the clock moves on.

    Returns how many flags went up. A state that is no longer a number ends the episode; see
    `_mend`.
    """
    results, flags = s.results + row, s.flags + row
    elapsed, running = base + (slots.clock + 3) * LANES, base + (slots.clock + 4) * LANES
    n_broken, n_raised = 0, 0
    for i in range(n):
        y = load(memory, base + i, shapes.state, LANES)
        u = load(memory, base + slots.inputs * LANES + i, shapes.inputs, LANES)
        p = load(memory, base + slots.parameters * LANES + i, shapes.parameters, LANES)
        memo = load(memory, base + slots.memo * LANES + i, shapes.memo, LANES)
        memo, terms, cost, success, done = judge(y, u, memo, p, c, s.dt)
        store(memory, base + slots.memo * LANES + i, memo, LANES)
        broken = 0
        for k in range(len(y)):
            broken |= not abs(y[k]) < _LARGEST
        reward = 0.0
        for k in range(len(terms)):
            reward = fma(c[k], terms[k], reward)
        store(memory, results + i, (cost, *terms, reward), s.n_rows)
        steps = load(memory, elapsed + i, _ONE, 1)[0] + 1.0
        store(memory, elapsed + i, (steps,), 1)
        over, late = done | (broken != 0), steps >= s.max_steps
        store(memory, running + i, (select(over | late, 0.0, 1.0),), 1)
        n_raised += over | late | success
        store_byte(memory, flags + i, (over, late, success), s.n_rows)
        store_byte(memory, flags + 4 * s.n_rows + i, (broken,), 1)
        n_broken += broken
    if n_broken:
        _mend(shapes, memory, s, slots, base, row, n)
    return n_raised


@routine
def _mend(
    shapes: Shapes, memory: Memory, s: Settings, slots: Slots, base: int, row: int, n: int
) -> None:
    """A broken row gets the system's rest state, no reward, no cost and no success."""
    byte = memory.view(np.uint8)
    results, flags = s.results + row, s.flags + row
    for i in range(n):
        if byte[flags + 4 * s.n_rows + i]:
            store(memory, base + i, shapes.state, LANES)
            store(memory, base + slots.memo * LANES + i, shapes.memo, LANES)
            byte[flags + 2 * s.n_rows + i] = 0
            for k in range(2 + s.n_terms):
                memory[results + k * s.n_rows + i] = 0.0


@phase
def _observe(
    observe: Function,
    shapes: Shapes,
    memory: Memory,
    s: Settings,
    slots: Slots,
    base: int,
    first: int,
    last: int,
    c: Row,
) -> None:
    """Observation slots: the task's features, the attitude, the drawn parameters, noise."""
    at = base + slots.observation * LANES
    n_features = 0
    for i in range(first, last):
        y = load(memory, base + i, shapes.state, LANES)
        p = load(memory, base + slots.parameters * LANES + i, shapes.parameters, LANES)
        memo = load(memory, base + slots.memo * LANES + i, shapes.memo, LANES)
        features = observe(y, memo, p, c)
        n_features = len(features)
        store(memory, at + i, features, LANES)
    at = at + n_features * LANES
    at = at + write_attitude(memory, base, at, first, last, s.rotation) * LANES
    for k in range(s.n_observed):
        source = base + int(memory[s.observed + k]) * LANES
        for i in range(first, last):
            memory[at + k * LANES + i] = memory[source + i]
    if s.noisy_observations:
        add_observation_noise(memory, s, slots, base, first, last)


@routine
def _publish(
    memory: Memory, s: Settings, slots: Slots, base: int, row: int, first: int, last: int
) -> None:
    """Observations as float32, one row after the other."""
    at = base + slots.observation * LANES
    target = s.observations + row * s.n_observation
    for k in range(s.n_observation):
        for i in range(first, last):
            value = load(memory, at + k * LANES + i, _ONE, 1)
            store_single(memory, target + i * s.n_observation + k, value, 1)


@routine
def _new_episode(shapes: Shapes, memory: Memory, s: Settings, slots: Slots, at: int) -> None:
    """Clock of a new episode; no past actions."""
    clock = at + slots.clock * LANES
    memory[clock + 2 * LANES] += 1.0
    memory[clock + 3 * LANES] = 0.0
    memory[clock + 4 * LANES] = 1.0
    for k in range(len(shapes.action) * s.n_delays):
        memory[at + (slots.history + k) * LANES] = 0.0


@routine
def _draw_parameters(shapes: Shapes, memory: Memory, s: Settings, slots: Slots, at: int) -> None:
    """Every parameter of the system and the channel, uniform in its range; the delay whole."""
    n_raw = len(shapes.raw)
    draws = stream_of(memory, at + slots.clock * LANES, DRAW_PARAMETERS)
    for k in range(n_raw + 3):
        low, high = memory[s.ranges + 2 * k], memory[s.ranges + 2 * k + 1]
        share = randoms.uniform(draws, k)
        if k == n_raw + 2:
            value = low + np.floor((high - low + 1.0) * share)
        else:
            value = fma(high - low, share, low)
        slot = slots.parameters + k if k < n_raw else slots.channel + k - n_raw
        memory[at + slot * LANES] = value


@phase
def _draw_start(
    derive: Function,
    start: Function,
    shapes: Shapes,
    memory: Memory,
    slots: Slots,
    at: int,
    c: Row,
) -> None:
    parameters = at + slots.parameters * LANES
    p = derive(load(memory, parameters, shapes.raw, LANES))
    store(memory, parameters, p, LANES)
    y, memo = start(stream_of(memory, at + slots.clock * LANES, DRAW_START), p, c)
    store(memory, at, y, LANES)
    store(memory, at + slots.memo * LANES, memo, LANES)
