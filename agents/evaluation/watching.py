"""One episode, step by step, as a table to read."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any, TextIO

import numpy as np

from ..environments.factory import make
from .evaluate import RandomPolicy, SupportsPredict

__all__ = ["watch"]

_LEFT_OUT = ("is_success", "action_clipped", "physics_error")  # said in words where they are true


def watch(
    policy: SupportsPredict | None,
    env_id: str,
    env_kwargs: dict[str, Any],
    seed: int,
    out: TextIO | None = None,
) -> bool:
    """Play one episode and print every step of it.

    Args:
        policy: The policy; None plays at random.
        env_id: The environment.
        env_kwargs: Hyperparameters of the task.
        seed: Seed of the start.
        out: Where to print; None for standard output.

    Returns:
        Whether it ended in success.
    """
    out = sys.stdout if out is None else out
    venv = make(env_id, env_kwargs, 1)
    if policy is None:
        policy = RandomPolicy(venv.single_action_space, np.random.default_rng(seed))
    env: Any = venv.unwrapped
    dt = getattr(getattr(env, "task", None), "dt", None)
    total, success, names = 0.0, False, None
    for step, (action, reward, info) in enumerate(_episode(policy, venv, seed), start=1):
        total += reward
        success = bool(info.get("is_success", False))
        if names is None:
            names = [key for key in info if key not in _LEFT_OUT and np.isscalar(info[key])]
            _print_header(out, f"{env_id}   seed {seed}", names, np.size(action), dt)
        clock = f"{step:6d}" if dt is None else f"{step * dt:6.2f}"
        cells = [f"{float(a):7.3f}" for a in np.atleast_1d(action)] + [f"{reward:9.4f}"]
        cells += [f"{float(info[name]):>{_width(name)}.4g}" for name in names]
        notes = [key for key in _LEFT_OUT if info.get(key)]
        print(f"{step:5d}", clock, *cells, *notes, file=out)
    print(f"return {total:.4f} in {step} steps: {'success' if success else 'no success'}", file=out)
    venv.close()
    return success


def _episode(
    policy: SupportsPredict, venv: Any, seed: int
) -> Iterator[tuple[Any, float, dict[str, Any]]]:
    obs, _ = venv.reset(seed=[seed])
    done = False
    while not done:
        actions, _ = policy.predict(obs, deterministic=True)
        obs, rewards, terminated, truncated, infos = venv.step(actions)
        done = bool(terminated[0] or truncated[0])
        columns = infos["final_info"] if done else infos
        row = {
            key: np.asarray(column)[0]
            for key, column in columns.items()
            if not key.startswith("_") and not key.startswith("final_")
        }
        yield actions[0], float(rewards[0]), row


def _print_header(
    out: TextIO, title: str, names: list[str], n_action: int, dt: float | None
) -> None:
    actions = [f"   a[{k}]" for k in range(n_action)]
    clock = "  step" if dt is None else " t [s]"
    titles = [f"{_title(name):>{_width(name)}}" for name in names]
    header = [" step", clock, *actions, "   reward", *titles]
    print(title, " ".join(header), sep="\n", file=out)


def _title(name: str) -> str:
    """The name of an info entry; unweighted terms of the reward are `r:term`."""
    return name.replace("reward/", "r:")


def _width(name: str) -> int:
    return max(len(_title(name)), 9)
