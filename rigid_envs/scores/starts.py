"""The fixed starts, the episodes played from them, and what is measured of them."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple, Protocol, get_args

import numpy as np
import numpy.typing as npt
from gymnasium.vector import VectorEnv

from rigid_envs.base import files
from rigid_envs.base.checks import Array, Bools, ConfigError, Integers, exact_array
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.tasks.registry import ENVIRONMENTS, ErrorTerm
from rigid_envs.tasks.task import Task

# The evaluation set: starts of a published seed, the same for all policies.
#
# They are chosen among the first 16,384 that the seed draws, so that means over them are those of
# all starts; `python -m rigid_envs.tools.fair_starts` does so. First come those that were in
# version 1 too, which was the first 500, in the same order: of what was measured there, the shared
# starts are the first ones of the set.

VERSION = 2
"""Version of the evaluation sets; figures on other starts have another one."""

TEST_SEED = 314159
"""Seed of the starts of an evaluation, which no training and no selection has seen."""

N_STARTS = 500
"""Number of starts of every id."""

N_DRAWN = 16_384
"""Number of starts that the set is chosen among."""

Purpose = Literal["train", "validation", "test", "random policy", "learner"]

PLACES_FILE, PLACES_FORMAT = Path(__file__).with_name("starts.json"), "rigid-envs starts 2"
"""The places of the chosen starts among those that the seed draws."""

_PURPOSES = get_args(Purpose)
_PLACES_LIMIT = 2**16  # bytes


@cache
def places() -> Integers:
    """Places of the starts of the evaluation set, shape (500,)."""
    mend = "install rigid-envs anew"
    with files.read_document(PLACES_FILE, PLACES_FORMAT, _PLACES_LIMIT, mend) as data:
        return exact_array(data["places"], "places", N_STARTS).astype(np.int64)


def shared(version: int, n: int) -> Integers:
    """Which of the first n starts of a version of the set are in this one, as its first starts.

    Args:
        version: 1 or 2.
        n: Number of starts, 500 at most.
    """
    return np.arange(n) if version == VERSION else places()[places() < n]


def evaluation_seeds(n: int = N_STARTS) -> list[int]:
    """Seeds of the first n starts of the evaluation set; `reset(seed=...)` of a row gives one.

    The same for every id and every policy. More than 500 go on with starts drawn at random.

    Args:
        n: Number of starts.
    """
    return row_seeds(TEST_SEED, n, "test")


def row_seeds(seed: int, n: int, purpose: Purpose) -> list[int]:
    """One seed per row, spawned from a `SeedSequence`; of `TEST_SEED`, those of the evaluation set.

    Gymnasium's own rule, row i has seed s + i, gives the runs of seeds 0 and 1 all but one start in
    common; these have none, and no purpose shares one with another.

    Args:
        seed: Root seed, at least 0.
        n: Number of seeds.
        purpose: What the rows are for.

    Returns:
        n integers in [0, 2^63).
    """
    if (seed, purpose) == (TEST_SEED, "test"):
        beyond = range(N_DRAWN, N_DRAWN + n - N_STARTS)
        return drawn_seeds(seed, [*places()[:n].tolist(), *beyond], purpose)
    return drawn_seeds(seed, range(n), purpose)


def drawn_seeds(seed: int, places: Iterable[int], purpose: Purpose) -> list[int]:
    """The seeds at some places of the sequence that a root seed draws.

    Args:
        seed: Root seed, at least 0.
        places: Numbers from 0.
        purpose: What the rows are for.
    """
    key = _PURPOSES.index(purpose)
    children = (np.random.SeedSequence(int(seed), spawn_key=(key, place)) for place in places)
    return [int(child.generate_state(1, np.uint64)[0]) >> 1 for child in children]


# Episodes from many fixed starts, one from each, played together.

Observations = npt.NDArray[Any] | dict[str, npt.NDArray[Any]]

ActionFunction = Callable[[Observations], npt.NDArray[Any]]
"""A function from the observations of all rows to their actions."""


class SupportsPredict(Protocol):
    """A policy of observations: a trained one, or a model of Stable-Baselines3.

    One that has a memory also takes ``state`` and ``episode_start``, as Stable-Baselines3 has it.
    """

    def predict(
        self, observation: Observations, *, deterministic: bool = True
    ) -> tuple[npt.NDArray[Any], Any]:
        """Actions for a batch of observations, and the state of the memory."""


@dataclass(frozen=True)
class Episodes:
    """One episode from each start.

    Attributes:
        seeds: Seed of each start; `reset(seed=[...])` gives it again.
        returns: Sums of rewards, shape (n,).
        lengths: Numbers of steps, shape (n,).
        successes: `info["is_success"]` at the end, shape (n,).
        since: Step from which `info["is_success"]` was true to the end, shape (n,); where it is not
            true at the end, one step after it.
        terminated: Whether the task ended the episode, and not its time limit, shape (n,).
        costs: Sums of `info["cost"]`, in the unit that the task says, shape (n,).
        errors: Root mean squares of the error over the steps, shape (n,); None if none was asked
            for.
        limit: Number of steps after which an episode is cut off.
    """

    seeds: list[int]
    returns: Array
    lengths: npt.NDArray[np.int64]
    successes: Bools
    since: npt.NDArray[np.int64]
    terminated: Bools
    costs: Array
    errors: Array | None
    limit: int


def joined(parts: Sequence[Episodes], n: int) -> Episodes:
    """The first n episodes of several.

    Args:
        parts: Each with at least one episode.
        n: Number of episodes.
    """
    columns: dict[str, Any] = {"limit": max(part.limit for part in parts)}
    for name in ("returns", "lengths", "successes", "since", "terminated", "costs", "errors"):
        each = [getattr(part, name) for part in parts]
        columns[name] = None if each[0] is None else np.concatenate(each)[:n]
    return Episodes(seeds=[k for part in parts for k in part.seeds][:n], **columns)


def registered_rows(env_id: str, n: int, config: Mapping[str, Any]) -> RigidVectorEnv:
    """N rows of an id as the registry of this package has it; Gymnasium's can be written over.

    Args:
        env_id: Gymnasium's id.
        n: Number of rows.
        config: Hyperparameters of the task.
    """
    record = ENVIRONMENTS[env_id]
    limit = record.max_episode_steps
    return RigidVectorEnv(record.task, n, limit, autoreset_mode="SameStep", **config)


# Metrics of an episode, and the metrics of an id.


class Metric(NamedTuple):
    """One number of an episode.

    Attributes:
        name: Short name.
        text: Definition, with the unit; that of a cost is what the task says.
        higher_is_better: Whether a larger value is better.
        values: Values of episodes of a task, shape (n,).
        of_successes: Whether a mean is that of the successes alone: failures may well be cheap.
    """

    name: str
    text: str
    higher_is_better: bool
    values: Callable[[Episodes, Task], Array]
    of_successes: bool = False

    def unit(self, task: Task) -> str:
        """Unit of its values in a task; empty where they have none."""
        if self.is_cost:
            return task.cost_unit.rpartition("[")[2].rstrip("]") if "[" in task.cost_unit else ""
        return "s" if self.name == "time" else ""

    @property
    def is_cost(self) -> bool:
        """Whether its values are sums of what the task calls its cost."""
        return self.values is _costs


def _costs(episodes: Episodes, _: Task) -> Array:
    return episodes.costs


def _time(episodes: Episodes, task: Task) -> Array:
    """Time from which on success lasts, less the time for which it must hold; else the limit."""
    held = round(getattr(task, "hold", 0.0) / task.dt)
    steps = np.where(episodes.successes, episodes.since - held, episodes.limit)
    return np.asarray(task.dt * steps)


def _error(episodes: Episodes, task: Task) -> Array:
    assert episodes.errors is not None
    return episodes.errors


_ALL = (
    Metric("success", "rate of success", True, lambda e, _: e.successes.astype(np.float64)),
    Metric("return", "sum of rewards", True, lambda episodes, _: episodes.returns),
    Metric("time", "time [s] until success, to stay", False, _time, True),
    Metric("path", 'sum of `info["cost"]`', False, _costs, True),
    Metric("effort", 'sum of `info["cost"]`', False, _costs, True),
    Metric("error", "root mean square of the error", False, _error, True),
    Metric("loss", "minus the return, a quadratic cost", False, lambda e, _: -e.returns, True),
)
METRICS = {metric.name: metric for metric in _ALL}
"""All metrics by name."""


def metrics_of(env_id: str) -> tuple[Metric, ...]:
    """The metrics of an id, its cost first; none for an unknown id."""
    record = ENVIRONMENTS.get(env_id)
    return () if record is None else tuple(METRICS[name] for name in record.metrics)


# Figures of episodes while they are played.


class Tally:
    """Sums over the steps of one episode in each row, from which metrics follow at any time.

    Args:
        seeds: Seed of each start.
        error: Reward term whose error is recorded; None for none.
        limit: Number of steps after which an episode is cut off; None for that of the longest one.

    Attributes:
        keys: What `add` reads of an info.
        running: Rows whose episode has not ended, shape (n,).
        lengths: Steps counted, shape (n,).
    """

    def __init__(
        self, seeds: Sequence[int], error: ErrorTerm | None = None, limit: int | None = None
    ) -> None:
        """No step yet."""
        n = len(seeds)
        self._seeds, self._error, self._limit = list(seeds), error, limit
        self.keys = ("cost", "is_success", *([] if error is None else [f"reward/{error.term}"]))
        self.running = np.ones(n, dtype=bool)
        self.lengths = np.zeros(n, dtype=np.int64)
        self._failed = np.zeros(n, dtype=np.int64)
        self._returns, self._costs, self._squares = np.zeros(n), np.zeros(n), np.zeros(n)
        self._terminated = np.zeros(n, dtype=bool)

    def add(
        self,
        rewards: npt.ArrayLike,
        terminated: npt.ArrayLike,
        truncated: npt.ArrayLike,
        info: Mapping[str, Any],
    ) -> None:
        """Count a step of the rows that are running.

        Args:
            rewards: As `step` returns them, shape (n,); of one row also a number, as all others.
            terminated: As `step` returns it.
            truncated: As `step` returns it.
            info: Of the step itself, also where another episode has begun since.
        """
        running = self.running
        self.lengths += running
        self._returns += np.where(running, rewards, 0.0)
        self._costs += np.where(running, info["cost"], 0.0)
        missed = running & ~np.asarray(info["is_success"]).astype(bool)
        self._failed[missed] = self.lengths[missed]
        ended = running & np.logical_or(terminated, truncated)
        self._terminated |= ended & np.asarray(terminated)
        if self._error is not None:
            # rows that are not running may hold anything
            term = np.where(running, info[self.keys[-1]], 1.0)
            self._squares += ((1.0 / term - 1.0) / self._error.sharpness) ** 2
        self.running = running & ~ended

    def episodes(self) -> Episodes:
        """The episodes so far."""
        counted = np.maximum(self.lengths, 1)
        return Episodes(
            seeds=self._seeds,
            returns=self._returns,
            lengths=self.lengths,
            successes=self._failed < self.lengths,
            since=self._failed + 1,
            terminated=self._terminated,
            costs=self._costs,
            errors=None if self._error is None else np.sqrt(self._squares / counted),
            limit=self._limit or int(self.lengths.max()),
        )

    @property
    def success(self) -> bool:
        """Whether the last step of the first row was a success."""
        return bool(self._failed[0] < self.lengths[0])

    def value(self, metric: Metric, task: Task) -> float:
        """A metric of the first row, also where it failed."""
        return float(metric.values(self.episodes(), task)[0])


# What an episode costs, and the efficiency of a success.
#
# Success and cost are never mixed in a number that hides either. From each start the efficiency is
# ``s b / max(b, c)``: s is 1 for a success and 0 for a failure, c the cost of the episode, b the
# best cost that is known from that start. A failure has 0, however little it spent; a success has 1
# if nobody is known to have done better.
#
# Source: Anderson et al. 2018, *On Evaluation of Embodied Navigation Agents*, arXiv:1807.06757
# (SPL).

FLOOR = 0.001
"""Least path [m], effort [unit of the task], error and loss that count; of times, it is a step."""


class Cost(NamedTuple):
    """The number of an episode that its efficiency is computed from.

    Attributes:
        name: Name of the metric, one of `rigid_envs.tasks.registry.COSTS`.
        unit: Its unit; empty where it has none.
        floor: Costs below it count as it, so that nothing is divided by 0.
    """

    name: str
    unit: str
    floor: float

    @property
    def title(self) -> str:
        """Name with the unit, if it has one."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


