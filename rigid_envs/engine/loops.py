"""The step and the reset of an environment, over all rows."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rigid_envs.base.checks import Bools
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Row, weighted_sum
from rigid_envs.engine.compiler import phase, routine, scalar
from rigid_envs.engine.elementary import fma, select
from rigid_envs.engine.layout import (
    CHANNEL,
    CLOCK,
    FLAGS,
    Buffer,
    Prototypes,
    Sizes,
    Slots,
    read_settings,
    slots_of,
)
from rigid_envs.engine.publication import (
    DRAW_PARAMETERS,
    DRAW_START,
    Observations,
    Results,
    Span,
    complete_observations,
    observe_features,
    publish_flags,
    publish_observations,
    publish_results,
    stream_of,
)
from rigid_envs.engine.rows import LANES, integrate, load, load_single, load_tile, store

# Loop that steps the rows of an environment, with the functions of an `Episode`.
#
# Rows are independent, so the result is the same for any number of rows and threads.

ENDED = 1 << 40  # more than rows that have a flag

_ONE = (0.0,)
_LARGEST = 1e9  # a larger state is a physics error and ends the episode

Function = Callable[..., Any]
Step = Callable[[Buffer, int, int, Results, Observations, Bools], int]


def step_rows(
    advance: Function,
    restore: Function,
    stages: Row,
    clip: Function,
    turn: Function,
    actuate: Function,
    outcome: Function,
    force: Function,
    grip: Function,
    slips: Function,
    rate: Function,
    observe: Function,
    frame_of: Function,
    disturb_actions: Function,
    disturb_observations: Function,
    prototypes: Prototypes,
) -> Step:
    """Loop ``step(buffer, first_block, last_block, results, observations, flags)`` of functions.

    It steps all rows of the given blocks by one control period, and publishes them: see
    `publication`. It returns 0 if no flag of any row is set, a positive number if one is, and at
    least `ENDED` if an episode has ended. If action entry k is not finite, no row changes and
    -1 - k is returned.
    """

    def step(
        buffer: Buffer,
        first_block: int,
        last_block: int,
        results: Results,
        observations: Observations,
        flags: Bools,
    ) -> int:
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
            left = s.n_rows - row
            n = left if left < LANES else LANES
            n_raised += _receive(clip, turn, prototypes, buffer, s, slots, base, row, n)
            disturb_actions(clip, prototypes, buffer, s, slots, base, n)
            _actuate(actuate, prototypes, buffer, slots, base, n, c)
            h = s.dt / s.n_substeps
            integrate(advance, restore, stages, moving, buffer, base, n, h, s.n_substeps)
            n_raised += _conclude(outcome, observe, frame_of, force, grip, slips, rate, prototypes,
                                  buffer, s, slots, base, n, weights, c)  # fmt: skip
            complete_observations(disturb_observations, buffer, s, slots, base, 0, n)
            span = Span(base, row, 0, n)
            publish_results(buffer, s, slots, span, results)
            publish_observations(buffer, s, slots, span, observations)
            publish_flags(buffer, s, slots, span, flags)
        return n_raised

    return step


@routine
def _first_not_finite(buffer: Buffer, s: Sizes, n_action: int) -> int:
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
    turn: Function,
    prototypes: Prototypes,
    buffer: Buffer,
    s: Sizes,
    slots: Slots,
    base: int,
    row: int,
    n: int,
) -> int:
    """Read actions, clip them to their space and turn them from the frame in which they are given.

    Returns how many were clipped.
    """
    n_action = len(prototypes.action)
    given, at = s.actions + row * n_action, base + slots.action * LANES
    flag = base + (slots.flags + FLAGS.action_clipped) * LANES
    whole = n - n % 8
    for i in range(0, whole, 8):
        load_tile(buffer, given + i * n_action, at + i, prototypes.action)
    for i in range(whole, n):
        action = load_single(buffer, given + i * n_action, prototypes.action, 1)
        store(buffer, at + i, action, LANES)
    n_clipped = 0
    for i in range(n):
        action, clipped = clip(load(buffer, at + i, prototypes.action, LANES))
        frame = load(buffer, base + slots.frame * LANES + i, prototypes.frame, LANES)
        store(buffer, at + i, turn(action, frame), LANES)
        store(buffer, flag + i, (_number(clipped),), 1)
        n_clipped += clipped
    for k in range(n_action):
        for i in range(n):
            a = load(buffer, at + k * LANES + i, _ONE, 1)
            store(buffer, at + k * LANES + i, (a[0] + 0.0,), 1)  # -0 becomes 0
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
    observe: Function,
    frame_of: Function,
    force: Function,
    grip: Function,
    slips: Function,
    rate: Function,
    prototypes: Prototypes,
    buffer: Buffer,
    s: Sizes,
    slots: Slots,
    base: int,
    n: int,
    weights: Row,
    c: Row,
) -> int:
    """Write cost, reward terms, grip, reward, flags, features and frame, and advance the clock.

    What outcome, features and frame have in common, as the rotation vector of a ball, is computed
    once: the compiler sees all three in one loop.

    Returns how many rows have a flag, plus `ENDED` times how many episodes ended. A physics error
    ends the episode, see `_mend`: a state that is not finite or too large, one with which it would
    go on faster than the envelope of the integrator allows, or a reward that is not finite. Slip
    ends it where the task says so, and then it is no success. Everything is written to the block,
    at distances known when this is compiled: otherwise the loop would need a check at run time of
    each pair of places for overlap, more than the compiler makes, and would not become vector
    instructions.
    """
    elapsed = base + (slots.clock + CLOCK.elapsed) * LANES
    running = base + (slots.clock + CLOCK.running) * LANES
    results, flags = base + slots.results * LANES, base + slots.flags * LANES
    grip_at = results + (1 + len(prototypes.terms)) * LANES
    reward_at = grip_at + len(prototypes.grip) * LANES
    broken_flag = flags + FLAGS.physics_error * LANES
    n_broken, n_raised, n_ended = 0, 0, 0
    for i in range(n):
        y = load(buffer, base + i, prototypes.state, LANES)
        u = load(buffer, base + slots.inputs * LANES + i, prototypes.inputs, LANES)
        p = load(buffer, base + slots.parameters * LANES + i, prototypes.parameters, LANES)
        aux = load(buffer, base + slots.aux * LANES + i, prototypes.aux, LANES)
        aux, terms, cost, success, done = outcome(y, u, aux, p, c, s.dt)
        store(buffer, base + slots.aux * LANES + i, aux, LANES)
        store(buffer, base + slots.observation * LANES + i, observe(y, aux, p, c), LANES)
        store(buffer, base + slots.frame * LANES + i, frame_of(y, aux, p, c), LANES)
        held = grip(force(y, u, p))
        slipping = slips(held, p)
        lost = slipping & (s.ends_on_slip > 0)
        success, done = success & (not lost), done | lost
        reward = weighted_sum(weights, terms) - select(lost, s.slip_penalty, 0.0)
        too_fast = (rate(y, p) > s.fastest) & (not done)
        broken = _is_broken(y) | too_fast | (not abs(reward) < np.inf)
        store(buffer, results + i, (cost,), LANES)
        store(buffer, results + LANES + i, terms, LANES)
        store(buffer, grip_at + i, held, LANES)
        store(buffer, reward_at + i, (reward,), LANES)
        steps = load(buffer, elapsed + i, _ONE, 1)[0] + 1.0
        store(buffer, elapsed + i, (steps,), 1)
        over, late = done | (broken != 0), steps >= s.max_steps
        store(buffer, running + i, (select(over | late, 0.0, 1.0),), 1)
        n_raised += over | late | success | slipping
        n_ended += over | late
        store(buffer, flags + i, (_number(over), _number(late), _number(success)), LANES)
        store(buffer, broken_flag + i, (float(broken), _number(slipping)), LANES)
        n_broken += broken
    if n_broken:
        _mend(prototypes, buffer, slots, base, n)
        observe_features(observe, frame_of, prototypes, buffer, slots, base, 0, n, c)
    return n_raised + ENDED * n_ended


# A loop over the numbers of a row is unrolled before it reaches the loop over the rows only in a
# function of its own; otherwise that loop would run its first and last rows one by one.


@scalar
def _is_broken(y: Row) -> int:
    """1 if a number is not finite or too large, else 0."""
    broken = 0
    for k in range(len(y)):
        broken |= not abs(y[k]) < _LARGEST
    return broken


@scalar
def _number(flag: bool) -> float:
    """1 if the flag is set, else 0."""
    return select(flag, 1.0, 0.0)


@routine
def _mend(
    prototypes: Prototypes,
    buffer: Buffer,
    slots: Slots,
    base: int,
    n: int,
) -> None:
    """Set a row with a physics error to the rest state, without reward, cost and success."""
    flags = base + slots.flags * LANES
    for i in range(n):
        if buffer[flags + FLAGS.physics_error * LANES + i]:
            store(buffer, base + i, prototypes.state, LANES)
            store(buffer, base + slots.aux * LANES + i, prototypes.aux, LANES)
            buffer[flags + FLAGS.is_success * LANES + i] = 0.0
            buffer[flags + FLAGS.slips * LANES + i] = 0.0
            for k in range(slots.flags - slots.results):
                buffer[base + (slots.results + k) * LANES + i] = 0.0


# Loop that resets rows of an environment, with the functions of an `Episode`.

BEGIN, BEGIN_UNSEEN, PARAMETERS_GIVEN, OBSERVE = range(4)  # modes of `reset_rows`

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
def _new_episode(prototypes: Prototypes, buffer: Buffer, s: Sizes, slots: Slots, at: int) -> None:
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
    prototypes: Prototypes, buffer: Buffer, s: Sizes, slots: Slots, at: int
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
    rate: Function, prototypes: Prototypes, buffer: Buffer, s: Sizes, slots: Slots, at: int
) -> bool:
    """Whether the rate of a row is outside the envelope of the integrator."""
    y = load(buffer, at, prototypes.state, LANES)
    p = load(buffer, at + slots.parameters * LANES, prototypes.parameters, LANES)
    return not rate(y, p) <= s.fastest
