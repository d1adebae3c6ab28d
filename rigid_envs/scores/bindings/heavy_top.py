"""Controllers for the tasks of a heavy top; of drawn parameters they know the middle."""

from __future__ import annotations

from rigid_envs.control.asymmetric import AsymmetricBalance
from rigid_envs.control.precession import PrecessionRegulator
from rigid_envs.control.top_balance import PivotBalance, UprightBalance
from rigid_envs.scores.controllers import Controller
from rigid_envs.systems import HeavyTop
from rigid_envs.tasks import PivotTop, SleepingTop, Task, TopPrecession, TopRandom

__all__ = [
    "asymmetric_balance",
    "pivot_balance",
    "precession_regulator",
    "top_of",
    "upright_balance",
]


def top_of(task: Task) -> HeavyTop:
    """The top of a task, with the middle of each range."""
    top = task.system()
    assert isinstance(top, HeavyTop)
    return top


def upright_balance(task: SleepingTop) -> Controller:
    """Linear-quadratic regulator of the upright top by torque."""
    law = UprightBalance(top_of(task), task.torque, task.dt)
    return lambda states: law(states.y)


def pivot_balance(task: PivotTop) -> Controller:
    """Linear-quadratic regulator of the upright top by acceleration of its pivot."""
    law = PivotBalance(top_of(task), task.push, task.dt)
    return lambda states: law(states.y)


def precession_regulator(task: TopPrecession) -> Controller:
    """Linear-quadratic regulator of steady precession at the commanded tilt."""
    top = top_of(task)
    highest = task.goal_tilt + max(task.goal_spread, 1e-3)
    fastest = top.critical_spin * (task.start_spin + max(task.start_spread, 1e-3))
    law = PrecessionRegulator(
        top,
        task.torque,
        task.dt,
        tilts=(task.goal_tilt, highest),
        spins=(top.critical_spin, fastest),
        branch=task.branch,
    )
    return lambda states: law(states.y, states.auxiliary("goal_tilt"))


def asymmetric_balance(task: TopRandom) -> Controller:
    """Linear-quadratic regulator of the asymmetric upright top by torque."""
    law = AsymmetricBalance(top_of(task), task.torque, task.dt, fastest=1.5 * task.start_spin)
    return lambda states: law(states.y)
