"""Gymnasium environments: of one row and of many, with three autoreset modes; also with goals."""

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from functools import cached_property, partial
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy import ndarray

from rigid_envs.base.checks import Array, Bools, real_numbers, require, safe_repr
from rigid_envs.base.settings import Flag, checked
from rigid_envs.engine.loops import ENDED
from rigid_envs.envs import lookup, spaces
from rigid_envs.envs.display import MODES, Shown, frames_per_second
from rigid_envs.envs.lookup import FLOAT32, INTEGERS, actions_of
from rigid_envs.mechanics.system import System
from rigid_envs.tasks.core import Core, Moment
from rigid_envs.tasks.starts import Start, start_from
from rigid_envs.tasks.task import Task

# Single environments, as Gymnasium has them, also with goals.

Observation = npt.NDArray[np.float32]

_FRESH, _RUNNING, _ENDED, _CLOSED = range(4)


class RigidEnv(Shown, gym.Env[Observation, Observation]):
    """One row of a task as a Gymnasium environment.

    Args:
        task: the task as "module:Class"; set by the registration of each id.
        render_mode: "rgb_array", "human" or None.
        width: of a picture in pixels.
        height: of a picture in pixels.
        camera: fields of `rigid_envs.watch.views.Camera` that differ from those of the task.
        **config: hyperparameters of the task; unknown keys and wrong values are refused.

    Raises:
        ConfigError: message ``config.<key>: ...``.
    """

    metadata: dict[str, Any] = {"render_modes": list(MODES)}  # noqa: RUF012 - as in gymnasium.Env

    def __init__(
        self,
        task: str,
        render_mode: str | None = None,
        width: int = 480,
        height: int = 480,
        camera: Mapping[str, Any] | None = None,
        **config: Any,
    ) -> None:
        """Check the configuration, then allocate one row."""
        self.task = lookup.new_task(task, config)
        self._set_look(render_mode, width, height, camera)
        self.metadata = {**type(self).metadata, "render_fps": frames_per_second(self.task)}
        self.action_space = spaces.action_space(self.task)
        self.observation_space = spaces.observation_space(self.task)
        self._core = Core(self.task, 1)
        self._row = np.zeros(1, dtype=np.int64)
        self._numbers, self._flags = spaces.info_numbers(self.task), spaces.info_flags(self.task)
        self._blank_info = dict.fromkeys(self._numbers, 0.0) | dict.fromkeys(self._flags, False)
        # shape of actions that need no further check than finiteness; None for discrete ones
        self._shape = None if self.task.n_choices else (len(self.task.actions()),)
        self._n_choices = self.task.n_choices
        self._status = _FRESH
        self._checked_steps = spaces.checked_steps(self.task, None)
        self._steps_left = 0  # before `_status` must be checked again
        self._keyed_by: np.random.Generator | None = None
        self._observe = self._observer()

    def __getstate__(self) -> dict[str, Any]:
        """All attributes except the display and those bound to the core."""
        bound = ("_observe", "_used_by_step")
        return {key: value for key, value in super().__getstate__().items() if key not in bound}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore attributes, and bind them to the core of the copy."""
        self.__dict__.update(state)
        self._observe = self._observer()

    @cached_property
    def _used_by_step(self) -> tuple[Any, ...]:
        """What `step` uses, together, to save attribute look-ups."""
        core = self._core
        advance = partial(core.step_into, *core.outputs)
        row = core.actions[0], self._observe, core.results[:, 0], core.flags[:, 0]
        return advance, *row, self._shape, self._blank_info, self._numbers

    def _observer(self) -> Callable[[], Any]:
        """Function that copies the observation from the outputs of the core."""
        copy: Callable[[], Observation] = self._core.observations[0].copy
        return copy

    def step(self, action: npt.ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advance by one control period.

        Args:
            action: shape (n_action,), clipped to [-1, 1] (a disk action by its norm).

        Returns:
            Observation, reward, terminated, truncated (always False: time limits are the
            wrapper's) and info.

        Raises:
            ValueError: NaN, inf or a wrong shape; the state is unchanged.
            ResetNeeded: before `reset` or after the end of the episode.
            ClosedEnvironmentError: after `close`.
            ConfigError: the episode is so long that the rates may leave the stability envelope.
        """
        if not self._steps_left:
            self._allow_step()
        self._steps_left -= 1
        advance, row_action, observe, result, flag, shape, blank, keys = self._used_by_step
        if action.__class__ is ndarray and action.dtype is FLOAT32 and action.shape == shape:
            row_action[...] = action
        elif action.__class__ in INTEGERS and 0 <= (choice := int(action)) < self._n_choices:
            row_action[0] = choice
        else:
            row_action[...] = actions_of(self.task, action, (), self._name)
        terminated = False
        info = blank.copy()
        if raised := advance():
            if raised < 0:
                actions_of(self.task, action, (), self._name)  # says which entry is not finite
            terminated, _, *flags = flag.tolist()
            for key, flag in zip(self._flags, flags):  # noqa: B905 - ends with the keys
                info[key] = flag
            if terminated:
                self._status, self._steps_left = _ENDED, 0
        numbers = result.tolist()  # the last one is the reward, which has no key
        for key, number in zip(keys, numbers):  # noqa: B905 - ends with the keys
            info[key] = number
        if self.render_mode == "human":
            self.render()
        return observe(), numbers[-1], terminated, False, info

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin a new episode.

        Args:
            seed: new random stream; None continues the present one.
            options: ``state``: physical state to start from, y or named components;
                ``params``: parameters of the system by name.

        Returns:
            Observation and info, with the keys and types that `step` gives.

        Raises:
            ValueError: unknown option, wrong state or parameter, or a start that is too fast for
                the step of the integrator; the state is unchanged.
        """
        given = lookup.options_of(options, ("state", "params"), self._name)
        start = start_from(self.task, 1, given.get("state"), given.get("params"))
        with spaces.undone_if_refused(self) if start.state else nullcontext():
            self._begin(seed, start)
        self._status, self._steps_left = _RUNNING, self._checked_steps
        if self.render_mode == "human":
            self.render()
        return self._observe(), self._blank_info.copy()

    def render(self) -> Any:
        """Picture of the present state.

        Returns:
            RGB, uint8 (height, width, 3), with ``render_mode="rgb_array"``; None with "human",
            which shows every step in a window by itself.

        Raises:
            ResetNeeded: before `reset`.
            ClosedEnvironmentError: after `close`.
            DependencyNotInstalled: the extra "render" is missing.
            ValueError: a step is to be shown in a window, and there is no display.
        """
        status = self._status
        self._refuse_without_episode("render", status == _CLOSED, status == _FRESH)
        pictures = self._pictures((0,))
        return pictures[0] if pictures is not None else None

    def moment(self) -> Moment:
        """State of the row and the results of its last step."""
        return self._core.moment(0)

    def close(self) -> None:
        """Close the window; no step is allowed before the next reset."""
        self._close_display()
        self._status, self._steps_left = _CLOSED, 0

    @property
    def system(self) -> System:
        """The physical system with the parameters of this episode."""
        return self.task.system(self._core.system_parameters(0))

    @property
    def y(self) -> Array:
        """Physical state, shape (n_state,); names and units are in ``system.state_entries``."""
        y: Array = self._core.y[0]
        return y

    def auxiliary(self, *names: str) -> Array:
        """Auxiliary state of the task (goal, counters), by name.

        Args:
            *names: some of ``task.aux_names``.

        Returns:
            Shape () for one name, (k,) for k > 1.

        Raises:
            ValueError: unknown name.
        """
        return np.asarray(self._core.auxiliary(*names)[0])

    def get_state(self) -> dict[str, Array]:
        """Complete state: physical state, parameters, goal, clock, random stream."""
        return {name: part[0] for name, part in self._core.get_state().items()}

    def set_state(self, state: Mapping[str, npt.ArrayLike]) -> None:
        """Restore the result of `get_state`; the continuation is bitwise the same.

        That of an environment which was never reset leaves one to be reset, with its own random
        stream.

        Raises:
            ValueError: not a state of this environment in this configuration, or a number that it
                cannot have; the state is unchanged.
        """
        require(isinstance(state, Mapping), state, "state", "what get_state has given")
        rows: dict[str, Any] = {name: [part] for name, part in state.items()}
        self._core.set_state(rows)
        begun, running = self._core.begun[0], self._core.running[0]
        if begun:
            self._keyed_by = self.np_random  # keep the restored random stream
        if self._status != _CLOSED:
            self._status = _RUNNING if running else _ENDED if begun else _FRESH
            self._steps_left = 0  # the next step checks the clock

    def _begin(self, seed: int | None, start: Start) -> None:
        """Seed the random stream, where that is asked for, and begin an episode."""
        super().reset(seed=spaces.python_seed(seed))
        if self.np_random is not self._keyed_by:
            self._core.seed(self._row, np.array([spaces.stream_key(self.np_random)]))
            self._keyed_by = self.np_random
        self._core.reset(self._row, start)

    def _allow_step(self) -> None:
        """Check that an episode runs, and set the number of steps until the next check.

        Raises:
            ResetNeeded, ClosedEnvironmentError: no episode is running.
            ConfigError: the rates may leave the stability envelope.
        """
        if self._status == _RUNNING:
            elapsed = int(self._core.elapsed[0])
            left = self._checked_steps - elapsed
            self._steps_left = (
                left if left > 0 else spaces.further_steps(self.task, elapsed, self._name)
            )
            return
        status = self._status
        self._refuse_without_episode("step", status == _CLOSED, status == _FRESH)
        raise ResetNeeded(f"{self._name}: step after the episode ended; call reset first")


# Vector environment with the three autoreset modes of Gymnasium.

Rows = npt.NDArray[np.int64]
Observations = npt.NDArray[np.float32]

_NO_ROWS: Rows = np.zeros(0, dtype=np.int64)


class RigidVectorEnv(Shown, VectorEnv[Observations, Observations, npt.NDArray[Any]]):
    """N rows of a task as a Gymnasium vector environment.

    Row i seeded s is bitwise the single environment seeded s + i, for any N and any number of
    threads.

    Args:
        task: the task as "module:Class"; set by the registration of each id.
        num_envs: number of rows N.
        max_episode_steps: time limit, after which a row is truncated; None for no limit.
        autoreset_mode: NEXT_STEP (default), SAME_STEP or DISABLED, as Gymnasium defines them.
        num_threads: threads that share the rows, with the same bits; more than 1 pay from about
            4000 rows on, on idle cores (not on two hardware threads of one). After a step they
            wait for the next one for about 0.1 ms, which occupies their cores, before they sleep.
        infos_on_request: steps and resets give an empty dict, and `infos` gives those of the last
            step when they are needed: to make them is a large part of a step of few rows. With
            SAME_STEP, a step in which an episode ends gives all its infos.
        render_mode: "rgb_array", "human" (one window with all of `render_rows`) or None.
        width: of a picture in pixels.
        height: of a picture in pixels.
        camera: fields of `rigid_envs.watch.views.Camera` that differ from those of the task.
        render_rows: indices of the rows of which `render` makes pictures; None for all.
        **config: hyperparameters of the task.

    Raises:
        ConfigError: message ``config.<key>: ...``.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - as in gymnasium.VectorEnv
        "render_modes": list(MODES),
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        task: str,
        num_envs: int = 1,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        num_threads: int = 1,
        infos_on_request: bool = False,
        render_mode: str | None = None,
        width: int = 480,
        height: int = 480,
        camera: Mapping[str, Any] | None = None,
        render_rows: Sequence[int] | None = None,
        **config: Any,
    ) -> None:
        """Check the configuration, then allocate the rows."""
        lookup.check_counts(num_envs, num_threads, max_episode_steps)
        self.autoreset_mode = lookup.autoreset_of(autoreset_mode)
        self._infos_on_request: bool = checked("infos_on_request", infos_on_request, Flag("infos"))
        self.task: Task = lookup.new_task(task, config)
        self._set_look(render_mode, width, height, camera)
        self.num_envs = int(num_envs)
        self._shown_rows = lookup.shown_rows(render_rows, self.num_envs)
        self.metadata = type(self).metadata | {
            "autoreset_mode": self.autoreset_mode,
            "render_fps": frames_per_second(self.task),
        }
        self.single_action_space = spaces.action_space(self.task)
        self.single_observation_space = spaces.observation_space(self.task)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._core = Core(self.task, self.num_envs, max_episode_steps, int(num_threads))
        self._rows = np.arange(self.num_envs)
        # shape of actions that need no further check than finiteness; None for discrete ones
        self._shape = None if self.task.n_choices else (self.num_envs, len(self.task.actions()))
        self._infos = spaces.Infos(self._core)
        self._ended = self._rows  # rows without a running episode
        self._keyed = False  # whether the rows have random streams
        self._fresh = True
        self._checked_steps = spaces.checked_steps(self.task, max_episode_steps)
        self._limited = max_episode_steps is not None
        self._steps_left = 0.0  # before the next check of order and clocks

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin new episodes.

        Args:
            seed: an integer s gives row i the seed s + i; or one seed (or None) for each row.
            options: ``reset_mask``: bool (N,), the rows to reset, the others stay bitwise as
                they are; ``state`` and ``params`` as in the single environment, for all reset
                rows or (with a leading axis) one for each.

        Returns:
            Observations (N, n) and infos, with the keys and types that `step` gives.

        Raises:
            ValueError: unknown option, wrong mask, seed, state or parameter, or a start that is
                too fast for the step of the integrator; no row has changed.
        """
        given = lookup.options_of(options, ("state", "params", "reset_mask"), self._name)
        rows = lookup.rows_of(given.get("reset_mask"), self.num_envs, self._name)
        start = start_from(self.task, len(rows), given.get("state"), given.get("params"))
        self._core.renew_outputs()  # the old ones are with who has made the last step
        with spaces.undone_if_refused(self) if start.state else nullcontext():
            self._seed(seed, rows)
            self._core.reset(rows, start)
        self.closed = False
        self._ended = np.setdiff1d(self._ended, rows)
        self._fresh = self._fresh and not self._core.begun.all()
        self._steps_left = 0
        if self.render_mode == "human" and not self._fresh:
            self.render()
        infos = {} if self._infos_on_request else self._infos.of_reset()
        return self._core.observations, infos

    def step(self, actions: Any) -> tuple[Observations, Array, Bools, Bools, dict[str, Any]]:
        """Advance all rows by one control period.

        Args:
            actions: shape (N, n_action).

        Returns:
            Observations, rewards, terminated, truncated and infos; the autoreset mode says what
            they hold for rows whose episode has ended.

        Raises:
            ValueError: NaN, inf or a wrong shape; no row has changed.
            ResetNeeded: before `reset`; in DISABLED mode if a row has ended and was not reset.
            ClosedEnvironmentError: after `close`.
            ConfigError: without a time limit, an episode is so long that the rates may leave the
                stability envelope.
        """
        if not self._steps_left:
            self._allow_steps()
        self._steps_left -= 1
        core = self._core
        if not (
            actions.__class__ is ndarray
            and actions.dtype is FLOAT32
            and actions.shape == self._shape
        ):
            actions = actions_of(self.task, actions, (self.num_envs,), self._name)
        core.actions[...] = actions
        results, observations, flags = outputs = core.blank_outputs()
        raised = core.step_into(results, observations, flags)
        if raised < 0:  # raises with the entry that is not finite
            actions_of(self.task, actions, (self.num_envs,), self._name)
        core.outputs = outputs
        if self._ended.size:  # in the mode NEXT_STEP: no other steps where a row has ended
            core.reset_unseen(self._ended)  # such rows are reset instead of stepped
        infos: dict[str, Any] = {}
        if self._infos_on_request:
            # a quarter of the time of unpacking
            rewards, terminated, truncated = results[-1], flags[0], flags[1]
        else:
            rewards, terminated, truncated, infos = self._infos.of_step()
        self._ended = _NO_ROWS
        if raised >= ENDED:
            ended = terminated | truncated
            self._ended = ended.nonzero()[0]
            if self.autoreset_mode is AutoresetMode.SAME_STEP:
                infos = infos or self._infos.of_step()[-1]
                self._infos.keep_final(infos, ended)
                core.reset(self._ended)
                self._ended = _NO_ROWS
            elif self.autoreset_mode is AutoresetMode.DISABLED:
                self._steps_left = 0
        if self.render_mode == "human":
            self.render()
        return observations, rewards, terminated, truncated, infos

    def infos(self) -> dict[str, Any]:
        """Infos of the last step, as it gives them without ``infos_on_request``.

        Those of rows that have begun an episode since are zero: with SAME_STEP, the step has given
        their last ones.

        Raises:
            ResetNeeded: before `reset`.
            ClosedEnvironmentError: after `close`.
        """
        self._refuse_without_episode("infos", self.closed, self._fresh)
        return self._infos.now()

    def render(self) -> Any:
        """Pictures of the rows.

        Returns:
            A tuple with an RGB picture, uint8 (height, width, 3), for each of `render_rows`, with
            ``render_mode="rgb_array"``; None with "human", which shows every step by itself.

        Raises:
            ResetNeeded: before `reset`.
            ClosedEnvironmentError: after `close`.
            DependencyNotInstalled: the extra "render" is missing.
            ValueError: a step is to be shown in a window, and there is no display.
        """
        self._refuse_without_episode("render", self.closed, self._fresh)
        return self._pictures(self._shown_rows)

    def call(self, name: Any) -> tuple[Any, ...]:
        """One value for each row, as Gymnasium's vectors of single environments give it.

        Args:
            name: "render", for its pictures, or None for each row where it makes none; or an
                attribute, which all rows share.

        Raises:
            AttributeError: no such attribute, or another method: those here act on all rows.
        """
        if isinstance(name, str):
            value = self.render() if name == "render" else getattr(self, name)
        if not isinstance(name, str) or callable(value):
            given = safe_repr(name)
            raise AttributeError(f"{self._name}: call({given}); expected 'render' or an attribute")
        return value if name == "render" and value is not None else (value,) * self.num_envs

    def moment(self, row: int) -> Moment:
        """State of a row and the results of its last step.

        Raises:
            ValueError: not the index of a row.
        """
        return self._core.moment(lookup.row_of(row, self.num_envs, self._name))

    def close_extras(self, **_: Any) -> None:
        """Close the window; no step is allowed before the next reset."""
        self._close_display()
        self._steps_left = 0

    @property
    def systems(self) -> list[System]:
        """The physical system of every row, with the parameters of its episode."""
        return [self.task.system(self._core.system_parameters(row)) for row in range(self.num_envs)]

    @property
    def y(self) -> Array:
        """Physical states, shape (N, n_state)."""
        return self._core.y

    def auxiliary(self, *names: str) -> Array:
        """Auxiliary state of the task (goal, counters), by name.

        Args:
            *names: some of ``task.aux_names``.

        Returns:
            Shape (N,) for one name, (N, k) for k > 1.

        Raises:
            ValueError: unknown name.
        """
        return self._core.auxiliary(*names)

    def in_frame(self, actions: npt.ArrayLike) -> Array:
        """Actions as they are to be given for actions in the frame of the task, shape (N, m).

        The same in the frame of the world; in the reduced frame turned into it, in every row by its
        state of now. So a controller that acts in the world can act, or teach, in reduced rows.

        Args:
            actions: In the frame of the task, within its limits, shape (N, m).
        """
        return self._core.in_frame(actions)

    def get_state(self) -> dict[str, Array]:
        """Complete state, each part of shape (N, k)."""
        return self._core.get_state()

    def set_state(self, state: Mapping[str, npt.ArrayLike]) -> None:
        """Restore the result of `get_state`; the continuation is bitwise the same.

        Rows that were never reset are to be reset, with their own random streams.

        Raises:
            ValueError: not a state of this environment in this configuration, or a number that it
                cannot have; the state is unchanged.
        """
        self._core.renew_outputs()  # the old ones are with who has made the last step
        self._core.set_state(state)
        self._ended = np.flatnonzero(~self._core.running)
        self._fresh = not self._core.begun.all()
        self._keyed = self._keyed or not self._fresh
        self._steps_left = 0

    def _allow_steps(self) -> None:
        """Check that all rows have an episode, and set the number of steps until the next check.

        Raises:
            ResetNeeded, ClosedEnvironmentError: no step is allowed.
            ConfigError: without a time limit, the rates may leave the stability envelope.
        """
        self._refuse_without_episode("step", self.closed, self._fresh)
        if self.autoreset_mode is not AutoresetMode.NEXT_STEP and self._ended.size:
            raise ResetNeeded(
                f"{self._name}: row {self._ended[0]} has ended; in {self.autoreset_mode.name} mode "
                "reset it first, with options={'reset_mask': ...}"
            )
        if self._limited:
            self._steps_left = math.inf
            return
        elapsed = int(self._core.elapsed.max())
        left = self._checked_steps - elapsed
        self._steps_left = (
            left if left > 0 else spaces.further_steps(self.task, elapsed, self._name)
        )

    def _seed(self, seed: int | Sequence[int | None] | None, rows: Rows) -> None:
        """Set the random stream of each row, from its seed or else from entropy."""
        seeds = spaces.seeds_of(seed, self.num_envs, self._name)
        if isinstance(seed, int | np.integer):
            super().reset(seed=int(seed))
        if not self._keyed:
            keys = self.np_random.integers(0, 2**64, self.num_envs, dtype=np.uint64)
            fresh = np.flatnonzero(~self._core.begun)  # the others have been restored
            self._core.seed(fresh, keys[fresh])
            self._keyed = True
        seeded = [(row, spaces.seeded_key(s)) for row in rows if (s := seeds[row]) is not None]
        if seeded:
            where, keys_of_rows = zip(*seeded, strict=True)
            self._core.seed(np.array(where), np.array(keys_of_rows))


# Goal environments: dictionary observations, and rewards that can be recomputed.
#
# The interface of Gymnasium-Robotics and of hindsight experience replay: `observation`,
# `achieved_goal`, `desired_goal`, and ``compute_reward(achieved, desired, info)``, bit for bit the
# reward of `step`. The episode does not end at the goal: staying there has the largest reward.

Part = npt.NDArray[np.float32]


class _Goals:
    """Functions of achieved and desired goals, single or in batches."""

    task: Task

    def compute_reward(self, achieved_goal: Any, desired_goal: Any, info: Any) -> Any:
        """Reward of a step that leads to the achieved goal; float64.

        Args:
            achieved_goal: shape (..., n_goal).
            desired_goal: shape (..., n_goal).
            info: not used.

        Raises:
            ValueError: no real numbers, or wrong shapes.
        """
        reward = self.task.goal_reward(achieved_goal, desired_goal)
        return reward if np.ndim(reward) else float(reward)

    def compute_terminated(self, achieved_goal: Any, desired_goal: Any, info: Any) -> Any:
        """False everywhere; so is `compute_truncated`, for time limits are the wrapper's."""
        shape = real_numbers(achieved_goal, "achieved_goal").shape[:-1]
        return np.zeros(shape, dtype=np.bool_) if shape else False

    compute_truncated = compute_terminated


