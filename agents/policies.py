"""Trained policies in torch, run without Stable-Baselines3."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from rigid_envs.base.files import DamagedFileError, canonical_json, write_atomic
from rigid_envs.scores.layers import ACTIVATIONS, RelativeRotation
from rigid_envs.scores.trained import FORMAT, StoredPolicy, read_policy, write_policy

# Action heads: last layer and action distribution, with the bits of SB3.

Arrays = Mapping[str, NDArray[Any]]
_LOG_STD = (-20.0, 2.0)  # bounds of SB3's squashed Gaussian


class Head(Protocol):
    """Last layer of a network and its action distribution."""

    def __init__(self, last: nn.Linear, arrays: Arrays) -> None:
        """Take the last layer, and arrays of the head's own: see `rigid_envs.scores.trained`."""

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


# Policy of a multilayer perceptron in torch: observation to action.

# Not SB3's own policy: this one runs without SB3, and a file of today under any version of it.


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


# Policies in files: weights and statistics as safetensors, the rest as JSON, no code in either.
#
# `policy.safetensors` holds all of it; `policy.json` beside it is the same JSON for people to read.


def save_policy(policy: Policy, folder: Path) -> Path:
    """Write a policy, atomically.

    Args:
        policy: Network and document to write.
        folder: Folder of the files; made if it is not there.

    Returns:
        The file that `load_policy` reads.
    """
    folder.mkdir(exist_ok=True)
    path = write_policy(folder / "policy.safetensors", policy.document, policy.arrays)
    document = {"format": FORMAT, **policy.document}
    write_atomic(folder / "policy.json", canonical_json(document, indent=2) + "\n")
    return path


def load_policy(path: str | Path) -> Policy:
    """Read a policy. Nothing in the file is run.

    Args:
        path: `policy.safetensors`, or the folder that it is in.

    Raises:
        DamagedFileError: It is not what `save_policy` wrote; the message says why.
        FileNotFoundError: There is no such file.
    """
    path = Path(path)
    if path.is_dir():
        path = path / "policy.safetensors"
    document, arrays = read_policy(path)
    try:
        return Policy(document, arrays)
    except (ValueError, LookupError, TypeError, RuntimeError) as error:
        raise DamagedFileError(f"{path}: not a policy: {error!r:.200}") from error
