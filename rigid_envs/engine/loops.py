"""The step and the reset of an environment, over all rows."""

from collections.abc import Callable
from typing import Any, NamedTuple

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
from rigid_envs.engine.rows import LANES, get, integrate, load, load_single, load_tile, place, put

Function = Callable[..., Any]


class Functions(NamedTuple):
    """Compiled functions of an `Episode`, and the rows that they take."""

    advance: Function
    restore: Function
    stages: Row
    rate: Function
    derive: Function
    start: Function
    clip: Function
    turn: Function
    actuate: Function
    outcome: Function
    force: Function
    grip: Function
    slips: Function
    observe: Function
    frame_of: Function
    disturb_actions: Function
    disturb_observations: Function
    prototypes: Prototypes


# Loop that steps the rows of an environment.
#
# Rows are independent, so the result is the same for any number of rows and threads.

ENDED = 1 << 40  # more than rows that have a flag

_ONE = (0.0,)
_LARGEST = 1e9  # a larger state is a physics error and ends the episode

Step = Callable[[Buffer, int, int, Results, Observations, Bools], int]


def step_rows(e: Functions) -> Step:
    """Loop ``step(buffer, first_block, last_block, results, observations, flags)`` of an episode.

    It steps all rows of the given blocks by one control period, and publishes them: see
    `publication`. It returns 0 if no flag of any row is set, a positive number if one is, and at
    least `ENDED` if an episode has ended. If action entry k is not finite, no row changes and
    -1 - k is returned.
    """
    disturb_actions = e.disturb_actions  # inlined before types are known
    slots = slots_of(e.prototypes)

    def step(
        buffer: Buffer,
        first_block: int,
        last_block: int,
        results: Results,
        observations: Observations,
        flags: Bools,
    ) -> int:
        s = read_settings(buffer)
        bad = _first_not_finite(buffer, s, len(e.prototypes.action))
        if bad >= 0:
            return -1 - bad
        weights = load(buffer, s.weights, e.prototypes.terms, 1)
        c = load(buffer, s.constants, e.prototypes.constants, 1)
        n_raised = 0
        for block in range(first_block, last_block):
            base, row = s.blocks + block * s.total * LANES, block * LANES
            left = s.n_rows - row
            n = left if left < LANES else LANES
            n_raised += _receive(e, buffer, s, slots, base, row, n)
            disturb_actions(e.clip, e.prototypes.action, buffer, s, slots, base, n)
            _actuate(e, buffer, slots, base, n, c)
            _integrate(e, buffer, s, base, n)
            n_raised += _conclude(e, buffer, s, slots, base, n, weights, c)
            complete_observations(e.disturb_observations, buffer, s, slots, base, 0, n)
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
    e: Functions, buffer: Buffer, s: Sizes, slots: Slots, base: int, row: int, n: int
) -> int:
    """Read actions, clip them to their space and turn them from the frame in which they are given.

    Returns how many were clipped.
    """
    n_action = len(e.prototypes.action)
    given = s.actions + row * n_action
    whole = n - n % 8
    for i in range(0, whole, 8):
        at = place(base, slots.action, i)
        load_tile(buffer, given + i * n_action, at, e.prototypes.action)
    for i in range(whole, n):
        action = load_single(buffer, given + i * n_action, e.prototypes.action, 1)
        put(buffer, base, slots.action, i, action)
    n_clipped = 0
    for i in range(n):
        action, clipped = e.clip(get(buffer, base, slots.action, i, e.prototypes.action))
        frame = get(buffer, base, slots.frame, i, e.prototypes.frame)
        put(buffer, base, slots.action, i, e.turn(action, frame))
        put(buffer, base, slots.flags + FLAGS.action_clipped, i, (_number(clipped),))
        n_clipped += clipped
    for k in range(n_action):
        for i in range(n):
            entry = get(buffer, base, slots.action + k, i, _ONE)
            put(buffer, base, slots.action + k, i, (entry[0] + 0.0,))  # -0 becomes 0
    return n_clipped


@phase
def _actuate(e: Functions, buffer: Buffer, slots: Slots, base: int, n: int, c: Row) -> None:
    for i in range(n):
        y = get(buffer, base, slots.state, i, e.prototypes.state)
        p = get(buffer, base, slots.parameters, i, e.prototypes.parameters)
        aux = get(buffer, base, slots.aux, i, e.prototypes.aux)
        a = get(buffer, base, slots.action, i, e.prototypes.action)
        y, u = e.actuate(a, y, aux, p, c)
        put(buffer, base, slots.state, i, y)
        put(buffer, base, slots.inputs, i, u)


