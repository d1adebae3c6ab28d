"""Controllers bound to the tasks of a top, and what they read in observations."""

from __future__ import annotations

from rigid_envs.base.checks import Array
from rigid_envs.control.predictive import PredictiveControl, doubling
from rigid_envs.mechanics import rotations
from rigid_envs.scores.policies import PREDICTION_PERIOD, Controller, predicting
from rigid_envs.scores.references import Decoded, Decoder, attitude, entries
from rigid_envs.systems.heavy_top.controllers import (
    AsymmetricBalance,
    BalancedTop,
    PivotBalance,
    PrecessionRegulator,
    UprightBalance,
)
from rigid_envs.systems.heavy_top.system import HeavyTop
from rigid_envs.systems.heavy_top.tasks.pivot_top import PivotTop
from rigid_envs.systems.heavy_top.tasks.sleeping_top import SleepingTop
from rigid_envs.systems.heavy_top.tasks.top_precession import TopPrecession
from rigid_envs.systems.heavy_top.tasks.top_random import TopRandom
from rigid_envs.tasks.task import Task

# Controllers for the tasks of a heavy top; of drawn parameters they know the middle.


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


# Predictive controllers; of drawn parameters they know the middle. They need CasADi.


def balanced_top(task: PivotTop) -> Controller:
    """Least acceleration over a horizon of 156 control periods."""
    problem = BalancedTop(top_of(task), task.push)
    law = PredictiveControl(problem, doubling(task.dt, 4, 4, 4, 4, 6))
    return predicting(law, task.dt, PREDICTION_PERIOD)


# Decoders of the tasks of a heavy top: attitude, angular velocity, pivot.

_IN_WORLD = ("omega_x", "omega_y", "omega_z")
_IN_BODY = ("omega1", "omega2", "omega3")


def sleeping_top(task: SleepingTop) -> Decoder:
    """The angular velocity is observed in world axes."""
    top, attitude_of, rates = top_of(task), attitude(task), entries(task, *_IN_WORLD)

    def decode(seen: Array) -> Decoded:
        q = attitude_of(seen)
        return Decoded(top, top.state(q=q, omega_body=rotations.rotate_inverse(q, rates(seen))))

    return decode


def pivot_top(task: PivotTop) -> Decoder:
    """The angular velocity is observed in world axes, the pivot in radii of the arena."""
    top, attitude_of, rates = top_of(task), attitude(task), entries(task, *_IN_WORLD)
    pivot, velocity = entries(task, "X / arena", "Y / arena"), entries(task, "VX", "VY")

    def decode(seen: Array) -> Decoded:
        q = attitude_of(seen)
        y = top.state(
            q=q,
            omega_body=rotations.rotate_inverse(q, rates(seen)),
            pivot=task.arena * pivot(seen),
            pivot_velocity=velocity(seen),
        )
        return Decoded(top, y)

    return decode


def top_precession(task: TopPrecession) -> Decoder:
    """Attitude, angular velocity in body axes, and the commanded tilt."""
    top, q, rates = top_of(task), attitude(task), entries(task, *_IN_BODY)
    goal = entries(task, "goal theta")
    return lambda seen: Decoded(
        top, top.state(q=q(seen), omega_body=rates(seen)), {"goal_tilt": goal(seen)}
    )


def top_random(task: TopRandom) -> Decoder:
    """Attitude and angular velocity in body axes."""
    top, q, rates = top_of(task), attitude(task), entries(task, *_IN_BODY)
    return lambda seen: Decoded(top, top.state(q=q(seen), omega_body=rates(seen)))
