"""Controllers bound to the tasks of a ball with inertia, what they observe, and bounds."""

import bisect
from collections.abc import Mapping
from typing import Any

import numpy as np

from rigid_envs.base.checks import Array, Singles
from rigid_envs.control.planning import Conditions, Model
from rigid_envs.control.planning.model import Tracking, steps_held
from rigid_envs.control.predictive import PredictiveControl, doubling
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.scores.best import TheoreticalLimit, _rows, least_time
from rigid_envs.scores.policies import (
    PREDICTION_PERIOD,
    Controller,
    Rows,
    Script,
    States,
    feedback,
    predicting,
    system_of,
)
from rigid_envs.scores.references import Decoded, Decoder, attitude, entries
from rigid_envs.systems.dynamic_ball.controllers import (
    HeldBall,
    PlateRegulator,
    PushAlong,
    TiltPlan,
    TiltTransfer,
)
from rigid_envs.systems.dynamic_ball.tasks.ball_park_dynamic import BallParkDynamic
from rigid_envs.systems.dynamic_ball.tasks.ball_plate import BallPlate
from rigid_envs.systems.rolling_ball.references import _PLACE, _POSE, _pose, _roll, straight_rolls
from rigid_envs.tasks.core import Core

# Theoretical limits of metrics: optima and bounds from each start, in closed form.


def _push(envs: RigidVectorEnv) -> Array:
    """Least time [s] to push a ball along the length of `_roll`, with its inertia."""
    task: Any = envs.task
    inertia = _rows(envs, "m") * (1.0 + _rows(envs, "beta"))
    return least_time(_roll(envs), task.force / inertia, task.speed_tolerance)


PUSHED_BALL_TIME = TheoreticalLimit(
    "bound", "$2 sqrt(length (1 + beta) m / F)$, less the tolerances", _push
)


# Controllers for the tasks of a ball; of drawn mass and inertia they know the middle.


def pushed(task: BallParkDynamic) -> Controller:
    """Three straight rolls, each from rest to rest, tracked by feedback."""
    ball = system_of(task)
    controller, parts = PushAlong(ball, task.force, task.dt), ball.components

    def plan(states: States, rows: Rows) -> Array:
        y = states.y[rows]  # a velocity that it has, or seems to have by noise, is fed back later
        start = ball.state(q=y[:, parts["q"]], position=y[:, parts["position"]])
        found = controller.plan(start, straight_rolls(task, states, rows))
        return np.concatenate([found.pushes, found.positions[:-1], found.velocities[:-1]], axis=-1)

    return Script(plan, lambda states, due: controller(states.y, *np.split(due, 3, axis=-1)))


def plate_regulator(task: BallPlate) -> Controller:
    """Linear-quadratic regulator of the ball by the tilt of the table."""
    return feedback(PlateRegulator(system_of(task), task.tilt_rate, task.dt), "point_X", "point_Y")


# Predictive controllers; of drawn parameters they know the middle. They need CasADi.


def held_ball(task: BallPlate) -> Controller:
    """Least distance over a horizon of 32 control periods."""
    problem = HeldBall(system_of(task), task.tilt_rate, task.tilt_limit, task.dt)
    controller = PredictiveControl(problem, doubling(task.dt, 4, 8, 3))
    return predicting(
        controller, task.dt, PREDICTION_PERIOD, lambda envs: envs.auxiliary("point_X", "point_Y")
    )


# Decoders of the tasks of a ball: position, attitude, and what they are to become.
#
# Positions in radii are those of a ball of the middle radius: of what a controller makes of them,
# actions that are fractions of the largest, a radius that is drawn cancels.


def ball_park_dynamic(task: BallParkDynamic) -> Decoder:
    """Position, attitude and velocity; the ball does not spin about the vertical."""
    ball = system_of(task)
    q, place = attitude(task), entries(task, *_PLACE)
    velocity = entries(task, "VX / radius", "VY / radius")
    return lambda seen: Decoded(
        ball,
        ball.state(
            q=q(seen), position=ball.radius * place(seen), velocity=ball.radius * velocity(seen)
        ),
    )


def ball_plate(task: BallPlate) -> Decoder:
    """Ball, table, and the commanded point."""
    ball = system_of(task)
    q, place = attitude(task, needed=False), entries(task, "X", "Y")
    offset, velocity = entries(task, "X - X*", "Y - Y*"), entries(task, "VX", "VY")
    spin, tilt = entries(task, "spin"), entries(task, "alpha_x / limit", "alpha_y / limit")
    rate = entries(task, "alpha_x' / limit", "alpha_y' / limit")

    def decode(seen: Array) -> Decoded:
        y = ball.state(
            q=q(seen),
            position=place(seen),
            velocity=velocity(seen),
            spin=spin(seen),
            tilt=task.tilt_limit * tilt(seen),
            tilt_rate=task.tilt_rate * rate(seen),
        )
        point = place(seen) - offset(seen)
        return Decoded(ball, y, {"point_X": point[:, 0], "point_Y": point[:, 1]})

    return decode


