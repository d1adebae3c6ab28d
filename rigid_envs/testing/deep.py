"""`deep_check`: what a correct Gymnasium environment does, beyond what `check_env` looks at.

A check is a generator of findings, each a sentence; its docstring is the claim.
"""

import copy
import inspect
import pickle
import random
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.utils import EzPickle

Env = gym.Env[Any, Any]
Result = dict[str, Any]
"""What reset or step returned, by name, copied when it was returned."""

STEP = ("observation", "reward", "terminated", "truncated", "info")
N_STEPS = 60  # of the episodes that are compared
LONGEST = 1000  # steps of an episode that is played to its end, if it has one
EVERY = 15  # steps between pictures
N_SEEDS = 20
STRANGE = 3_141_592_653  # a seed for what is not the environment's, which nobody gives to it
ENOUGH = 15  # of 20 starts among as many as 20 draws do not repeat; one of 10 seeds gives 10
_FINDINGS_OF_A_CHECK = 3
_REAL = (int, float, np.integer, np.floating)
# seconds since the start, of gymnasium.wrappers.RecordEpisodeStatistics: the clock, not the episode
_CLOCK = "info['episode']['t']"


class DeepCheckError(AssertionError):
    """An environment does what no correct one does.

    Attributes:
        findings: All that was found, each as a sentence that begins with the name of the check.
    """

    def __init__(self, findings: Iterable[str]) -> None:
        """Make the message: one finding in a line."""
        self.findings = tuple(findings)
        count = len(self.findings)
        super().__init__("\n- ".join([f"{count} finding{'s'[: count > 1]}:", *self.findings]))


def deep_check(
    env_id: str | Callable[..., Env],
    /,
    *,
    seed: int = 0,
    strict: bool = False,
    options: dict[str, Any] | None = None,
    **kwargs: Any,
) -> None:
    """Check any Gymnasium environment beyond `gymnasium.utils.env_checker.check_env`.

    Episodes of random actions are the same in every bit for the same seed, however they are run;
    results are of the declared kind and belong to the caller; what the caller gives is not changed;
    the time limit truncates; copies go on as the original; pictures change nothing. An environment
    whose specification says ``nondeterministic`` is not asked for the same bits. The global random
    generators are left as they are.

    Args:
        env_id: Gymnasium's id, or a callable that makes an environment.
        seed: seed of the episodes that are looked at, from 0.
        strict: also what some of Gymnasium's own environments do not do: observations can be
            written into without harm, and NaN in an action is refused or harmless.
        options: options of a reset that the environment accepts, to see that they are not changed.
        **kwargs: arguments of `gymnasium.make`, or of the callable.

    Raises:
        DeepCheckError: with all findings, each a sentence.
        Exception: whatever making an environment raises.
    """
    subject = Examined(env_id, kwargs, seed, options or {})
    with _generators_kept():
        is_random = subject.spec is not None and bool(subject.spec.nondeterministic)
        findings = list(_attempt(first_episode, subject))
        if not findings:
            checks = CHECKS + (() if is_random else REPRODUCIBLE) + STRICT * strict
            findings = [told for check in checks for told in _attempt(check, subject)]
    if findings:
        raise DeepCheckError(findings)


@dataclass(frozen=True)
class Examined:
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

    @contextmanager
    def open(self, **more: Any) -> Iterator[Env]:
        """A new environment that is closed at the end."""
        if callable(self.source):
            env = self.source(**self.kwargs, **more)
        else:  # the messages of its checker would stand before ours, and stop at the first
            env = gym.make(self.source, disable_env_checker=True, **self.kwargs, **more)
        with closing(env):
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


Check = Callable[[Examined], Iterator[str]]


def begin(env: Env, seed: int | None) -> Result:
    """Reset, and what that returned."""
    return _named(env.reset(seed=seed), ("observation", "info"), "reset")


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


def _named(returned: Any, names: tuple[str, ...], by: str) -> Result:
    """Copies of what was returned, by name."""
    if not isinstance(returned, tuple) or len(returned) != len(names):
        told = f"{type(returned).__name__}: {returned!r}"
        raise TypeError(f"{by} returned a {told}; expected the tuple ({', '.join(names)})")
    return copy.deepcopy(dict(zip(names, returned, strict=True)))


# Where two results differ, in every bit.


