"""Reference controllers that act on observations."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from rigid_envs.base.checks import Array, ConfigError, require
from rigid_envs.base.settings import refusal
from rigid_envs.envs.lookup import checked_id, task_of
from rigid_envs.envs.spaces import action_space
from rigid_envs.mechanics import rotations
from rigid_envs.mechanics.system import System
from rigid_envs.scores.policies import Memory, Script, reference_controllers
from rigid_envs.tasks.fields import attitude_entries
from rigid_envs.tasks.registry import ENVIRONMENTS, load
from rigid_envs.tasks.task import Task

# Parts of observations by name, and what is decoded from them.

Part = Callable[[Array], Array]
"""Part of the numbers of observations, shape (N, n)."""

GoalPart = Literal["achieved_goal", "desired_goal", "observation"]
"""Part of an observation of a goal environment."""

_COLUMNS = ("R11", "R21", "R31", "R12", "R22", "R32")
_GOALS = ("achieved_goal", "desired_goal", "observation")


@dataclass(frozen=True, eq=False)
class Decoded:
    """States found in observations, as controllers read them (`rigid_envs.scores.policies.States`).

    Attributes:
        system: The physical system with the middle of each range.
        y: Physical states, shape (N, n_state); what no controller reads is at rest.
        known: Parts of the auxiliary state by name, each of shape (N,).
    """

    system: System
    y: Array
    known: Mapping[str, Array] = field(default_factory=dict)

    @property
    def systems(self) -> list[System]:
        """The physical system of every row."""
        return [self.system] * len(self.y)

    def auxiliary(self, *names: str) -> Array:
        """Parts of the auxiliary state, by name: shape (N,), or (N, k) of k > 1 names."""
        columns = [self.known[name] for name in names]
        return columns[0] if len(columns) == 1 else np.stack(columns, axis=-1)


Decoder = Callable[[Array], Decoded]
"""From the numbers of observations, shape (N, n), in the order of `Task.observations`."""


def numbers(task: Task, observation: Any) -> tuple[Array, bool]:
    """The numbers of observations in the order of `Task.observations`.

    Args:
        task: The task.
        observation: One or a batch; a dictionary of such from a goal environment.

    Returns:
        Shape (N, n), and whether it is one alone.

    Raises:
        ValueError: Another shape, a part that is missing, or a number that is not finite.
    """
    n = len(task.observations())
    if task.n_goal:
        if not isinstance(observation, Mapping) or not set(_GOALS) <= set(observation):
            raise ValueError(f"observation: expected a dictionary of {', '.join(_GOALS)}")
        observation = np.concatenate([np.asarray(observation[name]) for name in _GOALS], axis=-1)
    seen = np.asarray(observation, dtype=np.float64)
    if seen.shape[-1:] != (n,) or seen.ndim > 2 or not np.isfinite(seen).all():
        expected = f"({n},) or (N, {n}), every entry finite"
        raise ValueError(f"observation of shape {seen.shape}: expected {expected}")
    return np.atleast_2d(seen), seen.ndim == 1


def entries(task: Task, *symbols: str, part: GoalPart = "observation") -> Part:
    """Reader of entries of an observation by their symbols in `Task.features`.

    Args:
        task: The task.
        *symbols: The symbols.
        part: Of a goal environment.

    Returns:
        A function to shape (N,) for one symbol, (N, k) for k > 1.
    """
    first = task.n_goal * _GOALS.index(part)
    known = [entry.symbol for entry in task.features()]
    at = [known.index(symbol, first) for symbol in symbols]
    return lambda seen: seen[:, at[0]] if len(at) == 1 else seen[:, at]


def attitude(task: Task, needed: bool = True) -> Part:
    """Reader of the attitude q, shape (N, 4), in any representation; of one that noise has moved.

    Args:
        task: The task.
        needed: Whether it is refused that the attitude is not observed; else it is upright then.

    Raises:
        ConfigError: It is not observed.
    """
    symbols = [entry.symbol for entry in attitude_entries(task.rotation)]
    first = len(task.features())
    if not symbols:
        if needed:
            raise refusal("rotation", "none", "an attitude that is seen: 'matrix', 'quat', ...")
        return lambda seen: np.tile(rotations.identity(), (len(seen), 1))
    if task.rotation == "quat":
        return lambda seen: rotations.normalize(seen[:, first : first + 4])
    if task.rotation == "euler":
        return lambda seen: rotations.quaternion_from_euler(seen[:, first : first + 3])
    at = [first + symbols.index(symbol) for symbol in _COLUMNS]
    return lambda seen: attitude_of_columns(seen[:, at])


def goal_attitude(task: Task, part: GoalPart) -> Part:
    """Reader of the attitude q, shape (N, 4), in a goal.

    Args:
        task: The task.
        part: The goal.
    """
    columns = entries(task, *_COLUMNS, part=part)
    return lambda seen: attitude_of_columns(columns(seen))


def attitude_of_columns(columns: Array) -> Array:
    """Attitudes q, shape (N, 4), of the first two columns of R, shape (N, 6)."""
    return rotations.quaternion_from_matrix(rotations.matrix_from_rot6d(columns))


# Reference controllers as agents that act on observations.


class Reference:
    """A reference controller that acts on observations, in Stable-Baselines3's form.

    It keeps nothing of the episodes that it plays: what it needs to remember is returned, and
    passed back. So one may serve several environments.

    Attributes:
        env_id: The environment.
        env_kwargs: Its settings, of which the observations must be.
        name: Of the controller.
    """

    def __init__(self, env_id: str, name: str | None, settings: Mapping[str, Any]) -> None:
        """Find controller and decoder; see `reference`."""
        self.env_id, self.env_kwargs = checked_id(env_id), dict(settings)
        known, code = reference_controllers(self.env_id), ENVIRONMENTS[self.env_id].decoder
        if not known or not code:
            raise ConfigError(f"env_id = {env_id!r}; expected one with a controller and a decoder")
        self.name = next(iter(known)) if name is None else name
        if self.name not in known:
            raise ConfigError(f"name = {name!r}; expected one of {', '.join(map(repr, known))}")
        self._task = task_of(self.env_id, settings)
        if self._task.frame != "world":
            raise refusal("frame", self._task.frame, f"'world': {self.name} acts in that frame")
        self._controller = known[self.name](self._task)
        self._decoder = load(code)(self._task)
        self._kind = action_space(self._task).dtype

    def __repr__(self) -> str:
        """As it is made."""
        settings = "".join(f", {key}={value!r}" for key, value in self.env_kwargs.items())
        return f"rigid_envs.reference({self.env_id!r}, {self.name!r}{settings})"

    def decode(self, observation: Any) -> Decoded:
        """The states that the controller reads in observations.

        Args:
            observation: One or a batch, as `predict` takes them.

        Raises:
            ValueError: The observation has another shape, or is not finite.
        """
        found: Decoded = self._decoder(numbers(self._task, observation)[0])
        return found

    def __call__(self, observation: Any) -> npt.NDArray[Any]:
        """The action or actions alone, without memory; see `predict`."""
        return self.predict(observation)[0]

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[npt.NDArray[Any], Any]:
        """Actions for observations, in Stable-Baselines3's form.

        Args:
            observation: One observation or a batch of N, as the environment gives them; a
                dictionary of such from a goal environment.
            state: What the call before returned; None begins an episode. A controller that plans
                then plans in every step where it is left out.
            episode_start: Rows whose observation is the first of an episode, shape (N,); none, if
                left out.
            deterministic: Ignored: nothing is drawn.

        Returns:
            The action or actions, and the state for the next call.

        Raises:
            ValueError: The observation has another shape, or is not finite; the state is of
                another number of rows.
        """
        seen, alone = numbers(self._task, observation)
        states = self._decoder(seen)
        if isinstance(self._controller, Script):
            actions, state = self._act(self._controller, states, state, episode_start)
        else:
            actions = self._controller(states)
        actions = np.asarray(actions, dtype=self._kind)
        return (actions[0] if alone else actions), state

    @staticmethod
    def _act(
        script: Script, states: Decoded, state: Any, episode_start: Any
    ) -> tuple[npt.NDArray[Any], Memory]:
        n = len(states.y)
        known = state is None or (isinstance(state, Memory) and len(state.age) == n)
        expected = f"what the call before returned for the same {n} rows, or None at their begin"
        require(known, state, "state", expected)
        begins = np.zeros(n, np.bool_)
        begins |= np.asarray(episode_start, dtype=np.bool_)  # None is false
        return script.act(states, state, begins)


def reference(env_id: str, name: str | None = None, **settings: Any) -> Reference:
    """A reference controller as an agent; see `rigid_envs.reference`."""
    return Reference(env_id, name, settings)