def cost_of(env_id: str, task: Task) -> Cost:
    """The cost of an id: the first of its metrics.

    Args:
        env_id: Gymnasium's id.
        task: Its task, with its settings.
    """
    metric = metrics_of(env_id)[0]
    return Cost(metric.name, metric.unit(task), task.dt if metric.name == "time" else FLOOR)


def efficiencies(
    successes: npt.ArrayLike, costs: npt.ArrayLike, best: npt.ArrayLike, floor: float
) -> Array:
    """Success-weighted efficiency from each start, shape (n,).

    Args:
        successes: Whether the episodes succeeded, shape (n,).
        costs: What they cost, shape (n,); of failures it may be anything.
        best: Best known costs, shape (n,); NaN where nobody is known to have succeeded: then the
            first to succeed has 1.
        floor: See `Cost`.
    """
    won = np.asarray(successes).astype(bool)
    cost = np.where(won, costs, np.inf)
    known = np.maximum(np.where(np.isnan(best), cost, best), floor)
    return np.where(won, known, 0.0) / np.where(won, np.maximum(known, cost), 1.0)


# Episodes played in all rows of an environment, and counted.

Told = Callable[[Mapping[str, Any], Iterable[str], Bools], dict[str, npt.NDArray[Any]]]
"""From infos, names of entries and the rows that ended to the entries of the step itself."""

