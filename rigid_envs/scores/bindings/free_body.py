"""Policies for the tasks of a free body; where moments are drawn, they know the middle ones."""

from __future__ import annotations

from rigid_envs.control.attitude import QuaternionPD
from rigid_envs.control.energy_casimir import EnergyCasimir, SingleTorque
from rigid_envs.control.flip import ForcedFlip, TimedFlip
from rigid_envs.control.momentum import MomentumBrake, MomentumRegulator
from rigid_envs.control.saddle import SeparatrixSteering
from rigid_envs.control.spin import SpinRegulator
from rigid_envs.scores.controllers import Controller
from rigid_envs.systems import FreeBody
from rigid_envs.tasks import (
    AxisFlip,
    Detumble,
    IntermediateAxis,
    IntermediateAxisSingle,
    Reorient,
    SpinCapture,
    Task,
)

__all__ = [
    "body_of",
    "energy_casimir",
    "forced_flip",
    "momentum_brake",
    "momentum_regulator",
    "quaternion_pd",
    "separatrix_steering",
    "spin_regulator",
    "timed_flip",
]


def body_of(task: Task) -> FreeBody:
    """The body of a task, with the middle of each range."""
    body = task.system()
    assert isinstance(body, FreeBody)
    return body


def spin_regulator(task: IntermediateAxis) -> Controller:
    """The spin held by linear feedback."""
    law = SpinRegulator(body_of(task), task.spin_rate, task.torque, task.dt)
    return lambda envs: law(envs.y)


def energy_casimir(task: IntermediateAxis) -> Controller:
    """The spin held by energy-Casimir feedback."""
    law = EnergyCasimir(body_of(task), task.spin_rate, task.torque)
    return lambda envs: law(envs.y)


def single_torque(
    task: IntermediateAxisSingle, strength: float = 3.0, damping: float = 5.0 / 3.0
) -> Controller:
    """The spin aligned by one torque; see `SingleTorque` for its two gains."""
    law = SingleTorque(body_of(task), task.spin_rate, task.torque, strength, damping)
    return lambda envs: law(envs.y)


def separatrix_steering(task: SpinCapture) -> Controller:
    """The spin steered onto the way to e2, and caught there."""
    first, second, third = (torque > 0.0 for torque in task.torques())
    law = SeparatrixSteering(
        body_of(task), task.spin_rate, task.torque, task.dt, axes=(first, second, third)
    )
    return lambda envs: law(envs.y)


def timed_flip(task: AxisFlip) -> Controller:
    """The free flip, to arrive with 0.6 of the tolerance at the commanded time."""
    law = TimedFlip(body_of(task), task.spin_rate, task.torque, margin=0.6 * task.tolerance)
    time_left = task.memo_names.index("time_left")
    return lambda envs: law(envs.y, envs.get_state()["memo"][:, time_left])


def forced_flip(task: AxisFlip) -> Controller:
    """The flip by brute force, at once."""
    law = ForcedFlip(body_of(task), task.spin_rate, task.torque)
    return lambda envs: law(envs.y)


def momentum_regulator(task: Detumble) -> Controller:
    """The impulses of least cost, by the weights of the reward."""
    law = MomentumRegulator(
        body_of(task),
        task.impulse,
        weight_momentum=task.weight_momentum / task.start_momentum**2,
        weight_impulse=task.weight_impulse / task.impulse**2,
    )
    return lambda envs: law(envs.y)


def momentum_brake(task: Detumble) -> Controller:
    """Rest in the least number of steps."""
    law = MomentumBrake(body_of(task), task.impulse)
    return lambda envs: law(envs.y)


def quaternion_pd(task: Reorient) -> Controller:
    """The short way to the goal."""
    law = QuaternionPD(body_of(task), task.torque)
    return lambda envs: law(envs.y, envs.get_state()["memo"])
