"""Look-up of registered environments, their arguments, their compilation before use."""

import dataclasses
import difflib
import importlib
import logging
import multiprocessing
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode

from rigid_envs.base.checks import ConfigError, as_array, one_of, printable, require, safe_repr
from rigid_envs.base.settings import from_config, refusal
from rigid_envs.engine.compiler import KernelCache
from rigid_envs.tasks.core import Core
from rigid_envs.tasks.registry import ENVIRONMENTS
from rigid_envs.tasks.task import Task

# Arguments of the environments: task and settings, actions, options of a reset.

FLOAT32 = np.dtype(np.float32)
INTEGERS = (int, np.int64)
_MOST = 2**53
_TASK = "'module:Class' of a rigid_envs.tasks.Task"


def new_task(task: str, config: Mapping[str, Any]) -> Task:
    """Make the task "module:Class" with the given configuration.

    Raises:
        UnknownKeywordError: unknown key; suggests the most similar one.
        ConfigError: wrong value; names the key and the allowed values.
    """
    try:
        module, name = task.split(":")
        kind = getattr(importlib.import_module(module), name)
    except (AttributeError, ImportError, TypeError, ValueError) as error:
        raise refusal("task", task, f"{_TASK}: {error}") from error
    if not (isinstance(kind, type) and issubclass(kind, Task)):
        raise refusal("task", task, _TASK)
    return from_config(kind, config)


def check_counts(num_envs: Any, num_threads: Any, max_episode_steps: Any) -> None:
    """Check the numbers of rows, threads and steps.

    Raises:
        ConfigError: one is not an integer from 1; `max_episode_steps` may be None.
    """
    limit = 1 if max_episode_steps is None else max_episode_steps
    counts = {"num_envs": num_envs, "num_threads": num_threads, "max_episode_steps": limit}
    for name, value in counts.items():
        whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
        if not (whole and 1 <= value <= _MOST):
            raise refusal(name, value, f"an integer from 1 to {_MOST}")


def autoreset_of(mode: Any) -> AutoresetMode:
    """A mode of Gymnasium by itself or by its value.

    Raises:
        ConfigError: no such mode.
    """
    try:
        return AutoresetMode(mode)
    except Exception:  # also of an object that cannot be compared or shown
        modes = [known.value for known in AutoresetMode]
        raise refusal("autoreset_mode", mode, f"one of {modes}") from None


def actions_of(
    task: Task, value: Any, lead: tuple[int, ...], env_id: str
) -> npt.NDArray[np.float32]:
    """Check an action and convert it to float32, shape (*lead, n_action).

    Raises:
        ValueError: names the environment, the entry, its value and what was expected.
    """
    n, entry = task.n_choices, () if task.n_choices else (len(task.episode.prototypes.action),)
    if lead and isinstance(value, list | tuple) and len(value) == lead[0]:
        rows = [_action(n, row, entry, env_id, f"action[{k}]") for k, row in enumerate(value)]
        array = np.stack(rows)
    else:
        array = _action(n, value, (*lead, *entry), env_id, "action")
    return array.reshape(*lead, -1)


def _action(
    n: int, value: Any, shape: tuple[int, ...], env_id: str, name: str
) -> npt.NDArray[np.float32]:
    """Numbers, or where there are some n choices."""
    expected = f"an integer from 0 to {n - 1}" if n else "finite numbers in [-1, 1]"
    expected = f"expected {expected}" + (f" in shape {shape}" if shape else "")
    array = as_array(value)
    if array.dtype.kind not in ("iu" if n else "fiu"):
        raise ValueError(f"{env_id}: {name} = {safe_repr(value)}; {expected}")
    if array.shape != shape:
        raise ValueError(f"{env_id}: {name} has shape {array.shape}; {expected}")
    with np.errstate(over="ignore"):
        single = array.astype(np.float32)
    known = np.asarray((array >= 0) & (array < n) if n else np.isfinite(single))
    if not known.all():
        index = tuple(np.argwhere(~known)[0].tolist())
        raise ValueError(f"{env_id}: {name}{list(index) or ''} = {array[index]}; {expected}")
    return single


def options_of(
    options: Mapping[str, Any] | None, known: tuple[str, ...], env_id: str
) -> Mapping[str, Any]:
    """Check the keys of the options of a reset.

    Raises:
        ValueError: names the key and the known ones.
    """
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise ValueError(f"{env_id}: options = {safe_repr(options)}; expected a dict or None")
    for key in options:
        one_of(key, known, f"{env_id}: key of options")
    return options


