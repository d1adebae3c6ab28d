"""Spaces of tasks, infos, streams of seeds, time limits."""

from collections.abc import Iterator
from contextlib import contextmanager
from operator import itemgetter
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.error import Error
from gymnasium.utils import seeding

from rigid_envs.base.checks import Array, Bools, ConfigError, safe_repr
from rigid_envs.engine.layout import FLAGS
from rigid_envs.tasks.core import Core
from rigid_envs.tasks.task import Task

# Spaces of a task, and the keys of its infos.


def action_space(task: Task) -> spaces.Space[Any]:
    """Box(-1, 1) with one entry for each action entry; Discrete for discrete actions."""
    if task.n_choices:
        return spaces.Discrete(task.n_choices)
    return spaces.Box(-1.0, 1.0, (len(task.episode.prototypes.action),), np.float32)


def observation_space(task: Task) -> spaces.Space[Any]:
    """Box with the bounds of the task's observation entries; a Dict of boxes for a goal task."""
    entries, n = task.observations(), task.n_goal
    low = np.array([entry.low for entry in entries], dtype=np.float32)
    high = np.array([entry.high for entry in entries], dtype=np.float32)
    if not n:
        return spaces.Box(low, high, dtype=np.float32)
    ends = zip(goal_parts(low, n).items(), goal_parts(high, n).values(), strict=True)
    return spaces.Dict({name: spaces.Box(least, most) for (name, least), most in ends})


def goal_parts(flat: npt.NDArray[np.float32], n_goal: int) -> dict[str, npt.NDArray[np.float32]]:
    """Views of the parts of a flat observation (..., 2 n_goal + n) of a goal task."""
    return {
        "observation": flat[..., 2 * n_goal :],
        "achieved_goal": flat[..., :n_goal],
        "desired_goal": flat[..., n_goal : 2 * n_goal],
    }


def info_keys(task: Task) -> tuple[str, ...]:
    """Keys of every info: numbers, then flags."""
    return (*info_numbers(task), *info_flags(task))


def info_numbers(task: Task) -> tuple[str, ...]:
    """Cost, unweighted reward terms, and what a contact with the ground bears."""
    return ("cost", *(f"reward/{term}" for term in task.terms), *task.episode.ground.names)


def info_flags(task: Task) -> tuple[str, ...]:
    """Flags of every info, in the order of those of a row after its two ends."""
    return FLAGS._fields[2:] if task.episode.ground.names else FLAGS._fields[2:-1]


# Infos of a vector environment: one array over the rows for each key.

# rows of an array: a third of the time that it takes to iterate over it
_flags_by_row = itemgetter(*range(len(FLAGS)))


class Infos:
    """Infos of the rows of a `Core`, each with a mask in which all rows are set."""

    def __init__(self, core: Core) -> None:
        """Prepare keys and masks."""
        self._core = core
        self._numbers, self._flags = info_numbers(core.task), info_flags(core.task)
        self._keys = info_keys(core.task)
        everywhere = np.ones(core.n_rows, dtype=np.bool_)
        everywhere.flags.writeable = False
        self._masks: dict[str, Any] = {f"_{key}": everywhere for key in self._keys}
        self._blank = dict.fromkeys(self._keys) | self._masks
        self._results_by_row = itemgetter(*range(len(self._numbers) + 1))

    def of_reset(self) -> dict[str, Any]:
        """Zeros, of the types that a step gives."""
        zeros: dict[str, Any] = {
            key: np.zeros(self._core.n_rows, dtype=np.float64 if key in self._numbers else np.bool_)
            for key in self._keys
        }
        return {**zeros, **self._masks}

    def of_step(self) -> tuple[Array, Bools, Bools, dict[str, Any]]:
        """Rewards, terminated, truncated and infos of the last step."""
        results, _, all_flags = self._core.outputs
        numbers = self._results_by_row(results)  # the last one is the reward
        terminated, truncated, *flags = _flags_by_row(all_flags)
        infos = self._blank.copy()
        for key, number in zip(self._numbers, numbers):  # noqa: B905 - ends with the keys
            infos[key] = number
        for key, flag in zip(self._flags, flags):  # noqa: B905 - ends with the keys
            infos[key] = flag
        return numbers[-1], terminated, truncated, infos

    def now(self) -> dict[str, Any]:
        """Infos of the last step; those of rows that have begun an episode since are zero."""
        self._core.renew_outputs()  # the old ones are with who has made the last step
        *_, infos = self.of_step()
        self._clear(infos, self._core.elapsed == 0.0)
        return infos

    def keep_final(self, infos: dict[str, Any], ended: Bools) -> None:
        """Move the infos of rows that ended to `final_info`, and add their last observations.

        Args:
            infos: changed: those of the rows are zero.
            ended: the rows, shape (N,).
        """
        infos["final_info"] = {
            **{key: np.where(ended, infos[key], 0).astype(infos[key].dtype) for key in self._keys},
            **{f"_{key}": ended for key in self._keys},
        }
        infos["final_obs"] = self._core.observations.copy()
        infos["_final_obs"] = infos["_final_info"] = ended
        self._clear(infos, ended)

    def _clear(self, infos: dict[str, Any], rows: Bools) -> None:
        for key in self._keys:
            infos[key][rows] = 0


