"""Single environments, as Gymnasium has them, also with goals."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import nullcontext
from functools import cached_property, partial
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.error import ResetNeeded
from numpy import ndarray

from rigid_envs.base.checks import Array, require
from rigid_envs.envs.display import MODES, Shown, frames_per_second
from rigid_envs.envs.lookup import FLOAT32, INTEGERS, actions_of, new_task, options_of
from rigid_envs.envs.spaces import (
    action_space,
    checked_steps,
    further_steps,
    info_flags,
    info_numbers,
    observation_space,
    python_seed,
    stream_key,
    undone_if_refused,
)
from rigid_envs.mechanics.system import System
from rigid_envs.tasks.core import Core, Moment
from rigid_envs.tasks.starts import Start, start_from

Observation = npt.NDArray[np.float32]

_FRESH, _RUNNING, _ENDED, _CLOSED = range(4)


class RigidEnv(Shown, gym.Env[Observation, Observation]):
    """One row of a task as a Gymnasium environment.

    Args:
        task: the task as "module:Class"; set by the registration of each id.
        render_mode: "rgb_array", "human" or None.
        width: of a picture in pixels.
        height: of a picture in pixels.
        camera: fields of `rigid_envs.watch.scene.Camera` that differ from those of the task.
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
        self.task = new_task(task, config)
        self._set_look(render_mode, width, height, camera)
        self.metadata = {**type(self).metadata, "render_fps": frames_per_second(self.task)}
        self.action_space = action_space(self.task)
        self.observation_space = observation_space(self.task)
        self._core = Core(self.task, 1)
        self._row = np.zeros(1, dtype=np.int64)
        self._numbers, self._flags = info_numbers(self.task), info_flags(self.task)
        self._blank_info = dict.fromkeys(self._numbers, 0.0) | dict.fromkeys(self._flags, False)
        # shape of actions that need no further check than finiteness; None for discrete ones
        self._shape = None if self.task.n_choices else (len(self.task.actions()),)
        self._n_choices = self.task.n_choices
        self._status = _FRESH
        self._checked_steps = checked_steps(self.task, None)
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
        given = options_of(options, ("state", "params"), self._name)
        start = start_from(self.task, 1, given.get("state"), given.get("params"))
        with undone_if_refused(self) if start.state else nullcontext():
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
        super().reset(seed=python_seed(seed))
        if self.np_random is not self._keyed_by:
            self._core.seed(self._row, np.array([stream_key(self.np_random)]))
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
            self._steps_left = left if left > 0 else further_steps(self.task, elapsed, self._name)
            return
        status = self._status
        self._refuse_without_episode("step", status == _CLOSED, status == _FRESH)
        raise ResetNeeded(f"{self._name}: step after the episode ended; call reset first")
