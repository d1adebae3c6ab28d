"""The vector form that an environment registers of its own."""

import copy
from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np

from rigid_envs.testing.deep.comparison import difference
from rigid_envs.testing.deep.subject import STEP, Check, Result, Subject, begin, mismatch

__all__ = ["CHECKS", "STRICT"]

N_ROWS = 3
N_STEPS = 50


def rows_of_the_same_seed_are_the_same(subject: Subject) -> Iterator[str]:
    """The vector environment gives the same episodes for the same seed."""
    if _has_rows(subject):
        found, expected = _play(subject), _play(subject)
        yield from mismatch(found, expected, f"{N_ROWS} rows of make_vec of the same seed")


def a_row_is_the_single_environment(subject: Subject) -> Iterator[str]:
    """Row i of the vector environment seeded s is the single environment seeded s + i."""
    if not _has_rows(subject):
        return
    results = _play(subject)
    for row in range(N_ROWS):
        with subject.open() as env:
            told = _difference_of_row(env, subject, row, results)
        if told:
            yield f"row {row} of make_vec and the single environment: {told}"


CHECKS: tuple[Check, ...] = (rows_of_the_same_seed_are_the_same,)
STRICT: tuple[Check, ...] = (a_row_is_the_single_environment,)


def _has_rows(subject: Subject) -> bool:
    named = not callable(subject.source) and subject.spec is not None
    return named and subject.spec.vector_entry_point is not None


def _play(subject: Subject) -> list[Result]:
    """What the vector environment returns, and the actions, each the same in every play."""
    envs: Any = gym.make_vec(
        str(subject.source),
        num_envs=N_ROWS,
        vectorization_mode="vector_entry_point",
        **subject.kwargs,
    )
    space = copy.deepcopy(envs.action_space)
    space.seed(subject.seed)
    observation, info = envs.reset(seed=subject.seed)
    results = [copy.deepcopy({"observation": observation, "info": info})]
    for _ in range(N_STEPS):
        action = space.sample()
        result = dict(zip(STEP, envs.step(action.copy()), strict=True))
        results.append(copy.deepcopy(result | {"action": action}))
    envs.close()
    return results


def _difference_of_row(env: Any, subject: Subject, row: int, results: list[Result]) -> str | None:
    """First difference until the first end of the row, after which its modes of reset differ."""
    start = begin(env, subject.seed + row)["observation"]
    if told := difference(_pick(results[0]["observation"], row), start, "first observation"):
        return told
    for k, result in enumerate(results[1:], 1):
        observation, reward, *flags, _ = env.step(copy.deepcopy(result["action"][row]))
        numbers = np.array([reward, *flags], np.float64)
        told = difference(_pick(result["observation"], row), observation, "observation")
        names = ("reward", "terminated", "truncated")
        seen = np.array([result[name][row] for name in names], np.float64)
        told = told or difference(seen, numbers, "(reward, terminated, truncated)")
        if told:
            return f"step {k}: {told}"
        if any(flags):
            return None
    return None


def _pick(observation: Any, row: int) -> Any:
    """Row of an observation, as a single environment returns it."""
    if isinstance(observation, dict):
        return {key: _pick(part, row) for key, part in observation.items()}
    if isinstance(observation, tuple):
        return tuple(_pick(part, row) for part in observation)
    return observation[row]
