"""Controllers for the tasks of a free body; of drawn moments they know the middle."""

from __future__ import annotations

from rigid_envs.control.energy_casimir import EnergyCasimir, SingleTorque
from rigid_envs.control.flip import ForcedFlip, TimedFlip
from rigid_envs.control.momentum import MomentumBrake, MomentumRegulator
from rigid_envs.control.saddle import SeparatrixSteering
from rigid_envs.control.slewing import QuaternionPD
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
    """Linear-quadratic regulator of the spin."""
    law = SpinRegulator(body_of(task), task.spin_rate, task.torque, task.dt)
    return lambda states: law(states.y)


def energy_casimir(task: IntermediateAxis) -> Controller:
    """Energy-Casimir feedback of the spin."""
    law = EnergyCasimir(body_of(task), task.spin_rate, task.torque)
    return lambda states: law(states.y)


def single_torque(
    task: IntermediateAxisSingle, strength: float = 3.0, damping: float = 5.0 / 3.0
) -> Controller:
    """Energy-Casimir feedback by one torque; see `SingleTorque` for its two gains."""
    law = SingleTorque(body_of(task), task.spin_rate, task.torque, strength, damping)
    return lambda states: law(states.y)


def separatrix_steering(task: SpinCapture) -> Controller:
    """Steering onto the separatrix that leads to e2, and a regulator there."""
    first, second, third = (torque > 0.0 for torque in task.torques())
    law = SeparatrixSteering(
        body_of(task), task.spin_rate, task.torque, task.dt, axes=(first, second, third)
    )
    return lambda states: law(states.y)


def timed_flip(task: AxisFlip) -> Controller:
    """Tracking of the free flip that ends within 0.6 of the tolerance at the commanded time."""
    law = TimedFlip(body_of(task), task.spin_rate, task.torque, margin=0.6 * task.tolerance)
    return lambda states: law(states.y, states.auxiliary("time_left"))


def forced_flip(task: AxisFlip) -> Controller:
    """The flip by linear feedback, at once."""
    law = ForcedFlip(body_of(task), task.spin_rate, task.torque)
    return lambda states: law(states.y)


def momentum_regulator(task: Detumble) -> Controller:
    """Optimal impulses for the weights of the reward, from the scalar Riccati equation."""
    law = MomentumRegulator(
        body_of(task),
        task.impulse,
        weight_momentum=task.weight_momentum / task.start_momentum**2,
        weight_impulse=task.weight_impulse / task.impulse**2,
    )
    return lambda states: law(states.y)


def momentum_brake(task: Detumble) -> Controller:
    """Time-optimal impulses: rest in the least number of steps."""
    law = MomentumBrake(body_of(task), task.impulse)
    return lambda states: law(states.y)


def quaternion_pd(task: Reorient) -> Controller:
    """Quaternion feedback to the goal attitude."""
    law = QuaternionPD(body_of(task), task.torque)
    return lambda states: law(states.y, states.auxiliary(*task.aux_names))
