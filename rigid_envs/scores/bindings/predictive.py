"""Predictive controllers; of drawn parameters they know the middle. They need CasADi."""

from __future__ import annotations

from rigid_envs.control.predicted import BalancedTop, HeldBall, HeldSpin
from rigid_envs.control.predictive import PredictiveControl, doubling
from rigid_envs.scores.bindings.ball import _dynamic_ball
from rigid_envs.scores.bindings.free_body import body_of
from rigid_envs.scores.bindings.heavy_top import top_of
from rigid_envs.scores.controllers import Controller
from rigid_envs.scores.predicting import predicting
from rigid_envs.tasks import BallPlate, IntermediateAxis, PivotTop

__all__ = ["balanced_top", "held_ball", "held_spin"]

_PERIOD = 4


def held_spin(task: IntermediateAxis) -> Controller:
    """Least torque impulse over a horizon of 52 control periods."""
    problem = HeldSpin(body_of(task), task.spin_rate, task.torque)
    law = PredictiveControl(problem, doubling(task.dt, 4, 4, 10))
    return predicting(law, task.dt, _PERIOD)


def balanced_top(task: PivotTop) -> Controller:
    """Least acceleration over a horizon of 156 control periods."""
    problem = BalancedTop(top_of(task), task.push)
    law = PredictiveControl(problem, doubling(task.dt, 4, 4, 4, 4, 6))
    return predicting(law, task.dt, _PERIOD)


def held_ball(task: BallPlate) -> Controller:
    """Least distance over a horizon of 32 control periods."""
    problem = HeldBall(_dynamic_ball(task), task.tilt_rate, task.tilt_limit, task.dt)
    law = PredictiveControl(problem, doubling(task.dt, 4, 8, 3))
    return predicting(law, task.dt, _PERIOD, lambda envs: envs.auxiliary("point_X", "point_Y"))
