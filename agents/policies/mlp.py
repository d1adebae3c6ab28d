"""Policy of a multilayer perceptron: observation to action."""

# Not SB3's own policy: this one runs without SB3, and a file of today under any version of it.

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from .activations import ACTIVATIONS
from .heads import HEADS, linear
from .relative_rotation import RelativeRotation

__all__ = ["Policy"]

_LAYER_LIMIT = 64


class Policy:
    """A multilayer perceptron from observations to actions.

    Its actions are those of the SB3 model that it was exported from, bit by bit: the same
    operations of torch and NumPy in the same order.

    Attributes:
        document: JSON values: `algo`, `env_id`, `env_kwargs`, `network`, `spaces`, ...
        arrays: `layers.<k>.weight`, `layers.<k>.bias`; what the head of the network needs (see
            `heads`); if observations are normalised `observation.mean`, `observation.var`.
    """

    def __init__(self, document: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Build the network.

        Args:
            document: See the attributes.
            arrays: See the attributes.

        Raises:
            ValueError, LookupError, TypeError: They do not fit together.
        """
        self.document = dict(document)
        self.arrays = {key: np.array(value) for key, value in arrays.items()}
        network = document["network"]
        head, activation = HEADS[network["distribution"]], ACTIVATIONS[network["activation"]]
        weights = _weights(self.arrays)
        self._n_obs, n_hidden, n_out = weights[0].shape[1], weights[-1].shape[1], len(weights[-1])
        first = _rotation_layer(network.get("attitudes"), self._n_obs)
        self._n_obs -= RelativeRotation.n_more * len(first)
        self._inputs = _inputs(network.get("inputs"), self._n_obs)
        self._normalized = bool(network["normalized"])
        if self._normalized:
            self._clip, self._epsilon = float(network["clip"]), float(network["epsilon"])
        _check(self.arrays, head.needs(n_hidden, n_out), self._n_obs if self._normalized else None)
        self._body = nn.Sequential(*first, *_body(self.arrays, len(weights) - 1, activation))
        self._head = head(linear(self.arrays, f"layers.{len(weights) - 1}"), self.arrays)

    def predict(
        self,
        observation: NDArray[Any] | Mapping[str, NDArray[Any]],
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
        generator: torch.Generator | None = None,
    ) -> tuple[NDArray[Any], Any]:
        """Actions for observations, in SB3's form.

        Args:
            observation: One observation (n,) or a batch (N, n), as the environment gives them; a
                dictionary of such from a goal environment.
            state: Returned as it is; the network is not recurrent.
            episode_start: Ignored, for the same reason.
            deterministic: The mode of the distribution, or else a sample.
            generator: Random stream of the sample; None is torch's global one, as in SB3.

        Returns:
            The action or actions, and `state`.

        Raises:
            ValueError: The observation has another shape, or is not finite.
        """
        obs = self._flat(observation)
        if obs.shape[-1:] != (self._n_obs,) or obs.ndim > 2 or not np.isfinite(obs).all():
            raise ValueError(
                f"observation of shape {obs.shape}: expected ({self._n_obs},) or "
                f"(N, {self._n_obs}), every entry finite"
            )
        batch = torch.as_tensor(self._normalize(np.atleast_2d(obs)))
        with torch.no_grad():
            actions = self._head.act(self._body(batch), deterministic, generator)
        return (actions if obs.ndim == 2 else actions.squeeze(axis=0)), state

    def _flat(self, observation: NDArray[Any] | Mapping[str, NDArray[Any]]) -> NDArray[Any]:
        """The parts of an observation side by side, in the order that the network takes them."""
        if self._inputs is None:
            return np.asarray(observation)
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


def _inputs(value: Any, n_obs: int) -> list[tuple[str, int]] | None:
    """Names and sizes of the parts of an observation; None if it is one array."""
    if value is None:
        return None
    inputs = [(str(name), int(size)) for name, size in value]
    if sum(size for _, size in inputs) != n_obs:
        raise ValueError(f"inputs = {inputs}; expected {n_obs} numbers in all, as layers.0 takes")
    return inputs


def _rotation_layer(places: Any, n_inputs: int) -> list[RelativeRotation]:
    """The layer of relative rotation before those that take so many inputs, if there is one."""
    if places is None:
        return []
    achieved, desired = places
    if not all(
        type(at) is int and 0 <= at <= n_inputs - RelativeRotation.n_more - 9 for at in places
    ):
        raise ValueError(
            f"attitudes = {places}; expected where matrices are in the input of layers.0"
        )
    return [RelativeRotation(achieved, desired)]


def _weights(arrays: Mapping[str, NDArray[Any]]) -> list[NDArray[np.float32]]:
    """The matrices of the layers, each checked to take what the one before gives."""
    count = sum(name.startswith("layers.") and name.endswith(".weight") for name in arrays)
    if not 1 <= count <= _LAYER_LIMIT:
        raise ValueError(f"expected 1 to {_LAYER_LIMIT} layers, found {count}")
    weights = [arrays[f"layers.{k}.weight"] for k in range(count)]
    for k, weight in enumerate(weights):
        bias = arrays[f"layers.{k}.bias"]
        if {weight.dtype, bias.dtype} != {np.dtype(np.float32)} or weight.ndim != 2:
            raise ValueError(f"layers.{k}: expected a matrix and a vector of float32")
        if k and weight.shape[1] != len(weights[k - 1]):
            raise ValueError(
                f"layers.{k}.weight has shape {weight.shape}; expected (..., {len(weights[k - 1])})"
            )
    return weights


def _check(
    arrays: Mapping[str, NDArray[Any]], needs: Mapping[str, tuple[int, ...]], n_normal: int | None
) -> None:
    """Refuse an array, other than those of the layers, that is missing, misshapen or unused."""
    wanted = {name: ("float32", shape) for name, shape in needs.items()}
    if n_normal is not None:
        for name in ("observation.mean", "observation.var"):
            wanted[name] = ("float64", (n_normal,))
    found = {k: (str(a.dtype), a.shape) for k, a in arrays.items() if not k.startswith("layers.")}
    for name in sorted(wanted.keys() | found.keys()):
        if wanted.get(name) != found.get(name):
            raise ValueError(f"{name}: expected {wanted.get(name)}, found {found.get(name)}")


def _body(
    arrays: Mapping[str, NDArray[Any]], count: int, activation: type[nn.Module]
) -> list[nn.Module]:
    """All layers but the last."""
    pairs = [(linear(arrays, f"layers.{k}"), activation()) for k in range(count)]
    return [module for pair in pairs for module in pair]
