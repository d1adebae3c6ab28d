"""Wrappers that record episodes: of any single environment, and of rows of a vector one."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.utils import RecordConstructorArgs
from gymnasium.vector import AutoresetMode

from rigid_envs.base.checks import Array
from rigid_envs.envs.lookup import actions_of
from rigid_envs.scores.evaluation import make_rows
from rigid_envs.scores.policies import PolicyFactory
from rigid_envs.scores.starts import TEST_SEED, play, row_seeds
from rigid_envs.tasks.task import Task
from rigid_envs.watch.replays.episode import Episode, checked_label, play_again
from rigid_envs.watch.replays.replay import Replay, id_of

# Wrappers that record episodes: of any single environment, and of rows of a vector one.


class _Recording:
    """The start and the actions of an episode that is going on."""

    def __init__(self, task: Task, start: dict[str, Array], label: str) -> None:
        self.task, self.start, self.label = task, start, label
        self.actions: list[npt.NDArray[np.float32]] = []

    def end(self, terminated: bool = False, truncated: bool = False) -> Episode:
        """The whole episode: the rest is computed again, to the same bits."""
        shape = (len(self.actions), -1) if self.actions else (0, len(self.task.actions()))
        actions = np.array(self.actions, dtype=np.float32).reshape(shape)
        ends = {"terminated": bool(terminated), "truncated": bool(truncated)}
        return play_again(self.task, self.start, actions, self.label, **ends)


class RecordReplay(gym.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Record the episodes of a single environment, and save them as a replay.

    ``env = RecordReplay(gym.make("RigidEnvs/BallPark-v0"), "first.npz")``. Other wrappers go around
    this one: what is recorded is what the environment itself receives.

    Args:
        env: An environment of this library.
        file: Where `close` saves the replay; None saves nothing.
        label: Who acts, as "policy" or "reference".
        last: How many of the last episodes are kept; None keeps all.

    Raises:
        ValueError: An environment of another kind, or with wrappers that change its actions.
    """

    def __init__(
        self, env: Any, file: str | Path | None = None, label: str = "", last: int | None = None
    ) -> None:
        """Check that the environment can be recorded."""
        RecordConstructorArgs.__init__(self, file=file, label=label, last=last)
        gym.Wrapper.__init__(self, env)
        self._task = _checked_task(env)
        self._id = id_of(env, self._task)
        self._file, self._label = file, checked_label(label)
        self._episodes: deque[Episode] = deque(maxlen=last)
        self._recording: _Recording | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; one that was left unfinished is kept as such."""
        answer = self.env.reset(seed=seed, options=options)
        self._leave()
        self._recording = _Recording(self._task, self._inner.get_state(), self._label)
        return answer

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Step, and record the action."""
        answer = self.env.step(action)
        if self._recording is not None:
            self._recording.actions.append(actions_of(self._task, action, (), self._id))
            _, _, terminated, truncated, _ = answer
            if terminated or truncated:
                self._finish(terminated, truncated)
        return answer

    @property
    def _inner(self) -> Any:
        return self.env.unwrapped

    def replay(self) -> Replay:
        """The episodes so far, the unfinished one included.

        Raises:
            ValueError: There are none.
        """
        episodes = [*self._episodes]
        if self._recording is not None and self._recording.actions:
            episodes.append(self._recording.end())
        return Replay(self._id, self._task, tuple(episodes))

    def close(self) -> None:
        """Save the replay if a file was given and there is an episode; close the environment."""
        self._leave()
        if self._file is not None and self._episodes:
            self.replay().save(self._file)
            self._file = None
        self.env.close()

    def _finish(self, terminated: bool, truncated: bool) -> None:
        """Keep an episode that has ended.

        Raises:
            ValueError: Its actions do not lead to the state of the environment.
        """
        assert self._recording is not None
        episode = self._recording.end(terminated, truncated)
        self._recording = None
        if not np.array_equal(episode.y[-1], self._inner.y):
            raise ValueError(
                f"y = {self._inner.y.tolist()}; expected {episode.y[-1].tolist()}, to which the "
                "recorded actions lead: the state was set, or the environment stepped, past "
                "RecordReplay"
            )
        self._episodes.append(episode)

    def _leave(self) -> None:
        """Keep an unfinished episode."""
        if self._recording is not None and self._recording.actions:
            self._episodes.append(self._recording.end())
        self._recording = None


class RecordRows(gym.vector.VectorWrapper):
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
        super().__init__(env)
        self._task = _checked_task(env)
        self._id = id_of(env, self._task)
        for row in rows:
            if isinstance(row, bool) or not 0 <= row < env.num_envs:
                raise ValueError(
                    f"rows = {tuple(rows)}; expected rows from 0 to {env.num_envs - 1}"
                )
        self._file, self._label, self._first = file, checked_label(label), first
        self._episodes: dict[int, list[Episode]] = {int(row): [] for row in rows}
        self._recordings: dict[int, _Recording] = {}
        self._ended: set[int] = set()

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Begin episodes; those that were left unfinished are kept as such."""
        seeds: Any = seed
        answer = self.env.reset(seed=seeds, options=options)
        mask = (options or {}).get("reset_mask")
        for row in self._episodes:
            if mask is None or mask[row]:
                self._leave(row)
                self._begin(row)
        return answer

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Step, and record the actions of the rows."""
        answer = self.env.step(actions)
        given = actions_of(self._task, actions, (self.num_envs,), self._id)
        _, _, terminated, truncated, _ = answer
        for row in self._episodes:
            if row in self._ended:  # NEXT_STEP: this step was the reset
                self._begin(row)
            elif row in self._recordings:
                self._recordings[row].actions.append(given[row].copy())
                if terminated[row] or truncated[row]:
                    self._finish(row, terminated[row], truncated[row])
        return answer

    def replay(self) -> Replay:
        """The episodes so far, row by row, the unfinished ones included.

        Raises:
            ValueError: There are none.
        """
        episodes: list[Episode] = []
        for row, found in self._episodes.items():
            going_on = self._recordings.get(row)
            episodes += [*found, *([going_on.end()] if going_on and going_on.actions else [])]
        return Replay(self._id, self._task, tuple(episodes))

    def close(self, **kwargs: Any) -> None:
        """Save the replay if a file was given and there is an episode; close the environment."""
        for row in self._episodes:
            self._leave(row)
        if self._file is not None and any(self._episodes.values()):
            self.replay().save(self._file)
            self._file = None
        self.env.close(**kwargs)

    def _begin(self, row: int) -> None:
        self._ended.discard(row)
        if self._first is None or len(self._episodes[row]) < self._first:
            inner: Any = self.env.unwrapped
            start = {name: part[row].copy() for name, part in inner.get_state().items()}
            self._recordings[row] = _Recording(self._task, start, self._label)

    def _finish(self, row: int, terminated: bool, truncated: bool) -> None:
        self._episodes[row].append(self._recordings.pop(row).end(terminated, truncated))
        mode = self.env.metadata.get("autoreset_mode")
        if mode is AutoresetMode.SAME_STEP:
            self._begin(row)
        elif mode is AutoresetMode.NEXT_STEP:
            self._ended.add(row)

    def _leave(self, row: int) -> None:
        """Keep an unfinished episode."""
        recording = self._recordings.pop(row, None)
        if recording is not None and recording.actions:
            self._episodes[row].append(recording.end())
        self._ended.discard(row)


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
    task = getattr(inner, "task", None)
    if not isinstance(task, Task) or not hasattr(inner, "get_state"):
        raise ValueError(f"env = {inner!r:.100}; expected an environment of rigid_envs")
    return task


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