_MOST = 100_000  # steps of an episode; those of this package have hundreds


class Step(NamedTuple):
    """A step of N rows, as it was before any of them started anew.

    Attributes:
        seen: Observations that were acted on.
        actions: Of all rows.
        observations: After the step; of native rows that ended, the last of their episode.
        rewards: Shape (N,).
        terminated: Shape (N,).
        truncated: Shape (N,).
        infos: Entries of all rows by name.
        running: Rows whose episode counts, shape (N,): it had not ended before the step.
    """

    seen: Any
    actions: npt.NDArray[Any]
    observations: Any
    rewards: npt.NDArray[Any]
    terminated: Bools
    truncated: Bools
    infos: Mapping[str, npt.NDArray[Any]]
    running: Bools


def entries_of(
    infos: Mapping[str, Any], keys: Iterable[str], ended: Bools
) -> dict[str, npt.NDArray[Any]]:
    """Info entries of the step itself, also in rows that started anew within it.

    Args:
        infos: Of all rows.
        keys: Names of the entries; one that is missing is 0.
        ended: Rows whose episode ended in the step, shape (N,).
    """
    values = {key: np.asarray(infos.get(key, np.zeros(len(ended)))) for key in keys}
    if ended.any() and "final_info" in infos:  # else rows start anew in the next step
        last = infos["final_info"]
        values = {key: np.where(ended, last.get(key, 0), now) for key, now in values.items()}
    return values


