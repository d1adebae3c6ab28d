"""Controllers bound to the tasks of a coin, what they read in observations, and bounds."""

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.control.planning import Conditions
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.mechanics import rotations
from rigid_envs.scores.best import TheoreticalLimit, _rows
from rigid_envs.scores.policies import Controller, Script, system_of
from rigid_envs.scores.references import Decoded, Decoder, attitude, entries
from rigid_envs.systems.upright_coin.controllers import TwoRolls
from rigid_envs.systems.upright_coin.system import UprightCoin
from rigid_envs.systems.upright_coin.tasks.coin_park import CoinPark
from rigid_envs.tasks.core import Core

# Theoretical limits of metrics: optima and bounds from each start, in closed form.


def _coin(envs: RigidVectorEnv) -> Array:
    """Least length [m] of a path of a coin to within tolerance of place and phase."""
    task: Any = envs.task
    distance = np.hypot(envs.y[:, 4], envs.y[:, 5]) - task.position_tolerance
    roll = _rows(envs, "radius") * (np.abs(UprightCoin().phase(envs.y)) - task.phase_tolerance)
    return np.asarray(np.maximum(np.maximum(distance, roll), 0.0))


COIN_PATH = TheoreticalLimit("bound", "$max(distance, radius |psi|)$, less tolerances", _coin)


# Controllers for the tasks of a coin, a disk and a roller, for the middle of drawn ranges.


def two_rolls(task: CoinPark) -> Controller:
    """Two straight rolls, planned in the first step and carried out open loop."""
    coin = system_of(task)
    planner = TwoRolls(coin, task.roll_per_step, task.steer_per_step)
    return Script(lambda states, rows: planner(states.y[rows]).actions)


# Decoders of the tasks of a coin, a disk and a roller.


def coin_park(task: CoinPark) -> Decoder:
    """Position, heading and phase; the coin stays upright, and its rates do not count.

    The position is in radii, so that of what the controller makes of it a radius that is drawn
    cancels.
    """
    coin = system_of(task)
    turn, place = attitude(task), entries(task, "X / radius", "Y / radius")

    def decode(seen: Array) -> Decoded:
        heading, _, phase = rotations.euler_from_quaternion(turn(seen)).T
        q = coin.attitude(heading, phase)
        return Decoded(coin, coin.state(q=q, contact=coin.radius * place(seen)))

    return decode


# What success asks of a motion, for planning.


def _coin_parked(core: Core) -> list[Array]:
    task: Any = core.task
    y, coin = core.y, task.system()
    return [
        y[:, 4:6] / task.position_tolerance,
        coin.heading(y)[:, None] / task.heading_tolerance,
        coin.phase(y)[:, None] / task.phase_tolerance,
    ]


PARKED = Conditions(("w", "x", "y", "z", "X", "Y"), _coin_parked)
