"""Episodes and replays: what happened, in a file that says what it is and runs no code."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rigid_envs.base import files
from rigid_envs.base.checks import Array, Bools, printable, require
from rigid_envs.engine.provenance import provenance
from rigid_envs.envs import lookup as catalogue
from rigid_envs.tasks.core import Core, Moment
from rigid_envs.tasks.registry import ENVIRONMENTS, load
from rigid_envs.tasks.task import Task
from rigid_envs.watch.views import Interpolation

# Episode: what happened in one episode of a row, from the start to the end.

ARRAYS = ("y", "u", "actions", "applied", "rewards", "costs", "success", "times", "aux")
"""Attributes of a `PastEpisode` that are arrays over its T steps or T + 1 moments."""

_LABEL_LIMIT = 200  # characters


@dataclass(frozen=True, eq=False)
class PastEpisode:
    """T steps of one row.

    The start and the actions determine all the rest, to the bit: `play_again` computes it.

    Attributes:
        label: Who acted, as "policy" or "reference"; one line of text.
        start: Complete state at the start, as `get_state` of the environment gives it.
        parameters: Parameters of the system, by name.
        y: Physical states, shape (T + 1, n_state); y[0] is the start.
        u: Physical inputs of the steps, shape (T, n_input).
        actions: Actions as they were given, float32 (T, n_action).
        applied: Actions after clipping, noise and delay, shape (T, n_action).
        rewards: Rewards of the steps, shape (T,).
        costs: Costs of the steps, in ``task.cost_unit``, shape (T,).
        success: `info["is_success"]` of the steps, bool (T,).
        times: Times since the reset [s], shape (T + 1,).
        aux: Auxiliary states of the task, shape (T + 1, n_aux).
        terminated: Whether the task ended the episode.
        truncated: Whether the time limit ended it; neither where it was left unfinished.
    """

    label: str
    start: Mapping[str, Array]
    parameters: Mapping[str, float]
    y: Array
    u: Array
    actions: npt.NDArray[np.float32]
    applied: Array
    rewards: Array
    costs: Array
    success: Bools
    times: Array
    aux: Array
    terminated: bool = False
    truncated: bool = False

    def __len__(self) -> int:
        """Number of steps T."""
        return len(self.rewards)

    def moment(self, k: int, task: Task) -> Moment:
        """The row after k steps; as after a reset for k = 0.

        Args:
            k: Number of steps, from 0 to T.
            task: The task of the episode.
        """
        begun = k > 0
        return Moment(
            y=self.y[k],
            u=self.u[k - 1] if begun else np.zeros(self.u.shape[1]),
            parameters=self.parameters,
            aux=dict(zip(task.aux_names, self.aux[k].tolist(), strict=True)),
            action=self.applied[k - 1] if begun else np.zeros(self.applied.shape[1]),
            time=float(self.times[k]),
            reward=float(self.rewards[k - 1]) if begun else 0.0,
            cost=float(self.costs[k - 1]) if begun else 0.0,
            success=bool(begun and self.success[k - 1]),
            totals=(float(self.rewards[:k].sum()), float(self.costs[:k].sum())),
            dynamics=task.system_type.dynamics,
        )


def checked_label(label: Any, name: str = "label") -> str:
    """A label that can be printed, drawn and read again.

    Args:
        label: The label.
        name: What a refusal names it.

    Raises:
        ValueError: It is no text, too long, or of several lines.
    """
    ok = isinstance(label, str) and len(label) <= _LABEL_LIMIT
    require(ok, label, name, f"at most {_LABEL_LIMIT} letters")
    return str(printable(label, name))


def play_again(
    task: Task,
    start: Mapping[str, npt.ArrayLike],
    actions: npt.ArrayLike,
    label: str = "",
    *,
    terminated: bool = False,
    truncated: bool = False,
) -> PastEpisode:
    """The episode of a start and a sequence of actions, by the compiled step of the environments.

    Args:
        task: The task.
        start: Complete state of one row, as `get_state` of a single environment gives it.
        actions: Shape (T, n_action), finite.
        label: Who acted.
        terminated: How the episode ended.
        truncated: Likewise.

    Raises:
        ValueError: A start of another task or outside an episode, or an action that is not finite.
    """
    core = Core(task, 1)
    core.set_state({name: np.asarray(part)[None] for name, part in start.items()})
    running = bool(core.running[0])
    require(running, start["clock"], "start['clock']", "that of an episode: call reset first")
    rows = np.asarray(actions, dtype=np.float32).reshape(-1, core.actions.shape[1])
    moments = [core.moment(0)]
    for k, action in enumerate(rows):
        core.actions[0] = action
        require(core.step() >= 0, action, f"actions[{k}]", "finite numbers")
        moments.append(core.moment(0))
    first, steps, n = moments[0], moments[1:], len(rows)
    return PastEpisode(
        label=label,
        start={name: np.array(part, dtype=np.float64) for name, part in start.items()},
        parameters=dict(first.parameters),
        y=np.array([moment.y for moment in moments]),
        u=np.array([moment.u for moment in steps]).reshape(n, len(first.u)),
        actions=rows.copy(),
        applied=np.array([moment.action for moment in steps]).reshape(rows.shape),
        rewards=np.array([moment.reward for moment in steps], dtype=np.float64),
        costs=np.array([moment.cost for moment in steps], dtype=np.float64),
        success=np.array([moment.success for moment in steps], dtype=np.bool_),
        times=np.array([moment.time for moment in moments]),
        aux=np.array([list(moment.aux.values()) for moment in moments]).reshape(n + 1, -1),
        terminated=terminated,
        truncated=truncated,
    )


def same_bits(one: PastEpisode, other: PastEpisode) -> bool:
    """Whether all arrays of two episodes agree to the bit, and the parameters."""
    return one.parameters == other.parameters and all(
        getattr(one, name).tobytes() == getattr(other, name).tobytes() for name in ARRAYS
    )


# Moments between the steps of an episode, so that motion is smooth and its paths are curves.

_PERIOD = 0.04  # s between moments, at most
_TURN = 0.4  # rad between moments, at most
_MOST = 24  # moments in a step
_ROUNDING = 1e-6  # of a step


def moments(task: Task, episode: PastEpisode, budget: int) -> list[Moment]:
    """Moments of an episode and between, in order; those of the steps are exact.

    Args:
        task: Its task.
        episode: The episode.
        budget: How many there may be; there are never fewer than T + 1.
    """
    system = task.system(episode.parameters)
    steps = [episode.moment(k, task) for k in range(len(episode) + 1)]
    motions = [Interpolation(system, one, other) for one, other in pairwise(steps)]
    turns = [float(np.linalg.norm(motion.turn)) for motion in motions]
    wanted = math.ceil(max([task.dt / _PERIOD, *(turn / _TURN for turn in turns)]))
    found = steps[:1]
    for motion in motions:
        n = max(1, min(wanted, _MOST, budget // len(motions)))
        found += [motion.at(j / n) for j in range(1, n + 1)]
    return found


def moment_at(task: Task, episode: PastEpisode, time: float) -> Moment:
    """Moment of an episode at any time [s]; its end after that."""
    steps = min(time / task.dt, float(len(episode)))
    k = min(int(steps + _ROUNDING), len(episode))
    one = episode.moment(k, task)
    share = steps - k
    if share < _ROUNDING or k == len(episode):
        return one
    other = episode.moment(k + 1, task)
    return Interpolation(task.system(episode.parameters), one, other).at(share)


# Checks of the arrays of a replay: names, kinds, shapes and what they must agree with.

Arrays = Mapping[str, npt.NDArray[Any]]

_FLAGS = ("terminated", "truncated")


def row_names(task: Task) -> dict[str, list[str]]:
    """Names of the entries of every row of a task, in their order."""
    system = task.system_type
    return {
        "y": list(system.state_entries),
        "u": list(system.input_entries),
        "actions": list(task.episode.Action._fields),
        "aux": list(task.aux_names),
        "parameters": list(system.parameter_names()),
    }


def episodes_from(task: Task, entries: Sequence[Any], arrays: Arrays) -> tuple[PastEpisode, ...]:
    """The episodes of a file.

    Args:
        task: The task.
        entries: What the header says of each.
        arrays: All arrays of the file but the header.

    Raises:
        ValueError: An entry or array that is missing, unknown, or not what it must be.
    """
    parts = Core(task, 1).get_state()
    names = [*ARRAYS, "parameters", *(f"start/{part}" for part in parts)]
    expected = {f"{k}/{name}" for k in range(len(entries)) for name in names}
    if missing := sorted(expected - set(arrays)):
        raise ValueError(f"no array {missing[0]!r}; expected one for each of {names}")
    if unknown := sorted(set(arrays) - expected):
        raise ValueError(f"array {unknown[0]!r}; expected some of {names} of each episode")
    return tuple(_episode(task, k, entry, arrays, parts) for k, entry in enumerate(entries))


def _episode(task: Task, k: int, entry: Any, arrays: Arrays, parts: Arrays) -> PastEpisode:
    place = f"episodes[{k}]"
    whole = isinstance(entry, dict) and set(entry) == {"label", *_FLAGS}
    require(whole, entry, place, "label, terminated and truncated")
    label, ends = entry["label"], {name: entry[name] for name in _FLAGS}
    known = all(isinstance(flag, bool) for flag in ends.values())
    require(known, entry, place, f"true or false for {_FLAGS}")
    found: dict[str, Any] = {name: arrays[f"{k}/{name}"] for name in (*ARRAYS, "parameters")}
    n_steps = len(found["rewards"]) if found["rewards"].ndim else 0
    for name, (dtype, shape) in _kinds(task, n_steps).items():
        _check(f"{k}/{name}", found[name], dtype, shape)
    start = {name: arrays[f"{k}/start/{name}"] for name in parts}
    for name, part in parts.items():
        _check(f"{k}/start/{name}", start[name], np.float64, part.shape[1:])
    _check_content(task, k, found, start)
    values = found.pop("parameters").tolist()
    parameters = dict(zip(task.system_type.parameter_names(), values, strict=True))
    return PastEpisode(label=label, start=start, parameters=parameters, **found, **ends)


def _kinds(task: Task, n: int) -> dict[str, tuple[Any, tuple[int, ...]]]:
    """Kind of number and shape of every array of an episode of n steps."""
    size = {name: len(entries) for name, entries in row_names(task).items()}
    return {
        "rewards": (np.float64, (n,)),
        "y": (np.float64, (n + 1, size["y"])),
        "u": (np.float64, (n, size["u"])),
        "actions": (np.float32, (n, size["actions"])),
        "applied": (np.float64, (n, size["actions"])),
        "costs": (np.float64, (n,)),
        "success": (np.bool_, (n,)),
        "times": (np.float64, (n + 1,)),
        "aux": (np.float64, (n + 1, size["aux"])),
        "parameters": (np.float64, (size["parameters"],)),
    }


def _check(name: str, array: npt.NDArray[Any], dtype: Any, shape: tuple[int, ...]) -> None:
    """Refuse another kind of number, another shape, NaN and inf."""
    if array.dtype != dtype:
        raise ValueError(f"{name} has dtype {array.dtype}; expected {np.dtype(dtype)}")
    if array.shape != shape:
        raise ValueError(f"{name} has shape {array.shape}; expected {shape}")
    if not np.isfinite(array).all():
        where = np.argwhere(~np.isfinite(array))[0].tolist()
        raise ValueError(f"{name}{where} = {array[tuple(where)]}; expected finite numbers")


def _check_content(task: Task, k: int, found: Arrays, start: Arrays) -> None:
    """Refuse states that the system cannot have, and parts that contradict each other."""
    names = task.system_type.parameter_names()
    task.system_type(**dict(zip(names, found["parameters"].tolist(), strict=True)))
    try:
        task.system_type.checked_state(found["y"])
    except ValueError as error:
        raise ValueError(f"{k}/{error}") from None
    begin = found["y"][0]
    require(np.array_equal(begin, start["y"]), begin, f"{k}/y[0]", "start/y")
    if not np.all(np.diff(found["times"]) > 0.0):
        raise ValueError(f"{k}/times do not increase; expected multiples of {task.dt} s")


# Replay: episodes of one environment in a file that says what they are and runs no code.

FORMAT, VERSION = "rigid-envs replay", 3
_HEADER = "header"
_KEYS = {"format", "version", "env_id", "config", "rows", "units", "episodes", "provenance"}
_SEAL = "sha256"
_KINDS = {"env_id": str, "config": dict, "provenance": dict, "episodes": list}


@dataclass(frozen=True, eq=False)
class Replay:
    """Episodes of one environment with the settings of its task.

    The file is a NumPy archive (.npz). ``header`` holds the bytes of a JSON document (UTF-8):
    ``format``, ``version``, ``env_id``, ``config`` (every setting of the task), ``rows`` (names of
    the entries of state, input, action, auxiliary state and parameters), ``units`` (of the cost;
    the metric that is its cost), ``provenance``, for each episode k ``label``, ``terminated`` and
    ``truncated``, and ``sha256``, the digest of all of it and of every array. Its arrays are
    ``k/y``, ``k/u`` and so on, the attributes of `PastEpisode`, with ``k/parameters`` and
    ``k/start/<part>``. No array is pickled.

    Attributes:
        env_id: Gymnasium's id.
        task: Its task.
        episodes: At least one.
        provenance: Versions, commit, machine and date that it comes from.
    """

    env_id: str
    task: Task
    episodes: tuple[PastEpisode, ...]
    provenance: Mapping[str, Any] = field(default_factory=provenance)

    def __post_init__(self) -> None:
        """Refuse a replay of nothing, and text that cannot be shown."""
        if not self.episodes:
            raise ValueError("episodes = (); expected at least one: play an episode first")
        for k, episode in enumerate(self.episodes):
            checked_label(episode.label, f"episodes[{k}].label")
        printable(self.provenance, "provenance")

    def save(self, path: str | Path) -> Path:
        """Write the file, atomically.

        Args:
            path: Its path; ".npz" is added where it has no such ending, missing folders are made.

        Returns:
            The path that was written.
        """
        file = Path(path)
        file = file if file.suffix == ".npz" else file.with_name(f"{file.name}.npz")
        file.parent.mkdir(parents=True, exist_ok=True)
        arrays: dict[str, npt.NDArray[Any]] = {}
        for k, episode in enumerate(self.episodes):
            arrays |= {f"{k}/{name}": getattr(episode, name) for name in ARRAYS}
            arrays[f"{k}/parameters"] = np.array(list(episode.parameters.values()))
            arrays |= {f"{k}/start/{name}": part for name, part in episode.start.items()}
        header = self._header()
        text = files.canonical_json({**header, _SEAL: files.digest(header, arrays)})
        files.write_arrays(file, {_HEADER: np.frombuffer(text.encode(), dtype=np.uint8), **arrays})
        return file

    def _header(self) -> dict[str, Any]:
        return {
            "format": FORMAT,
            "version": VERSION,
            "env_id": self.env_id,
            "config": dataclasses.asdict(self.task),
            "rows": row_names(self.task),
            "units": {"cost": self.task.cost_unit, "metric": ENVIRONMENTS[self.env_id].metrics[0]},
            "provenance": dict(self.provenance),
            "episodes": [
                {"label": e.label, "terminated": e.terminated, "truncated": e.truncated}
                for e in self.episodes
            ],
        }


def load_replay(path: str | Path) -> Replay:
    """Read a replay, and check everything in it.

    What a file of version 2 says, which has no digest, is compared with what its actions lead to.

    Args:
        path: The file.

    Raises:
        DamagedFileError: Not a replay, cut, changed, of another version or another environment;
            the message names the file, the entry and what was expected.
        FileNotFoundError: There is no such file.
    """
    file = Path(path)
    arrays = files.read_arrays(file)
    with files.named_damage(file):
        header = _read_header(arrays.pop(_HEADER, None), arrays)
        env_id = catalogue.checked_id(catalogue.id_in_file(header["env_id"]))
        config = header["config"]
        task = catalogue.task_of(env_id, config)
        versions, names = header["provenance"].get("versions"), row_names(task)
        expected = f"{names}: it was written by another version of the environment, {versions}"
        require(header["rows"] == names, header["rows"], "rows", expected)
        episodes = episodes_from(task, header["episodes"], arrays)
        if _SEAL not in header:
            _refuse_others(task, episodes)
        return Replay(env_id, task, episodes, header["provenance"])


def _refuse_others(task: Task, episodes: Sequence[PastEpisode]) -> None:
    """Refuse episodes that are not what their start and actions lead to."""
    for k, episode in enumerate(episodes):
        if not same_bits(episode, play_again(task, episode.start, episode.actions)):
            raise ValueError(
                f"episodes[{k}]: other numbers than its start and actions lead to; expected the "
                "same bits: it was changed since"
            )


def id_of(env: Any, task: Task) -> str:
    """The registered id that an environment can be made again from.

    Args:
        env: An environment of either kind; its `spec` may be None.
        task: Its task.

    Raises:
        ValueError: None is registered for this task.
    """
    env_id = getattr(getattr(env, "spec", None), "id", None)
    if env_id in ENVIRONMENTS:
        return str(env_id)
    for record in ENVIRONMENTS.values():
        if load(record.task) is type(task):
            return record.id
    raise ValueError(
        f"env = {env_id or type(task).__name__}; expected an environment that is registered, so "
        "that its replay can be read: see rigid_envs.register"
    )


def _read_header(
    raw: npt.NDArray[Any] | None, arrays: Mapping[str, npt.NDArray[Any]]
) -> dict[str, Any]:
    """The JSON document of a file, with all its keys, and a digest that is that of its content.

    Raises:
        ValueError: It is none, of another format or version, or the content was changed.
    """
    if raw is None or raw.dtype != np.uint8 or raw.ndim != 1:
        raise ValueError("no header; expected a file that Replay.save wrote")
    try:
        header = files.parse_json(raw.tobytes())
    except ValueError as error:
        raise ValueError(f"header is no JSON: {error}") from None
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise ValueError(f"header has another format; expected {FORMAT!r}")
    expected = f"2 or {VERSION}: install the version of rigid-envs that wrote it"
    require(header.get("version") in (2, VERSION), header.get("version"), "version", expected)
    keys = _KEYS if header["version"] == 2 else _KEYS | {_SEAL}
    if set(header) != keys:
        raise ValueError(f"header has keys {sorted(header)}; expected {sorted(keys)}")
    files.checked_values(header, _KINDS)
    content = {name: value for name, value in header.items() if name != _SEAL}
    if _SEAL in header and header[_SEAL] != files.digest(content, arrays):
        raise ValueError(f"{_SEAL}: that of other content; expected the one that was saved")
    return header