def row_of(row: Any, num_envs: int, env_id: str) -> int:
    """Index of a row.

    Raises:
        ValueError: no integer from 0 to num_envs - 1.
    """
    whole = isinstance(row, int | np.integer) and not isinstance(row, bool)
    known = f"an integer from 0 to {num_envs - 1}"
    require(whole and 0 <= row < num_envs, row, f"{env_id}: row", known)
    return int(row)


def rows_of(mask: Any, num_envs: int, env_id: str) -> npt.NDArray[np.int64]:
    """Indices of the rows that a reset mask selects; of all rows for None.

    Raises:
        ValueError: no bool array of shape (num_envs,), or no row is selected.
    """
    if mask is None:
        return np.arange(num_envs)
    name = f"{env_id}: options['reset_mask']"
    if not (isinstance(mask, np.ndarray) and mask.dtype == bool and mask.shape == (num_envs,)):
        expected = f"a bool array of shape ({num_envs},)"
        raise ValueError(f"{name} = {safe_repr(mask)}; expected {expected}")
    if not mask.any():
        raise ValueError(f"{name} = False everywhere; expected a row to reset")
    return np.flatnonzero(mask)


def shown_rows(rows: Any, num_envs: int) -> tuple[int, ...]:
    """Indices of the rows of which pictures are made; of all rows for None.

    Raises:
        ConfigError: not some indices from 0 to num_envs - 1.
    """
    if rows is None:
        return tuple(range(num_envs))
    given = as_array(rows)
    inside = given.dtype.kind in "iu" and ((given >= 0) & (given < num_envs)).all()
    if given.ndim != 1 or not given.size or not inside:
        expected = f"None or a sequence of indices from 0 to {num_envs - 1}"
        raise refusal("render_rows", rows, expected)
    return tuple(given.tolist())


# Look-up of registered environments by id.

SEEN = ("rotation", "observe_params", "frame")
"""Settings that change what is seen of a task, and not the task."""


class UnknownIdError(ConfigError):
    """No environment of that id is registered."""


def full_id(env_id: str) -> str:
    """The id that a short form means: of "BallPark" and "BallPark-v0" "RigidEnvs/BallPark-v0".

    Of several versions it is the newest. Any other text, and a name that two namespaces have, is
    given back as it is.

    Args:
        env_id: An id or a short form.
    """
    if env_id in ENVIRONMENTS:
        return env_id
    meant = [known for known in ENVIRONMENTS if env_id in _short_forms(known)]
    if len({known.rpartition("/")[0] for known in meant}) != 1:
        return env_id
    return max(meant, key=_version)


def _version(env_id: str) -> int:
    number = env_id.rpartition("-v")[2]
    return int(number) if number.isdecimal() else 0


def _short_forms(env_id: str) -> set[str]:
    bare, _, version = env_id.rpartition("-v")
    forms = {env_id, bare} if version.isdecimal() else {env_id}
    return forms | {form.rpartition("/")[2] for form in forms}


def checked_id(env_id: str) -> str:
    """A registered id; of "module:id", the module is imported first, as `gym.make` does.

    Args:
        env_id: An id or a short form, see `full_id`.

    Raises:
        UnknownIdError: names the nearest id.
        ValueError: no text.
    """
    require(isinstance(env_id, str), env_id, "env_id", "the id of an environment, a text")
    module, colon, name = env_id.rpartition(":")
    if colon:
        try:
            importlib.import_module(module)
        except (ModuleNotFoundError, ValueError) as error:
            expected = f"a module that can be imported: {error}"
            raise UnknownIdError(f"env_id = {env_id!r}; expected {expected}") from None
    name = full_id(name)
    if name in ENVIRONMENTS:
        return name
    raise UnknownIdError(
        f"env_id = {env_id!r}; expected the id of an environment: did you mean "
        f"{nearest_id(name, ENVIRONMENTS)!r}? `rigid-envs list` shows all of them, and with "
        "--allow-import MODULE those of a package"
    )


def nearest_id(name: str, known: Iterable[str]) -> str:
    """The id that a misspelt one is most like, in short or in full.

    Args:
        name: The misspelt id.
        known: All ids.
    """
    back = reversed(list(known))  # of several with the same short form, the first one stays
    forms = {form.lower(): env_id for env_id in back for form in _short_forms(env_id)}
    return forms[difflib.get_close_matches(name.lower(), forms, n=1, cutoff=0.0)[0]]


