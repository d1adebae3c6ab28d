"""Definition of a task: functions of one row, compiled into step and reset."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np

from rigid_envs.engine import publication as goals
from rigid_envs.engine.algebra import Contact, Row
from rigid_envs.engine.compiler import kernel, scalar
from rigid_envs.engine.dynamics import Dynamics, check_compiled, check_derive
from rigid_envs.engine.elementary import clamp
from rigid_envs.engine.layout import Prototypes, Slots, slots_of
from rigid_envs.engine.loops import Functions, Reset, Step, reset_rows, step_rows
from rigid_envs.engine.publication import NOISE_AND_DELAY, UNDISTURBED, Array, Disturbances
from rigid_envs.engine.returns import Returns
from rigid_envs.engine.rows import prototype

# Clipping of actions to the action space.

# a float32 vector that was scaled to length 1 may have this squared length at most
_ROUNDED_UNIT = 1.0 + 2.0**-22


@scalar
def clip(a: float) -> float:
    """Clip one component to [-1, 1]."""
    return clamp(a, -1.0, 1.0)


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

Function = Callable[..., Any]
_STREAM = (np.uint64(0),) * 3  # an example of `randoms.Stream`


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

    y is the state, u the input and p the parameters of the system; aux is the auxiliary state,
    which a task keeps from step to step (goal, counters); c are its constants. All are read by
    name: ``y.X / p.radius``, ``c.position_tolerance``.

    Attributes:
        dynamics: the physical system.
        Action: `NamedTuple` of the action, each entry in [-1, 1].
        Terms: `NamedTuple` of the reward terms, unweighted.
        Constants: `NamedTuple` of numbers that the functions use; each is an attribute of the task.
        Auxiliary: `NamedTuple` of the auxiliary state; its defaults are used after a physics error.
        start: ``start(stream, p, c) -> (y, aux)``, the first state of an episode.
        clip: ``clip(action) -> (action, clipped)``, an action clipped to its space.
        actuate: ``actuate(action, y, aux, p, c) -> (y, u)``, the state, changed at once or
            unchanged, and the input that is held over the step.
        outcome: ``outcome(y, u, aux, p, c, dt) -> (aux, terms, cost, success, terminated)``, the
            result of the step.
        observe: ``observe(y, aux, p, c) -> features``, the observation without the attitude.
        Frame: `NamedTuple` of the frame.
        frame_of: ``frame_of(y, aux, p, c) -> frame``, in which the next action is given.
        turn: ``turn(action, frame) -> action``, from this frame to that of `actuate`; by default
            actions are given in that one.
        disturbances: noise and delay between agent and body; by default none.
        advance: one step of the integrator, by default that of the system.
        contact: contact with the ground, by default that of the system.
        derive: parameters from the physical ones, by default that of the system.
        Goal: `NamedTuple` of a goal, in a goal task.
        judge: ``judge(achieved, desired, c) -> (terms, reached)``, in a goal task: what `outcome`
            makes its terms and success of.

    Raises:
        TypeError: a function that is not compiled, or a `derive` that does not take the physical
            parameters of the system.
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
        """Check the arguments of `derive`, and the functions."""
        if self.derive is not None:
            check_derive(self.derive, self.dynamics.Parameters, len(self.dynamics.raw_names))
        check_compiled(self)

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

    @cached_property
    def slots(self) -> Slots:
        """Memory slots of a row."""
        return slots_of(self.prototypes)

    @property
    def ground(self) -> Contact:
        """Contact with the ground."""
        return self.contact or self.dynamics.contact

    @cached_property
    def functions(self) -> Functions:
        """Compiled functions and rows, as the loops take them."""
        system, ground = self.dynamics, self.ground
        return Functions(
            advance=self.advance or system.step,
            restore=system.restore,
            stages=system.weights,
            rate=system.rate,
            derive=self.derive or system.derive,
            start=self.start,
            clip=self.clip,
            turn=self.turn,
            actuate=self.actuate,
            outcome=self.outcome,
            force=ground.force,
            grip=ground.grip,
            slips=ground.slips,
            observe=self.observe,
            frame_of=self.frame_of,
            disturb_actions=self.disturbances.of_actions,
            disturb_observations=self.disturbances.of_observations,
            prototypes=self.prototypes,
        )

    @cached_property
    def step(self) -> Step:
        """Compiled loop of a step: see `step_rows`."""
        f, (y, u, p, _, aux, frame, a, terms, _, c) = self.functions, self.prototypes
        results = aux, terms, 1.0, True, True
        returns = (
            Returns("clip", f.clip, (a,), (a, True)),
            Returns("turn", f.turn, (tuple(a), frame), a),
            Returns("actuate", f.actuate, (a, y, aux, p, c), (y, u)),
            Returns("step", f.advance, (y, u, p, 1.0), y),
            Returns("restore", f.restore, (y,), y),
            Returns("force", f.force, (y, u, p), (1.0,) * self.ground.n_force),
            Returns("rate", f.rate, (y, p), 1.0),
            Returns("outcome", f.outcome, (y, u, aux, p, c, 1.0), results),
            Returns("frame_of", f.frame_of, (y, aux, p, c), frame),
        )
        return self._kernel(step_rows(f), returns, *f)

    @cached_property
    def reset(self) -> Reset:
        """Compiled loop of a reset: see `reset_rows`."""
        f, (y, _, p, raw, aux, frame, _, _, _, c) = self.functions, self.prototypes
        returns = (
            Returns("derive", f.derive, raw, p),
            Returns("start", f.start, (_STREAM, p, c), (y, aux)),
            Returns("rate", f.rate, (y, p), 1.0),
            Returns("frame_of", f.frame_of, (y, aux, p, c), frame),
        )
        return self._kernel(reset_rows(f), returns, *f)

    @cached_property
    def reward(self) -> Callable[[Array, Array, Array, Array, Array], None]:
        """Compiled ``reward(achieved, desired, weights, constants, out)`` of a goal task."""
        judge: Any = self.judge
        goal, rows = prototype(self.Goal), self.prototypes

        def reward(
            achieved: Array, desired: Array, weights: Array, constants: Array, out: Array
        ) -> None:
            goals.reward_rows(judge, goal, rows, achieved, desired, weights, constants, out)

        returns = Returns("judge", judge, (goal, goal, rows.constants), (rows.terms, True))
        return self._kernel(reward, (returns,), judge, self.Goal)

    def _kernel(self, loop: Function, returns: Iterable[Returns], *functions: Any) -> Function:
        label = f"{self.outcome.__module__}.{loop.__name__}"
        rows = (self.Action, self.Terms, self.Constants, self.Auxiliary, self.Frame)
        parts = (*functions, *rows, *self.dynamics.parts, self.prototypes)
        checks = [each.check for each in returns]
        return kernel(loop, label, parts, allocates=False, checks=checks)


@cache
def with_noise_and_delay(episode: Episode) -> Episode:
    """The same episodes with noise and delay; made and compiled once."""
    return replace(episode, disturbances=NOISE_AND_DELAY)
