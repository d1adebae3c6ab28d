"""A policy as its file holds it: a multilayer perceptron with its document, checked."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_envs.catalogue import SEEN, id_in_file
from rigid_envs.checks import printable
from rigid_envs.kernels.network import ACTIVATIONS
from rigid_envs.policies.arrays import HEADS, check_others, weights_of

__all__ = ["N_ROTATIONS", "StoredPolicy"]

N_ROTATIONS = 18
"""Numbers that a layer of relative rotations adds to its inputs."""

_SHOWN = ("algo", "env_kwargs", "versions", "git_commit", "kernel_hash")


class StoredPolicy(abc.ABC):
    """A multilayer perceptron from observations to actions.

    Attributes:
        document: JSON values: `algo`, `env_id`, `env_kwargs`, `seed`, `timesteps`, `network`,
            `spaces`, `versions`, `git_commit`, ...
        env_id: The environment that it was trained on, as it is registered.
        arrays: `layers.<k>.weight`, `layers.<k>.bias`; what the head of the network needs; if
            observations are normalised `observation.mean`, `observation.var`.
        n_obs: Numbers of an observation.
        activation: Activation of the hidden layers.
        head: Distribution of the actions.
        attitudes: Where two matrices are in an observation, whose relative rotations the first
            layer takes too; None if it does not.
    """

    def __init__(self, document: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Check what a file holds.

        Args:
            document: See the attributes.
            arrays: See the attributes.

        Raises:
            ValueError, LookupError, TypeError: They do not fit together.
        """
        self.document = dict(document)
        self.env_id = id_in_file(document["env_id"])
        for name in _SHOWN:
            printable(document.get(name), name)
        self.arrays = {key: np.array(value) for key, value in arrays.items()}
        if bad := [name for name, array in self.arrays.items() if not np.isfinite(array).all()]:
            raise ValueError(f"{bad[0]} is not finite")
        network = document["network"]
        self.activation = _one_of(ACTIVATIONS[1:], network["activation"], "activation")
        self.head = _one_of(HEADS, network["distribution"], "distribution")
        weights = weights_of(self.arrays)
        self.attitudes = _attitudes(network.get("attitudes"), weights[0].shape[1])
        self.n_obs = weights[0].shape[1] - (0 if self.attitudes is None else N_ROTATIONS)
        self._inputs = _inputs(network.get("inputs"), self.n_obs)
        self._normalized = bool(network["normalized"])
        if self._normalized:
            self._clip, self._epsilon = float(network["clip"]), float(network["epsilon"])
        last: tuple[int, int] = weights[-1].shape
        check_others(self.arrays, self.head, last, self.n_obs if self._normalized else None)

    @property
    def env_kwargs(self) -> dict[str, Any]:
        """Settings of an environment that it sees what it was trained to see in.

        What rewards and randomises a task is none of them: an evaluation has that of the id.
        """
        return {key: value for key, value in self.document["env_kwargs"].items() if key in SEEN}

    @property
    def name(self) -> str:
        """Who acts: the algorithm, and the frame if it is not that of the world."""
        frame = self.env_kwargs.get("frame", "world")
        return str(self.document["algo"]) + ("" if frame == "world" else f" {frame}")

    @abc.abstractmethod
    def predict(
        self,
        observation: NDArray[Any] | Mapping[str, NDArray[Any]],
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], Any]:
        """Actions for observations, in SB3's form.

        Args:
            observation: One observation (n,) or a batch (N, n), as the environment gives them; a
                dictionary of such from a goal environment, of which a policy of another one reads
                the part `observation`.
            state: Returned as it is; the network is not recurrent.
            episode_start: Ignored, for the same reason.
            deterministic: The mode of the distribution, or else a sample.

        Returns:
            The action or actions, and `state`.

        Raises:
            ValueError: The observation has another shape, or is not finite.
        """

    def _batch(
        self, observation: NDArray[Any] | Mapping[str, NDArray[Any]]
    ) -> tuple[NDArray[np.float32], bool]:
        """What the network takes of observations, shape (N, n), and whether it is one alone."""
        obs = self._flat(observation)
        if obs.shape[-1:] != (self.n_obs,) or obs.ndim > 2 or not np.isfinite(obs).all():
            raise ValueError(
                f"observation of shape {obs.shape}: expected ({self.n_obs},) or "
                f"(N, {self.n_obs}), every entry finite"
            )
        alone = obs.ndim == 1
        return self._normalize(obs[None] if alone else obs), alone

    def _flat(self, observation: NDArray[Any] | Mapping[str, NDArray[Any]]) -> NDArray[Any]:
        """The parts of an observation side by side, in the order that the network takes them."""
        if self._inputs is None:
            # in the reduced frame this part of a goal task says where the goal is, too
            alone = isinstance(observation, Mapping) and "observation" in observation
            return np.asarray(observation["observation"] if alone else observation)
        names = [name for name, _ in self._inputs]
        if not isinstance(observation, Mapping) or not set(names) <= set(observation):
            raise ValueError(f"observation: expected a dictionary of {', '.join(names)}")
        parts = [np.asarray(observation[name]) for name in names]
        for (name, size), part in zip(self._inputs, parts, strict=True):
            if part.shape[-1:] != (size,):
                raise ValueError(f"observation[{name!r}]: shape {part.shape}, expected {size} last")
        return np.concatenate(parts, axis=-1)

    def _normalize(self, obs: NDArray[Any]) -> NDArray[np.float32]:
        if self._normalized:
            mean, var = self.arrays["observation.mean"], self.arrays["observation.var"]
            obs = np.clip((obs - mean) / np.sqrt(var + self._epsilon), -self._clip, self._clip)
        return obs.astype(np.float32)


def _one_of(known: tuple[str, ...], name: Any, what: str) -> str:
    if name not in known:
        raise ValueError(f"{what} = {name!r}; expected one of {', '.join(known)}")
    return str(name)


def _inputs(value: Any, n_obs: int) -> list[tuple[str, int]] | None:
    """Names and sizes of the parts of an observation; None if it is one array."""
    if value is None:
        return None
    inputs = [(str(name), int(size)) for name, size in value]
    if sum(size for _, size in inputs) != n_obs:
        raise ValueError(f"inputs = {inputs}; expected {n_obs} numbers in all, as layers.0 takes")
    return inputs


def _attitudes(places: Any, n_inputs: int) -> tuple[int, int] | None:
    """Indices of two matrices in an observation, within the inputs of the first layer."""
    if places is None:
        return None
    achieved, desired = places
    if not all(type(at) is int and 0 <= at <= n_inputs - N_ROTATIONS - 9 for at in places):
        raise ValueError(
            f"attitudes = {places}; expected where matrices are in the input of layers.0"
        )
    return achieved, desired