def id_in_file(env_id: Any) -> str:
    """The id that a file names, without a module: nothing is imported because a file says so.

    Args:
        env_id: What the file has; "module:id" of an environment of another package.

    Raises:
        ValueError: no text that can be shown.
    """
    require(isinstance(env_id, str), env_id, "env_id", "the id of an environment")
    return str(printable(env_id, "env_id")).rpartition(":")[2]


def task_of(env_id: str, config: Mapping[str, Any] | None = None) -> Task:
    """The task of an id.

    Args:
        env_id: Gymnasium's id.
        config: Hyperparameters that differ from their defaults.

    Raises:
        UnknownIdError: no such id.
        ConfigError: unknown key or bad value.
    """
    return new_task(ENVIRONMENTS[checked_id(env_id)].task, {} if config is None else config)


def changed(env_id: str, task: Task) -> dict[str, Any]:
    """Hyperparameters of a task that differ from those that its id is registered with.

    Args:
        env_id: Gymnasium's id.
        task: A task of this id.
    """
    now, then = dataclasses.asdict(task), dataclasses.asdict(task_of(env_id))
    return {key: value for key, value in now.items() if value != then[key]}


def one_of_each(ids: Iterable[str] = ENVIRONMENTS) -> list[str]:
    """The first id of every kind: continuous actions, discrete actions, goals."""
    first: dict[tuple[bool, bool], str] = {}
    for env_id in ids:
        task = task_of(env_id)
        first.setdefault((bool(task.n_choices), bool(task.n_goal)), env_id)
    return list(first.values())


def families(ids: Iterable[str] = ENVIRONMENTS) -> dict[str, list[str]]:
    """Ids by family, in the order of registration."""
    found: dict[str, list[str]] = {}
    for env_id in ids:
        found.setdefault(ENVIRONMENTS[env_id].family, []).append(env_id)
    return found


# Compilation of environments before their first use, in processes side by side.


class Kernel(NamedTuple):
    """Compiled loop of an environment.

    Attributes:
        env_id: Gymnasium's id, also "module:id".
        config: Hyperparameters of the task.
        part: "reset", "step" or, of a goal environment, "reward".
    """

    env_id: str
    config: Mapping[str, Any]
    part: str

    def __str__(self) -> str:
        """What is shown while it is compiled."""
        settings = "".join(f", {key} = {value}" for key, value in self.config.items())
        return f"{checked_id(self.env_id).rpartition('/')[2]} {self.part}{settings}"


def kernels_of(env_id: str, config: Mapping[str, Any] | None = None) -> list[Kernel]:
    """The kernels of an environment.

    Args:
        env_id: Gymnasium's id or a short form of it, also "module:id".
        config: Hyperparameters of the task; None takes the defaults, in both frames where the task
            has a reduced one.

    Raises:
        UnknownIdError: no such id.
        ConfigError: unknown key or bad value.
    """
    task = task_of(env_id, config)
    parts = ("step", "reset", "reward") if task.n_goal else ("step", "reset")
    configs: list[Mapping[str, Any]] = [config or {}]
    if not config and task.reduction:
        configs.append({"frame": "reduced"})
    return [Kernel(env_id, each, part) for each in configs for part in parts]


def compile_all(kernels: list[Kernel], jobs: int) -> Iterator[tuple[Kernel, bool]]:
    """Compile kernels, or find them in the cache.

    Args:
        kernels: Which.
        jobs: Number of processes.

    Yields:
        Each kernel when it is there, and whether it was in the cache.
    """
    context = multiprocessing.get_context("spawn")  # a fork would copy locks of other threads
    quiet = logging.getLogger(KernelCache.__module__).setLevel  # the caller says how far it is
    with ProcessPoolExecutor(min(jobs, len(kernels)), context, quiet, (logging.WARNING,)) as pool:
        waiting = {pool.submit(_compile, kernel): kernel for kernel in kernels}
        for done in as_completed(waiting):
            yield waiting[done], done.result()


def _compile(kernel: Kernel) -> bool:
    """Use a kernel once; whether it was compiled before."""
    task = task_of(kernel.env_id, kernel.config)
    episode = task.episode if kernel.part == "reward" else task.compiled
    if kernel.part == "reward":
        goal = np.zeros(task.n_goal, dtype=np.float32)
        task.goal_reward(goal, goal)
    elif kernel.part == "reset":
        Core(task, 1).reset(np.zeros(1, dtype=np.int64))
    else:
        Core(task, 1).step()
    return bool(getattr(episode, kernel.part).stats.cache_hits)
