"""What leaves the loops: results, observations, flags; their noise and delay."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Bools
from rigid_envs.engine import randoms
from rigid_envs.engine.algebra import Quaternion, Row, matrix, weighted_sum
from rigid_envs.engine.compiler import phase, routine, scalar
from rigid_envs.engine.elementary import atan2, clamp, fma, select
from rigid_envs.engine.layout import CHANNEL, CLOCK, FLAGS, Buffer, Prototypes, Sizes, Slots
from rigid_envs.engine.rows import (
    get,
    load,
    place,
    put,
    store,
    store_byte,
    store_nonzero,
    store_single,
    store_tile,
)

# What a step or a reset publishes: results, observations and flags, in three arrays.
#
# Results are float64, shape (n, N): cost, reward terms, grip and reward of every row; observations
# float32, shape (N, n_observation); flags bool, in the order of `FLAGS`, shape (6, N). A step
# writes to arrays that nobody holds yet, block by block, while the block is in the first-level
# cache: so nothing has to be copied afterwards, and each thread writes the part of its rows.

_ONE, _EIGHT = (0.0,), (0.0,) * 8

Results = npt.NDArray[np.float64]
Observations = npt.NDArray[np.float32]
Outputs = tuple[Results, Observations, Bools]


class Span(NamedTuple):
    """Rows ``first .. last - 1`` of the block that begins at `base`, whose first row is `row`."""

    base: int
    row: int
    first: int
    last: int


@routine
def publish_results(buffer: Buffer, s: Sizes, slots: Slots, span: Span, results: Results) -> None:
    """Publish the results of some rows of a block."""
    base, row, first, last = span
    n = slots.flags - slots.results
    rest = last - (last - first) % 8
    for k in range(n):
        for i in range(first, rest, 8):
            values = load(buffer, place(base, slots.results + k, i), _EIGHT, 1)
            store(results, k * s.n_rows + row + i, values, 1)
    for i in range(rest, last):
        for k in range(n):
            value = get(buffer, base, slots.results + k, i, _ONE)
            store(results, k * s.n_rows + row + i, value, 1)


@routine
def publish_observations(
    buffer: Buffer, s: Sizes, slots: Slots, span: Span, observations: Observations
) -> None:
    """Publish the observations of some rows of a block."""
    base, row, first, last = span
    width = s.n_observation
    target = row * width
    rest = first
    if width >= 4:
        rest = last - (last - first) % 8
        for i in range(first, rest, 8):
            for start in range(0, width, 4):
                k = select(start < width - 4, start, width - 4)  # the last tile overlaps another
                at = place(base, slots.observation + k, i)
                store_tile(buffer, at, observations, target + i * width + k, width)
    for k in range(width):
        for i in range(rest, last):
            value = get(buffer, base, slots.observation + k, i, _ONE)
            store_single(observations, target + i * width + k, value, 1)


@routine
def publish_flags(buffer: Buffer, s: Sizes, slots: Slots, span: Span, flags: Bools) -> None:
    """Publish the flags of some rows of a block."""
    base, row, first, last = span
    rest = last - (last - first) % 8
    for k in range(len(FLAGS)):
        for i in range(first, rest, 8):
            at = place(base, slots.flags + k, i)
            store_nonzero(buffer, at, flags, k * s.n_rows + row + i)
    for i in range(rest, last):
        for k in range(len(FLAGS)):
            flag = buffer[place(base, slots.flags + k, i)] != 0.0
            store_byte(flags, k * s.n_rows + row + i, (flag,), 1)


# Observed attitude: matrix, two columns, quaternion or Euler angles.

HIDDEN, MATRIX, ROT6D, QUATERNION, EULER = range(5)
_Q = (1.0, 0.0, 0.0, 0.0)


@scalar
def canonical(q: Quaternion) -> Quaternion:
    """Quaternion of the same attitude with w >= 0."""
    sign = select(q[0] < 0.0, -1.0, 1.0)
    return (sign * q[0], sign * q[1], sign * q[2], sign * q[3])


@scalar
def rot6d(q: Quaternion) -> Row:
    """First two columns of R, one after the other (Zhou et al. 2019, arXiv:1812.07035)."""
    r = matrix(q)
    return (r[0], r[3], r[6], r[1], r[4], r[7])


@scalar
def euler(q: Quaternion) -> Row:
    """Angles (phi, theta, psi) of R = Rz(phi) Rx(theta) Rz(psi) [rad].

    With phi + psi = 2 atan2(z, w) and phi - psi = 2 atan2(y, x). At theta = 0 and pi one of the two
    is undefined and replaced by atan2(0, 0) = 0: finite, but not continuous.
    """
    w, x, y, z = q
    total, difference = atan2(z, w), atan2(y, x)
    theta = 2.0 * atan2(math.sqrt(fma(x, x, y * y)), math.sqrt(fma(w, w, z * z)))
    return (_wrapped(total + difference), theta, _wrapped(total - difference))


@scalar
def _wrapped(angle: float) -> float:
    """The same angle in [-pi, pi], for one in [-2 pi, 2 pi]."""
    turn = select(angle > math.pi, -2.0 * math.pi, 0.0)
    return angle + select(angle < -math.pi, 2.0 * math.pi, turn)


@routine
def write_attitude(
    buffer: Buffer, base: int, end: int, first: int, last: int, representation: int
) -> None:
    """Write the attitude of rows ``first .. last - 1`` to the slots before slot `end`."""
    if representation == MATRIX:
        for i in range(first, last):
            put(buffer, base, end - 9, i, matrix(get(buffer, base, 0, i, _Q)))
    elif representation == ROT6D:
        for i in range(first, last):
            put(buffer, base, end - 6, i, rot6d(get(buffer, base, 0, i, _Q)))
    elif representation == QUATERNION:
        for i in range(first, last):
            put(buffer, base, end - 4, i, canonical(get(buffer, base, 0, i, _Q)))
    elif representation == EULER:
        for i in range(first, last):
            put(buffer, base, end - 3, i, euler(get(buffer, base, 0, i, _Q)))


# Observations of rows and frames of their next actions, computed from the state.

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
    for i in range(first, last):
        y = get(buffer, base, slots.state, i, prototypes.state)
        p = get(buffer, base, slots.parameters, i, prototypes.parameters)
        aux = get(buffer, base, slots.aux, i, prototypes.aux)
        put(buffer, base, slots.observation, i, observe(y, aux, p, c))
        put(buffer, base, slots.frame, i, frame_of(y, aux, p, c))


@phase
def complete_observations(
    disturb: Function, buffer: Buffer, s: Sizes, slots: Slots, base: int, first: int, last: int
) -> None:
    """Write what follows the features: attitude, drawn parameters, noise.

    A reset may be given parameters outside their ranges: they are observed as the nearest end.
    """
    end = s.n_observation - s.n_observed  # of the attitude
    write_attitude(buffer, base, slots.observation + end, first, last, s.rotation)
    for k in range(s.n_observed):
        slot = np.int64(buffer[s.observed + k])
        low, high = buffer[s.bounds + 2 * (end + k)], buffer[s.bounds + 2 * (end + k) + 1]
        for i in range(first, last):
            value = buffer[place(base, slot, i)]
            buffer[place(base, slots.observation + end + k, i)] = clamp(value, low, high)
    disturb(buffer, s, slots, base, first, last)


# Noise and delay of actions and observations, and the random streams of a row.
#
# Kernels contain the `Disturbances` of their task: noise and delay are compiled where they are
# used.

DRAW_PARAMETERS, DRAW_START, DRAW_ACTION, DRAW_OBSERVATION = range(4)  # purposes of random streams


class Disturbances(NamedTuple):
    """What happens to actions and observations between agent and body, in the rows of a block.

    Attributes:
        of_actions: ``of_actions(clip, like, buffer, s, slots, base, n)``, like an action.
        of_observations: ``of_observations(buffer, s, slots, base, first, last)``.
    """

    of_actions: Function
    of_observations: Function


@scalar
def stream_of(buffer: Buffer, slots: Slots, base: int, i: int, use: int) -> randoms.Stream:
    """Random stream of one row and episode for one purpose."""
    high = np.uint64(buffer[place(base, slots.clock + CLOCK.key_high, i)])
    low = np.uint64(buffer[place(base, slots.clock + CLOCK.key_low, i)])
    key = (high << np.uint64(32)) | low
    return key, np.uint64(buffer[place(base, slots.clock + CLOCK.episode, i)]), np.uint64(use)


@scalar
def _noise_pair(
    buffer: Buffer, slots: Slots, base: int, i: int, use: int, pair: int
) -> tuple[float, float]:
    """Standard normals 2 * pair and 2 * pair + 1 of this row at this step (pair below 128)."""
    index = int(buffer[place(base, slots.clock + CLOCK.elapsed, i)]) * 128 + pair
    return randoms.normal_pair(stream_of(buffer, slots, base, i, use), index)


@phase
def _disturb_actions(
    clip: Function, like: Row, buffer: Buffer, s: Sizes, slots: Slots, base: int, n: int
) -> None:
    if s.noisy_actions:
        _add_action_noise(clip, like, buffer, slots, base, n)
    if s.n_delays:
        _delay_actions(buffer, s, slots, base, n, len(like))


@routine
def _disturb_observations(
    buffer: Buffer, s: Sizes, slots: Slots, base: int, first: int, last: int
) -> None:
    if s.noisy_observations:
        _add_observation_noise(buffer, s, slots, base, first, last)


@phase
def _leave_actions(
    clip: Function, like: Row, buffer: Buffer, s: Sizes, slots: Slots, base: int, n: int
) -> None:
    pass


@routine
def _leave_observations(
    buffer: Buffer, s: Sizes, slots: Slots, base: int, first: int, last: int
) -> None:
    pass


@phase
def _add_action_noise(
    clip: Function, like: Row, buffer: Buffer, slots: Slots, base: int, n: int
) -> None:
    """Add Gaussian noise to every entry of the action, and clip it again."""
    for i in range(n):
        sigma = buffer[place(base, slots.channel + CHANNEL.action_noise, i)]
        for pair in range((len(like) + 1) // 2):
            even, odd = _noise_pair(buffer, slots, base, i, DRAW_ACTION, pair)
            buffer[place(base, slots.action + 2 * pair, i)] += sigma * even
            if 2 * pair + 1 < len(like):
                buffer[place(base, slots.action + 2 * pair + 1, i)] += sigma * odd
        action, _ = clip(get(buffer, base, slots.action, i, like))
        put(buffer, base, slots.action, i, action)


@routine
def _delay_actions(
    buffer: Buffer, s: Sizes, slots: Slots, base: int, n: int, n_action: int
) -> None:
    """Replace the action by that of `action_delay` steps before; zero before the first."""
    for i in range(n):
        lag = np.int64(buffer[place(base, slots.channel + CHANNEL.action_delay, i)])
        for k in range(n_action):
            at, past = place(base, slots.action + k, i), s.history + k * s.n_delays
            new = buffer[at]
            if lag > 0:
                buffer[at] = buffer[place(base, past + lag - 1, i)]
            for j in range(s.n_delays - 1, 0, -1):
                buffer[place(base, past + j, i)] = buffer[place(base, past + j - 1, i)]
            buffer[place(base, past, i)] = new


@routine
def _add_observation_noise(
    buffer: Buffer, s: Sizes, slots: Slots, base: int, first: int, last: int
) -> None:
    """Add Gaussian noise to every observation entry except goals, and clip to its bounds."""
    for i in range(first, last):
        sigma = buffer[place(base, slots.channel + CHANNEL.observation_noise, i)]
        for pair in range(s.n_exact // 2, (s.n_observation + 1) // 2):
            values = _noise_pair(buffer, slots, base, i, DRAW_OBSERVATION, pair)
            for k in range(2 * pair, 2 * pair + 2):
                if s.n_exact <= k < s.n_observation:
                    at = place(base, slots.observation + k, i)
                    noisy = buffer[at] + sigma * values[k % 2]
                    low, high = buffer[s.bounds + 2 * k], buffer[s.bounds + 2 * k + 1]
                    buffer[at] = clamp(noisy, low, high)


UNDISTURBED = Disturbances(_leave_actions, _leave_observations)
NOISE_AND_DELAY = Disturbances(_disturb_actions, _disturb_observations)


# Rewards of observed goals (float32 values), computed anew exactly as `step` computes them.

Array = npt.NDArray[Any]


@phase
def reward_rows(
    judge: Callable[[Row, Row, Row], tuple[Row, bool]],
    goal: Row,
    prototypes: Prototypes,
    achieved: Array,
    desired: Array,
    weights: Array,
    constants: Array,
    out: Array,
) -> None:
    """``out[i]`` = weighted sum of the terms of ``judge(achieved[i], desired[i], constants)``."""
    w = load(weights, 0, prototypes.terms, 1)
    c = load(constants, 0, prototypes.constants, 1)
    for i in range(achieved.shape[0]):
        at = i * len(goal)
        terms, _ = judge(load(achieved, at, goal, 1), load(desired, at, goal, 1), c)
        out[i] = weighted_sum(w, terms)