# Keys of the random streams of rows.


def stream_key(generator: np.random.Generator) -> np.uint64:
    """Key of the random stream of one row, drawn from its generator."""
    return np.uint64(generator.integers(0, 2**64, dtype=np.uint64))


def seeded_key(seed: int) -> np.uint64:
    """Key of a row with a given seed, the same in single and vector environments."""
    return stream_key(seeding.np_random(python_seed(seed))[0])


def python_seed(seed: Any) -> Any:
    """A seed as a Python integer, which is what Gymnasium takes, or None.

    Raises:
        gymnasium.error.Error: no integer of at least 0.
    """
    whole = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
    if seed is None or (whole and seed >= 0):
        return seed if seed is None else int(seed)
    raise Error(f"Seed = {safe_repr(seed)}; expected an integer of at least 0, or None")


def seeds_of(seed: Any, num_envs: int, env_id: str) -> list[Any]:
    """Seed of each row: s + i for row i of one seed s; None where there is none.

    Raises:
        gymnasium.error.Error: no integer of at least 0, and no sequence of such or None.
        ValueError: another number of seeds than rows.
    """
    if isinstance(seed, np.ndarray) and seed.ndim == 1:
        seed = list(seed)
    if not isinstance(seed, list | tuple):
        first = python_seed(seed)
        return [None if first is None else first + i for i in range(num_envs)]
    if len(seed) != num_envs:
        expected = f"{num_envs}, one for each row"
        raise ValueError(f"{env_id}: seed has {len(seed)} entries; expected {expected}")
    return [python_seed(each) for each in seed]


@contextmanager
def undone_if_refused(env: Any) -> Iterator[None]:
    """A reset to a given start that is refused, as it may be after all has been drawn: undo it.

    Rows, random streams and generator are then as before.
    """
    attributes, rows = dict(env.__dict__), env._core.buffer.copy()
    generator = env._np_random
    drawn = None if generator is None else generator.bit_generator.state
    try:
        yield
    except Exception:
        env.__dict__.clear()
        env.__dict__.update(attributes)
        env._core.buffer[:] = rows
        if generator is not None:
            generator.bit_generator.state = drawn
        raise


# Number of steps for which the integrator stays within its stability envelope.


def checked_steps(task: Task, max_episode_steps: int | None) -> int:
    """Check the stability envelope up to the time limit; returns the limit in steps.

    Args:
        task: The task, which has already checked the registered limit.
        max_episode_steps: Time limit in force; None takes the registered one, as Gymnasium does
            not pass the limit to a single environment.

    Raises:
        ConfigError: the rates may leave the envelope before the limit.
    """
    if max_episode_steps is None:
        return task.registered_steps()
    task.check_duration(max_episode_steps)
    return max_episode_steps


def further_steps(task: Task, elapsed: int, name: str) -> int:
    """Number of further steps before the rates may leave the envelope.

    Raises:
        ConfigError: no further step is allowed; the message names the remedy.
    """
    left = task.stable_steps() - elapsed
    if left > 0:
        return left
    try:
        task.check_duration(elapsed + 1)
    except ConfigError as error:
        expected = f"expected a reset before: {error}"
        raise ConfigError(f"{name}: elapsed = {elapsed} steps; {expected}") from None
    return 1
