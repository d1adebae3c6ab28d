"""Decoders of the tasks of a coin, a disk and a roller."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs import rotations
from rigid_envs.control.disk import Rolling, rolling_state
from rigid_envs.references.decoding import Decoded, Decoder, attitude, entries
from rigid_envs.tasks import CoinPark, DiskRoll, RollPump

__all__ = ["coin_park", "disk_roll", "roll_pump"]

Array = npt.NDArray[np.float64]


def coin_park(task: CoinPark) -> Decoder:
    """Position, heading and phase; the coin stays upright, and its rates do not count.

    The position is in radii, so that of what the law makes of it a radius that is drawn cancels.
    """
    coin: Any = task.system()
    turn, place = attitude(task), entries(task, "X / radius", "Y / radius")

    def decode(seen: Array) -> Decoded:
        heading, _, phase = rotations.euler_from_quaternion(turn(seen)).T
        q = coin.attitude(heading, phase)
        return Decoded(coin, coin.state(q=q, contact=coin.radius * place(seen)))

    return decode


def disk_roll(task: DiskRoll) -> Decoder:
    """Lean and rates, all of the state that counts: contact at the origin, heading and phase 0."""
    disk = task.system()
    motion = entries(task, "lean", "theta'", "wn", "w3")
    goal = entries(task, "goal curvature * radius")
    return lambda seen: Decoded(
        disk, rolling_state(Rolling(*motion(seen).T)), {"goal_curvature": goal(seen)}
    )


def roll_pump(task: RollPump) -> Decoder:
    """Arc length and velocity in the valley, and the addition to the ratio, which is positive."""
    roller: Any = task.system()
    angle, speed = entries(task, "curvature s"), entries(task, "v sqrt(curvature / g)")
    addition = entries(task, "beta_change / largest")
    unit = math.sqrt(roller.g / roller.curvature)
    return lambda seen: Decoded(
        roller,
        roller.state(arc_length=angle(seen) / roller.curvature, velocity=unit * speed(seen)),
        {"beta_change": task.beta_change * np.maximum(addition(seen), 0.0)},
    )
