"""Policies in files: weights and statistics as safetensors, the rest as JSON, no code in either.

`policy.safetensors` holds all of it; `policy.json` beside it is the same JSON for people to read.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from .files import DamagedFileError, canonical_json, write_atomic
from .tensorfile import load_tensors, save_tensors

__all__ = ["ACTIVATIONS", "Policy", "load_policy", "save_policy"]

ACTIVATIONS: dict[str, type[nn.Module]] = {
    "tanh": nn.Tanh,
    "relu": nn.ReLU,
    "elu": nn.ELU,
    "silu": nn.SiLU,
}
_FORMAT = "rigid-envs policy 1"
_SIZE_LIMIT = 256 * 2**20
_LAYER_LIMIT = 64


class Policy:
    """A multilayer perceptron from observations to actions.

    Its actions are those of the SB3 model that it was exported from, bit by bit: the same
    operations of torch and NumPy in the same order.

    Attributes:
        document: JSON values: `algo`, `env_id`, `env_kwargs`, `network`, `spaces`, ...
        arrays: `layers.<k>.weight`, `layers.<k>.bias`; for a Gaussian `log_std`; for a box of
            actions `action.low`, `action.high`; if observations are normalised
            `observation.mean`, `observation.var`.
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
        self._gaussian = {"gaussian": True, "categorical": False}[network["distribution"]]
        weights = _weights(self.arrays)
        self._net = _perceptron(self.arrays, len(weights), ACTIVATIONS[network["activation"]])
        self._n_obs, n_out = weights[0].shape[1], len(weights[-1])
        for name in ("observation.mean", "observation.var"):
            self._check(name, (self._n_obs,), np.float64, network["normalized"])
        for name in ("log_std", "action.low", "action.high"):
            self._check(name, (n_out,), np.float32, self._gaussian)
        self._normalized = bool(network["normalized"])
        if self._normalized:
            self._clip, self._epsilon = float(network["clip"]), float(network["epsilon"])

    def predict(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
        generator: torch.Generator | None = None,
    ) -> tuple[NDArray[Any], Any]:
        """Actions for observations, in SB3's form.

        Args:
            observation: One observation (n,) or a batch (N, n), as the environment gives them.
            state: Returned as it is; there is no memory.
            episode_start: Ignored, for the same reason.
            deterministic: The most likely action, or else a draw.
            generator: Source of the draw; None is torch's global one, as in SB3.

        Returns:
            The action or actions, and `state`.

        Raises:
            ValueError: The observation has another shape, or is not finite.
        """
        obs = np.asarray(observation)
        if obs.shape[-1:] != (self._n_obs,) or obs.ndim > 2 or not np.isfinite(obs).all():
            raise ValueError(
                f"observation of shape {obs.shape}: expected ({self._n_obs},) or "
                f"(N, {self._n_obs}), every entry finite"
            )
        batch = torch.as_tensor(self._normalize(np.atleast_2d(obs)))
        with torch.no_grad():
            output = self._net(batch)
            actions = self._act(output, deterministic, generator)
        return (actions if obs.ndim == 2 else actions.squeeze(axis=0)), state

    def _normalize(self, obs: NDArray[Any]) -> NDArray[np.float32]:
        if self._normalized:
            mean, var = self.arrays["observation.mean"], self.arrays["observation.var"]
            obs = np.clip((obs - mean) / np.sqrt(var + self._epsilon), -self._clip, self._clip)
        return obs.astype(np.float32)

    def _act(
        self, output: Tensor, deterministic: bool, generator: torch.Generator | None
    ) -> NDArray[Any]:
        if not self._gaussian:
            chances = torch.softmax(output - output.logsumexp(dim=-1, keepdim=True), dim=-1)
            if deterministic:
                return chances.argmax(dim=1).numpy()
            return torch.multinomial(chances, 1, True, generator=generator)[:, 0].numpy()
        if not deterministic:
            spread = torch.ones_like(output) * torch.from_numpy(self.arrays["log_std"]).exp()
            zero, one = torch.zeros_like(output), torch.ones_like(output)
            output = output + torch.normal(zero, one, generator=generator) * spread
        low, high = self.arrays["action.low"], self.arrays["action.high"]
        clipped: NDArray[np.float32] = np.clip(output.numpy(), low, high)
        return clipped

    def _check(self, name: str, shape: tuple[int, ...], dtype: type, wanted: bool) -> None:
        array = self.arrays.get(name)
        if not wanted:
            if array is not None:
                raise ValueError(f"{name} has no use here")
        elif array is None or array.shape != shape or array.dtype != dtype:
            found = "nothing" if array is None else f"{array.dtype}{array.shape}"
            raise ValueError(f"{name}: expected {np.dtype(dtype)}{shape}, found {found}")


