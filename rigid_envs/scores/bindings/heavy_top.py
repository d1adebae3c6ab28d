"""Policies for the tasks of a heavy top; where parameters are drawn, they know the middle ones."""

from __future__ import annotations

from rigid_envs.control.asymmetric import AsymmetricBalance
from rigid_envs.control.precession import PrecessionRegulator
from rigid_envs.control.tops import PivotBalance, UprightBalance
from rigid_envs.scores.policy import Builder, Policy
from rigid_envs.systems import HeavyTop
from rigid_envs.tasks import PivotTop, SleepingTop, Task, TopPrecession, TopRandom

__all__ = ["REFERENCES"]


def top_of(task: Task) -> HeavyTop:
    """The top of a task, with the middle of each range."""
    top = task.system()
    assert isinstance(top, HeavyTop)
    return top


def upright_balance(task: SleepingTop) -> Policy:
    """The top kept upright by torque."""
    law = UprightBalance(top_of(task), task.torque, task.dt)
    return lambda envs: law(envs.y)


def pivot_balance(task: PivotTop) -> Policy:
    """The top kept upright by its pivot."""
    law = PivotBalance(top_of(task), task.push, task.dt)
    return lambda envs: law(envs.y)


def precession_regulator(task: TopPrecession) -> Policy:
    """Steady precession at the commanded tilt, on the branch of the task."""
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
    return lambda envs: law(envs.y, envs.auxiliary("goal_tilt"))


def asymmetric_balance(task: TopRandom) -> Policy:
    """The asymmetric top kept upright by torque."""
    law = AsymmetricBalance(top_of(task), task.torque, task.dt, fastest=1.5 * task.start_spin)
    return lambda envs: law(envs.y)


REFERENCES: dict[str, dict[str, Builder]] = {
    "RigidEnvs/SleepingTop-v0": {"lqr": upright_balance},
    "RigidEnvs/SleepingTopRandom-v0": {"lqr": upright_balance},
    "RigidEnvs/PivotTop-v0": {"lqr": pivot_balance},
    "RigidEnvs/TopPrecession-v0": {"lqr": precession_regulator},
    "RigidEnvs/TopRandom-v0": {"lqr": asymmetric_balance},
}