def difference(found: Any, expected: Any, where: str = "") -> str | None:
    """First difference in type or bits as "PLACE is X, expected Y"; None if there is none.

    Args:
        found: numbers, strings and arrays in dictionaries, lists and tuples.
        expected: the same; objects of other types are not compared.
        where: name of the place.
    """
    if where.endswith(_CLOCK):
        return None
    if type(found) is not type(expected):
        return f"{where} is of type {type(found).__name__}, expected {type(expected).__name__}"
    if isinstance(found, Mapping):
        if found.keys() != expected.keys():
            return f"{where} has the keys {list(found)}, expected {list(expected)}"
        # steps have names, their parts have keys
        parts = ((key, f"{where}[{key!r}]" if where else f"{key}") for key in found)
    elif isinstance(found, list | tuple):
        if len(found) != len(expected):
            return f"{where} has length {len(found)}, expected {len(expected)}"
        parts = ((k, f"{where}[{k}]") for k in range(len(found)))
    else:
        same = _same_bits(found, expected)
        return None if same else f"{where} is {found!r}, expected {expected!r}"
    told = (difference(found[key], expected[key], place) for key, place in parts)
    return next(filter(None, told), None)


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


def _same_bits(a: Any, b: Any) -> bool:
    """Whether two values of one type are equal; objects that can be anything are."""
    if isinstance(a, str | bytes):
        return bool(a == b)
    x, y = np.asarray(a), np.asarray(b)
    if (x.dtype, x.shape) != (y.dtype, y.shape):
        return False
    if x.dtype == object:
        return not x.shape or difference(x.tolist(), y.tolist()) is None
    return x.tobytes() == y.tobytes()


def _leaves(value: Any) -> list[np.ndarray[Any, Any]]:
    """All arrays in nested dictionaries, lists and tuples."""
    if isinstance(value, np.ndarray):
        return [value]
    if isinstance(value, Mapping):
        value = tuple(value.values())
    if isinstance(value, list | tuple):
        return [leaf for part in value for leaf in _leaves(part)]
    return []


# What reset and step return is of the declared kind, and belongs to the caller.


def first_episode(subject: Examined) -> Iterator[str]:
    """It can be reset, and stepped with actions of its space; else no check has a sense."""
    assert subject.reference
    yield from ()


def results_are_of_their_declared_kinds(subject: Examined) -> Iterator[str]:
    """Observations are in their space, rewards finite, flags bools, keys of info strings."""
    with subject.open() as env:
        space = env.observation_space
    kinds: dict[str, tuple[Callable[[Any], bool], str]] = {
        "observation": (lambda x: _is_array_of(space, x) and space.contains(x), f"one of {space}"),
        "reward": (lambda x: isinstance(x, _REAL) and bool(np.isfinite(x)), "a finite real number"),
        "terminated": (lambda x: isinstance(x, bool | np.bool_), "a bool"),
        "truncated": (lambda x: isinstance(x, bool | np.bool_), "a bool"),
        "info": (
            lambda x: isinstance(x, dict) and all(isinstance(key, str) for key in x),
            "a dict with strings as keys",
        ),
    }
    for k, result in enumerate(subject.reference):
        for name, value in result.items():
            is_right, expected = kinds[name]
            if not is_right(value):
                yield f"result {k} (0 is the first reset): {name} is {value!r}, expected {expected}"
                return


def nan_in_an_action_gives_no_nan(subject: Examined) -> Iterator[str]:
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
    if not all(np.isfinite(leaf).all() for leaf in [*_leaves(observation), np.asarray(reward)]):
        yield (
            f"step(nan) returned the observation {observation} and the reward {reward}; "
            "expected an error, or finite numbers"
        )


def actions_are_not_changed(subject: Examined) -> Iterator[str]:
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


def options_are_not_changed(subject: Examined) -> Iterator[str]:
    """The caller's options are as they were."""
    for options in ({}, subject.options):
        given = copy.deepcopy(options)
        with subject.open() as env:
            env.reset(seed=subject.seed, options=given)
        if told := difference(given, options, "options"):
            yield f"reset changed its argument: {told}"


def observations_may_be_written_into(subject: Examined) -> Iterator[str]:
    """What the caller writes into an observation does not change the environment."""
    found: list[Result] = []

    def overwrite(observation: Any) -> None:
        found.append({"observation": copy.deepcopy(observation)})
        for leaf in _leaves(observation):
            if leaf.flags.writeable:
                leaf.fill(1)

    with subject.open() as env:
        overwrite(env.reset(seed=subject.seed)[0])
        for action in subject.actions:
            observation, _, terminated, truncated, _ = env.step(copy.deepcopy(action))
            overwrite(observation)
            if terminated or truncated:
                overwrite(env.reset()[0])
    expected = [{"observation": result["observation"]} for result in subject.reference]
    yield from mismatch(found, expected, "with every returned observation overwritten by 1")


def _is_array_of(space: gym.Space[Any], value: Any) -> bool:
    """Whether it is an array where the space is a box, which takes lists, too."""
    return isinstance(value, np.ndarray) or not isinstance(space, spaces.Box)


# How episodes and environments end.


