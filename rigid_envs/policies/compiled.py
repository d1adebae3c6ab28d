"""A stored policy as compiled code: without torch, with the same bits on every processor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_envs.kernels.network import ACTIVATIONS, perceptron, relative_rotations
from rigid_envs.policies.arrays import weights_of
from rigid_envs.policies.stored import N_ROTATIONS, StoredPolicy

__all__ = ["CompiledPolicy"]


class CompiledPolicy(StoredPolicy):
    """A policy whose actions are the same to the last bit on every x86-64 processor."""

    def __init__(self, document: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
        """Lay out the weights as the compiled code takes them.

        Args:
            document: See `StoredPolicy`.
            arrays: See `StoredPolicy`.

        Raises:
            ValueError, LookupError, TypeError: They do not fit together.
        """
        super().__init__(document, arrays)
        weights = weights_of(self.arrays)
        self._sizes = np.array([weights[0].shape[1], *map(len, weights)])
        parts = [(self.arrays[f"layers.{k}.bias"], w.T.ravel()) for k, w in enumerate(weights)]
        self._weights = np.concatenate([part for pair in parts for part in pair])
        self._hidden = ACTIVATIONS.index(self.activation)
        self._last = ACTIVATIONS.index("tanh" if self.head == "squashed gaussian" else "identity")

    def predict(
        self,
        observation: NDArray[Any] | Mapping[str, NDArray[Any]],
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], Any]:
        """See `StoredPolicy`; it has no random stream, and so is always deterministic."""
        if not deterministic:
            raise ValueError("deterministic = False; expected True: it does not draw at random")
        x, alone = self._batch(observation)
        if self.attitudes is not None:
            more = np.empty((len(x), x.shape[1] + N_ROTATIONS), np.float32)
            relative_rotations(x, *self.attitudes, more)
            x = more
        out = np.empty((len(x), self._sizes[-1]))
        perceptron(x, self._weights, self._sizes, self._hidden, self._last, out)
        actions = self._actions(out)
        return (actions[0] if alone else actions), state

    def _actions(self, out: NDArray[np.float64]) -> NDArray[Any]:
        """Modes of the distributions that the outputs of the network stand for."""
        if self.head in ("categorical", "greedy"):
            return np.asarray(out.argmax(axis=1))
        low, high = self.arrays["action.low"], self.arrays["action.high"]
        actions = out if self.head == "gaussian" else low + 0.5 * (out + 1.0) * (high - low)
        return np.asarray(np.clip(actions.astype(np.float32), low, high))
