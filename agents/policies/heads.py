"""Action heads: last layer and action distribution, with the bits of SB3."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

__all__ = ["HEADS", "Head", "linear"]

Arrays = Mapping[str, NDArray[Any]]
_LOG_STD = (-20.0, 2.0)  # bounds of SB3's squashed Gaussian


class Head(Protocol):
    """Last layer of a network and its action distribution."""

    def __init__(self, last: nn.Linear, arrays: Arrays) -> None:
        """Take the last layer, and arrays of the head's own: see `rigid_envs.policies.arrays`."""

    def act(
        self, hidden: Tensor, deterministic: bool, generator: torch.Generator | None
    ) -> NDArray[Any]:
        """Actions.

        Args:
            hidden: Last hidden layer, shape (N, n_hidden).
            deterministic: The mode of the distribution, or else a sample.
            generator: Random stream of the sample; None is torch's global one.
        """


class Gaussian:
    """Gaussian of state-independent standard deviation, clipped to the action bounds (PPO)."""

    def __init__(self, last: nn.Linear, arrays: Arrays) -> None:
        """See `Head`."""
        self._mean, self._log_std = last, torch.from_numpy(arrays["log_std"])
        self._low, self._high = arrays["action.low"], arrays["action.high"]

    def act(
        self, hidden: Tensor, deterministic: bool, generator: torch.Generator | None
    ) -> NDArray[Any]:
        """See `Head`."""
        actions = self._mean(hidden)
        if not deterministic:
            actions = _draw(actions, torch.ones_like(actions) * self._log_std.exp(), generator)
        clipped: NDArray[np.float32] = np.clip(actions.numpy(), self._low, self._high)
        return clipped


class SquashedGaussian:
    """tanh of a Gaussian of state-dependent standard deviation (SAC)."""

    def __init__(self, last: nn.Linear, arrays: Arrays) -> None:
        """See `Head`."""
        self._mean, self._log_std = last, linear(arrays, "log_std")
        self._low, self._high = arrays["action.low"], arrays["action.high"]

    def act(
        self, hidden: Tensor, deterministic: bool, generator: torch.Generator | None
    ) -> NDArray[Any]:
        """See `Head`."""
        actions = self._mean(hidden)
        if not deterministic:
            spread = torch.clamp(self._log_std(hidden), *_LOG_STD).exp()
            actions = _draw(actions, torch.ones_like(actions) * spread, generator)
        scaled = torch.tanh(actions).numpy()
        actions_in_box: NDArray[np.float32] = self._low + (
            0.5 * (scaled + 1.0) * (self._high - self._low)
        )
        return actions_in_box


class Categorical:
    """Categorical distribution over discrete actions (PPO)."""

    def __init__(self, last: nn.Linear, arrays: Arrays) -> None:
        """See `Head`."""
        self._logits = last

    def act(
        self, hidden: Tensor, deterministic: bool, generator: torch.Generator | None
    ) -> NDArray[Any]:
        """See `Head`."""
        logits = self._logits(hidden)
        probabilities = torch.softmax(logits - logits.logsumexp(dim=-1, keepdim=True), dim=-1)
        if deterministic:
            return probabilities.argmax(dim=1).numpy()
        return torch.multinomial(probabilities, 1, True, generator=generator)[:, 0].numpy()


class Greedy:
    """Action of the largest Q-value, never drawn at random (DQN)."""

    def __init__(self, last: nn.Linear, arrays: Arrays) -> None:
        """See `Head`."""
        self._values = last

    def act(
        self, hidden: Tensor, deterministic: bool, generator: torch.Generator | None
    ) -> NDArray[Any]:
        """See `Head`."""
        values: Tensor = self._values(hidden)
        return values.argmax(dim=1).numpy()


HEADS: dict[str, type[Head]] = {
    "gaussian": Gaussian,
    "squashed gaussian": SquashedGaussian,
    "categorical": Categorical,
    "greedy": Greedy,
}
"""By the name that a policy file gives them."""


def linear(arrays: Arrays, name: str) -> nn.Linear:
    """A linear layer with the weights `<name>.weight` and `<name>.bias`.

    Args:
        arrays: Arrays of the policy file.
        name: Prefix of both.
    """
    weight, bias = (torch.tensor(arrays[f"{name}.{part}"]) for part in ("weight", "bias"))
    layer = nn.Linear(weight.shape[1], weight.shape[0], device="meta").to_empty(device="cpu")
    layer.load_state_dict({"weight": weight, "bias": bias})
    return layer


def _draw(mean: Tensor, spread: Tensor, generator: torch.Generator | None) -> Tensor:
    zero, one = torch.zeros_like(mean), torch.ones_like(mean)
    return mean + torch.normal(zero, one, generator=generator) * spread
