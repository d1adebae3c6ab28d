"""The same seed gives the same episode, and another one another."""

import random
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from rigid_envs.testing.deep.comparison import difference
from rigid_envs.testing.deep.subject import (
    LONGEST,
    Check,
    Env,
    Result,
    Subject,
    begin,
    finish,
    mismatch,
    play,
    proceed,
)

__all__ = ["CHECKS"]

N_SEEDS = 20
STRANGE = 3_141_592_653  # a seed for what is not the environment's, which nobody gives to it
ENOUGH = 15  # of 20 starts among as many as 20 draws do not repeat; one of 10 seeds gives 10


def same_seed_again(subject: Subject) -> Iterator[str]:
    """A seed gives the same episode again in one instance."""
    with subject.open() as env:
        play(env, subject.seed, subject.actions)
        again = play(env, subject.seed, subject.actions)
    yield from mismatch(again, subject.reference, "the same seed in the same instance")


def same_seed_in_another_instance(subject: Subject) -> Iterator[str]:
    """A seed gives the same episode in every instance."""
    with subject.open() as env:
        found = play(env, subject.seed, subject.actions)
    yield from mismatch(found, subject.reference, "the same seed in another instance")


def same_seed_beside_another_instance(subject: Subject) -> Iterator[str]:
    """Another instance that is stepped in turn changes nothing."""
    with subject.open() as env, subject.open() as other:
        found = [begin(env, subject.seed)]
        begin(other, subject.seed + 1)
        for action in subject.actions:
            found += proceed(env, [action])
            proceed(other, [action])
    yield from mismatch(found, subject.reference, "with another instance stepped in turn")


def same_seed_after_a_broken_episode(subject: Subject) -> Iterator[str]:
    """An episode that was left in its middle does not change the next."""
    with subject.open() as env:
        for seed, n_steps in ((subject.seed + 1, 7), (subject.seed + 2, 0), (subject.seed, 4)):
            play(env, seed, subject.actions[::-1][:n_steps])
        found = play(env, subject.seed, subject.actions)
    yield from mismatch(found, subject.reference, "after episodes that were left in their middle")


def same_seed_after_an_end(subject: Subject) -> Iterator[str]:
    """An episode that was played to its end does not change the next."""
    with subject.open() as env:
        finish(env, subject.seed + 1, LONGEST)
        found = play(env, subject.seed, subject.actions)
    yield from mismatch(found, subject.reference, "after an episode that was played to its end")


def global_generators_are_not_used(subject: Subject) -> Iterator[str]:
    """The state of the global generators does not change an episode."""
    for state in (STRANGE, STRANGE + 1):
        _seed_global(state)
        with subject.open() as env:
            found = play(env, subject.seed, subject.actions)
        case = f"with the global generators of random and numpy seeded {state}"
        yield from mismatch(found, subject.reference, case)


def global_generators_are_not_touched(subject: Subject) -> Iterator[str]:
    """Reset and step leave the global generators as they are."""
    with subject.open() as env:
        _seed_global(STRANGE)
        before = _global_states()
        begin(env, subject.seed)
        yield from _touched(before, "reset(seed)")
        _seed_global(STRANGE)
        proceed(env, subject.actions)
        yield from _touched(before, "steps and resets without a seed")


def another_seed_starts_elsewhere(subject: Subject) -> Iterator[str]:
    """If starts differ without a seed, they differ by their seeds."""
    unseeded = []
    for _ in range(N_SEEDS):
        with subject.open() as env:
            unseeded.append(begin(env, None))
    n_unseeded = _count(unseeded)
    with subject.open() as env:
        seeded = _count(begin(env, subject.seed + k) for k in range(N_SEEDS))
    least = ENOUGH if n_unseeded == N_SEEDS else min(2, n_unseeded)
    if seeded < least:
        yield (
            f"{N_SEEDS} seeds from {subject.seed} on give {seeded} different starts, and as many "
            f"instances without a seed {n_unseeded}; expected at least {least}"
        )


def the_next_episode_goes_on_in_its_stream(subject: Subject) -> Iterator[str]:
    """Episodes that follow a seeded one without a seed are the same, too."""
    with subject.open() as env, subject.open() as other:
        found, expected = (_three_episodes(each, subject) for each in (env, other))
    yield from mismatch(found, expected, "resets without a seed after the same seed")


def seed_alone_decides_when_the_action_space_is_seeded(subject: Subject) -> Iterator[str]:
    """The environment does not draw from its action space."""
    with subject.open() as env, subject.open() as other:
        for each in (env, other):
            each.action_space.seed(STRANGE)
        found = play(env, subject.seed, subject.actions)
        drawn, expected = ([each.action_space.sample() for _ in range(3)] for each in (env, other))
    yield from mismatch(found, subject.reference, "with the action space seeded another way")
    if told := difference(drawn, expected, "action_space.sample()"):
        yield f"after the same seed of the action space and an episode: {told}"


CHECKS: tuple[Check, ...] = (
    same_seed_again,
    same_seed_in_another_instance,
    same_seed_beside_another_instance,
    same_seed_after_a_broken_episode,
    same_seed_after_an_end,
    global_generators_are_not_used,
    global_generators_are_not_touched,
    another_seed_starts_elsewhere,
    the_next_episode_goes_on_in_its_stream,
    seed_alone_decides_when_the_action_space_is_seeded,
)


def _three_episodes(env: Env, subject: Subject) -> list[Result]:
    """A start with the seed, and two more without one, each after a few steps."""
    found = play(env, subject.seed, subject.actions[:5])
    for _ in range(2):
        found += [begin(env, None), *proceed(env, subject.actions[:5])]
    return found


def _count(starts: Iterable[Result]) -> int:
    """Number of different observations."""
    distinct: list[Any] = []
    for start in starts:
        observation = start["observation"]
        if all(difference(observation, other) for other in distinct):
            distinct.append(observation)
    return len(distinct)


def _seed_global(seed: int) -> None:
    random.seed(seed)
    np.random.seed(seed)  # noqa: NPY002 - others use it


def _global_states() -> dict[str, Any]:
    return {"random": random.getstate(), "numpy.random": np.random.get_state()}  # noqa: NPY002


def _touched(before: dict[str, Any], by: str) -> Iterator[str]:
    for name, state in _global_states().items():
        if difference(state, before[name]):
            yield f"{by} changed the global generator of {name}; expected it as it was"
