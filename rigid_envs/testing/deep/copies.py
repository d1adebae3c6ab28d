"""Copies of an environment go on as the original does."""

import copy
import pickle
from collections.abc import Callable, Iterator

import gymnasium as gym
from gymnasium.utils import EzPickle

from rigid_envs.testing.deep.subject import (
    Check,
    Env,
    Result,
    Subject,
    begin,
    mismatch,
    play,
    proceed,
)

__all__ = ["CHECKS"]


def deep_copies_go_on_alike(subject: Subject) -> Iterator[str]:
    """A deep copy goes on as the original, and neither changes the other."""
    yield from _copied(subject, copy.deepcopy, "deepcopy")


def pickles_go_on_alike(subject: Subject) -> Iterator[str]:
    """An environment that was pickled and loaded goes on as the original."""
    yield from _copied(
        subject,
        lambda env: pickle.loads(pickle.dumps(env)),  # noqa: S301 - its own
        "pickle",
    )


def its_specification_makes_the_same_environment(subject: Subject) -> Iterator[str]:
    """``gym.make(env.spec)`` gives the same episodes."""
    if subject.spec is None or callable(subject.source):
        return
    env = gym.make(subject.spec)
    try:
        found = play(env, subject.seed, subject.actions)
    finally:
        env.close()
    yield from mismatch(found, subject.reference, "gym.make(env.spec)")


CHECKS: tuple[Check, ...] = (
    deep_copies_go_on_alike,
    pickles_go_on_alike,
    its_specification_makes_the_same_environment,
)


def _copied(subject: Subject, duplicate: Callable[[Env], Env], name: str) -> Iterator[str]:
    """Findings on one way to copy, where it works at all."""
    half = len(subject.actions) // 2
    first, second = subject.actions[:half], subject.actions[half:]
    with subject.open() as env:
        play(env, subject.seed, first)
        try:
            twin = duplicate(env)
        except Exception:  # many cannot be copied: windows, engines
            return
        if isinstance(env.unwrapped, EzPickle):  # made anew from its arguments
            yield from mismatch(
                play(twin, subject.seed, subject.actions), subject.reference, f"after {name}"
            )
            return
        copied = _rest(twin, second)
        original = _rest(env, second)
        twin.close()
    with subject.open() as env:
        play(env, subject.seed, first)
        expected = _rest(env, second)
    yield from mismatch(copied, expected, f"the copy by {name} from step {half} on")
    yield from mismatch(original, expected, f"the original after {name} at step {half}")


def _rest(env: Env, actions: list[object]) -> list[Result]:
    """The episode from here on, and the beginning of the next one, without a seed."""
    return [*proceed(env, actions), begin(env, None), *proceed(env, actions[:3])]
