"""Reference controllers as agents that act on observations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.catalogue import checked_id, task_of
from rigid_envs.envs.task_spaces import action_space
from rigid_envs.errors import ConfigError
from rigid_envs.references.decoding import Decoded, numbers
from rigid_envs.registry import ENVIRONMENTS, load
from rigid_envs.scores.controllers import reference_controllers
from rigid_envs.scores.scripts import Memory, Script
from rigid_envs.settings import refusal

__all__ = ["Reference", "reference"]


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
        if state is not None and not (isinstance(state, Memory) and len(state.age) == n):
            raise ValueError(
                f"state = {state!r:.100}; expected what the call before returned for the same "
                f"{n} rows, or None where an episode begins"
            )
        begins = np.zeros(n, np.bool_)
        begins |= np.asarray(episode_start, dtype=np.bool_)  # None is false
        return script.act(states, state, begins)


def reference(env_id: str, name: str | None = None, **settings: Any) -> Reference:
    """A reference controller as an agent; see `rigid_envs.reference`."""
    return Reference(env_id, name, settings)