@phase
def _integrate(e: Functions, buffer: Buffer, s: Sizes, base: int, n: int) -> None:
    rows = (e.prototypes.state, e.prototypes.inputs, e.prototypes.parameters)
    h = s.dt / s.n_substeps
    integrate(e.advance, e.restore, e.stages, rows, buffer, base, n, h, s.n_substeps)


@phase
def _conclude(
    e: Functions, buffer: Buffer, s: Sizes, slots: Slots, base: int, n: int, weights: Row, c: Row
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
    n_broken, n_raised, n_ended = 0, 0, 0
    for i in range(n):
        y = get(buffer, base, slots.state, i, e.prototypes.state)
        u = get(buffer, base, slots.inputs, i, e.prototypes.inputs)
        p = get(buffer, base, slots.parameters, i, e.prototypes.parameters)
        aux = get(buffer, base, slots.aux, i, e.prototypes.aux)
        aux, terms, cost, success, done = e.outcome(y, u, aux, p, c, s.dt)
        put(buffer, base, slots.aux, i, aux)
        put(buffer, base, slots.observation, i, e.observe(y, aux, p, c))
        put(buffer, base, slots.frame, i, e.frame_of(y, aux, p, c))
        held = e.grip(e.force(y, u, p))
        slipping = e.slips(held, p)
        lost = slipping & (s.ends_on_slip > 0)
        success, done = success & (not lost), done | lost
        reward = weighted_sum(weights, terms) - select(lost, s.slip_penalty, 0.0)
        too_fast = (e.rate(y, p) > s.fastest) & (not done)
        broken = _is_broken(y) | too_fast | (not abs(reward) < np.inf)
        put(buffer, base, slots.results, i, (cost,))
        put(buffer, base, slots.results + 1, i, terms)
        put(buffer, base, slots.results + 1 + len(terms), i, held)
        put(buffer, base, slots.flags - 1, i, (reward,))
        steps = get(buffer, base, slots.clock + CLOCK.elapsed, i, _ONE)[0] + 1.0
        over, late = done | (broken != 0), steps >= s.max_steps
        put(buffer, base, slots.clock + CLOCK.elapsed, i, (steps, _number(not (over | late))))
        n_raised += over | late | success | slipping
        n_ended += over | late
        put(buffer, base, slots.flags, i, (_number(over), _number(late), _number(success)))
        put(buffer, base, slots.flags + FLAGS.physics_error, i, (float(broken), _number(slipping)))
        n_broken += broken
    if n_broken:
        _mend(e.prototypes.state, e.prototypes.aux, buffer, slots, base, n)
        observe_features(e.observe, e.frame_of, e.prototypes, buffer, slots, base, 0, n, c)
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
    """1 if the flag is set, else 0: a blend is faster than the conversion."""
    return select(flag, 1.0, 0.0)


@routine
def _mend(rest: Row, aux: Row, buffer: Buffer, slots: Slots, base: int, n: int) -> None:
    """Set a row with a physics error to the rest state, without reward, cost and success."""
    for i in range(n):
        if buffer[place(base, slots.flags + FLAGS.physics_error, i)]:
            put(buffer, base, slots.state, i, rest)
            put(buffer, base, slots.aux, i, aux)
            buffer[place(base, slots.flags + FLAGS.is_success, i)] = 0.0
            buffer[place(base, slots.flags + FLAGS.slips, i)] = 0.0
            for k in range(slots.results, slots.flags):
                buffer[place(base, k, i)] = 0.0


# Loop that resets rows of an environment.

BEGIN, BEGIN_UNSEEN, PARAMETERS_GIVEN, OBSERVE, COUNT = range(5)  # modes of `reset_rows`

Reset = Callable[[Buffer, Any, int, Results, Observations, Bools], int]


def reset_rows(e: Functions) -> Reset:
    """Loop ``reset(buffer, rows, mode, results, observations, flags)`` of an episode.

    It begins a new episode in the given rows and publishes their observations. `BEGIN` draws
    parameters and an initial state. `BEGIN_UNSEEN` does the same and sets the results of the last
    step to zero. `PARAMETERS_GIVEN`, after one of these, keeps the parameters and draws the initial
    state again. `OBSERVE` draws nothing. It returns the last one of the rows whose rate is outside
    the envelope of the integrator, or -1. `COUNT` changes nothing, and returns the number of
    features that `observe` gives.
    """
    slots = slots_of(e.prototypes)

    def reset(
        buffer: Buffer,
        rows: Any,
        mode: int,
        results: Results,
        observations: Observations,
        flags: Bools,
    ) -> int:
        s = read_settings(buffer)
        c = load(buffer, s.constants, e.prototypes.constants, 1)
        if mode == COUNT:
            return len(e.observe(e.prototypes.state, e.prototypes.aux, e.prototypes.parameters, c))
        outside = -1
        for row in rows:
            block, i = row // LANES, row % LANES
            base = s.blocks + block * s.total * LANES
            span = Span(base, block * LANES, i, i + 1)
            if mode == BEGIN_UNSEEN:
                _clear_results(buffer, slots, base, i)
                publish_results(buffer, s, slots, span, results)
                publish_flags(buffer, s, slots, span, flags)
            if mode <= BEGIN_UNSEEN:
                _new_episode(buffer, s, slots, base, i)
                _draw_parameters(buffer, s, slots, base, i, len(e.prototypes.raw))
            _derive_parameters(e, buffer, slots, base, i)
            if mode != OBSERVE:
                _draw_start(e, buffer, slots, base, i, c)
            if _is_outside(e, buffer, s, slots, base, i):
                outside = row
            observe_features(e.observe, e.frame_of, e.prototypes, buffer, slots, base, i, i + 1, c)
            complete_observations(e.disturb_observations, buffer, s, slots, base, i, i + 1)
            publish_observations(buffer, s, slots, span, observations)
        return outside

    return reset


@routine
def _new_episode(buffer: Buffer, s: Sizes, slots: Slots, base: int, i: int) -> None:
    """Set the clock of a new episode and clear past actions."""
    buffer[place(base, slots.clock + CLOCK.episode, i)] += 1.0
    buffer[place(base, slots.clock + CLOCK.elapsed, i)] = 0.0
    buffer[place(base, slots.clock + CLOCK.running, i)] = 1.0
    for k in range(s.history, s.total):
        buffer[place(base, k, i)] = 0.0


@routine
def _clear_results(buffer: Buffer, slots: Slots, base: int, i: int) -> None:
    for k in range(slots.results, slots.observation):
        buffer[place(base, k, i)] = 0.0


@routine
def _draw_parameters(buffer: Buffer, s: Sizes, slots: Slots, base: int, i: int, n_raw: int) -> None:
    """Draw every parameter of system and channel, uniform in its range; the delay is an integer."""
    draws = stream_of(buffer, slots, base, i, DRAW_PARAMETERS)
    for k in range(n_raw + len(CHANNEL)):
        low, high = buffer[s.ranges + 2 * k], buffer[s.ranges + 2 * k + 1]
        share = randoms.uniform(draws, k)
        if k == n_raw + CHANNEL.action_delay:
            value = low + np.floor((high - low + 1.0) * share)
        else:
            value = fma(high - low, share, low)
        slot = slots.parameters + k if k < n_raw else slots.channel + k - n_raw
        buffer[place(base, slot, i)] = value


@phase
def _derive_parameters(e: Functions, buffer: Buffer, slots: Slots, base: int, i: int) -> None:
    p = e.derive(*get(buffer, base, slots.parameters, i, e.prototypes.raw))
    put(buffer, base, slots.parameters, i, p)


@phase
def _draw_start(e: Functions, buffer: Buffer, slots: Slots, base: int, i: int, c: Row) -> None:
    p = get(buffer, base, slots.parameters, i, e.prototypes.parameters)
    y, aux = e.start(stream_of(buffer, slots, base, i, DRAW_START), p, c)
    put(buffer, base, slots.state, i, y)
    put(buffer, base, slots.aux, i, aux)


@phase
def _is_outside(e: Functions, buffer: Buffer, s: Sizes, slots: Slots, base: int, i: int) -> bool:
    """Whether the rate of a row is outside the envelope of the integrator."""
    y = get(buffer, base, slots.state, i, e.prototypes.state)
    p = get(buffer, base, slots.parameters, i, e.prototypes.parameters)
    return not e.rate(y, p) <= s.fastest
