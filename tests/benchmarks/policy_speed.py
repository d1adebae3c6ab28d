"""Time of an action: compiled policy beside the same network in torch, in one interleaved run.

Run as a program: ``python -m tests.benchmarks.policy_speed [NAME]``. Prints the least time of one
call of `predict`, for one observation and for 500 together, on one thread.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from rigid_envs import load
from rigid_envs.sb3.exporting import ACTIVATIONS
from rigid_envs.scores.trained import FOLDER, CompiledPolicy, weights_of

CALLS, ROUNDS = 50, 100


Act = Callable[[np.ndarray], object]


def seconds(act: Act, obs: np.ndarray) -> float:
    """Time of one action."""
    begin = time.perf_counter()
    for _ in range(CALLS):
        act(obs)
    return (time.perf_counter() - begin) / CALLS


def times(acts: tuple[Act, Act], n_obs: int, rows: int) -> tuple[float, float]:
    """Least times of both [s], taken in turns: what else runs on the machine only adds to them."""
    obs = np.random.default_rng(0).normal(size=(rows, n_obs)).astype(np.float32)
    obs = obs[0] if rows == 1 else obs
    each = [[seconds(act, obs) for act in acts] for _ in range(ROUNDS)]
    one, two = (min(column) for column in zip(*each, strict=True))
    return one, two


def in_torch(policy: CompiledPolicy) -> Act:
    """The modes of a Gaussian policy, as torch computes them."""
    modules: list[torch.nn.Module] = []
    for k, weight in enumerate(weights_of(policy.arrays)):
        layer = torch.nn.Linear(weight.shape[1], len(weight))
        layer.weight.data = torch.tensor(weight)
        layer.bias.data = torch.tensor(policy.arrays[f"layers.{k}.bias"])
        modules += [layer, ACTIVATIONS[policy.activation]()]
    network = torch.nn.Sequential(*modules[:-1])
    low, high = policy.arrays["action.low"], policy.arrays["action.high"]

    def act(obs: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            return np.clip(network(torch.as_tensor(obs)).numpy(), low, high)

    return act


def main(path: Path) -> None:
    """Print the table."""
    torch.set_num_threads(1)
    policy = load(path)
    acts = policy.predict, in_torch(policy)
    print("observations   compiled      torch   ratio")
    for rows in (1, 500):
        one, two = times(acts, policy.n_obs, rows)
        print(f"{rows:12}{1e6 * one:8.1f} us{1e6 * two:8.1f} us{two / one:8.1f}")


if __name__ == "__main__":
    main(FOLDER / f"{(sys.argv[1:] or ['BallPark-v0'])[0]}.safetensors")
