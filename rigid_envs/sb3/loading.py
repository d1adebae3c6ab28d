"""Policy files as models that learn on, and as modules of torch and graphs of ONNX."""

import inspect
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common import vec_env
from stable_baselines3.common.vec_env import VecEnv, VecNormalize
from torch import Tensor, nn

from rigid_envs.base.checks import require
from rigid_envs.base.files import write_atomic
from rigid_envs.sb3.adapter import make_vec_env
from rigid_envs.sb3.exporting import ACTIVATIONS, AttitudeExtractor, layers_of, turned
from rigid_envs.scores.records import read_record
from rigid_envs.scores.trained import FOLDER, CompiledPolicy, load, path_of, weights_of

_ACTIVATIONS: dict[str, type[nn.Module]] = {**ACTIVATIONS, "tanh": nn.Tanh}  # all of them torch's

# A model from a policy file, on which `learn` goes on.

_OF_PPO = ("ppo", "dagger")  # the second is of `agents`: the networks of PPO, taught by a law


def load_model(name: str | Path, env: VecEnv | None = None, **changes: Any) -> PPO:
    """A model of PPO whose policy is that of a file, and on which `learn` goes on.

    The weights of the policy, the standard deviations of its actions and the statistics of
    VecNormalize are those of the file. So is the value network if the file has one, as files of
    `export` have. **Published files have none: the value network is a fresh one**, and what is
    learnt first are values. Hyperparameters of a published policy are those of its training (its
    record), where the learning rate stays as it was in the end; those of another file are
    Stable-Baselines3's.

    Args:
        name: A published policy, or a file, as `rigid_envs.load` takes it.
        env: Environment to learn in, as `make_vec_env` gives it; None makes that of the training.
            What else `agents` does in training (`cost_price`, `success_bonus`, `train_kwargs`,
            `normalize_reward` of its configs) is not part of it. A VecNormalize gets the statistics
            of a policy that has some; without one, such a policy is given one of the defaults.
        **changes: Arguments of PPO in place of these: `learning_rate`, `seed`, ...

    Raises:
        ValueError: No such policy, one of another algorithm, or an environment with other
            observations or actions.
        DamagedFileError: The file is no policy.
    """
    path = path_of(name)
    policy = load(path)
    algo = policy.document["algo"]
    require(algo in _OF_PPO, algo, f"{name}: algo", f"one of {_OF_PPO}")
    config = read_record(path.with_suffix(".json")).config if path.parent == FOLDER else {}
    if env is None:
        env = make_vec_env(policy.env_id, config.get("n_envs", 1), **policy.document["env_kwargs"])
    env = _seen(policy, env)
    own = {key: config[key] for key in inspect.signature(PPO).parameters if key in config}
    if isinstance(own.get("learning_rate"), list):
        own["learning_rate"] = own["learning_rate"][-1]
    own |= {"seed": None, "device": "cpu", **changes}
    own["policy_kwargs"] = _network(policy) | own.get("policy_kwargs", {})
    several = isinstance(env.observation_space, spaces.Dict)
    model = PPO("MultiInputPolicy" if several else "MlpPolicy", env, **own)
    for prefix, modules in zip(("layers", "value"), layers_of(model), strict=True):
        if f"{prefix}.0.weight" in policy.arrays:
            _fill(modules, policy.arrays, prefix)
    if "log_std" in policy.arrays:
        model.policy.log_std.data.copy_(torch.from_numpy(policy.arrays["log_std"]))
    return model


def _seen(policy: CompiledPolicy, env: VecEnv) -> VecEnv:
    """The environment as the networks see it: the parts that they take, scaled."""
    network = policy.document["network"]
    inputs = network.get("inputs") or [["observation", policy.n_obs]]
    if isinstance(env.observation_space, spaces.Dict) and len(inputs) == 1:
        env = vec_env.VecExtractDictObs(env, inputs[0][0])
    head = "categorical" if isinstance(env.action_space, spaces.Discrete) else "gaussian"
    found = spaces.flatdim(env.observation_space), spaces.flatdim(env.action_space), head
    fitting = policy.n_obs, len(weights_of(policy.arrays)[-1]), policy.head
    expected = f"{fitting}: make it with the settings {policy.env_kwargs}"
    require(found == fitting, found, "env: observation, action, distribution", expected)
    if not network["normalized"]:
        return env
    scaled = env if isinstance(env, VecNormalize) else VecNormalize(env)
    scaled.clip_obs, scaled.epsilon = network["clip"], network["epsilon"]
    running: Any = scaled.obs_rms
    at = 0
    for each in running.values() if isinstance(running, dict) else [running]:
        part = slice(at, at := at + len(each.mean))
        each.mean, each.var = (policy.arrays[f"observation.{x}"][part] for x in ("mean", "var"))
        each.count = policy.document["timesteps"]
    return scaled


