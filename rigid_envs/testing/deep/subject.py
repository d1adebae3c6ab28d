"""An environment to be checked: how it is made, and the episodes that it is held to."""

import copy
import inspect
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import gymnasium as gym

from rigid_envs.testing.deep.comparison import difference

__all__ = [
    "LONGEST",
    "STEP",
    "Check",
    "Env",
    "Result",
    "Subject",
    "begin",
    "finish",
    "mismatch",
    "play",
    "proceed",
]

N_STEPS = 60
"""Steps of the episodes that are compared."""

LONGEST = 1000
"""Steps of an episode that is played to its end, if it has one."""

STEP = ("observation", "reward", "terminated", "truncated", "info")
"""What a step returns."""

Env = gym.Env[Any, Any]
Result = dict[str, Any]
"""What reset or step returned, by name, copied when it was returned."""


@dataclass(frozen=True)
class Subject:
    """An environment to be checked.

    Attributes:
        source: Gymnasium's id, or a callable that makes an environment.
        kwargs: arguments of `gym.make` or of the callable.
        seed: seed of the episodes.
        options: options of a reset that the environment accepts.
    """

    source: str | Callable[..., Env]
    kwargs: dict[str, Any]
    seed: int
    options: dict[str, Any]

    def make(self, **more: Any) -> Env:
        """A new environment."""
        if callable(self.source):
            return self.source(**self.kwargs, **more)
        # its messages would stand before ours, and stop at the first
        return gym.make(self.source, disable_env_checker=True, **self.kwargs, **more)

    @contextmanager
    def open(self, **more: Any) -> Iterator[Env]:
        """A new environment that is closed at the end."""
        with closing(self.make(**more)) as env:
            yield env

    def accepts(self, name: str) -> bool:
        """Whether environments are made with an argument of this name."""
        if not callable(self.source):
            return True
        try:
            inspect.signature(self.source).bind(**self.kwargs, **{name: None})
        except (TypeError, ValueError):
            return False
        return True

    @cached_property
    def spec(self) -> Any:
        """Gymnasium's specification; None of an environment that has none."""
        with self.open() as env:
            return env.spec

    @cached_property
    def actions(self) -> list[Any]:
        """Random actions, drawn from a copy of the action space."""
        with self.open() as env:
            space = copy.deepcopy(env.action_space)
        space.seed(self.seed)
        return [space.sample() for _ in range(N_STEPS)]

    @cached_property
    def reference(self) -> list[Result]:
        """What a new instance does for the seed and the actions."""
        with self.open() as env:
            return play(env, self.seed, self.actions)


Check = Callable[[Subject], Iterator[str]]
"""Finds what is wrong, each as a sentence; its docstring is the claim."""


def begin(env: Env, seed: int | None, **more: Any) -> Result:
    """Reset, and what that returned."""
    return _named(env.reset(seed=seed, **more), ("observation", "info"), "reset")


def proceed(env: Env, actions: list[Any]) -> list[Result]:
    """Take actions, each a copy; an ended episode is followed by the next."""
    results = []
    for action in actions:
        results.append(_named(env.step(copy.deepcopy(action)), STEP, "step"))
        if results[-1]["terminated"] or results[-1]["truncated"]:
            results.append(begin(env, None))
    return results


def play(env: Env, seed: int, actions: list[Any]) -> list[Result]:
    """Episodes from a seed, with these actions."""
    return [begin(env, seed), *proceed(env, actions)]


def finish(env: Env, seed: int, limit: int) -> tuple[int, Any, Any]:
    """An episode of random actions, at most so long: number of its last step, and the flags."""
    space = copy.deepcopy(env.action_space)
    space.seed(seed)
    begin(env, seed)
    step, terminated, truncated = 0, False, False
    while step < limit and not (terminated or truncated):
        _, _, terminated, truncated, _ = env.step(space.sample())
        step += 1
    return step, terminated, truncated


def mismatch(found: list[Result], expected: list[Result], case: str) -> Iterator[str]:
    """A sentence on the first result of two plays that differs.

    Args:
        found: results of one.
        expected: results of the other.
        case: how the first was made.
    """
    for k, pair in enumerate(zip(found, expected, strict=False)):
        if told := difference(*pair):
            yield f"{case}: result {k} (0 is the first reset): {told}"
            return


def _named(returned: Any, names: tuple[str, ...], by: str) -> Result:
    """Copies of what was returned, by name."""
    if not isinstance(returned, tuple) or len(returned) != len(names):
        told = f"{type(returned).__name__}: {returned!r}"
        raise TypeError(f"{by} returned a {told}; expected the tuple ({', '.join(names)})")
    return copy.deepcopy(dict(zip(names, returned, strict=True)))
