"""A hash of what an environment does, by which a change of it is noticed."""

import hashlib
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium import spaces

N_ROWS = 100
N_STEPS = 110  # more than 10,000 of a row, without those that only reset
HORIZON = 40  # steps, so that every row passes ends and new starts
SEED = 0
INFOS = ("cost", "reward/")
"""How the entries of info begin that belong to the hash; others may be added to an environment."""


def fingerprint(env_id: str, **config: Any) -> str:
    """SHA-256 hash over 10,000 steps of an environment, the same as long as it is the same.

    It covers the spaces, the time limit, starts by their seeds, observations, rewards, flags, and
    the entries of info that are named cost or reward. 100 rows of `gymnasium.make_vec` are taken
    through episodes of at most 40 steps, with actions from the bits of PCG64, which are the same in
    every version of NumPy.

    Args:
        env_id: Gymnasium's id; its actions are a bounded box or a choice.
        **config: arguments of the environment.

    Returns:
        64 hexadecimal digits.

    Raises:
        ValueError: an action space of another kind.
    """
    envs = gym.make_vec(env_id, num_envs=N_ROWS, max_episode_steps=HORIZON, **config)
    digest = hashlib.sha256(_declared(envs, env_id).encode())
    bits = np.random.PCG64(SEED)
    _add(digest, envs.reset(seed=SEED)[0])
    for _ in range(N_STEPS):
        *results, infos = envs.step(_actions(envs.single_action_space, bits))
        _add(digest, [*results, {key: infos[key] for key in infos if key.startswith(INFOS)}])
    envs.close()
    return digest.hexdigest()


def _declared(envs: gym.vector.VectorEnv[Any, Any, Any], env_id: str) -> str:
    """Spaces and time limit, with every digit."""
    limit = gym.spec(env_id.rpartition(":")[2]).max_episode_steps  # its module is imported by now
    found = [_bounds(space) for space in (envs.single_observation_space, envs.single_action_space)]
    return f"{found} {limit}"


def _bounds(space: gym.Space[Any]) -> str:
    if isinstance(space, spaces.Dict):
        return str({key: _bounds(part) for key, part in sorted(space.items())})
    if isinstance(space, spaces.Box):
        return f"Box({space.low.tolist()}, {space.high.tolist()}, {space.dtype})"
    return str(space)


def _actions(space: gym.Space[Any], bits: np.random.PCG64) -> npt.NDArray[Any]:
    """An action for each row."""
    if isinstance(space, spaces.Discrete):
        raw = bits.random_raw(N_ROWS) % np.uint64(space.n)
        choices: npt.NDArray[Any] = np.asarray(raw, space.dtype) + space.start
        return choices
    if not isinstance(space, spaces.Box) or not space.is_bounded():
        raise ValueError(f"action_space = {space}; expected a bounded Box, or Discrete")
    raw = bits.random_raw((N_ROWS, *space.shape)) >> np.uint64(11)
    low = space.low.astype(np.float64)
    return np.asarray(low + (space.high - low) * (raw * 2.0**-53), space.dtype)


def _add(digest: Any, value: Any) -> None:
    """Add every number in nested dictionaries, lists and tuples."""
    if isinstance(value, dict):
        value = [value[key] for key in sorted(value)]
    if isinstance(value, list | tuple):
        for part in value:
            _add(digest, part)
    else:
        digest.update(np.ascontiguousarray(value).tobytes())
