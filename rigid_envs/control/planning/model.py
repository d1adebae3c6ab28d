"""Limits of actions, conditions of success, and plans that are rolled out and linearised."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, Bools, Integers
from rigid_envs.control.linear import clip_to_ball, clip_to_box
from rigid_envs.engine.episode import clip_to_disk
from rigid_envs.engine.layout import FLAGS
from rigid_envs.tasks.core import Core
from rigid_envs.tasks.registry import ENVIRONMENTS, load
from rigid_envs.tasks.task import Task

# Actions within their limits, and the proximal map of what they cost.

_RIM = 1.0 - 1e-6  # length of an action at the limit, but for rounding to float32
_N_HALVINGS = 45  # of where the length of an action at a side of the box may lie


class Limits(NamedTuple):
    """Limits of an action of m components, and those that its cost counts.

    Attributes:
        disk: Whether its length is limited to 1, rather than each component.
        counted: Which components the cost, a multiple of their joint length, counts, shape (m,).
    """

    disk: bool
    counted: Bools

    def clip(self, a: Array) -> Array:
        """The nearest actions within the limits, shape (..., m)."""
        return clip_to_ball(a) if self.disk else clip_to_box(a)

    def length(self, a: Array) -> Array:
        """Length of the components that count, shape (...)."""
        return np.asarray(np.linalg.norm(a * self.counted, axis=-1))

    def free(self, a: Array, slope: Array) -> tuple[Array, Array]:
        """Directions in which actions can follow a descent, and how the limits curve there.

        Args:
            a: Actions within the limits, shape (N, m).
            slope: Derivative of what is minimised, shape (N, m).

        Returns:
            The projector onto the directions along the limits that the descent would leave, shape
            (N, m, m), and the Lagrange multiplier over the radius, shape (N,): a step v along a
            circle ends inside it by ``v^2 / 2``, and costs so much times that.
        """
        if not self.disk:
            left = (np.abs(a) >= 1.0) & (a * slope < 0.0)
            return np.eye(a.shape[1]) * ~left[:, None], np.zeros(len(a))
        length = np.linalg.norm(a, axis=1)
        out = a / np.maximum(length, _RIM)[:, None]
        price = np.where(length >= _RIM, np.maximum(-np.sum(out * slope, axis=1), 0.0), 0.0)
        across = out[:, :, None] * out[:, None, :] * (price > 0.0)[:, None, None]
        return np.eye(a.shape[1]) - across, price

    def shrink(self, z: Array, threshold: Array) -> tuple[Array, Array]:
        """The v within the limits with the least ``threshold |v| + |v - z|^2 / 2``, and dv/dz.

        Args:
            z: Shape (..., m).
            threshold: Shape (...).

        Returns:
            v, shape (..., m), and its derivative, shape (..., m, m).
        """
        length = self.length(z)
        kept = np.maximum(length - threshold, 0.0) / np.maximum(length, 1e-300)
        v = np.where(self.counted, kept[..., None] * z, z)
        if self.disk:
            return self._on_disk(z, v, kept, length)
        slope = self._slope(z, kept, length)
        over = np.abs(v).max(axis=-1) > 1.0
        if over.any():
            v[over], slope[over] = self._in_box(z[over], threshold[over])
        return v, slope

    def _slope(self, z: Array, kept: Array, length: Array) -> Array:
        """Derivative where no limit is reached: kept I + (1 - kept) z z^T / |z|^2."""
        unit = self.counted * z / np.maximum(length, 1e-300)[..., None]
        across = unit[..., :, None] * unit[..., None, :]
        inner = kept[..., None, None] * np.diag(1.0 * self.counted)
        inner = inner + ((1.0 - kept) * (kept > 0.0))[..., None, None] * across
        return np.asarray(inner + np.diag(1.0 * ~self.counted))

    def _on_disk(self, z: Array, v: Array, kept: Array, length: Array) -> tuple[Array, Array]:
        slope = self._slope(z, kept, length)
        over = kept * length > 1.0
        if over.any():
            unit = z[over] / length[over][..., None]
            v[over] = unit
            across = np.eye(z.shape[-1]) - unit[..., :, None] * unit[..., None, :]
            slope[over] = across / length[over][..., None, None]
        return v, slope

    def _in_box(self, z: Array, threshold: Array) -> tuple[Array, Array]:
        """Where a side of the box is reached: the length is a fixed point, found by bisection."""
        low, high = np.zeros(len(z)), np.full(len(z), np.sqrt(z.shape[1]))
        for _ in range(_N_HALVINGS):
            length = 0.5 * (low + high)
            kept = np.where(self.counted, (length / (length + threshold))[..., None], 1.0)
            v = np.clip(z * kept, -1.0, 1.0)
            more = self.length(v) > length
            low, high = np.where(more, length, low), np.where(more, high, length)
        free = np.abs(z * kept) < 1.0
        unit = self.counted * v / length[..., None]
        curved = np.diag(1.0 * self.counted) - unit[..., :, None] * unit[..., None, :]
        hessian = np.eye(z.shape[-1]) + (threshold / length)[..., None, None] * curved
        both = free[..., :, None] & free[..., None, :]
        inverse = np.linalg.inv(np.where(both, hessian, np.eye(z.shape[-1])))
        return v, np.where(both, inverse, 0.0)


# What success asks of a motion: errors, each a vector, that must stay within their tolerances.
#
# A norm alone would not do: its derivative knows one direction only.

_ROUNDING_OF_TIME = 1e-9  # of times, in control periods


@dataclass(frozen=True)
class Conditions:
    """Conditions of success of a task.

    Attributes:
        components: Of the state, those that the conditions depend on, now or later.
        errors: Function of rows that have just stepped to their errors, each over its tolerance,
            of shapes (N, q): a step counts as success where no norm is above 1.
        coordinates: Function of these components, shape (N, n), to as few numbers as the conditions
            need, shape (N, p); by default the components themselves.
        n_parts: Parts of the time of success whose largest errors are looked at. An error that
            grows is looked at in few places: its derivatives are much the same in all of them.
    """

    components: tuple[str, ...]
    errors: Callable[[Core], list[Array]]
    coordinates: Callable[[Array], Array] = np.asarray
    n_parts: int = 1


def conditions_of(task: Task) -> Conditions:
    """The conditions of a task, which the registry names.

    Raises:
        ValueError: None are declared.
    """
    kind = type(task)
    for record in ENVIRONMENTS.values():
        if record.conditions and record.task.endswith(f":{kind.__name__}"):
            if load(record.task) is kind:
                found: Conditions = load(record.conditions)
                return found
    raise ValueError(f"task = {kind.__name__}; expected one of an id whose record has conditions")


def first_steps(core: Core, n_steps: int) -> Integers:
    """Number of the first step from which on conditions must hold, shape (N,), of rows at a start.

    Args:
        core: The rows.
        n_steps: Number of steps of a plan, the last of which is the last that must hold.
    """
    task: Any = core.task
    if "time_left" in task.aux_names:
        left = core.auxiliary("time_left") / task.dt
        return np.asarray(np.ceil(left - _ROUNDING_OF_TIME), dtype=np.int64)
    return np.full(core.n_rows, n_steps - steps_held(task) + 1)


def steps_held(task: Task) -> int:
    """Number of steps in succession that make a success."""
    return max(1, round(float(getattr(task, "hold", 0.0)) / task.dt))


Counts = Literal["cost", "time", "error"]
"""What of a plan is to be small."""


# Plans rolled out, and every step of them linearised, by the compiled step of the environment.

_TOGETHER = 2**14  # copies of rows that are stepped at once
_SMALL = 1e-7  # change of a state for a difference quotient
_COARSE = 2.0**-10  # the same of an action, which is float32
_GRID = 2.0**14  # actions that track are multiples of its inverse, so that files of plans are small
_ROUNDING = 1e-12  # keeps a matrix of such quotients regular


class Motion(NamedTuple):
    """Plans of N rows, and what came of them.

    Attributes:
        actions: As they were applied, float32, shape (T, N, m).
        y: States before each step and at the end, shape (T + 1, N, n).
        clocks: Clocks and auxiliary states then, side by side, shape (T + 1, N, k).
        errors: Of the conditions after each step, over the tolerances, shape (T, N, q).
        costs: What counts, see `Model`, shape (N,).
        successes: Whether the last step before the end was a success, shape (N,).
    """

    actions: npt.NDArray[np.float32]
    y: Array
    clocks: Array
    errors: Array
    costs: Array
    successes: Bools


class Linear(NamedTuple):
    """Steps linearised in the n coordinates that matter and in the m actions.

    Attributes:
        A: Of the next coordinates by the coordinates, shape (T, N, n, n).
        B: By the actions, shape (T, N, n, m).
        Ey: Of the errors after the step by the coordinates before, shape (T, N, q, n).
        Ea: By the actions, shape (T, N, q, m).
    """

    A: Array
    B: Array
    Ey: Array
    Ea: Array


class Tracking(NamedTuple):
    """Feedback of a rollout: gains, shape (T, N, m, n), of the distance from `targets`.

    Attributes:
        gains: Of each step.
        targets: Coordinates before each step, shape (T, N, n).
    """

    gains: Array
    targets: Array


class Model:
    """N rows of a task at given starts, for plans of T actions.

    Attributes:
        task: The task.
        n_steps: T.
        n_actions: Components m of an action.
        limits: Of the actions.
        weights: Cost of a unit of action in a step, shape (N,).
        first: Number of the step from which on the conditions must hold, shape (N,).
        index: Places of the components that matter in the state.
        groups: Places of the entries of each error beside one another.
        conditions: What success asks of a plan of the task.
    """

    def __init__(
        self,
        task: Task,
        state: Mapping[str, Array],
        n_steps: int,
        counts: Counts = "cost",
    ) -> None:
        """Make room.

        Args:
            task: The task.
            state: Of rows at their starts, as `Core.get_state` gives it.
            n_steps: T.
            counts: What is to be small: the costs of the environment, the time until the first
                step of a success that stays, or the root mean square of the errors. Actions are
                free but for costs.
        """
        self.task, self.n_steps, self.counts = task, n_steps, counts
        self._state = {key: np.array(part) for key, part in state.items()}
        n_clock, n_aux = self._state["clock"].shape[1], len(task.aux_names)
        self._columns = {"clock": slice(0, n_clock)}
        if n_aux:
            self._columns["aux"] = slice(n_clock, n_clock + n_aux)
        self.conditions: Conditions = conditions_of(task)
        fields = type(task).episode.dynamics.State._fields
        self.index = np.array([fields.index(name) for name in self.conditions.components])
        self._core = Core(task, len(self._state["y"]))
        self.n_actions = self._core.actions.shape[1]
        self._copies: Core | None = None
        self._core.set_state(self._state)
        self.first = first_steps(self._core, n_steps)
        if counts == "error":
            self.first = np.ones_like(self.first)
        sizes = [each.shape[-1] for each in self.conditions.errors(self._core)]
        self.groups = tuple(np.split(np.arange(sum(sizes)), np.cumsum(sizes)[:-1]))
        each = self._unit_costs()
        disk = type(task).episode.clip is clip_to_disk
        self.limits = Limits(disk, each.max(axis=1) > 0.0)
        self.weights = (1.0 if counts == "cost" else 0.0) * each.max(axis=0)

    @property
    def n_rows(self) -> int:
        """N."""
        return self._core.n_rows

    def part(self, rows: Integers) -> Model:
        """A model of some of the rows."""
        part = self.ending(rows, self.n_steps)
        part.first, part.weights = self.first[rows], self.weights[rows]
        return part

    def ending(self, rows: Integers, n_steps: int) -> Model:
        """A model of some of the rows, whose plans have so many actions."""
        state = {key: each[rows] for key, each in self._state.items()}
        return Model(self.task, state, n_steps, self.counts)

    def roll(self, plan: Array, tracking: Tracking | None = None) -> Motion:
        """Roll plans out.

        Args:
            plan: Actions, shape (T, N, m).
            tracking: What is added to them where the motion leaves what was expected.
        """
        core = self._core
        core.set_state(self._state)
        y = np.empty((self.n_steps + 1, *self._state["y"].shape))
        actions = np.empty((self.n_steps, core.n_rows, self.n_actions), dtype=np.float32)
        errors: list[Array] = []
        clocks = [self._clocks(core)]
        costs: Array = np.zeros(core.n_rows)
        successes, ended = np.zeros((2, core.n_rows), dtype=bool)
        failed = np.zeros(core.n_rows, dtype=np.int64)
        y[0] = core.y
        for t in range(self.n_steps):
            action = plan[t]
            if tracking is not None:
                off = self.coordinates(y[t]) - tracking.targets[t]
                action = action + (tracking.gains[t] @ off[..., None])[..., 0]
                action = np.round(_GRID * action) / _GRID
            actions[t] = self.limits.clip(action)
            core.actions[...] = actions[t]
            core.step()
            flags = core.flags
            won = flags[FLAGS.is_success]
            costs += np.where(ended, 0.0, core.results[0])
            successes = np.where(ended, successes, won)
            failed[~ended & ~won] = t + 1
            ended |= flags[FLAGS.terminated]
            y[t + 1] = core.y
            clocks.append(self._clocks(core))
            errors.append(self._errors(core))
        if self.counts == "time":
            first = failed + 2 - steps_held(self.task)
            costs = np.asarray(self.task.dt * first, dtype=np.float64)
        elif self.counts == "error":
            costs = np.sqrt(np.mean(np.sum(np.square(errors), axis=-1), axis=0))
        return Motion(actions, y, np.stack(clocks), np.stack(errors), costs, successes)

    def linearise(self, motion: Motion) -> Linear:
        """Linearise the steps of a motion, by differences of copies of the rows."""
        T, rows, m, q = self.n_steps, self.n_rows, self.n_actions, motion.errors.shape[2]
        x = self.path(motion)
        n, n_y = x.shape[2], len(self.index)
        sizes = ((n, n), (n, m), (q, n), (q, m))
        linear = Linear(*(np.zeros((T, rows, *size)) for size in sizes))
        together = min(T, max(1, _TOGETHER // (rows * (n_y + m))))
        for begin in np.minimum(np.arange(0, T, together), T - together):
            steps = slice(begin, begin + together)
            before, after, shown = self._differences(motion, x, steps)
            square = before.swapaxes(1, 2) @ before + _ROUNDING * np.eye(n)
            back = np.linalg.solve(square, before.swapaxes(1, 2)).swapaxes(1, 2)
            found = (
                *(after[:, :n_y].swapaxes(1, 2) @ back, after[:, n_y:].swapaxes(1, 2)),
                *(shown[:, :n_y].swapaxes(1, 2) @ back, shown[:, n_y:].swapaxes(1, 2)),
            )
            for whole, part in zip(linear, found, strict=True):
                whole[steps] = part.reshape(whole[steps].shape)
        return linear

    def _differences(self, motion: Motion, x: Array, steps: slice) -> tuple[Array, Array, Array]:
        """Difference quotients of some steps, of all rows in one step after those in another.

        An action is changed towards 0: so it stays within its limits. Auxiliary states change with
        time alone, as a goal does that moves.

        Args:
            motion: The motion.
            x: Its coordinates, shape (T + 1, N, n).
            steps: Which.

        Returns:
            Of the coordinates before a step by each component of the state, of those after it, and
            of the errors, by each component and each action.
        """
        n_y, m = len(self.index), self.n_actions
        d = n_y + m
        old = motion.actions[steps].reshape(-1, m)
        component, entry = np.arange(n_y), np.arange(m)
        y = motion.y[steps].reshape(len(old), 1, -1).repeat(d, axis=1)
        y[:, component, self.index] += _SMALL
        a = old[:, None].repeat(d, axis=1)
        a[:, n_y + entry, entry] = old - np.copysign(_COARSE, old)
        size = np.full((len(old), d, 1), _SMALL)
        size[:, n_y:, 0] = a[:, n_y + entry, entry].astype(np.float64) - old
        if self._copies is None:
            self._copies = Core(self.task, len(old) * d)
        n_steps = len(old) // self.n_rows
        state = {
            k: np.tile(part, (n_steps, 1)).repeat(d, axis=0) for k, part in self._state.items()
        }
        state["y"] = y.reshape(len(old) * d, -1)
        clocks = motion.clocks[steps].reshape(len(old), -1)
        for key, columns in self._columns.items():
            state[key] = clocks[:, columns].repeat(d, axis=0)
        copies = self._copies
        copies.set_state(state)
        start = copies.y  # attitudes are of length 1
        copies.actions[...] = a.reshape(len(old) * d, m)
        copies.step()
        now, then = (part.reshape(len(old), -1) for part in (x[steps], x[1:][steps]))
        before = self._quotients(start, now, size)[:, :n_y]
        errors = motion.errors[steps].reshape(len(old), 1, -1)
        shown = (self._errors(copies).reshape(len(old), d, -1) - errors) / size
        return before, self._quotients(copies.y, then, size), shown

    def _clocks(self, core: Core) -> Array:
        state = core.get_state()
        return np.concatenate([state[key] for key in self._columns], axis=1)

    def _errors(self, core: Core) -> Array:
        """Errors of rows that have just stepped, side by side, shape (N, q)."""
        return np.concatenate(self.conditions.errors(core), axis=-1)

    def coordinates(self, y: Array) -> Array:
        """The coordinates that matter of states, shape (N, n)."""
        return self.conditions.coordinates(y[:, self.index])

    def path(self, motion: Motion) -> Array:
        """The coordinates of a motion before each step and at the end, shape (T + 1, N, n)."""
        rows = self.coordinates(motion.y.reshape(-1, motion.y.shape[2]))
        return rows.reshape(*motion.y.shape[:2], -1)

    def _quotients(self, y: Array, x: Array, size: Array) -> Array:
        """Changes of the coordinates from x (N, n) in d copies of each row, over a size."""
        moved = self.coordinates(y).reshape(*size.shape[:2], -1)
        return np.asarray((moved - x[:, None]) / size)

    def _unit_costs(self) -> Array:
        """Cost of a step with each component of the action alone at 1, shape (m, N)."""
        costs = []
        for unit in np.eye(self.n_actions):
            self._core.set_state(self._state)
            self._core.actions[...] = unit
            self._core.step()
            costs.append(self._core.results[0].copy())
        return np.array(costs)


def tracking_gains(linear: Linear, weight: float = 1.0) -> Array:
    """Gains of the linear-quadratic regulator along a motion, shape (T, N, m, n).

    Args:
        linear: The motion's steps.
        weight: Of the squares of the components, beside those of the actions.
    """
    A, B = linear.A, linear.B
    n, m = B.shape[2:]
    gains = np.empty((len(A), A.shape[1], m, n))
    P = weight * np.eye(n)
    for t in range(len(A) - 1, -1, -1):
        right = B[t].swapaxes(1, 2) @ P
        gains[t] = -np.linalg.solve(np.eye(m) + right @ B[t], right @ A[t])
        P = weight * np.eye(n) + A[t].swapaxes(1, 2) @ P @ (A[t] + B[t] @ gains[t])
    return gains