def the_time_limit_truncates(subject: Examined) -> Iterator[str]:
    """An episode that reaches `max_episode_steps` is truncated there, and not terminated."""
    limit = subject.spec and subject.spec.max_episode_steps
    if limit is None:
        return
    # a longer limit is looked at with a shorter one in its place
    shorter = {"max_episode_steps": LONGEST} if limit > LONGEST else {}
    with subject.open(**(shorter if subject.accepts("max_episode_steps") else {})) as env:
        limit = min(limit, LONGEST)
        # in one instance: what counts steps must begin anew
        ends = [finish(env, subject.seed + k, limit) for k in range(4)]
    if any(step == limit and not (ended or cut) for step, ended, cut in ends):
        yield f"step {limit} is neither terminated nor truncated, expected truncated"
        return
    steps = {step for step, _, _ in ends}
    # alone it may be chance: episodes may be terminated there, or truncated for another reason
    if steps == {limit} and all(ended for _, ended, _ in ends):
        yield f"all episodes are terminated at step {limit}, the limit, expected truncated"
    if len(steps) == 1 and steps != {limit} and all(cut for _, _, cut in ends):
        yield f"all episodes are truncated at step {steps.pop()}, expected {limit}"


def closing_twice_is_harmless(subject: Examined) -> Iterator[str]:
    """An environment that is closed can be closed again."""
    with subject.open() as env:
        begin(env, subject.seed)
        env.close()
    yield from ()


# The same seed gives the same episode, and another one another.


def same_seed_again(subject: Examined) -> Iterator[str]:
    """A seed gives the same episode again in one instance."""
    with subject.open() as env:
        play(env, subject.seed, subject.actions)
        again = play(env, subject.seed, subject.actions)
    yield from mismatch(again, subject.reference, "the same seed in the same instance")


def same_seed_beside_another_instance(subject: Examined) -> Iterator[str]:
    """A seed gives the same episode in every instance, also where another is stepped in turn."""
    with subject.open() as env, subject.open() as other:
        found = [begin(env, subject.seed)]
        begin(other, subject.seed + 1)
        for action in subject.actions:
            found += proceed(env, [action])
            proceed(other, [action])
    yield from mismatch(found, subject.reference, "with another instance stepped in turn")


def same_seed_after_another_episode(subject: Examined) -> Iterator[str]:
    """Episodes that were left in their middle, or played to their end, do not change the next."""
    with subject.open() as env:
        for seed, n_steps in ((subject.seed + 1, 7), (subject.seed + 2, 0), (subject.seed, 4)):
            play(env, seed, subject.actions[::-1][:n_steps])
        left = play(env, subject.seed, subject.actions)
    with subject.open() as env:
        finish(env, subject.seed + 1, LONGEST)
        ended = play(env, subject.seed, subject.actions)
    yield from mismatch(left, subject.reference, "after episodes that were left in their middle")
    yield from mismatch(ended, subject.reference, "after an episode that was played to its end")


def global_generators_are_not_used(subject: Examined) -> Iterator[str]:
    """The state of the global generators does not change an episode."""
    for state in (STRANGE, STRANGE + 1):
        _seed_global(state)
        with subject.open() as env:
            found = play(env, subject.seed, subject.actions)
        case = f"with the global generators of random and numpy seeded {state}"
        yield from mismatch(found, subject.reference, case)


def global_generators_are_not_touched(subject: Examined) -> Iterator[str]:
    """Reset and step leave the global generators as they are."""
    with subject.open() as env:
        _seed_global(STRANGE)
        before = _global_states()
        begin(env, subject.seed)
        yield from _touched(before, "reset(seed)")
        _seed_global(STRANGE)
        proceed(env, subject.actions)
        yield from _touched(before, "steps and resets without a seed")


def another_seed_starts_elsewhere(subject: Examined) -> Iterator[str]:
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


def the_next_episode_goes_on_in_its_stream(subject: Examined) -> Iterator[str]:
    """Episodes that follow a seeded one without a seed are the same, too."""
    with subject.open() as env, subject.open() as other:
        found, expected = (
            play(each, subject.seed, subject.actions[:5]) + _rest(each, subject.actions[:5])
            for each in (env, other)
        )
    yield from mismatch(found, expected, "resets without a seed after the same seed")


def seed_alone_decides_when_the_action_space_is_seeded(subject: Examined) -> Iterator[str]:
    """The environment does not draw from its action space."""
    with subject.open() as env, subject.open() as other:
        for each in (env, other):
            each.action_space.seed(STRANGE)
        found = play(env, subject.seed, subject.actions)
        drawn, expected = ([each.action_space.sample() for _ in range(3)] for each in (env, other))
    yield from mismatch(found, subject.reference, "with the action space seeded another way")
    if told := difference(drawn, expected, "action_space.sample()"):
        yield f"after the same seed of the action space and an episode: {told}"


