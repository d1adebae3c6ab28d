"""Controllers bound to the tasks of a top, and what they read in observations."""

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.control.planning import Conditions
from rigid_envs.control.predictive import PredictiveControl, doubling
from rigid_envs.mechanics import rotations
from rigid_envs.scores import policies
from rigid_envs.scores.policies import Controller, feedback, system_of
from rigid_envs.scores.references import Decoded, Decoder, attitude, entries
from rigid_envs.systems.heavy_top import controllers
from rigid_envs.systems.heavy_top.tasks.pivot_top import PivotTop
from rigid_envs.systems.heavy_top.tasks.sleeping_top import SleepingTop
from rigid_envs.systems.heavy_top.tasks.top_precession import TopPrecession
from rigid_envs.systems.heavy_top.tasks.top_random import TopRandom
from rigid_envs.systems.heavy_top.transfer import SleepTransfer
from rigid_envs.tasks.core import Core

# Controllers for the tasks of a heavy top; of drawn parameters they know the middle.


def upright_balance(task: SleepingTop) -> Controller:
    """Linear-quadratic regulator of the upright top by torque."""
    return feedback(controllers.UprightBalance(system_of(task), task.torque, task.dt))


def sleep_transfer(task: SleepingTop) -> Controller:
    """A fall and a rise onto the motion that comes to rest upright, where they are in time."""
    law = SleepTransfer(
        system_of(task),
        task.torque,
        task.dt,
        patience=task.registered_steps() * task.dt - task.hold - 2.0 * task.dt,
        tolerance=0.98 * task.tolerance,
    )
    return feedback(law)


def pivot_balance(task: PivotTop) -> Controller:
    """Linear-quadratic regulator of the upright top by acceleration of its pivot."""
    return feedback(controllers.PivotBalance(system_of(task), task.push, task.dt))


def precession_regulator(task: TopPrecession) -> Controller:
    """Linear-quadratic regulator of steady precession at the commanded tilt."""
    top = system_of(task)
    highest = task.goal_tilt + max(task.goal_spread, 1e-3)
    fastest = top.critical_spin * (task.start_spin + max(task.start_spread, 1e-3))
    controller = controllers.PrecessionRegulator(
        top,
        task.torque,
        task.dt,
        tilts=(task.goal_tilt, highest),
        spins=(top.critical_spin, fastest),
        branch=task.branch,
    )
    return feedback(controller, "goal_tilt")


def asymmetric_balance(task: TopRandom) -> Controller:
    """Linear-quadratic regulator of the asymmetric upright top by torque."""
    fastest = 1.5 * max(task.start_spin, 1e-3)
    return feedback(controllers.AsymmetricBalance(system_of(task), task.torque, task.dt, fastest))


# Predictive controllers; of drawn parameters they know the middle. They need CasADi.


def balanced_top(task: PivotTop) -> Controller:
    """Least acceleration over a horizon of 156 control periods."""
    problem = controllers.BalancedTop(system_of(task), task.push)
    controller = PredictiveControl(problem, doubling(task.dt, 4, 4, 4, 4, 6))
    return policies.predicting(controller, task.dt, policies.PREDICTION_PERIOD)


# Decoders of the tasks of a heavy top: attitude, angular velocity, pivot.

_IN_WORLD = ("omega_x", "omega_y", "omega_z")
_IN_BODY = ("omega1", "omega2", "omega3")


def sleeping_top(task: SleepingTop) -> Decoder:
    """The angular velocity is observed in world axes."""
    top, attitude_of, rates = system_of(task), attitude(task), entries(task, *_IN_WORLD)

    def decode(seen: Array) -> Decoded:
        q = attitude_of(seen)
        return Decoded(top, top.state(q=q, omega_body=rotations.rotate_inverse(q, rates(seen))))

    return decode


def pivot_top(task: PivotTop) -> Decoder:
    """The angular velocity is observed in world axes, the pivot in radii of the arena."""
    top, attitude_of, rates = system_of(task), attitude(task), entries(task, *_IN_WORLD)
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
    top, q, rates = system_of(task), attitude(task), entries(task, *_IN_BODY)
    goal = entries(task, "goal theta")
    return lambda seen: Decoded(
        top, top.state(q=q(seen), omega_body=rates(seen)), {"goal_tilt": goal(seen)}
    )


def top_random(task: TopRandom) -> Decoder:
    """Attitude and angular velocity in body axes."""
    top, q, rates = system_of(task), attitude(task), entries(task, *_IN_BODY)
    return lambda seen: Decoded(top, top.state(q=q(seen), omega_body=rates(seen)))


# What success asks of a motion, for planning.


def _tilt(q: Array) -> Array:
    """The angle of the turned e3 from e3 in two directions [rad], shape (N, 2)."""
    axis = rotations.rotate(q, np.array([0.0, 0.0, 1.0]))
    length = np.linalg.norm(axis[:, :2], axis=-1, keepdims=True)
    return np.asarray(np.arctan2(length, axis[:, 2:]) * axis[:, :2] / np.maximum(length, 1e-300))


def _upright(core: Core) -> list[Array]:
    task: Any = core.task
    return [_tilt(core.y[:, :4]) / task.tolerance]


def _upright_in_body(core: Core) -> list[Array]:
    """The tilt as the vertical has it in the body, which no heading changes."""
    task: Any = core.task
    return [_tilt(rotations.conjugate(core.y[:, :4])) / task.tolerance]


def _balanced(core: Core) -> list[Array]:
    task: Any = core.task
    y = core.y
    return [_tilt(y[:, :4]) / task.tilt_tolerance, y[:, 7:9] / task.centre_tolerance]


def _precessing(core: Core) -> list[Array]:
    """Tilt and rate of precession off their goals; sizes from the terms, signs as observed."""
    task: Any = core.task
    shown = dict(zip(task.terms, core.results[1:], strict=False))
    tilt, rate = (1.0 / np.maximum(shown[name], 1e-300) - 1.0 for name in ("tilt", "rate"))
    signs = np.sign(core.observations[:, 3:5] - core.observations[:, 5:7]).T
    scale = 10.0 * task.tolerance  # terms are 1 / (1 + 10 error)
    off = signs[0] * tilt / (scale * core.auxiliary("goal_tilt"))
    return [off[:, None], (signs[1] * rate / scale)[:, None]]


def _in_space(y: Array) -> Array:
    """Of a symmetric top whatever its phase: the axis, omega and the pivot in world axes."""
    q = rotations.normalize(y[:, :4])
    axis = rotations.rotate(q, np.array([0.0, 0.0, 1.0]))[:, :2]
    return np.concatenate([axis, rotations.rotate(q, y[:, 4:7]), y[:, 7:]], axis=1)


def _in_body(y: Array) -> Array:
    """Of a top whatever its heading: the vertical and omega in body axes."""
    q = rotations.conjugate(rotations.normalize(y[:, :4]))
    up = rotations.rotate(q, np.array([0.0, 0.0, 1.0]))[:, :2]
    return np.concatenate([up, y[:, 4:]], axis=1)


_TOP = ("w", "x", "y", "z", "omega1", "omega2", "omega3")
UPRIGHT = Conditions(_TOP, _upright, _in_space)
UPRIGHT_IN_BODY = Conditions(_TOP, _upright_in_body, _in_body)
PRECESSING = Conditions(_TOP, _precessing, _in_body, 10)
BALANCED = Conditions((*_TOP, "X", "Y", "VX", "VY"), _balanced, _in_space)
