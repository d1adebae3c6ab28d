"""Noise and delay of actions and observations, and the random streams of a row.

Kernels contain the `Disturbances` of their task: noise and delay are compiled where they are used.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rigid_envs.kernels import randoms
from rigid_envs.kernels.compiler import phase, routine, scalar
from rigid_envs.kernels.elementary import select
from rigid_envs.kernels.layout import CHANNEL, CLOCK, Buffer, Prototypes, Settings, Slots
from rigid_envs.kernels.rows import LANES, load, store

__all__ = [
    "DRAW_PARAMETERS",
    "DRAW_START",
    "NOISE_AND_DELAY",
    "UNDISTURBED",
    "Disturbances",
    "stream_of",
]

DRAW_PARAMETERS, DRAW_START, DRAW_ACTION, DRAW_OBSERVATION = range(4)  # purposes of random streams

Function = Callable[..., Any]


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
    s: Settings,
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
    buffer: Buffer, s: Settings, slots: Slots, base: int, first: int, last: int
) -> None:
    if s.noisy_observations:
        _add_observation_noise(buffer, s, slots, base, first, last)


@phase
def _leave_actions(
    clip: Function,
    prototypes: Prototypes,
    buffer: Buffer,
    s: Settings,
    slots: Slots,
    base: int,
    n: int,
) -> None:
    pass


@routine
def _leave_observations(
    buffer: Buffer, s: Settings, slots: Slots, base: int, first: int, last: int
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
    buffer: Buffer, s: Settings, slots: Slots, base: int, n: int, n_action: int
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
    buffer: Buffer, s: Settings, slots: Slots, base: int, first: int, last: int
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