def _names(infos: Mapping[str, Any]) -> list[str]:
    """Names of the entries of a step."""
    known = {**infos, **infos.get("final_info", {})}
    return [key for key in known if not key.startswith(("_", "final_"))]


def rollout(
    act: ActionFunction,
    venv: VectorEnv[Any, Any, Any],
    seeds: Sequence[int],
    keys: Iterable[str] | None = None,
    limit: int | None = None,
    told: Told = entries_of,
) -> Iterator[Step]:
    """Play exactly one episode in each row, a step of all rows at a time.

    Rows that are done go on with another episode, which does not count: so every start weighs the
    same.

    Args:
        act: Actions of all rows.
        venv: A vector environment whose rows start anew by themselves, or end together.
        seeds: One seed per row.
        keys: Names of the info entries that are needed; None for all there are.
        limit: Number of steps after which an episode is cut off here; None leaves that to the
            environment.
        told: Who tells the entries.

    Raises:
        ConfigError: No end after a hundred thousand steps.
    """
    given: Any = seeds  # native environments take one seed for each row
    seen, _ = venv.reset(seed=given)
    rows: Any = venv.unwrapped
    running, step = np.ones(len(seeds), dtype=bool), 0
    try:
        while left := np.count_nonzero(running):
            if step == _MOST:
                raise ConfigError(
                    f"env: {left} episodes of more than {_MOST} steps; expected a time limit: "
                    "wrap it in gymnasium.wrappers.TimeLimit"
                )
            step += 1
            rows.uncounted = ~running  # nobody needs to plan for them
            actions = act(seen)
            after, rewards, terminated, truncated, infos = venv.step(actions)
            truncated = truncated | (step == limit)
            ended = running & (terminated | truncated)
            entries = told(infos, _names(infos) if keys is None else keys, ended)
            last = infos.get("final_obs", after)
            yield Step(seen, actions, last, rewards, terminated, truncated, entries, running)
            seen, running = after, running & ~ended
    finally:
        rows.uncounted = None


def play(
    act: ActionFunction,
    venv: VectorEnv[Any, Any, Any],
    seeds: Sequence[int],
    error: ErrorTerm | None = None,
    progress: Callable[[str], None] = lambda _: None,
    limit: int | None = None,
    told: Told = entries_of,
) -> Episodes:
    """Play exactly one episode in each row, and count.

    Args:
        act: See `rollout`.
        venv: See `rollout`.
        seeds: See `rollout`.
        error: Reward term whose error is recorded; None for none.
        progress: Called with a few words in every step.
        limit: See `rollout`.
        told: See `rollout`.
    """
    tally = Tally(seeds, error, limit or getattr(venv.spec, "max_episode_steps", None))
    for step in rollout(act, venv, seeds, tally.keys, limit, told):
        tally.add(step.rewards, step.terminated, step.truncated, step.infos)
        progress(f"{np.count_nonzero(~tally.running)} of {len(seeds)} episodes")
    return tally.episodes()
