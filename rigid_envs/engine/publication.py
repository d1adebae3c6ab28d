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
from rigid_envs.engine.elementary import atan2, fma, select
from rigid_envs.engine.layout import CHANNEL, CLOCK, FLAGS, Buffer, Prototypes, Sizes, Slots
from rigid_envs.engine.rows import (
    LANES,
    load,
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
    at, n = base + slots.results * LANES, slots.flags - slots.results
    rest = last - (last - first) % 8
    for k in range(n):
        for i in range(first, rest, 8):
            values = load(buffer, at + k * LANES + i, _EIGHT, 1)
            store(results, k * s.n_rows + row + i, values, 1)
    for i in range(rest, last):
        for k in range(n):
            value = load(buffer, at + k * LANES + i, _ONE, 1)
            store(results, k * s.n_rows + row + i, value, 1)


@routine
def publish_observations(
    buffer: Buffer, s: Sizes, slots: Slots, span: Span, observations: Observations
) -> None:
    """Publish the observations of some rows of a block."""
    base, row, first, last = span
    at, width = base + slots.observation * LANES, s.n_observation
    target = row * width
    rest = first
    if width >= 4:
        rest = last - (last - first) % 8
        for i in range(first, rest, 8):
            for start in range(0, width, 4):
                k = select(start < width - 4, start, width - 4)  # the last tile overlaps another
                store_tile(buffer, at + k * LANES + i, observations, target + i * width + k, width)
    for k in range(width):
        for i in range(rest, last):
            value = load(buffer, at + k * LANES + i, _ONE, 1)
            store_single(observations, target + i * width + k, value, 1)


@routine
def publish_flags(buffer: Buffer, s: Sizes, slots: Slots, span: Span, flags: Bools) -> None:
    """Publish the flags of some rows of a block."""
    base, row, first, last = span
    at = base + slots.flags * LANES
    rest = last - (last - first) % 8
    for k in range(len(FLAGS)):
        for i in range(first, rest, 8):
            store_nonzero(buffer, at + k * LANES + i, flags, k * s.n_rows + row + i)
    for i in range(rest, last):
        for k in range(len(FLAGS)):
            flag = buffer[at + k * LANES + i] != 0.0
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
    """Write the attitude of rows ``first .. last - 1`` to the slots before `end`."""
    if representation == MATRIX:
        for i in range(first, last):
            r = matrix(load(buffer, base + i, _Q, LANES))
            store(buffer, end - 9 * LANES + i, r, LANES)
    elif representation == ROT6D:
        for i in range(first, last):
            columns = rot6d(load(buffer, base + i, _Q, LANES))
            store(buffer, end - 6 * LANES + i, columns, LANES)
    elif representation == QUATERNION:
        for i in range(first, last):
            q = canonical(load(buffer, base + i, _Q, LANES))
            store(buffer, end - 4 * LANES + i, q, LANES)
    elif representation == EULER:
        for i in range(first, last):
            angles = euler(load(buffer, base + i, _Q, LANES))
            store(buffer, end - 3 * LANES + i, angles, LANES)


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
    s: Sizes,
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


# Noise and delay of actions and observations, and the random streams of a row.
#
# Kernels contain the `Disturbances` of their task: noise and delay are compiled where they are
# used.

DRAW_PARAMETERS, DRAW_START, DRAW_ACTION, DRAW_OBSERVATION = range(4)  # purposes of random streams


class Disturbances(NamedTuple):
    """What happens to actions and observations between agent and body, in the rows of a block.

    Attributes:
        of_actions: ``of_actions(clip, prototypes, buffer, s, slots, base, n)``.
        of_observations: ``of_observations(buffer, s, slots, base, first, last)``.
    """

    of_actions: Function
    of_observations: Function


@scalar
def stream_of(buffer: Buffer, clock: int, use: int) -> randoms.Stream:
    """Random stream of one row and episode for one purpose."""
    high = np.uint64(buffer[clock + CLOCK.key_high * LANES])
    low = np.uint64(buffer[clock + CLOCK.key_low * LANES])
    key = (high << np.uint64(32)) | low
    return key, np.uint64(buffer[clock + CLOCK.episode * LANES]), np.uint64(use)


@scalar
def _noise_pair(buffer: Buffer, clock: int, use: int, pair: int) -> tuple[float, float]:
    """Standard normals 2 * pair and 2 * pair + 1 of this row at this step (pair below 128)."""
    index = int(buffer[clock + CLOCK.elapsed * LANES]) * 128 + pair
    return randoms.normal_pair(stream_of(buffer, clock, use), index)


@phase
def _disturb_actions(
    clip: Function,
    prototypes: Prototypes,
    buffer: Buffer,
    s: Sizes,
    slots: Slots,
    base: int,
    n: int,
) -> None:
    if s.noisy_actions:
        _add_action_noise(clip, prototypes, buffer, slots, base, n)
    if s.n_delays:
        _delay_actions(buffer, s, slots, base, n, len(prototypes.action))


@routine
def _disturb_observations(
    buffer: Buffer, s: Sizes, slots: Slots, base: int, first: int, last: int
) -> None:
    if s.noisy_observations:
        _add_observation_noise(buffer, s, slots, base, first, last)


@phase
def _leave_actions(
    clip: Function,
    prototypes: Prototypes,
    buffer: Buffer,
    s: Sizes,
    slots: Slots,
    base: int,
    n: int,
) -> None:
    pass


@routine
def _leave_observations(
    buffer: Buffer, s: Sizes, slots: Slots, base: int, first: int, last: int
) -> None:
    pass


@phase
def _add_action_noise(
    clip: Function, prototypes: Prototypes, buffer: Buffer, slots: Slots, base: int, n: int
) -> None:
    """Add Gaussian noise to every entry of the action, and clip it again."""
    at = base + slots.action * LANES
    for i in range(n):
        clock = base + slots.clock * LANES + i
        sigma = buffer[base + (slots.channel + CHANNEL.action_noise) * LANES + i]
        n_action = len(prototypes.action)
        for pair in range((n_action + 1) // 2):
            even, odd = _noise_pair(buffer, clock, DRAW_ACTION, pair)
            buffer[at + 2 * pair * LANES + i] += sigma * even
            if 2 * pair + 1 < n_action:
                buffer[at + (2 * pair + 1) * LANES + i] += sigma * odd
        action, _ = clip(load(buffer, at + i, prototypes.action, LANES))
        store(buffer, at + i, action, LANES)


@routine
def _delay_actions(
    buffer: Buffer, s: Sizes, slots: Slots, base: int, n: int, n_action: int
) -> None:
    """Replace the action by that of `action_delay` steps before; zero before the first."""
    for i in range(n):
        lag = int(buffer[base + (slots.channel + CHANNEL.action_delay) * LANES + i])
        for k in range(n_action):
            at = base + (slots.action + k) * LANES + i
            past = base + (slots.history + k * s.n_delays) * LANES + i
            new = buffer[at]
            if lag > 0:
                buffer[at] = buffer[past + (lag - 1) * LANES]
            for j in range(s.n_delays - 1, 0, -1):
                buffer[past + j * LANES] = buffer[past + (j - 1) * LANES]
            buffer[past] = new


@routine
def _add_observation_noise(
    buffer: Buffer, s: Sizes, slots: Slots, base: int, first: int, last: int
) -> None:
    """Add Gaussian noise to every observation entry except goals, and clip to its bounds."""
    for i in range(first, last):
        clock = base + slots.clock * LANES + i
        sigma = buffer[base + (slots.channel + CHANNEL.observation_noise) * LANES + i]
        for pair in range(s.n_exact // 2, (s.n_observation + 1) // 2):
            values = _noise_pair(buffer, clock, DRAW_OBSERVATION, pair)
            for k in range(2 * pair, 2 * pair + 2):
                if s.n_exact <= k < s.n_observation:
                    at = base + (slots.observation + k) * LANES + i
                    noisy = buffer[at] + sigma * values[k % 2]
                    low, high = buffer[s.bounds + 2 * k], buffer[s.bounds + 2 * k + 1]
                    noisy = select(low > noisy, low, noisy)
                    buffer[at] = select(high < noisy, high, noisy)


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
