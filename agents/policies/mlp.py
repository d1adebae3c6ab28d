"""Policy of a multilayer perceptron in torch: observation to action."""

# Not SB3's own policy: this one runs without SB3, and a file of today under any version of it.

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch
from numpy.typing import NDArray
from torch import nn

from rigid_envs.policies import StoredPolicy
from rigid_envs.policies.layers import ACTIVATIONS, RelativeRotation

from .heads import HEADS, linear

__all__ = ["Policy"]


class Policy(StoredPolicy):
    """A multilayer perceptron from observations to actions, in torch.

    Its actions are those of the SB3 model that it was exported from, bit by bit: the same
    operations of torch and NumPy in the same order.
    """

    def __init__(self, document: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Build the network.

        Args:
            document: See `StoredPolicy`.
            arrays: See `StoredPolicy`.

        Raises:
            ValueError, LookupError, TypeError: They do not fit together.
        """
        super().__init__(document, arrays)
        first = [] if self.attitudes is None else [RelativeRotation(*self.attitudes)]
        n_hidden = sum(name.endswith(".weight") for name in self.arrays if "layers." in name) - 1
        self._body = nn.Sequential(*first, *self._layers(n_hidden))
        self._act = HEADS[self.head](linear(self.arrays, f"layers.{n_hidden}"), self.arrays).act

    def predict(
        self,
        observation: NDArray[Any] | Mapping[str, NDArray[Any]],
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
        generator: torch.Generator | None = None,
    ) -> tuple[NDArray[Any], Any]:
        """See `StoredPolicy`.

        Args:
            observation: See `StoredPolicy`.
            state: See `StoredPolicy`.
            episode_start: See `StoredPolicy`.
            deterministic: See `StoredPolicy`.
            generator: Random stream of the sample; None is torch's global one, as in SB3.

        Returns:
            The action or actions, and `state`.

        Raises:
            ValueError: The observation has another shape, or is not finite.
        """
        x, alone = self._batch(observation)
        with torch.no_grad():
            actions = self._act(self._body(torch.as_tensor(x)), deterministic, generator)
        return (actions.squeeze(axis=0) if alone else actions), state

    def _layers(self, count: int) -> list[nn.Module]:
        """The hidden layers."""
        kind = ACTIVATIONS[self.activation]
        pairs = [(linear(self.arrays, f"layers.{k}"), kind()) for k in range(count)]
        return [module for pair in pairs for module in pair]
