"""How episodes and environments end."""

from collections.abc import Iterator
from typing import Any

from rigid_envs.testing.deep.subject import LONGEST, Check, Subject, begin, finish

__all__ = ["CHECKS"]

N_EPISODES = 4


def the_time_limit_truncates(subject: Subject) -> Iterator[str]:
    """An episode that reaches `max_episode_steps` is truncated there, and not terminated."""
    limit = subject.spec and subject.spec.max_episode_steps
    if limit is None:
        return
    # a longer limit is looked at with a shorter one in its place
    shorter = {"max_episode_steps": LONGEST} if limit > LONGEST else {}
    with subject.open(**(shorter if subject.accepts("max_episode_steps") else {})) as env:
        limit = min(limit, LONGEST)
        # in one instance: what counts steps must begin anew
        ends = [finish(env, subject.seed + k, limit) for k in range(N_EPISODES)]
    yield from _judged(ends, limit)


def a_time_limit_of_another_length_truncates(subject: Subject) -> Iterator[str]:
    """A limit given to `gym.make` cuts an episode and changes nothing before."""
    limit = subject.spec and subject.spec.max_episode_steps
    if limit is None or limit <= 5 or callable(subject.source):
        return
    with subject.open() as env:
        before = finish(env, subject.seed, 5)
    with subject.open(max_episode_steps=5) as env:
        step, terminated, truncated = finish(env, subject.seed, 5)
    if before[0] == 5 and (step, bool(terminated), bool(truncated)) != (5, bool(before[1]), True):
        yield (
            f"with max_episode_steps=5 the last step is {step}, terminated is {terminated} and "
            f"truncated {truncated}; expected 5, {before[1]} and True"
        )


def closing_twice_is_harmless(subject: Subject) -> Iterator[str]:
    """An environment that is closed can be closed again."""
    env = subject.make()
    begin(env, subject.seed)
    env.close()
    try:
        env.close()
    except Exception as error:
        yield f"the second close raised {type(error).__name__}, expected none: {error}"


CHECKS: tuple[Check, ...] = (
    the_time_limit_truncates,
    a_time_limit_of_another_length_truncates,
    closing_twice_is_harmless,
)


def _judged(ends: list[tuple[int, Any, Any]], limit: int) -> Iterator[str]:
    """What is wrong with the ends of episodes for their limit."""
    for step, terminated, truncated in ends:
        if step == limit and not terminated and not truncated:
            yield f"step {limit} is neither terminated nor truncated, expected truncated"
            return
    steps = {step for step, _, _ in ends}
    # alone it may be chance: episodes may be terminated there, or truncated for another reason
    if steps == {limit} and all(terminated for _, terminated, _ in ends):
        yield f"all episodes are terminated at step {limit}, the limit, expected truncated"
    if len(steps) == 1 and steps != {limit} and all(truncated for _, _, truncated in ends):
        yield f"all episodes are truncated at step {steps.pop()}, expected {limit}"