def _rest(env: Env, actions: list[Any]) -> list[Result]:
    """The episode from here on, and the beginning of the next one, without a seed."""
    return [*proceed(env, actions), begin(env, None), *proceed(env, actions[:3])]


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


@contextmanager
def _generators_kept() -> Iterator[None]:
    """Leave the global generators of Python and NumPy as they are found."""
    states = _global_states()
    try:
        yield
    finally:
        random.setstate(states["random"])
        np.random.set_state(states["numpy.random"])  # noqa: NPY002


def _touched(before: dict[str, Any], by: str) -> Iterator[str]:
    for name, state in _global_states().items():
        if difference(state, before[name]):
            yield f"{by} changed the global generator of {name}; expected it as it was"


# Copies and pictures are of the same episode.


def copies_go_on_alike(subject: Examined) -> Iterator[str]:
    """A deep copy and a pickle go on as the original, and do not change it."""
    half = len(subject.actions) // 2
    first, second = subject.actions[:half], subject.actions[half:]
    ways: dict[str, Callable[[Env], Env]] = {
        "deepcopy": copy.deepcopy,
        "pickle": lambda env: pickle.loads(pickle.dumps(env)),  # noqa: S301 - its own
    }
    for name, duplicate in ways.items():
        with subject.open() as env:
            play(env, subject.seed, first)
            try:
                twin = duplicate(env)
            except Exception:  # many cannot be copied: windows, engines
                continue
            if isinstance(env.unwrapped, EzPickle):  # made anew from its arguments
                again = play(twin, subject.seed, subject.actions)
                yield from mismatch(again, subject.reference, f"after {name}")
                continue
            copied, original = _rest(twin, second), _rest(env, second)
            twin.close()
        with subject.open() as env:
            play(env, subject.seed, first)
            expected = _rest(env, second)
        yield from mismatch(copied, expected, f"the copy by {name} from step {half} on")
        yield from mismatch(original, expected, f"the original after {name} at step {half}")


def pictures_are_rgb_arrays_and_change_nothing(subject: Examined) -> Iterator[str]:
    """``render_mode="rgb_array"`` gives uint8 (h, w, 3), and the same episode."""
    if not _draws(subject):
        return
    with subject.open(render_mode="rgb_array") as env:
        found, frames = [begin(env, subject.seed)], [env.render()]
        for k in range(0, len(subject.actions), EVERY):
            found += proceed(env, subject.actions[k : k + EVERY])
            frames.append(env.render())
    for k, frame in enumerate(map(np.asarray, frames)):
        if frame.dtype != np.uint8 or frame.ndim != 3 or frame.shape[2] != 3:
            told = f"has type {frame.dtype} and shape {frame.shape}"
            yield f"render() after {k * EVERY} steps {told}, expected uint8 of shape (h, w, 3)"
            break
    yield from mismatch(found, subject.reference, "with render() in between")


def _draws(subject: Examined) -> bool:
    """Whether pictures are offered, and can be made here: packages and drivers may be missing."""
    with subject.open() as env:
        modes = env.metadata.get("render_modes") or ()
    given = "render_mode" in subject.kwargs or not subject.accepts("render_mode")
    if given or "rgb_array" not in modes:
        return False
    try:
        with subject.open(render_mode="rgb_array") as env:
            begin(env, subject.seed)
            env.render()
    except Exception:  # each driver has errors of its own; `check_env` shows them
        return False
    return True


CHECKS: tuple[Check, ...] = (
    results_are_of_their_declared_kinds,
    actions_are_not_changed,
    options_are_not_changed,
    the_time_limit_truncates,
    closing_twice_is_harmless,
)
"""What every environment does."""

REPRODUCIBLE: tuple[Check, ...] = (
    same_seed_again,
    same_seed_beside_another_instance,
    same_seed_after_another_episode,
    global_generators_are_not_used,
    global_generators_are_not_touched,
    another_seed_starts_elsewhere,
    the_next_episode_goes_on_in_its_stream,
    seed_alone_decides_when_the_action_space_is_seeded,
    copies_go_on_alike,
    pictures_are_rgb_arrays_and_change_nothing,
)
"""What every environment does whose specification does not say that it is nondeterministic."""

STRICT: tuple[Check, ...] = (observations_may_be_written_into, nan_in_an_action_gives_no_nan)
"""What good environments do, and some of Gymnasium's own do not."""


def _attempt(check: Check, subject: Examined) -> Iterator[str]:
    """Findings of a check; an exception is one too."""
    try:
        for told in islice(check(subject), _FINDINGS_OF_A_CHECK):
            yield f"{check.__name__}: {told}"
    except Exception as error:
        yield f"{check.__name__}: {type(error).__name__} was raised, expected none: {error}"