class RigidGoalEnv(_Goals, RigidEnv):
    """One row of a goal task; arguments and errors as `RigidEnv`."""

    def _observer(self) -> Callable[[], Any]:
        parts = spaces.goal_parts(self._core.observations[0], self.task.n_goal)
        return partial(_copies, *parts.values())


class RigidGoalVectorEnv(_Goals, RigidVectorEnv):
    """N rows of a goal task; arguments and errors as `RigidVectorEnv`."""

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """One control period of all rows; see `RigidVectorEnv.step`."""
        flat, rewards, terminated, truncated, infos = super().step(actions)
        if "final_obs" in infos:
            infos["final_obs"] = spaces.goal_parts(infos["final_obs"], self.task.n_goal)
        return spaces.goal_parts(flat, self.task.n_goal), rewards, terminated, truncated, infos

    def reset(self, **arguments: Any) -> tuple[Any, dict[str, Any]]:
        """Begin new episodes; see `RigidVectorEnv.reset`."""
        flat, infos = super().reset(**arguments)
        return spaces.goal_parts(flat, self.task.n_goal), infos


def _copies(observation: Part, achieved: Part, desired: Part) -> dict[str, Part]:
    """Faster than views of one copy: a slice takes longer than a copy of so few numbers."""
    return {
        "observation": observation.copy(),
        "achieved_goal": achieved.copy(),
        "desired_goal": desired.copy(),
    }
