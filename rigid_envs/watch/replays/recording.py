"""Wrappers that record episodes: of any single environment, and of rows of a vector one."""

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.utils import RecordConstructorArgs
from gymnasium.vector import AutoresetMode

from rigid_envs.base.checks import Array, require
from rigid_envs.envs.lookup import actions_of
from rigid_envs.envs.shells import RigidEnv, RigidVectorEnv
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.policies import PolicyFactory
from rigid_envs.scores.starts import TEST_SEED, play, row_seeds
from rigid_envs.tasks.task import Task
from rigid_envs.watch.replays.replay import PastEpisode, Replay, checked_label, id_of, play_again

# Wrappers that record episodes: of any single environment, and of rows of a vector one.


class _Recorder:
    """Episodes of one row: those that have ended, and the start and actions of the present one.

    Args:
        task: The task.
        label: Who acts.
        last: How many of those that ended are kept, the latest; None keeps all.
        first: How many episodes are recorded; None records all.
    """

    def __init__(
        self, task: Task, label: str, last: int | None = None, first: int | None = None
    ) -> None:
        """Nothing goes on."""
        self._task, self._label, self._first = task, checked_label(label), first
        self.ended: deque[PastEpisode] = deque(maxlen=last)
        self._start: dict[str, Array] | None = None
        self._actions: list[npt.NDArray[np.float32]] = []

    @property
    def goes_on(self) -> bool:
        """Whether an episode is recorded now."""
        return self._start is not None

    def begin(self, start: dict[str, Array]) -> None:
        """Begin an episode; one that was left unfinished is kept as such."""
        if self._actions:
            self.ended.append(self.end())
        self._start = None
        if self._first is None or len(self.ended) < self._first:
            self._start = start

    def add(self, action: npt.NDArray[np.float32]) -> None:
        """Record the action of a step."""
        self._actions.append(action.copy())

    def end(self, terminated: bool = False, truncated: bool = False) -> PastEpisode:
        """The present episode, which is over: the rest is computed again, to the same bits."""
        episode = self._whole(terminated, truncated)
        self._start, self._actions = None, []
        return episode

    def episodes(self) -> list[PastEpisode]:
        """All that were kept, and the unfinished one."""
        return [*self.ended, *([self._whole()] if self._actions else [])]

    def _whole(self, terminated: bool = False, truncated: bool = False) -> PastEpisode:
        assert self._start is not None
        ends = {"terminated": bool(terminated), "truncated": bool(truncated)}
        return play_again(self._task, self._start, self._actions, self._label, **ends)


class _Recording:
    """What the wrappers share: a recorder for each row, and the replay of all."""

    env: Any

    def _set_up(
        self, rows: Iterable[int], file: str | Path | None, label: str, **kept: int | None
    ) -> None:
        self._task = _checked_task(self.env)
        self._id, self._file = id_of(self.env, self._task), file
        self._recorders = {row: _Recorder(self._task, label, **kept) for row in rows}

    def episodes(self) -> tuple[PastEpisode, ...]:
        """The episodes so far that had a step, row by row, the unfinished ones included."""
        return tuple(e for recorder in self._recorders.values() for e in recorder.episodes())

    def replay(self) -> Replay:
        """The replay of `episodes`.

        Raises:
            ValueError: There are none.
        """
        return Replay(self._id, self._task, self.episodes())

    def close(self, **kwargs: Any) -> None:
        """Save the replay if a file was given and there is an episode; close the environment."""
        if self._file is not None and self.episodes():
            self.replay().save(self._file)
            self._file = None
        self.env.close(**kwargs)


