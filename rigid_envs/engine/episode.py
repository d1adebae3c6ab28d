"""Definition of a task: functions of one row, compiled into step and reset."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np

from rigid_envs.engine import loops as reset_loop
from rigid_envs.engine import loops as step_loop
from rigid_envs.engine import publication as goals
from rigid_envs.engine.algebra import Contact, Row
from rigid_envs.engine.compiler import kernel, scalar
from rigid_envs.engine.dynamics import Dynamics, check_derive
from rigid_envs.engine.layout import Prototypes
from rigid_envs.engine.publication import NOISE_AND_DELAY, UNDISTURBED, Array, Disturbances
from rigid_envs.engine.rows import prototype

# Clipping of actions to the action space.

# a float32 vector that was scaled to length 1 may have this squared length at most
_ROUNDED_UNIT = 1.0 + 2.0**-22


@scalar
def clip(a: float) -> float:
    """Clip one component to [-1, 1]."""
    return min(max(a, -1.0), 1.0)


@scalar
def clip_to_interval(action: Row) -> tuple[Row, bool]:
    """Clip a single component to [-1, 1]; also whether it was outside."""
    x = clip(action[0])
    return (x,), x != action[0]


@scalar
def clip_to_square(action: Row) -> tuple[Row, bool]:
    """Clip two components, each to [-1, 1]."""
    x, y = clip(action[0]), clip(action[1])
    return (x, y), (x != action[0]) | (y != action[1])


@scalar
def clip_to_box(action: Row) -> tuple[Row, bool]:
    """Clip three components, each to [-1, 1]."""
    a, b, c = action
    x, y, z = clip(a), clip(b), clip(c)
    return (x, y, z), (x != a) | (y != b) | (z != c)


@scalar
def clip_to_disk(action: Row) -> tuple[Row, bool]:
    """Clip two components to the unit disk; the direction is kept.

    The result is rounded to float32, so that clipping it again changes nothing.
    """
    x, y = action
    scale, outside = shrink(x * x + y * y)
    return (single(x * scale), single(y * scale)), outside


@scalar
def clip_to_ball(action: Row) -> tuple[Row, bool]:
    """Clip three components to the unit ball, as `clip_to_disk`."""
    x, y, z = action
    scale, outside = shrink(x * x + y * y + z * z)
    return (single(x * scale), single(y * scale), single(z * scale)), outside


@scalar
def keep(action: Row) -> tuple[Row, bool]:
    """Discrete action, unchanged: it has been checked already."""
    return action, False


@scalar
def as_given(action: Row, frame: Row) -> Row:
    """The action itself, where it is given in the frame of the task."""
    return action


@scalar
def no_frame(y: Any, aux: Any, p: Any, c: Any) -> tuple[()]:
    """Nothing: actions are given in the frame of the task."""
    return ()


@scalar
def shrink(square: float) -> tuple[float, bool]:
    """Scale factor to norm 1 for a squared norm above 1, else 1; also whether it was above 1."""
    outside = square > _ROUNDED_UNIT
    return (1.0 / math.sqrt(square) if outside else 1.0), outside


@scalar
def single(x: float) -> float:
    """The nearest float32, as a double: what is computed with it must not be rounded to float32."""
    return np.float64(np.float32(x))


# Definition of a task over a system: functions of one row, compiled into step and reset.
#
# ============================================================  ====================================
# ``start(stream, p, c) -> (y, aux)``                           first state of an episode
# ``clip(action) -> (action, clipped)``                         action clipped to its space
# ``frame_of(y, aux, p, c) -> frame``                           frame in which the next action is
# given ``turn(action, frame) -> action``                             action turned from this frame
# to that of `actuate` ``actuate(action, y, aux, p, c) -> (y, u)``                   state, changed
# at once or unchanged, and the input held over the step ``outcome(y, u, aux, p, c, dt)
# result of the step -> (aux, terms, cost, success, terminated)`` ``observe(y, aux, p, c) ->
# features``                         observation without the attitude
# ============================================================  ====================================
#
# y is the state, u the input and p the parameters of the system; aux is the auxiliary state, which
# a task keeps from step to step (goal, counters); c are its constants. All are read by name: ``y.X
# / p.radius``, ``c.position_tolerance``.

Function = Callable[..., Any]


class NoAuxiliary(NamedTuple):
    """Empty auxiliary state."""


class NoConstants(NamedTuple):
    """Empty row of constants."""


class NoFrame(NamedTuple):
    """Empty frame, where actions are given in that of the task."""


class NoGoal(NamedTuple):
    """Empty goal, of a task without goals."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Episode:
    """Functions and rows of a task; `step`, `reset` and `reward` are compiled on first use.

    Attributes:
        dynamics: the physical system.
        Action: `NamedTuple` of the action, each entry in [-1, 1].
        Terms: `NamedTuple` of the reward terms, unweighted.
        Constants: `NamedTuple` of numbers that the functions use; each is an attribute of the task.
        Auxiliary: `NamedTuple` of the auxiliary state; its defaults are used after a physics error.
        start, clip, actuate, outcome, observe: see the table of the module.
        Frame: `NamedTuple` of the frame.
        frame_of, turn: see the table; by default actions are given in the frame of `actuate`.
        disturbances: noise and delay between agent and body; by default none.
        advance: one step of the integrator, by default that of the system.
        contact: contact with the ground, by default that of the system.
        derive: parameters from the physical ones, by default that of the system.
        Goal: `NamedTuple` of a goal, in a goal task.
        judge: ``judge(achieved, desired, c) -> (terms, reached)``, in a goal task: what `outcome`
            makes its terms and success of.

    Raises:
        TypeError: `derive` does not take the physical parameters of the system.
    """

    dynamics: Dynamics
    Action: type[Any]
    Terms: type[Any]
    start: Function
    clip: Function
    actuate: Function
    outcome: Function
    observe: Function
    Frame: type[Any] = NoFrame
    frame_of: Function = no_frame
    turn: Function = as_given
    disturbances: Disturbances = UNDISTURBED
    Constants: type[Any] = NoConstants
    Auxiliary: type[Any] = NoAuxiliary
    advance: Function | None = None
    contact: Contact | None = None
    derive: Function | None = None
    Goal: type[Any] = NoGoal
    judge: Function | None = None

    def __post_init__(self) -> None:
        """Check the arguments of `derive`."""
        if self.derive is not None:
            check_derive(self.derive, self.dynamics.Parameters, len(self.dynamics.raw_names))

    @cached_property
    def prototypes(self) -> Prototypes:
        """Prototype rows, for which the loops are compiled."""
        state, inputs, parameters = self.dynamics.prototypes
        return Prototypes(
            state=state,
            inputs=inputs,
            parameters=parameters,
            raw=(1.0,) * len(self.dynamics.raw_names),
            aux=prototype(self.Auxiliary),
            frame=prototype(self.Frame),
            action=prototype(self.Action),
            terms=prototype(self.Terms),
            grip=(1.0,) * len(self.ground.names),
            constants=prototype(self.Constants),
        )

    @property
    def ground(self) -> Contact:
        """Contact with the ground."""
        return self.contact or self.dynamics.contact

    @cached_property
    def step(self) -> step_loop.Step:
        """Compiled loop of a step: see `step_loop.step_rows`."""
        advance, restore = self.advance or self.dynamics.step, self.dynamics.restore
        stages, prototypes = self.dynamics.weights, self.prototypes
        clip, turn, actuate = self.clip, self.turn, self.actuate
        outcome, rate = self.outcome, self.dynamics.rate
        force, grip, slips, *_ = self.ground
        functions = (
            *(clip, turn, actuate, outcome, force, grip, slips, rate),
            *(self.observe, self.frame_of),
            *self.disturbances,
        )
        step = step_loop.step_rows(advance, restore, stages, *functions, prototypes)
        return self._kernel(step, advance, restore, *functions)

    @cached_property
    def reset(self) -> reset_loop.Reset:
        """Compiled loop of a reset: see `reset_loop.reset_rows`."""
        derive, start = self.derive or self.dynamics.derive, self.start
        rate, observe, frame_of = self.dynamics.rate, self.observe, self.frame_of
        functions = (derive, start, rate, observe, frame_of, self.disturbances.of_observations)
        reset = reset_loop.reset_rows(*functions, self.prototypes)
        return self._kernel(reset, *functions)

    @cached_property
    def reward(self) -> Callable[[Array, Array, Array, Array, Array], None]:
        """Compiled ``reward(achieved, desired, weights, constants, out)`` of a goal task."""
        judge: Any = self.judge
        goal, rows = prototype(self.Goal), self.prototypes

        def reward(
            achieved: Array, desired: Array, weights: Array, constants: Array, out: Array
        ) -> None:
            goals.reward_rows(judge, goal, rows, achieved, desired, weights, constants, out)

        return self._kernel(reward, judge, self.Goal)

    def _kernel(self, loop: Function, *functions: Any) -> Function:
        label = f"{self.outcome.__module__}.{loop.__name__}"
        rows = (self.Action, self.Terms, self.Constants, self.Auxiliary, self.Frame)
        return kernel(loop, label, (*functions, *rows, *self.dynamics.parts, self.prototypes))


@cache
def with_noise_and_delay(episode: Episode) -> Episode:
    """The same episodes with noise and delay; made and compiled once."""
    return replace(episode, disturbances=NOISE_AND_DELAY)
