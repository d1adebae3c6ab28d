"""Controllers bound to the tasks of a gyrostat, what they read in observations, and a bound."""

from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.control.planning import Conditions
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.mechanics import rotations
from rigid_envs.scores.best import TheoreticalLimit
from rigid_envs.scores.policies import Controller, Rows, Script, States, feedback, system_of
from rigid_envs.scores.references import (
    Decoded,
    Decoder,
    attitude,
    attitude_of_columns,
    entries,
    goal_attitude,
)
from rigid_envs.systems.gyrostat import controllers
from rigid_envs.systems.gyrostat.pointing import (
    FlyOver,
    LookAhead,
    PointingFeedback,
    Sight,
    SightFollower,
    off_axis,
)
from rigid_envs.systems.gyrostat.tasks.dual_spin import DualSpin
from rigid_envs.systems.gyrostat.tasks.wheel_reorient import TwoWheels, WheelReorient
from rigid_envs.systems.gyrostat.tasks.wheel_track import WheelTrack
from rigid_envs.tasks.core import Core

# Theoretical limits of metrics.


def _least_time(envs: RigidVectorEnv) -> Array:
    """The larger of the times of the latitude and of the motor, in whole periods [s]."""
    task: Any = envs.task
    systems: Any = envs.systems
    pairs = list(zip(systems, envs.y, strict=True))
    A = np.array([system.carrier_moments for system in systems])
    stored = np.array([np.abs(system.spin_momenta(y)[0]) for system, y in pairs])
    L = np.array([system.L_body(y) for system, y in pairs])
    size, most = np.linalg.norm(L, axis=-1), A[:, 1:].max(axis=1) * task.rate_tolerance
    latitude = np.arctanh(np.abs(L[:, 0]) / size)
    fastest = 0.5 * size * np.abs(1.0 / A[:, 1] - 1.0 / A[:, 2])
    growth = (np.arccosh(np.maximum(size / most, 1.0)) - latitude) / fastest
    missing = np.sqrt(np.maximum(size**2 - most**2, 0.0)) - A[:, 0] * task.rate_tolerance - stored
    time = np.maximum(growth, missing / task.torque)
    return np.asarray(task.dt * np.maximum(np.ceil(time / task.dt - 1e-9), 1.0))


DUAL_SPIN_TIME = TheoreticalLimit(
    "bound",
    "the latitude of $L$ grows at $(|L| / 2) |1 / A2 - 1 / A3|$ at most, $l$ at `torque`",
    _least_time,
)


# Controllers; of drawn moments they know the middle.


def eigenaxis(task: WheelReorient) -> Controller:
    """Turn about the axis of the rotation to the goal."""
    law = controllers.EigenaxisSlew(system_of(task), task.torque, task.capacity, task.dt)
    return feedback(law, *task.aux_names)


def three_turns(task: TwoWheels) -> Controller:
    """Turns about e1, e2 and e1, or about e2, e1 and e2."""
    law = controllers.ThreeTurns(system_of(task), task.torque, task.capacity, task.dt)
    return feedback(law, *task.aux_names)


_FRAME = tuple(f"pass_{name}" for name in "wxyz")  # axes of the pass
_PLACE = ("sine", "cosine", "target_sine", "target_cosine")
_AHEAD = 300  # steps that are planned


def _path(task: WheelTrack) -> FlyOver:
    return FlyOver(task.orbit_rate, 1.0 / task.ground)


def _place(states: Any) -> tuple[Array, Array]:
    """Angles of satellite and target in the pass, each of shape (N,) [rad]."""
    sine, cosine, target_sine, target_cosine = states.auxiliary(*_PLACE).T
    return np.arctan2(sine, cosine), np.arctan2(target_sine, target_cosine)


def _sight(task: WheelTrack, states: Any) -> Sight:
    """The line of sight of every row, in body axes."""
    turn = rotations.multiply(rotations.conjugate(states.y[:, :4]), states.auxiliary(*_FRAME))
    return _path(task).sight(*_place(states)).seen(turn)


def pd(task: WheelTrack) -> Controller:
    """Feedback of pointing error and angular velocity."""
    law = PointingFeedback(system_of(task), task.torque, task.capacity, task.dt)
    return lambda states: law(states.y, _sight(task, states).direction)


def feedforward(task: WheelTrack) -> Controller:
    """Follow the line of sight, without turning about it."""
    law = SightFollower(system_of(task), task.torque, task.capacity, task.dt)
    return lambda states: law(states.y, *_sight(task, states))


def look_ahead(task: WheelTrack) -> Controller:
    """Follow the line of sight, rolled so that the wheels hold what the pass ahead takes."""
    satellite = system_of(task)
    law = LookAhead(satellite, task.torque, task.capacity, task.dt)

    def plan(states: States, rows: Rows) -> Array:
        turn = rotations.multiply(rotations.conjugate(states.auxiliary(*_FRAME)), states.y[:, :4])
        L = rotations.rotate(turn, satellite.L_body(states.y))[rows]
        phi, beta = (angle[rows] for angle in _place(states))
        found = law.plan(_path(task), L, phi, beta, _sight(task, states).roll[rows], _AHEAD)
        return np.stack([found.rolls, found.rates], axis=-1)

    def follow(states: States, due: Array) -> Array:
        return law(states.y, *_sight(task, states), due[:, 0], due[:, 1])

    return Script(plan, follow)


