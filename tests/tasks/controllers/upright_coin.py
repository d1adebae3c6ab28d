"""Parking an upright coin by two straight rolls."""

import numpy as np
import numpy.typing as npt

from rigid_envs.systems import UprightCoin
from rigid_envs.tasks import CoinPark

__all__ = ["park"]

Array = npt.NDArray[np.float64]
_TURN = 2.0 * np.pi


def park(task: CoinPark, y: Array) -> Array:
    """Actions that park coins: turn, roll straight, turn, roll straight, turn.

    Rolls by a and b, with headings phi_1 and phi_2, lead home from the offset D (in radii) and the
    phase psi if ``a u_1 + b u_2 = D`` and ``a + b = S`` with u = (cos phi, sin phi) and S = -psi +
    2 pi k: the coin travels along -u. For every u_1 that gives

        a = (S^2 - D^2) / (2 (S - D . u_1)),   b = S - a,   u_2 = (D - a u_1) / b.

    It is the motion along the third bracket that the two turns make room for. Of 180 directions
    u_1, the heading at the start and three k, those that need the fewest steps are taken.

    Args:
        task: the task.
        y: states, shape (N, 8).

    Returns:
        Actions of shape (T, N, 2), zero for rows that are already there.

    Source: as Hammersley 1983 rolls a ball, "Oxford commemoration ball", LMS Lecture Notes 79.
    """
    coin = UprightCoin()
    sizes = (task.steer_per_step, task.roll_per_step) * 2 + (task.steer_per_step,)
    plans = [
        _best(_candidates(row[4:6] / task.radius, phi, psi), sizes)
        for row, phi, psi in zip(y, coin.heading(y), coin.phase(y), strict=True)
    ]
    rows = [_actions(plan, sizes) for plan in plans]
    whole = np.zeros((max(map(len, rows)), len(y), 2))
    for k, actions in enumerate(rows):
        whole[: len(actions), k] = actions
    return whole


def _candidates(D: Array, phi: float, psi: float) -> Array:
    """Turns and rolls (turn, a, turn, b, turn) [rad] that lead home, shape (n, 5)."""
    first = np.append(np.linspace(0.0, _TURN, 180, endpoint=False), phi)
    total = (-psi + _TURN * np.arange(-1, 2))[:, None]
    u = np.stack([np.cos(first), np.sin(first)], axis=-1)
    room = total - u @ D
    a = (total**2 - D @ D) / (2.0 * np.where(np.abs(room) < 1e-9, np.nan, room))
    b = total - a
    rest = D - a[..., None] * u
    second = np.arctan2(np.sign(b) * rest[..., 1], np.sign(b) * rest[..., 0])
    first = np.broadcast_to(first, a.shape)
    plan = np.stack(
        [_short(first - phi), a, _short(second - first), b, _short(-second)], axis=-1
    ).reshape(-1, 5)
    return plan[np.isfinite(plan).all(axis=1)]


def _short(angle: Array) -> Array:
    """The same turn, by half a turn at most."""
    return (angle + np.pi) % _TURN - np.pi


def _best(plans: Array, sizes: tuple[float, ...]) -> Array:
    """The plan of fewest steps; among those, of the shortest way."""
    steps = np.sum(np.ceil(np.abs(plans) / sizes - 1e-9), axis=1)
    way = np.abs(plans[:, 1]) + np.abs(plans[:, 3])
    return plans[np.argmin(steps + 1e-3 * way)]


def _actions(plan: Array, sizes: tuple[float, ...]) -> Array:
    """Steps (roll, steer) that carry out a plan, in parts of the largest."""
    parts = []
    for k, (angle, size) in enumerate(zip(plan, sizes, strict=True)):
        n = int(np.ceil(abs(angle) / size - 1e-9))
        step = np.zeros((n, 2))
        step[:, 1 - k % 2] = angle / (max(n, 1) * size)
        parts.append(step)
    return np.concatenate(parts)
