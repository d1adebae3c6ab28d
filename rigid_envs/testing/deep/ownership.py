"""What is returned belongs to the caller, and what the caller gives is not changed."""

import copy
from collections.abc import Iterator
from typing import Any

from rigid_envs.testing.deep.comparison import difference, leaves
from rigid_envs.testing.deep.subject import Check, Env, Result, Subject, begin, mismatch

__all__ = ["CHECKS", "STRICT"]


def kept_observations_do_not_change(subject: Subject) -> Iterator[str]:
    """An observation that the caller keeps stays as it was returned."""
    with subject.open() as env:
        # each is copied before the next is made
        kept = [(each, copy.deepcopy(each)) for each in _returned(env, subject)]
    for k, (observation, copied) in enumerate(kept):
        if told := difference(observation, copied, "observation"):
            yield f"result {k}, kept until the end of the episode: {told}, as it was returned"
            return


def actions_are_not_changed(subject: Subject) -> Iterator[str]:
    """The caller's action is as it was."""
    with subject.open() as env:
        begin(env, subject.seed)
        for k, action in enumerate(subject.actions):
            given = copy.deepcopy(action)
            _, _, terminated, truncated, _ = env.step(given)
            if told := difference(given, action, "action"):
                yield f"step {k} changed its argument: {told}"
                return
            if terminated or truncated:
                begin(env, None)


def options_are_not_changed(subject: Subject) -> Iterator[str]:
    """The caller's options are as they were."""
    for options in ({}, subject.options):
        given = copy.deepcopy(options)
        with subject.open() as env:
            env.reset(seed=subject.seed, options=given)
            for action in subject.actions[:3]:
                _, _, terminated, truncated, _ = env.step(copy.deepcopy(action))
                if terminated or truncated:
                    break
        if told := difference(given, options, "options"):
            yield f"reset changed its argument: {told}"


def observations_may_be_written_into(subject: Subject) -> Iterator[str]:
    """What the caller writes into an observation does not change the environment."""
    found: list[Result] = []
    with subject.open() as env:
        for observation in _returned(env, subject):
            found.append({"observation": copy.deepcopy(observation)})
            for leaf in leaves(observation):
                if leaf.flags.writeable:
                    leaf.fill(1)
    expected = [{"observation": result["observation"]} for result in subject.reference]
    yield from mismatch(found, expected, "with every returned observation overwritten by 1")


CHECKS: tuple[Check, ...] = (
    kept_observations_do_not_change,
    actions_are_not_changed,
    options_are_not_changed,
)
STRICT: tuple[Check, ...] = (observations_may_be_written_into,)


def _returned(env: Env, subject: Subject) -> Iterator[Any]:
    """Every observation of the episodes as it is returned, not a copy."""
    yield env.reset(seed=subject.seed)[0]
    for action in subject.actions:
        observation, _, terminated, truncated, _ = env.step(copy.deepcopy(action))
        yield observation
        if terminated or truncated:
            yield env.reset()[0]