def ride(task: DualSpin) -> Controller:
    """Ride to the end of the separatrix, then full torque to rest."""
    rest = 0.999 * task.rate_tolerance
    return feedback(
        controllers.DualSpinTurn(system_of(task), task.torque, task.dt, rest, task.n_substeps)
    )


# Decoders of the tasks of a gyrostat.


def _slew(task: WheelReorient | TwoWheels, n_wheels: int) -> Decoder:
    satellite = system_of(task)
    rates = entries(task, "omega1", "omega2", "omega3", part="achieved_goal")
    here, there = goal_attitude(task, "achieved_goal"), goal_attitude(task, "desired_goal")
    stored = entries(task, *(f"l{k} / capacity" for k in range(1, n_wheels + 1)))

    def decode(seen: Array) -> Decoded:
        omega, l = rates(seen), np.zeros((len(seen), 3))  # noqa: E741
        l[:, :n_wheels] = task.capacity * stored(seen)
        J = np.where(satellite.wheel_moments > 0.0, satellite.wheel_moments, 1.0)
        wheels = np.where(satellite.wheel_moments > 0.0, l / J - omega, 0.0)
        y = satellite.state(q=here(seen), omega_body=omega, wheel_rates=wheels)
        return Decoded(satellite, y, dict(zip(task.aux_names, there(seen).T, strict=True)))

    return decode


def wheel_reorient(task: WheelReorient) -> Decoder:
    """Pose and goal from the goals, which noise does not touch; the spin momenta."""
    return _slew(task, 3)


def two_wheels(task: TwoWheels) -> Decoder:
    """As `wheel_reorient`, with two wheels."""
    return _slew(task, 2)


def wheel_track(task: WheelTrack) -> Decoder:
    """Axes of the pass by the line of sight and its rate, seen from an upright satellite."""
    satellite, path = system_of(task), _path(task)
    sight = entries(task, "sight1", "sight2", "sight3")
    rate = entries(task, *(f"sight_rate{k} / overhead_rate" for k in "123"))
    omega = entries(task, *(f"omega{k} / overhead_rate" for k in "123"))
    stored = entries(task, *(f"l{k} / capacity" for k in "123"))
    place = entries(task, "to go / altitude", "across / altitude")

    def decode(seen: Array) -> Decoded:
        turning = task.overhead_rate * omega(seen)
        wheels = task.capacity / satellite.wheel_moments * stored(seen) - turning
        to_go, across = place(seen).T
        phi, beta = -to_go / (task.ground + 1.0), across / task.ground
        there = path.sight(phi, beta)
        q = attitude_of_columns(np.concatenate([sight(seen), rate(seen)], axis=-1))
        back = attitude_of_columns(np.concatenate([there.direction, there.rate], axis=-1))
        frame = rotations.multiply(q, rotations.conjugate(back))
        angles = np.sin(phi), np.cos(phi), np.sin(beta), np.cos(beta)
        known = dict(zip((*_FRAME, *_PLACE), (*frame.T, *angles), strict=True))
        return Decoded(satellite, satellite.state(omega_body=turning, wheel_rates=wheels), known)

    return decode


def dual_spin(task: DualSpin) -> Decoder:
    """Angular velocity, and the spin momentum by its part of the angular momentum."""
    satellite, q = system_of(task), attitude(task, needed=False)
    rates = entries(task, "omega1", "omega2", "omega3")
    direction = entries(task, *(f"L{k} / |L|" for k in "123"))
    part = entries(task, "l / |L|")

    def decode(seen: Array) -> Decoded:
        omega, n = rates(seen), direction(seen)
        # A omega = |L| (n - part e1), by least squares
        n[:, 0] -= part(seen)
        size = np.sum(satellite.carrier_moments * omega * n, axis=-1) / np.sum(n * n, axis=-1)
        wheels = np.zeros_like(omega)
        wheels[:, 0] = size * part(seen) / satellite.J1 - omega[:, 0]
        y = satellite.state(q=q(seen), omega_body=omega, wheel_rates=wheels)
        return Decoded(satellite, y)

    return decode


# What success asks of a motion, for planning.


def _turned(core: Core) -> list[Array]:
    """Rotation vector to the goal and angular velocity, each over its tolerance."""
    task: Any = core.task
    y, goal = core.y, core.auxiliary(*task.aux_names)
    off = rotations.log(rotations.multiply(rotations.conjugate(goal), y[:, :4]))
    return [off / task.largest_angle, y[:, 4:7] / task.rate_tolerance]


def _on_target(core: Core) -> list[Array]:
    """Pointing error over the largest mean of it: so small in every step, it is so in the mean."""
    task: Any = core.task
    return [off_axis(_sight(task, core).direction)[:, :2] / task.bound]


def _at_rest(core: Core) -> list[Array]:
    """Angular velocity over the tolerance."""
    task: Any = core.task
    return [core.y[:, 4:7] / task.rate_tolerance]


_STATE = ("w", "x", "y", "z", "omega1", "omega2", "omega3", "wheel1", "wheel2", "wheel3")
TURNED, ON_TARGET = Conditions(_STATE, _turned), Conditions(_STATE, _on_target)
AT_REST = Conditions(("omega1", "omega2", "omega3", "wheel1"), _at_rest)
