"""Controllers, planners and performance bounds: one subject per module.

A controller is a frozen dataclass of a system and of the limits of its actuator, in SI units; it
maps states y, shape (..., n), to actions, shape (..., m), inside the action space. It knows nothing
of tasks and environments. What proves that it works is part of it: a Riccati matrix, a Lyapunov
function, an invariant.
"""

from rigid_envs.control.asymmetric import AsymmetricBalance
from rigid_envs.control.closed_loop import region_of_attraction, simulate_closed_loop
from rigid_envs.control.coin import CoinPlan, TwoRolls
from rigid_envs.control.disk import CircleRegulator
from rigid_envs.control.energy_casimir import EnergyCasimir, SingleTorque
from rigid_envs.control.flip import ForcedFlip, TimedFlip
from rigid_envs.control.following import DampedFollower, FarSightedFollower, elastica_headings
from rigid_envs.control.grid import QuarterRolls
from rigid_envs.control.linear import Regulator, lqr, scheduled, step_jacobian, zero_order_hold
from rigid_envs.control.momentum import MomentumBrake, MomentumRegulator
from rigid_envs.control.mppi import CrossEntropyChoices, PathIntegral
from rigid_envs.control.plate import PlateRegulator
from rigid_envs.control.polygons import PushAlong, PushPlan, RollPlan, roll_along
from rigid_envs.control.precession import PrecessionRegulator
from rigid_envs.control.predicted import BalancedTop, HeldBall, HeldSpin
from rigid_envs.control.predictive import Prediction, PredictiveControl, PredictiveProblem, doubling
from rigid_envs.control.pumping import Pump
from rigid_envs.control.saddle import SeparatrixSteering
from rigid_envs.control.shortest_path import ShortestPath, shortest_path
from rigid_envs.control.slewing import QuaternionPD, least_slew_time, slew_acceleration
from rigid_envs.control.spin import SpinRegulator
from rigid_envs.control.three_rolls import three_rolls
from rigid_envs.control.top_balance import PivotBalance, UprightBalance

__all__ = [
    "AsymmetricBalance",
    "BalancedTop",
    "CircleRegulator",
    "CoinPlan",
    "CrossEntropyChoices",
    "DampedFollower",
    "EnergyCasimir",
    "FarSightedFollower",
    "ForcedFlip",
    "HeldBall",
    "HeldSpin",
    "MomentumBrake",
    "MomentumRegulator",
    "PathIntegral",
    "PivotBalance",
    "PlateRegulator",
    "PrecessionRegulator",
    "Prediction",
    "PredictiveControl",
    "PredictiveProblem",
    "Pump",
    "PushAlong",
    "PushPlan",
    "QuarterRolls",
    "QuaternionPD",
    "Regulator",
    "RollPlan",
    "SeparatrixSteering",
    "ShortestPath",
    "SingleTorque",
    "SpinRegulator",
    "TimedFlip",
    "TwoRolls",
    "UprightBalance",
    "doubling",
    "elastica_headings",
    "least_slew_time",
    "lqr",
    "region_of_attraction",
    "roll_along",
    "scheduled",
    "shortest_path",
    "simulate_closed_loop",
    "slew_acceleration",
    "step_jacobian",
    "three_rolls",
    "zero_order_hold",
]