def _network(policy: CompiledPolicy) -> dict[str, Any]:
    """The `policy_kwargs` of PPO for the networks of a file."""
    values = "value" if "value.0.weight" in policy.arrays else "layers"
    pi, vf = ([*map(len, weights_of(policy.arrays, of)[:-1])] for of in ("layers", values))
    told = {"net_arch": {"pi": pi, "vf": vf}, "activation_fn": _ACTIVATIONS[policy.activation]}
    if policy.attitudes is not None:
        places = dict(zip(("achieved", "desired"), policy.attitudes, strict=True))
        told |= {"features_extractor_class": AttitudeExtractor, "features_extractor_kwargs": places}
    return told


def _fill(modules: Sequence[nn.Module], arrays: Mapping[str, Any], prefix: str) -> None:
    """Give linear layers, between which there are activations, the weights of a file."""
    for k, layer in enumerate(modules[::2]):
        for part in ("weight", "bias"):
            getattr(layer, part).data.copy_(torch.from_numpy(arrays[f"{prefix}.{k}.{part}"]))


# A policy as a module of torch, and as a graph of ONNX.


class Actor(nn.Module):
    """A policy with all that stands around its network: from observations to actions."""

    def __init__(self, policy: CompiledPolicy) -> None:
        """As `to_torch`."""
        super().__init__()
        modules: list[nn.Module] = []
        for weight in weights_of(policy.arrays):
            linear = nn.utils.skip_init(nn.Linear, *weight.shape[::-1])  # type: ignore[no-untyped-call]
            modules += [linear, _ACTIVATIONS[policy.activation]()]
        _fill(modules, policy.arrays, "layers")
        self.layers = nn.Sequential(*modules[:-1])
        self._policy = policy
        for name, array in policy.arrays.items():
            if name.startswith(("action.", "observation.")):
                self.register_buffer(name.replace(".", "_"), torch.tensor(array))

    def forward(self, observation: Tensor) -> Tensor:
        """Actions, shape (..., m) or of choices (...), for observations of shape (..., n)."""
        policy, network, x = self._policy, self._policy.document["network"], observation
        if network["normalized"]:
            clip, mean = network["clip"], self.get_buffer("observation_mean")
            spread = (self.get_buffer("observation_var") + network["epsilon"]).sqrt()
            x = ((x - mean) / spread).clamp(-clip, clip).float()
        if policy.attitudes is not None:
            x = turned(x, *policy.attitudes)
        out: Tensor = self.layers(x)
        if policy.head in ("categorical", "greedy"):
            return out.argmax(-1)
        low, high = self.get_buffer("action_low"), self.get_buffer("action_high")
        if policy.head == "squashed gaussian":
            out = low + 0.5 * (out.tanh() + 1.0) * (high - low)
        return out.clamp(low, high)


def to_torch(policy: CompiledPolicy) -> nn.Module:
    """A policy as a module of torch, for observations of shape (..., n) as the environment gives.

    Of a goal environment the parts of an observation that the policy takes, side by side. Its
    actions are those of the policy up to rounding in float32.

    Args:
        policy: As `rigid_envs.load` gives it.
    """
    return Actor(policy)


def to_onnx(policy: CompiledPolicy, path: str | Path) -> Path:
    """Write a policy as a graph of ONNX, from `observation` (N, n) to `action`; see `to_torch`.

    Args:
        policy: As `rigid_envs.load` gives it.
        path: File to write, ``NAME.onnx``, in a folder that exists.

    Returns:
        The file.

    Raises:
        ImportError: onnx or onnxscript is missing.
    """
    inputs, shapes = (torch.zeros(2, policy.n_obs),), ({0: torch.export.Dim("N")},)
    names: Any = {"input_names": ["observation"], "output_names": ["action"]}
    found: Any = torch.onnx.export(
        to_torch(policy).eval(), inputs, dynamic_shapes=shapes, dynamo=True, verbose=False, **names
    )
    write_atomic(Path(path), found.model_proto.SerializeToString())
    return Path(path)