# What success asks of a motion, for planning.


def _stopped(core: Core) -> list[Array]:
    task: Any = core.task
    y = core.y
    return [*_pose(y, None, task), y[:, 6:8] / task.speed_tolerance]


def _held(core: Core) -> list[Array]:
    task: Any = core.task
    return [(core.y[:, 4:6] - core.auxiliary("point_X", "point_Y")) / task.tolerance]


STOPPED = Conditions((*_POSE, "VX", "VY"), _stopped)
_TABLE = ("spin", "alpha_x", "alpha_y", "rate_x", "rate_y")
HELD = Conditions(("X", "Y", "VX", "VY", *_TABLE), _held, n_parts=6)


# Plans of least time.

_N_ROUNDS = 8  # linearisations for a deadline
_HOPELESS = 1.02  # error of a linear programme with which a deadline is given up


class _TiltSearch:
    """A plan of one row that leads to the point by earlier and earlier deadlines."""

    def __init__(self, task: BallPlate, model: Model, start: Array, point: Array) -> None:
        self._model, n = model, model.n_steps
        self._start, self._point = start, point
        regulator = PlateRegulator(system_of(task), task.tilt_rate, task.dt)
        self._transfer = TiltTransfer(
            regulator, task.tilt_limit, task.tolerance, steps_held(task), task.n_substeps
        )
        gain = np.insert(regulator.regulator.gain, 4, 0.0, axis=1)  # none of the spin
        self._gains = np.broadcast_to(-gain / task.tilt_rate, (n, 1, 2, 9))
        self._rates, self._steps = np.zeros((n, 2)), self._transfer.level(n)
        self._distances = np.full(n + 1, np.inf)
        self._actions = np.zeros((n, 2), np.float32)

    def soonest(self) -> Singles:
        """Actions, shape (T, 2)."""
        last = self._model.n_steps - self._transfer.periods(0)
        deadline = 1
        while deadline < last and not self._linear(deadline):
            deadline *= 2
        late = range(deadline // 2 + 1, min(deadline, last))
        deadline = late.start + bisect.bisect_left(late, True, key=self._linear)
        if self._meets(deadline):
            found = self._actions
            while deadline > 1 and self._meets(deadline - 1):
                found, deadline = self._actions, deadline - 1
            return found
        while deadline < last and not self._meets(deadline):
            deadline += 1
        return self._actions

    def _linear(self, deadline: int) -> bool:
        """Whether a deadline can be met near rest on the level table."""
        plan = self._plan(deadline, np.inf)
        return plan is not None and plan.error < 1.0

    def _plan(self, deadline: int, reach: float) -> TiltPlan | None:
        place = (self._start, self._point, deadline)
        return self._transfer.plan(*place, self._steps, self._rates, reach)

    def _meets(self, deadline: int) -> bool:
        """Whether a deadline is met after some linearisations."""
        reach = widest = 2.0 * self._transfer.regulator.tilt_rate
        for k in range(_N_ROUNDS):
            if self._distances[deadline:].max() < 1.0:
                return True
            plan = self._plan(deadline, reach)
            if plan is None or (k > 1 and plan.error > _HOPELESS):
                return False
            better = self._roll(deadline, plan)
            reach = min(2.0 * reach, widest) if better else 0.3 * reach
        return bool(self._distances[deadline:].max() < 1.0)

    def _roll(self, deadline: int, plan: TiltPlan) -> bool:
        """Roll a plan out, with feedback, and take it over if it is better."""
        n, T = self._model.n_steps, len(plan.rates)
        actions, targets = np.zeros((n, 1, 2)), np.zeros((n + 1, 1, 9))
        actions[:T, 0] = plan.rates / self._transfer.regulator.tilt_rate
        targets[: T + 1, 0] = plan.x
        targets[T + 1 :, 0, :2] = plan.x[-1, :2]  # where it rests: a way back begins outwards
        motion = self._model.roll(actions, Tracking(self._gains, targets))
        x = self._model.coordinates(motion.y[:, 0])
        distances = np.linalg.norm(x[:, :2] - self._point, axis=1) / self._transfer.tolerance
        if distances[deadline:].max() >= self._distances[deadline:].max():
            return False
        self._actions, self._distances = motion.actions[:, 0], distances
        self._steps, self._rates = self._transfer.along(x), x[1:, 7:]
        return True


def held_soon(task: BallPlate, state: Mapping[str, Array]) -> Singles:
    """Plans from rows at their starts, shape (T, n, 2)."""
    model = Model(task, state, task.registered_steps(), "time")
    starts = model.coordinates(state["y"])
    points = state["aux"][:, [task.aux_names.index(name) for name in ("point_X", "point_Y")]]
    plans = [
        _TiltSearch(task, model.part(np.array([row])), starts[row], points[row]).soonest()
        for row in range(model.n_rows)
    ]
    return np.stack(plans, axis=1)
