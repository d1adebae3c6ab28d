"""Noise and delay of actions and observations, and the random streams of a row."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rigid_envs.kernels import randoms
from rigid_envs.kernels.compiler import phase, routine, scalar
from rigid_envs.kernels.layout import CHANNEL, CLOCK, Buffer, Prototypes, Settings, Slots
from rigid_envs.kernels.rows import LANES, load, store

__all__ = [
    "DRAW_PARAMETERS",
    "DRAW_START",
    "add_action_noise",
    "add_observation_noise",
    "delay_actions",
    "stream_of",
]

DRAW_PARAMETERS, DRAW_START, DRAW_ACTION, DRAW_OBSERVATION = range(4)  # purposes of random streams

Function = Callable[..., Any]


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
def add_action_noise(
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
def delay_actions(
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
def add_observation_noise(
    buffer: Buffer, s: Settings, slots: Slots, base: int, first: int, last: int
) -> None:
    """Add Gaussian noise to every observation entry except goals, and clip to its bounds."""
    for i in range(first, last):
        clock = base + slots.clock * LANES + i
        sigma = buffer[base + (slots.channel + CHANNEL.observation_noise) * LANES + i]
        for pair in range(s.n_exact // 2, (s.n_observation + 1) // 2):
            values = _noise_pair(buffer, clock, DRAW_OBSERVATION, pair)
            for k in range(max(2 * pair, s.n_exact), min(2 * pair + 2, s.n_observation)):
                at = base + (slots.observation + k) * LANES + i
                noisy = buffer[at] + sigma * values[k % 2]
                low, high = buffer[s.bounds + 2 * k], buffer[s.bounds + 2 * k + 1]
                buffer[at] = min(max(noisy, low), high)
