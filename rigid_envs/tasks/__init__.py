"""Tasks: observation, reward and success criterion, one file per environment family.

A task is a frozen dataclass of hyperparameters for a physical system, with a few compiled functions
of one row; `rigid_envs.core` runs it.
"""

from rigid_envs.errors import ConfigError
from rigid_envs.tasks.axis_flip import AxisFlip
from rigid_envs.tasks.ball_grid import BallGrid
from rigid_envs.tasks.ball_park import BallPark, BallParkRandom
from rigid_envs.tasks.ball_park_dynamic import BallParkDynamic
from rigid_envs.tasks.ball_park_goal import BallParkGoal
from rigid_envs.tasks.ball_plate import BallPlate
from rigid_envs.tasks.ball_reorient import BallReorient
from rigid_envs.tasks.ball_steer import BallSteer
from rigid_envs.tasks.base import Entry, Task
from rigid_envs.tasks.coin_park import CoinPark
from rigid_envs.tasks.detumble import Detumble
from rigid_envs.tasks.disk_roll import DiskRoll, DiskRollRandom
from rigid_envs.tasks.intermediate_axis import IntermediateAxis, IntermediateAxisRandom
from rigid_envs.tasks.intermediate_axis_single import IntermediateAxisSingle
from rigid_envs.tasks.pivot_top import PivotTop
from rigid_envs.tasks.reorient import Reorient
from rigid_envs.tasks.roll_pump import RollPump
from rigid_envs.tasks.sleeping_top import SleepingTop, SleepingTopRandom
from rigid_envs.tasks.spin_capture import SpinCapture
from rigid_envs.tasks.top_precession import TopPrecession
from rigid_envs.tasks.top_random import TopRandom

__all__ = [
    "AxisFlip",
    "BallGrid",
    "BallPark",
    "BallParkDynamic",
    "BallParkGoal",
    "BallParkRandom",
    "BallPlate",
    "BallReorient",
    "BallSteer",
    "CoinPark",
    "ConfigError",
    "Detumble",
    "DiskRoll",
    "DiskRollRandom",
    "Entry",
    "IntermediateAxis",
    "IntermediateAxisRandom",
    "IntermediateAxisSingle",
    "PivotTop",
    "Reorient",
    "RollPump",
    "SleepingTop",
    "SleepingTopRandom",
    "SpinCapture",
    "Task",
    "TopPrecession",
    "TopRandom",
]