class RecordReplay(_Recording, gym.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Record the episodes of a single environment, and save them as a replay.

    ``env = RecordReplay(gym.make("RigidEnvs/BallPark-v0"), "first.npz")``. Other wrappers go around
    this one: what is recorded is what the environment itself receives.

    Args:
        env: An environment of this library.
        file: Where `close` saves the replay; None saves nothing.
        label: Who acts, as "policy" or "reference".
        last: How many of the latest finished episodes are kept: an older one is dropped when a new
            one ends, or is left unfinished by a reset. The one that goes on is kept beside them,
            so a replay has up to `last` + 1. None keeps all.

    Raises:
        ValueError: An environment of another kind, or with wrappers that change its actions.
    """

    def __init__(
        self, env: Any, file: str | Path | None = None, label: str = "", last: int | None = None
    ) -> None:
        """Check that the environment can be recorded."""
        RecordConstructorArgs.__init__(self, file=file, label=label, last=last)
        gym.Wrapper.__init__(self, env)
        self._set_up((0,), file, label, last=last)
        self._recorder = self._recorders[0]

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; one that was left unfinished is kept as such."""
        answer: tuple[Any, dict[str, Any]] = self.env.reset(seed=seed, options=options)
        self._recorder.begin(self.env.unwrapped.get_state())
        return answer

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Step, and record the action.

        Raises:
            ValueError: The recorded actions do not lead to the state in which the episode ended.
        """
        answer: tuple[Any, Any, bool, bool, dict[str, Any]] = self.env.step(action)
        if self._recorder.goes_on:
            self._recorder.add(actions_of(self._task, action, (), self._id))
            _, _, terminated, truncated, _ = answer
            if terminated or truncated:
                episode = self._recorder.end(terminated, truncated)
                self._compare(episode)
                self._recorder.ended.append(episode)
        return answer

    def _compare(self, episode: PastEpisode) -> None:
        y, end = self.env.unwrapped.y, episode.y[-1]
        expected = "to which the recorded actions lead: the state was set, or the environment"
        expected = f"{end.tolist()}, {expected} stepped, past RecordReplay"
        require(np.array_equal(end, y), y, "y", expected)


class RecordRows(_Recording, gym.vector.VectorWrapper):
    """Record the episodes of some rows of a native vector environment, and save them as a replay.

    ``envs = RecordRows(gym.make_vec("RigidEnvs/BallPark-v0", num_envs=8), rows=(0, 1))``. It
    works in every autoreset mode.

    Args:
        env: A vector environment of this library.
        rows: Indices of the rows.
        file: Where `close` saves the replay; None saves nothing.
        label: Who acts.
        first: How many episodes of each row are recorded; None records all.

    Raises:
        ValueError: An environment of another kind, or a row that it does not have.
    """

    def __init__(
        self,
        env: Any,
        rows: Sequence[int] = (0,),
        file: str | Path | None = None,
        label: str = "",
        first: int | None = None,
    ) -> None:
        """Check that the rows can be recorded."""
        gym.vector.VectorWrapper.__init__(self, env)
        for row in rows:
            known = not isinstance(row, bool) and 0 <= row < env.num_envs
            require(known, tuple(rows), "rows", f"rows from 0 to {env.num_envs - 1}")
        self._set_up(map(int, rows), file, label, first=first)
        self._ended: set[int] = set()  # NEXT_STEP: their next step is the reset

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Begin episodes; those that were left unfinished are kept as such."""
        seeds: Any = seed
        answer: tuple[Any, dict[str, Any]] = self.env.reset(seed=seeds, options=options)
        mask = (options or {}).get("reset_mask")
        for row in self._recorders:
            if mask is None or mask[row]:
                self._begin(row)
        return answer

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Step, and record the actions of the rows."""
        answer: tuple[Any, Any, Any, Any, dict[str, Any]] = self.env.step(actions)
        given = actions_of(self._task, actions, (self.num_envs,), self._id)
        _, _, terminated, truncated, _ = answer
        mode = self.env.metadata.get("autoreset_mode")
        for row, recorder in self._recorders.items():
            if row in self._ended:
                self._begin(row)
            elif recorder.goes_on:
                recorder.add(given[row])
                if terminated[row] or truncated[row]:
                    recorder.ended.append(recorder.end(terminated[row], truncated[row]))
                    if mode is AutoresetMode.SAME_STEP:
                        self._begin(row)
                    elif mode is AutoresetMode.NEXT_STEP:
                        self._ended.add(row)
        return answer

    def _begin(self, row: int) -> None:
        inner: Any = self.env.unwrapped
        self._ended.discard(row)
        start = {name: part[row].copy() for name, part in inner.get_state().items()}
        self._recorders[row].begin(start)


def _checked_task(env: Any) -> Task:
    """The task of an environment that can be recorded.

    Raises:
        ValueError: It has none, or a wrapper between changes the actions or the number of steps.
    """
    inner: Any = env
    while inner is not env.unwrapped:
        if isinstance(inner, gym.ActionWrapper | gym.vector.VectorActionWrapper):
            raise ValueError(
                f"env = {type(inner).__name__}(...); expected wrappers that change actions around "
                "the recording one: record first, then wrap"
            )
        inner = inner.env
    if not isinstance(inner, RigidEnv | RigidVectorEnv):
        raise ValueError(f"env = {inner!r:.100}; expected an environment of rigid_envs")
    return inner.task


# Replays of policies from the starts of the evaluation set.


def record_starts(
    policy: PolicyFactory,
    env_id: str,
    n: int = 1,
    label: str = "policy",
    seed: int = TEST_SEED,
    config: Mapping[str, Any] | None = None,
) -> Replay:
    """Play and record one episode from each of the first n starts.

    Args:
        policy: From `rigid_envs.scores.from_controller`, `from_predict` or `uniform`, for example.
        env_id: Gymnasium's id.
        n: Number of starts.
        label: Who acts.
        seed: Seed that the starts are drawn from; that of the evaluation set by default.
        config: Hyperparameters of the task.
    """
    rows = make_rows(env_id, n, config)
    envs = RecordRows(rows, rows=range(n), label=label, first=1)
    try:
        play(policy(rows), envs, row_seeds(seed, n, "test"))
        return envs.replay()
    finally:
        envs.close()
