"""Controllers bound to the tasks of a free body, what they read in observations, and bounds."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from rigid_envs.base.checks import Array
from rigid_envs.control.planning import Conditions
from rigid_envs.control.predictive import PredictiveControl, doubling
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.mechanics import rotations
from rigid_envs.scores.best import TheoreticalLimit, _rows, least_time
from rigid_envs.scores.policies import (
    PREDICTION_PERIOD,
    Controller,
    feedback,
    predicting,
    system_of,
)
from rigid_envs.scores.references import Decoded, Decoder, attitude, entries, goal_attitude
from rigid_envs.systems.free_body import controllers
from rigid_envs.systems.free_body.tasks.axis_flip import AxisFlip
from rigid_envs.systems.free_body.tasks.detumble import Detumble
from rigid_envs.systems.free_body.tasks.intermediate_axis import IntermediateAxis
from rigid_envs.systems.free_body.tasks.intermediate_axis_single import IntermediateAxisSingle
from rigid_envs.systems.free_body.tasks.reorient import Reorient
from rigid_envs.systems.free_body.tasks.shared import SpinTask
from rigid_envs.systems.free_body.tasks.spin_capture import SpinCapture
from rigid_envs.systems.free_body.transfer import (
    PolhodeTransfer,
    TimedTransfer,
    intermediate_share,
    polhode_point,
    rays,
)
from rigid_envs.tasks.core import Core

# Theoretical limits of metrics: optima and bounds from each start, in closed form.


def _moments(envs: RigidVectorEnv) -> Array:
    """Principal moments of every row, shape (N, 3) [kg m^2]."""
    return np.stack([_rows(envs, name) for name in ("I1", "I2", "I3")], axis=-1)


def _turn(envs: RigidVectorEnv) -> Array:
    """Least time [s] of a turn from rest to within tolerance of the goal.

    With e = sqrt(2 T / I_min), which is at least the rate, ``|e'| <= a`` (`slew_acceleration`); at
    the end it is sqrt(I_max / I_min) times the tolerated rate at most.
    """
    task: Any = envs.task
    moments = _moments(envs).T
    angle = (
        rotations.distance(envs.y[:, :4], envs.auxiliary(*task.aux_names)) - task.angle_tolerance
    )
    rate = np.sqrt(moments.max(axis=0) / moments.min(axis=0)) * task.rate_tolerance
    return least_time(
        np.maximum(angle, 0.0), controllers.slew_acceleration(moments, task.torque), rate
    )


def _momentum(envs: RigidVectorEnv) -> Array:
    """|L| [N m s]."""
    return np.array(
        [
            np.linalg.norm(system.L_body(y))  # type: ignore[attr-defined]
            for system, y in zip(envs.systems, envs.y, strict=True)
        ]
    )


def _impulses(envs: RigidVectorEnv) -> Array:
    """Least number of largest impulses until |L| is within tolerance, as a time [s]."""
    task: Any = envs.task
    rest = _momentum(envs) - task.tolerance * task.start_momentum
    return np.asarray(task.dt * np.maximum(np.ceil(rest / task.impulse), 1.0))


def _riccati(envs: RigidVectorEnv) -> Array:
    """Loss of the optimal controller over an infinite horizon; after 50 steps 1e-7 is left."""
    task: Any = envs.task
    return _momentum_regulator(task).riccati * _momentum(envs) ** 2


def _spin_impulse(envs: RigidVectorEnv) -> Array:
    """Distance in the plane of `polhode_point` from a rectangle that holds all goals [N m s].

    With the tolerated rate r, of spins within r of Omega e2 (or -e2): along the ray the coordinate
    is from ``|L2|`` to ``|L|``, and across it ``x = (q1^2 (1 - a) - q3^2 a) / (q1 sqrt(1 - a) + q3
    sqrt(a))``, where the numerator is ``(1 - a) I1^2 d s`` (see `Shape`) and the denominator at
    least ``2 sqrt(a (1 - a)) |L2|``.

    The spin is held there for a time, in which d grows by `_growth_in_hold`. So when the hold
    begins, abs(d) is at most the largest in the end over that factor, and what an impulse J takes
    of d meanwhile, ``|J| sqrt(1 / I1^2 + ratio^2 / I3^2)``. Where this lets x be larger by less
    than ``|J|``, J is better spent before: the hold is taken to be free.
    """
    task: Any = envs.task
    moments = _moments(envs)
    rate, r = task.spin_rate, task.tolerance * task.spin_rate
    frame, squares = rays(moments), moments**2
    place = (frame @ polhode_point(moments, moments * envs.y[:, 4:7])[..., None])[..., 0]
    least = moments[:, 1] * (rate - r)
    # |L|^2 over the sphere of errors is largest in the plane of e2 and e3
    error = np.minimum(squares[:, 1] * rate / (squares[:, 2] - squares[:, 1]), r)
    most = np.sqrt(squares[:, 1] * (rate + error) ** 2 + squares[:, 2] * (r**2 - error**2))
    ratio, growth, _ = np.array([controllers.saddle(each) for each in moments]).T
    first, third = frame[:, 0, 0], frame[:, 0, 1]
    across = (third * moments[:, 0]) ** 2 / (2.0 * first * third * least)  # x over d s
    reach = r * np.hypot(1.0, ratio)  # of abs(d) and abs(s)
    taken = np.hypot(1.0 / moments[:, 0], ratio / moments[:, 2])
    held = across * reach**2 / _growth_in_hold(task, moments[:, 0], growth)
    held = np.where(across * reach * taken <= 1.0, held, np.inf)
    low = np.maximum(-across * (ratio * r) ** 2, -held)
    high = np.minimum(across * r**2, held)
    along = place[:, 0] - np.clip(place[:, 0], least, most)
    return np.asarray(np.hypot(along, place[:, 1] - np.clip(place[:, 1], low, high)))


def _growth_in_hold(task: Any, I1: Array, growth: Array) -> Array:
    """Least factor by which d grows between the first and the last state of a hold, shape (n,).

    These states are within r of Omega e2. The rate of change of omega is at most ``v = 2 r (Omega
    + 3 r) + |torque| / I1`` within 2 r, as no difference of two moments is above the third. So no
    state between is there further than ``v dt / 2`` from one of them, if that is within r; else
    the factor is 1.
    """
    rate, r = task.spin_rate, task.tolerance * task.spin_rate
    v = 2.0 * r * (rate + 3.0 * r) + np.linalg.norm(task.torques()) / I1
    away = 0.5 * task.dt * v
    hold = getattr(task, "hold", 0.0)  # `AxisFlip` is held until the time limit, which may be near
    n_periods = math.ceil(hold / task.dt * (1.0 - 1e-9)) - 1
    grown = np.exp(growth * np.maximum(rate - r - away, 0.0) * max(n_periods, 0) * task.dt)
    return np.where(away <= r, grown, 1.0)


def _axis_impulse(envs: RigidVectorEnv) -> Array:
    """Least change of q3 of `polhode_point` by torque about e3, which keeps q1 [N m s].

    It moves q3 by no more than the impulse. Spins within the angle of e2 have ``|omega1|`` and
    ``|omega3|`` up to omega2 times its tangent, so q3 / q1 from one to the other of

        sqrt((1 - a) / (I1^2 tan^2 / I2^2 + a)),   sqrt((I3^2 tan^2 / I2^2 + 1 - a) / a).
    """
    task: Any = envs.task
    moments = _moments(envs)
    q1, q3 = polhode_point(moments, moments * envs.y[:, 4:7]).T
    a, tangent = intermediate_share(moments), np.tan(task.tolerance)
    off = (moments * tangent / moments[:, 1:2]) ** 2
    least = np.sqrt((1.0 - a) / (off[:, 0] + a)) * q1
    return np.asarray(np.abs(q3 - np.clip(q3, least, np.sqrt((off[:, 2] + 1.0 - a) / a) * q1)))


SPIN_EFFORT = TheoreticalLimit(
    "bound",
    "the distance of the polhodes in the plane of angular momentum in which it is the impulse",
    _spin_impulse,
)
AXIS_EFFORT = TheoreticalLimit(
    "bound", "the change of the polhode that torque about $e3$ has to bring", _axis_impulse
)
DETUMBLE_LOSS = TheoreticalLimit("exact", "the root of the scalar Riccati equation", _riccati)
DETUMBLE_TIME = TheoreticalLimit("exact", "$|L|$ over the largest impulse, rounded up", _impulses)
REORIENT_TIME = TheoreticalLimit(
    "bound", "$2 sqrt(angle / a)$, $a$ the largest angular acceleration, less tolerances", _turn
)


# Controllers for the tasks of a free body; of drawn moments they know the middle.


def minimum_fuel(task: IntermediateAxis) -> Controller:
    """Least torque impulse to 0.97 of the tolerance; s may decay for half of the time before."""
    before = task.registered_steps() * task.dt - task.hold
    law = controllers.MinimumFuelSpin(
        system_of(task),
        task.spin_rate,
        task.torque,
        task.dt,
        tolerance=0.97 * task.tolerance,
        settle=max(0.5 * before, task.dt),
    )
    return feedback(law)


def _transfer(task: SpinTask, tolerance: float, **more: Any) -> PolhodeTransfer:
    """With the actuators that the task has."""
    first, second, third = (torque > 0.0 for torque in task.torques())
    return PolhodeTransfer(
        system_of(task),
        task.spin_rate,
        task.torque,
        task.dt,
        tolerance=tolerance,
        axes=(first, second, third),
        **more,
    )


def polhode_transfer(task: IntermediateAxis) -> Controller:
    """Least impulses to 0.9 of the tolerance, with free flights between them."""
    return feedback(
        _transfer(task, 0.9 * task.tolerance, efficiency=0.98, clearance=0.012, reach=0.14)
    )


def spin_regulator(task: IntermediateAxis) -> Controller:
    """Linear-quadratic regulator of the spin."""
    return feedback(
        controllers.SpinRegulator(system_of(task), task.spin_rate, task.torque, task.dt)
    )


def energy_casimir(task: IntermediateAxis) -> Controller:
    """Energy-Casimir feedback of the spin."""
    return feedback(controllers.EnergyCasimir(system_of(task), task.spin_rate, task.torque))


def single_torque(
    task: IntermediateAxisSingle, strength: float = 3.0, damping: float = 5.0 / 3.0
) -> Controller:
    """Energy-Casimir feedback by one torque; see `SingleTorque` for its two gains."""
    return feedback(
        controllers.SingleTorque(system_of(task), task.spin_rate, task.torque, strength, damping)
    )


def single_transfer(task: IntermediateAxisSingle) -> Controller:
    """Least impulses across the ray by one torque, at any rate of the spin."""
    law = _transfer(task, 1.0, efficiency=0.98, clearance=0.016, reach=0.14)
    return lambda states: law(states.y)[..., 2:]


def weak_transfer(task: SpinCapture) -> Controller:
    """The same by weak torque, which has to be used for longer around the best places."""
    return feedback(
        _transfer(task, 0.97 * task.tolerance, efficiency=0.8, clearance=0.01, reach=0.1)
    )


def separatrix_steering(task: SpinCapture) -> Controller:
    """Steering onto the separatrix that leads to e2, and a regulator there."""
    first, second, third = (torque > 0.0 for torque in task.torques())
    steering = controllers.SeparatrixSteering(
        system_of(task), task.spin_rate, task.torque, task.dt, axes=(first, second, third)
    )
    return feedback(steering)


def timed_transfer(task: AxisFlip) -> Controller:
    """The flip by itself, in time, after the least impulses; 0.8 and 0.7 of the tolerance."""
    law = TimedTransfer(
        system_of(task),
        task.spin_rate,
        task.torque,
        task.dt,
        tolerance=0.7 * task.tolerance,
        margin=0.8 * task.tolerance,
        efficiency=0.99,
        clearance=0.003,
    )
    return feedback(law, "time_left")


def timed_flip(task: AxisFlip) -> Controller:
    """Tracking of the free flip that ends within 0.6 of the tolerance at the commanded time."""
    margin = 0.6 * task.tolerance
    return feedback(
        controllers.TimedFlip(system_of(task), task.spin_rate, task.torque, margin), "time_left"
    )


def forced_flip(task: AxisFlip) -> Controller:
    """The flip by linear feedback, at once."""
    return feedback(controllers.ForcedFlip(system_of(task), task.spin_rate, task.torque))


def momentum_regulator(task: Detumble) -> Controller:
    """Optimal impulses for the weights of the reward, from the scalar Riccati equation."""
    return feedback(_momentum_regulator(task))


def _momentum_regulator(task: Detumble) -> controllers.MomentumRegulator:
    return controllers.MomentumRegulator(
        system_of(task),
        task.impulse,
        weight_momentum=task.weight_momentum / task.start_momentum**2,
        weight_impulse=task.weight_impulse / task.impulse**2,
    )


def momentum_brake(task: Detumble) -> Controller:
    """Time-optimal impulses: rest in the least number of steps."""
    return feedback(controllers.MomentumBrake(system_of(task), task.impulse))


def quaternion_pd(task: Reorient) -> Controller:
    """Quaternion feedback to the goal attitude."""
    return feedback(controllers.QuaternionPD(system_of(task), task.torque), *task.aux_names)


# Predictive controllers; of drawn parameters they know the middle. They need CasADi.


def held_spin(task: IntermediateAxis) -> Controller:
    """Least torque impulse over a horizon of 52 control periods."""
    problem = controllers.HeldSpin(system_of(task), task.spin_rate, task.torque)
    controller = PredictiveControl(problem, doubling(task.dt, 4, 4, 10))
    return predicting(controller, task.dt, PREDICTION_PERIOD)


# Decoders of the tasks of a free body: its angular velocity; the attitude where it is needed.

_SPIN = ("omega1 / Omega", "omega2 / Omega", "omega3 / Omega")
_RATES = ("omega1", "omega2", "omega3")


def intermediate_axis(task: IntermediateAxis | IntermediateAxisSingle | SpinCapture) -> Decoder:
    """The spin, which is observed divided by Omega."""
    body, q, spin = system_of(task), attitude(task, needed=False), entries(task, *_SPIN)
    return lambda seen: Decoded(body, body.state(q=q(seen), omega_body=task.spin_rate * spin(seen)))


def axis_flip(task: AxisFlip) -> Decoder:
    """The spin, and the time until the commanded time, which is 0 after it."""
    body, q, spin = system_of(task), attitude(task, needed=False), entries(task, *_SPIN)
    left = entries(task, "time left / longest")
    return lambda seen: Decoded(
        body,
        body.state(q=q(seen), omega_body=task.spin_rate * spin(seen)),
        {"time_left": task.largest_flip_time * left(seen)},
    )


def detumble(task: Detumble) -> Decoder:
    """The angular velocity."""
    body, q, rates = system_of(task), attitude(task, needed=False), entries(task, *_RATES)
    return lambda seen: Decoded(body, body.state(q=q(seen), omega_body=rates(seen)))


def reorient(task: Reorient) -> Decoder:
    """Pose and goal from the goals, which noise does not touch."""
    body, rates = system_of(task), entries(task, *_RATES, part="achieved_goal")
    here, there = goal_attitude(task, "achieved_goal"), goal_attitude(task, "desired_goal")
    return lambda seen: Decoded(
        body,
        body.state(q=here(seen), omega_body=rates(seen)),
        dict(zip(task.aux_names, there(seen).T, strict=True)),
    )


# What success asks of a motion, for planning.


def _turned(core: Core) -> list[Array]:
    task: Any = core.task
    y, goal = core.y, core.auxiliary(*core.task.aux_names)
    off = rotations.log(rotations.multiply(rotations.conjugate(goal), y[:, :4]))
    return [off / task.largest_angle, y[:, 4:] / task.rate_tolerance]


def _spin(sense: float) -> Callable[[Core], list[Array]]:
    """The error of the spin from the rate Omega about e2, or about -e2."""

    def errors(core: Core) -> list[Array]:
        task: Any = core.task
        goal = np.array([0.0, sense * task.spin_rate, 0.0])
        return [(core.y[:, 4:] - goal) / (task.tolerance * task.spin_rate)]

    return errors


def _axis(core: Core) -> list[Array]:
    """The angle of the spin from e2 in two directions."""
    task: Any = core.task
    omega = core.y[:, 4:]
    across = omega[:, [0, 2]]
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    angle = np.arctan2(length, omega[:, 1:2])
    return [angle / task.tolerance * across / np.maximum(length, 1e-300)]


TURNED = Conditions(("w", "x", "y", "z", *_RATES), _turned)
SPINNING, FLIPPED = Conditions(_RATES, _spin(1.0)), Conditions(_RATES, _spin(-1.0))
ALIGNED = Conditions(_RATES, _axis)
