"""What reset and step return is of the declared kind."""

from collections.abc import Iterator, Mapping
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from rigid_envs.testing.deep.comparison import leaves
from rigid_envs.testing.deep.subject import Check, Subject, begin

__all__ = ["CHECKS", "STRICT"]


def observations_are_in_their_space(subject: Subject) -> Iterator[str]:
    """Observations have the declared type and shape, and lie in the space."""
    with subject.open() as env:
        space = env.observation_space
    for k, result in enumerate(subject.reference):
        if told := _outside(space, result["observation"], "observation"):
            yield f"result {k} (0 is the first reset): {told}"
            return


def rewards_are_finite_numbers(subject: Subject) -> Iterator[str]:
    """A reward is a Python or NumPy real number, and finite."""
    for k, reward in _each(subject, "reward"):
        if not isinstance(reward, int | float | np.integer | np.floating):
            yield f"result {k}: reward is of type {type(reward).__name__}, expected a real number"
            return
        if not np.isfinite(reward):
            yield f"result {k}: reward is {reward!r}, expected a finite number"
            return


def flags_are_bools(subject: Subject) -> Iterator[str]:
    """Both flags are bool."""
    for name in ("terminated", "truncated"):
        for k, flag in _each(subject, name):
            if not isinstance(flag, bool | np.bool_):
                yield f"result {k}: {name} is of type {type(flag).__name__}, expected bool"
                break


def infos_are_dictionaries_with_strings_as_keys(subject: Subject) -> Iterator[str]:
    """Info is a dictionary, its keys are strings."""
    for k, info in _each(subject, "info"):
        if not isinstance(info, dict):
            yield f"result {k}: info is of type {type(info).__name__}, expected dict"
            return
        if strange := [key for key in info if not isinstance(key, str)]:
            yield f"result {k}: info has the key {strange[0]!r}, expected a str"
            return


def nan_in_an_action_gives_no_nan(subject: Subject) -> Iterator[str]:
    """NaN in a continuous action is refused, or harmless."""
    with subject.open() as env:
        space = env.action_space
        if not isinstance(space, spaces.Box) or not np.issubdtype(space.dtype, np.floating):
            return
        begin(env, subject.seed)
        try:
            observation, reward, *_ = env.step(np.full(space.shape, np.nan, space.dtype))
        except Exception:  # any error refuses it
            return
    if not all(np.isfinite(leaf).all() for leaf in [*leaves(observation), np.asarray(reward)]):
        yield (
            f"step(nan) returned the observation {observation} and the reward {reward}; "
            "expected an error, or finite numbers"
        )


CHECKS: tuple[Check, ...] = (
    observations_are_in_their_space,
    rewards_are_finite_numbers,
    flags_are_bools,
    infos_are_dictionaries_with_strings_as_keys,
)
STRICT: tuple[Check, ...] = (nan_in_an_action_gives_no_nan,)


def _each(subject: Subject, name: str) -> Iterator[tuple[int, Any]]:
    """Numbers of results, and what they have of this name."""
    return ((k, result[name]) for k, result in enumerate(subject.reference) if name in result)


def _outside(space: gym.Space[Any], value: Any, where: str) -> str | None:
    """Why a value is not in a space; None if it is."""
    if isinstance(space, spaces.Dict) and isinstance(value, Mapping):
        if value.keys() != space.keys():
            return f"{where} has the keys {list(value)}, expected {list(space)}"
        return _of_parts([(space[key], value[key], f"{where}[{key!r}]") for key in space])
    if isinstance(space, spaces.Tuple) and isinstance(value, tuple):
        if len(value) != len(space):
            return f"{where} has length {len(value)}, expected {len(space)}"
        return _of_parts([(space[k], value[k], f"{where}[{k}]") for k in range(len(space))])
    if isinstance(space, spaces.Box):
        return _outside_box(space, value, where)
    return None if space.contains(value) else f"{where} is {value!r}, expected one of {space}"


def _of_parts(parts: list[tuple[gym.Space[Any], Any, str]]) -> str | None:
    return next(filter(None, (_outside(*part) for part in parts)), None)


def _outside_box(box: spaces.Box, value: Any, where: str) -> str | None:
    if not isinstance(value, np.ndarray):
        return f"{where} is of type {type(value).__name__}, expected an array"
    if value.dtype != box.dtype or value.shape != box.shape:
        return (
            f"{where} has type {value.dtype} and shape {value.shape}, "
            f"expected {box.dtype} and {box.shape}"
        )
    wrong = ~((value >= box.low) & (value <= box.high))  # NaN is wrong, too
    if not wrong.any():
        return None
    index = tuple(int(k) for k in np.argwhere(wrong)[0])
    at = f"[{', '.join(map(str, index))}]" if index else ""
    low, high = box.low[index], box.high[index]
    return f"{where}{at} is {value[index]!r}, expected from {low!r} to {high!r}"