def save_policy(policy: Policy, folder: Path) -> Path:
    """Write a policy, atomically.

    Args:
        policy: The policy.
        folder: Where; made if it is not there.

    Returns:
        The file that `load_policy` reads.
    """
    folder.mkdir(exist_ok=True)
    document = {"format": _FORMAT, **policy.document}
    path = folder / "policy.safetensors"
    save_tensors(path, policy.arrays, document)
    write_atomic(folder / "policy.json", canonical_json(document, indent=2).encode() + b"\n")
    return path


def load_policy(path: str | Path) -> Policy:
    """Read a policy. Nothing in the file is run.

    Args:
        path: `policy.safetensors`, or the folder that it is in.

    Raises:
        DamagedFileError: It is not what `save_policy` wrote; the message says why.
        FileNotFoundError: No file.
    """
    path = Path(path)
    if path.is_dir():
        path = path / "policy.safetensors"
    arrays, document = load_tensors(path, _SIZE_LIMIT)
    if document.get("format") != _FORMAT:
        raise DamagedFileError(
            f"{path}: expected format {_FORMAT!r}, got {document.get('format')!r}"
        )
    bad = [name for name, array in arrays.items() if not np.isfinite(array).all()]
    if bad:
        raise DamagedFileError(f"{path}: {bad[0]} is not finite")
    try:
        return Policy(document, arrays)
    except (ValueError, LookupError, TypeError, RuntimeError) as error:
        raise DamagedFileError(f"{path}: not a policy: {error!r:.200}") from error


def _weights(arrays: Mapping[str, NDArray[Any]]) -> list[NDArray[np.float32]]:
    """The matrices of the layers, each checked to take what the one before gives."""
    count = sum(name.endswith(".weight") for name in arrays)
    if not 1 <= count <= _LAYER_LIMIT:
        raise ValueError(f"expected 1 to {_LAYER_LIMIT} layers, found {count}")
    weights = [arrays[f"layers.{k}.weight"] for k in range(count)]
    for k, weight in enumerate(weights):
        bias = arrays[f"layers.{k}.bias"]
        if {weight.dtype, bias.dtype} != {np.dtype(np.float32)} or weight.ndim != 2:
            raise ValueError(f"layers.{k}: expected a matrix and a vector of float32")
        if k and weight.shape[1] != len(weights[k - 1]):
            raise ValueError(
                f"layers.{k}: takes {weight.shape[1]} of {len(weights[k - 1])} numbers"
            )
    return weights


def _perceptron(
    arrays: Mapping[str, NDArray[Any]], count: int, activation: type[nn.Module]
) -> nn.Sequential:
    modules: list[nn.Module] = []
    for k in range(count):
        weight, bias = (torch.tensor(arrays[f"layers.{k}.{part}"]) for part in ("weight", "bias"))
        layer = nn.Linear(weight.shape[1], weight.shape[0], device="meta").to_empty(device="cpu")
        layer.load_state_dict({"weight": weight, "bias": bias})
        modules += [layer, activation()]
    return nn.Sequential(*modules[:-1])
