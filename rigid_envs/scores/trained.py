"""Trained policies in files: stored, checked, compiled, run without torch."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_envs.base.checks import ConfigError, one_of, printable, require
from rigid_envs.base.files import DamagedFileError, load_tensors, named_damage, save_tensors
from rigid_envs.engine.network import ACTIVATIONS, perceptron, relative_rotations
from rigid_envs.envs.lookup import SEEN, full_id, id_in_file
from rigid_envs.tasks.registry import ENVIRONMENTS

# Arrays of a policy file: the layers of its network, and what else its head needs.

Arrays = Mapping[str, NDArray[Any]]

HEADS = ("gaussian", "squashed gaussian", "categorical", "greedy")
"""Distributions of actions: of PPO, of SAC, of PPO over choices, and the largest value (DQN)."""

_LAYER_LIMIT = 64


def weights_of(arrays: Arrays, prefix: str = "layers") -> list[NDArray[np.float32]]:
    """The matrices of the layers, each checked to take what the one before gives.

    Args:
        arrays: `layers.<k>.weight`, shape (outputs, inputs), `layers.<k>.bias`, and others.
        prefix: What names of arrays begin with: "value" takes the layers of the value network.
    """
    count = sum(name.startswith(f"{prefix}.") and name.endswith(".weight") for name in arrays)
    if not 1 <= count <= _LAYER_LIMIT:
        raise ValueError(f"expected 1 to {_LAYER_LIMIT} layers, found {count}")
    names = [f"{prefix}.{k}" for k in range(count)]
    weights = [arrays[f"{name}.weight"] for name in names]
    for k, (name, weight) in enumerate(zip(names, weights, strict=True)):
        bias = arrays[f"{name}.bias"]
        if {weight.dtype, bias.dtype} != {np.dtype(np.float32)} or weight.ndim != 2:
            raise ValueError(f"{name}: expected a matrix and a vector of float32")
        if bias.shape != weight.shape[:1]:
            raise ValueError(f"{name}.bias: expected {len(weight)} numbers, found {bias.shape}")
        if k and weight.shape[1] != len(weights[k - 1]):
            raise ValueError(
                f"{name}.weight has shape {weight.shape}; expected (..., {len(weights[k - 1])})"
            )
    return weights


def _check_values(arrays: Arrays, head: str, n_inputs: int) -> None:
    """Refuse a value network, if there is one, that is of another head or of other inputs."""
    if not any(name.startswith("value.") for name in arrays):
        return
    require(head in ("gaussian", "categorical"), head, "distribution", "one with a value network")
    weights = weights_of(arrays, "value")
    ends = weights[0].shape[1], len(weights[-1])
    require(ends == (n_inputs, 1), ends, "value: inputs, outputs", f"{(n_inputs, 1)}")


def _check_others(arrays: Arrays, head: str, last: tuple[int, int], n_normal: int | None) -> None:
    """Refuse an array, other than those of the layers, that is missing, misshapen or unused.

    Args:
        arrays: All arrays of a file.
        head: One of `HEADS`.
        last: Shape of the matrix of the last layer.
        n_normal: Number of inputs that are normalised; None if they are not.
    """
    wanted = {name: ("float32", shape) for name, shape in _needs(head, *last).items()}
    if n_normal is not None:
        for name in ("observation.mean", "observation.var"):
            wanted[name] = ("float64", (n_normal,))
    others = {k: a for k, a in arrays.items() if not k.startswith(("layers.", "value."))}
    found = {k: (str(a.dtype), a.shape) for k, a in others.items()}
    for name in sorted(wanted.keys() | found.keys()):
        if wanted.get(name) != found.get(name):
            raise ValueError(f"{name}: expected {wanted.get(name)}, found {found.get(name)}")


def _needs(head: str, n_out: int, n_hidden: int) -> dict[str, tuple[int, ...]]:
    """Names and shapes of the arrays of a head, besides the last layer."""
    box: dict[str, tuple[int, ...]] = {"action.low": (n_out,), "action.high": (n_out,)}
    if head == "gaussian":
        return {"log_std": (n_out,), **box}
    if head == "squashed gaussian":
        return {"log_std.weight": (n_out, n_hidden), "log_std.bias": (n_out,), **box}
    return {}


# A policy as its file holds it: a multilayer perceptron with its document, checked.

N_ROTATIONS = 18
"""Numbers that a layer of relative rotations adds to its inputs."""

_SHOWN = ("algo", "env_kwargs", "versions", "git_commit", "kernel_hash")


class CompiledPolicy:
    """A multilayer perceptron from observations to actions, without torch.

    Its actions are the same to the last bit on every x86-64 processor.

    Attributes:
        document: JSON values: `algo`, `env_id`, `env_kwargs`, `seed`, `timesteps`, `network`,
            `spaces`, `versions`, `git_commit`, ...
        env_id: The environment that it was trained on, as it is registered.
        arrays: `layers.<k>.weight`, `layers.<k>.bias`; what the head of the network needs; if
            observations are normalised `observation.mean`, `observation.var`; for who trains it
            further, if the file has them, `value.<k>.weight`, `value.<k>.bias`.
        n_obs: Numbers of an observation.
        activation: Activation of the hidden layers.
        head: Distribution of the actions.
        attitudes: Where two matrices are in an observation, whose relative rotations the first
            layer takes too; None if it does not.
    """

    def __init__(self, document: Mapping[str, Any], arrays: Arrays) -> None:
        """Check what a file holds, and lay out the weights as the compiled code takes them.

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
        self.activation = one_of(network["activation"], ACTIVATIONS[1:], "activation")
        self.head = one_of(network["distribution"], HEADS, "distribution")
        weights = weights_of(self.arrays)
        self.attitudes = _attitudes(network.get("attitudes"), weights[0].shape[1])
        self.n_obs = weights[0].shape[1] - (0 if self.attitudes is None else N_ROTATIONS)
        self._inputs = _inputs(network.get("inputs"), self.n_obs)
        self._normalized = bool(network["normalized"])
        if self._normalized:
            self._clip, self._epsilon = float(network["clip"]), float(network["epsilon"])
        _check_values(self.arrays, self.head, weights[0].shape[1])
        last: tuple[int, int] = weights[-1].shape
        _check_others(self.arrays, self.head, last, self.n_obs if self._normalized else None)
        self._sizes = np.array([weights[0].shape[1], *map(len, weights)])
        parts = [(self.arrays[f"layers.{k}.bias"], w.T.ravel()) for k, w in enumerate(weights)]
        self._weights = np.concatenate([part for pair in parts for part in pair])
        self._hidden = ACTIVATIONS.index(self.activation)
        self._last = ACTIVATIONS.index("tanh" if self.head == "squashed gaussian" else "identity")

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

    def __call__(self, observation: NDArray[Any] | Mapping[str, NDArray[Any]]) -> NDArray[Any]:
        """The action or actions alone; see `predict`."""
        return self.predict(observation)[0]

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
            deterministic: True: it has no random stream, and acts by the mode of the distribution.

        Returns:
            The action or actions, and `state`.

        Raises:
            ValueError: The observation has another shape, or is not finite.
        """
        require(deterministic, False, "deterministic", "True: it does not draw at random")
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

    def _batch(
        self, observation: NDArray[Any] | Mapping[str, NDArray[Any]]
    ) -> tuple[NDArray[np.float32], bool]:
        """What the network takes of observations, shape (N, n), and whether it is one alone."""
        obs = self._flat(observation)
        if obs.shape[-1:] != (self.n_obs,) or obs.ndim > 2 or not np.isfinite(obs).all():
            expected = f"({self.n_obs},) or (N, {self.n_obs}), every entry finite"
            raise ValueError(f"observation of shape {obs.shape}: expected {expected}")
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


def _inputs(value: Any, n_obs: int) -> list[tuple[str, int]] | None:
    """Names and sizes of the parts of an observation; None if it is one array."""
    if value is None:
        return None
    inputs = [(str(name), int(size)) for name, size in value]
    total = sum(size for _, size in inputs)
    require(total == n_obs, inputs, "inputs", f"{n_obs} numbers in all, as layers.0 takes")
    return inputs


def _attitudes(places: Any, n_inputs: int) -> tuple[int, int] | None:
    """Indices of two matrices in an observation, within the inputs of the first layer."""
    if places is None:
        return None
    achieved, desired = places
    fits = all(type(at) is int and 0 <= at <= n_inputs - N_ROTATIONS - 9 for at in places)
    require(fits, places, "attitudes", "where matrices are in the input of layers.0")
    return achieved, desired


# Policies from files: those that come with the package by name, others by path.

FORMAT = "rigid-envs policy 2"
_FORMATS = ("rigid-envs policy 1", FORMAT)  # the first has no value network
FOLDER = Path(__file__).with_name("published")
"""Published policies, each with a record of its evaluation beside it."""

_SIZE_LIMIT = 256 * 2**20


def published(folder: Path = FOLDER) -> list[str]:
    """Names of the published policies: that of `RigidEnvs/BallPark-v0` is "BallPark-v0"."""
    return sorted(path.stem for path in folder.glob("*.safetensors"))


def file_of(name: str, folder: Path = FOLDER) -> Path:
    """File of a published policy.

    Args:
        name: An id, "RigidEnvs/BallPark-v0", or what is left of it: "BallPark-v0", "BallPark".
        folder: Where they are.

    Raises:
        ConfigError: None is published of that name; names those that are.
    """
    names = published(folder)
    stem = name.removeprefix("RigidEnvs/")
    for chosen in (stem, f"{stem}-v0"):
        if chosen in names:
            return folder / f"{chosen}.safetensors"
    raise ConfigError(
        f"name = {name!r}; expected the path of a policy.safetensors, or a published policy: "
        f"{', '.join(names) or 'there is none yet'}"
    )


def is_trained(name: str) -> bool:
    """Whether a name is of a trained policy: a file (.safetensors), or an id, also in short."""
    return name.endswith(".safetensors") or full_id(name) in ENVIRONMENTS


def load(name: str | Path) -> CompiledPolicy:
    """A trained policy that runs without torch, to the same bits on every x86-64 processor.

    Args:
        name: A published one, "BallPark" or "RigidEnvs/BallPark-v0"; or the path of a
            `policy.safetensors`, or of the folder that it is in.

    Raises:
        ConfigError: None of that name; names those that there are.
        DamagedFileError: The file is no policy; says why.
    """
    path = path_of(name)
    document, arrays = read_policy(path)
    with named_damage(path, "it is not a policy"):
        return CompiledPolicy(document, arrays)


def path_of(name: str | Path) -> Path:
    """The file of a policy; see `load`.

    Raises:
        ConfigError: None of that name; names those that there are.
    """
    path = Path(name)
    if path.is_dir():
        path = path / "policy.safetensors"
    return path if path.is_file() else file_of(str(name))


def read_policy(path: Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Document and arrays of a policy file. Nothing in it is run.

    Args:
        path: The file.

    Raises:
        DamagedFileError: Another format.
        FileNotFoundError: There is no such file.
    """
    arrays, document = load_tensors(path, _SIZE_LIMIT)
    if document.get("format") not in _FORMATS:
        given = document.get("format")
        raise DamagedFileError(f"{path}: expected format {FORMAT!r}, got {given!r}")
    return document, arrays


def write_policy(
    file: Path, document: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]
) -> Path:
    """Write a policy file, atomically.

    Args:
        file: Its path; the folder exists.
        document: JSON values; see `CompiledPolicy`.
        arrays: See `CompiledPolicy`.

    Returns:
        The file.
    """
    save_tensors(file, arrays, {"format": FORMAT, **document})
    return file
