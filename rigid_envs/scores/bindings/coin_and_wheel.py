"""Controllers for the tasks of a coin, a disk and a roller, for the middle of drawn ranges."""

from __future__ import annotations

from rigid_envs.control.coin import TwoRolls
from rigid_envs.control.disk import CircleRegulator
from rigid_envs.control.pumping import Pump
from rigid_envs.scores.controllers import Controller
from rigid_envs.scores.scripts import Script
from rigid_envs.systems import Roller, RollingDisk, UprightCoin
from rigid_envs.tasks import CoinPark, DiskRoll, RollPump

__all__ = [
    "circle_regulator",
    "pump",
    "two_rolls",
]


def two_rolls(task: CoinPark) -> Controller:
    """Two straight rolls, planned in the first step and carried out open loop."""
    coin = task.system()
    assert isinstance(coin, UprightCoin)
    planner = TwoRolls(coin, task.roll_per_step, task.steer_per_step)
    return Script(lambda states, rows: planner(states.y[rows]).actions)


def circle_regulator(task: DiskRoll) -> Controller:
    """Linear-quadratic regulator of the lean that the circle needs."""
    disk = task.system()
    assert isinstance(disk, RollingDisk)
    law = CircleRegulator(disk, task.torque, task.dt)
    return lambda states: law(states.y, states.auxiliary("goal_curvature"))


def pump(task: RollPump) -> Controller:
    """Bang-bang control of the inertia ratio: large on the way down, small on the way up."""
    roller = task.system()
    assert isinstance(roller, Roller)
    law = Pump(roller, task.beta_change, task.dt)
    return lambda states: law(states.y, states.auxiliary("beta_change"))
