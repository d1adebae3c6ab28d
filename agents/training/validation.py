"""What a training tells: validation, records, progress."""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, closing
from typing import Any, NamedTuple

import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.logger import Logger

from rigid_envs.scores.starts import ActionFunction, Episodes, play, row_seeds
from rigid_envs.tools.cli.words import say, tell

from ..config.entries import Config
from ..environments import make
from ..storage.logs import CsvLog, TensorBoardLog, check_position
from ..storage.runs import Run
from .algorithms import progress_columns

# Time spent on a run.


class Spent(NamedTuple):
    """Time spent on a run, all sessions together.

    Attributes:
        seconds: Of the clock on the wall [s].
        cpu_seconds: Of processors, user and system, all threads [s].
    """

    seconds: float
    cpu_seconds: float


class Stopwatch:
    """A clock that goes on from where an earlier session of a run stopped it."""

    def __init__(self, seconds: float = 0.0, cpu_seconds: float = 0.0) -> None:
        """Start it.

        Args:
            seconds: Time spent in earlier sessions, see `Spent`.
            cpu_seconds: And that of processors.
        """
        self._wall = seconds - time.perf_counter()
        self._processors = cpu_seconds - time.process_time()

    def spent(self) -> Spent:
        """Time spent so far."""
        return Spent(time.perf_counter() + self._wall, time.process_time() + self._processors)


# Evaluations during training, on fixed held-out starts; they choose the best policy.

VALIDATION_SEED = 271828
"""Seed of the starts of the evaluations during training, which choose the best policy."""

Policy = Callable[[VectorEnv[Any, Any, Any]], ActionFunction]
"""What acts in an environment."""

_TYPES = {"results": np.float64, "ep_lengths": np.int64, "successes": bool, "costs": np.float64}


class Validation:
    """The evaluations of a run so far.

    Attributes:
        found: All of them, one row each, under the names of SB3's `evaluations.npz`: ages of the
            run, shape (k,), and what each of n episodes gave, shape (k, n).
    """

    def __init__(self, config: Config) -> None:
        """Make the environment.

        Args:
            config: What to evaluate on, and how often.
        """
        n = config.eval_episodes
        self._venv = make(config.env_id, config.env_kwargs, n)
        self._seeds = row_seeds(VALIDATION_SEED, n, "validation")
        self._every = config.eval_every
        self._price = config.price_at(config.total_timesteps)
        self.found: dict[str, NDArray[Any]] = {"timesteps": np.zeros(0, np.int64)}
        self.found |= {name: np.zeros((0, n), kind) for name, kind in _TYPES.items()}

    @property
    def best(self) -> tuple[float, float] | None:
        """Success rate of the best policy, and its mean return less the price of its cost.

        The price is that at the end of the run. None before the first evaluation.
        """
        rows = zip(*(self.found[name] for name in ("successes", "results", "costs")), strict=True)
        scores = [
            (won.mean(), total.mean() - self._price * cost.mean()) for won, total, cost in rows
        ]
        return max(scores, default=None)

    def is_due(self, before: int, now: int, total: int) -> bool:
        """Whether an evaluation belongs between two ages of the run.

        Args:
            before: Age before the last update [steps].
            now: Age after it.
            total: Age at the end, where there always is one.
        """
        return now // self._every > before // self._every or now >= total

    def ages(self, updates: int, config: Config) -> list[int]:
        """Ages of a run at all its evaluations [steps].

        Args:
            updates: Updates that it has made.
            config: Its config.
        """
        update, total = config.steps_per_update, config.total_timesteps
        ages = range(update, updates * update + 1, update)
        return [age for age in ages if self.is_due(age - update, age, total)]

    def run(self, policy: Policy, timesteps: int) -> tuple[Episodes, bool]:
        """Evaluate a policy.

        Args:
            policy: The policy.
            timesteps: Age of the run [steps].

        Returns:
            The episodes, and whether no policy before was as good.
        """
        before, episodes = self.best, play(policy(self._venv), self._venv, self._seeds)
        row = {
            "timesteps": timesteps,
            "results": episodes.returns,
            "ep_lengths": episodes.lengths,
            "successes": episodes.successes,
            "costs": episodes.costs,
        }
        self.found = {name: np.append(rows, [row[name]], 0) for name, rows in self.found.items()}
        return episodes, before is None or self.best != before

    def close(self) -> None:
        """Close the environment."""
        self._venv.close()


# The logs of a run: progress, episodes, clock, TensorBoard; cut back together when it resumes.

_LOGS = ("progress", "monitor", "times")
_STEPS = "time/total_timesteps"  # the first column of the first and of the last


class Records:
    """All logs of a run.

    Attributes:
        logger: SB3's logger, which writes TensorBoard events, and holds a row of `progress.csv`.
    """

    START: Mapping[str, Any] = {**dict.fromkeys(_LOGS, 0), "timesteps": 0, "seconds": 0.0}
    """What `sync` gives for a run that has not begun, without headers."""

    def __init__(self, run: Run, config: Config, positions: Mapping[str, Any] | None) -> None:
        """Start the logs, or cut them back to a checkpoint.

        Args:
            run: Run folder of the files.
            config: Config of the run.
            positions: From `sync`; None starts anew.
        """
        at: Mapping[str, Any] = positions or {}
        # `t` of SB3's monitor files is a time. Steps keep two equal runs equal, byte by byte.
        about = json.dumps({"env_id": config.env_id, "t_start": 0, "t_unit": "steps"})
        columns = {
            "progress": (progress_columns(config), ""),
            "monitor": (("r", "l", "t", "is_success"), f"#{about}\n"),
            "times": ((_STEPS, *Spent._fields, "steps_per_second"), ""),
        }
        self._last = (at.get("timesteps", 0), at.get("seconds", 0.0))
        purge = None if positions is None else at["timesteps"] + 1
        self._csv: dict[str, CsvLog] = {}
        with ExitStack() as opened:  # where one cannot be opened, the others are closed again
            for name, each in columns.items():
                log = CsvLog(run / f"{name}.csv", *each, at.get(name))
                self._csv[name] = opened.enter_context(closing(log))
            self.logger = Logger(str(run.folder), [TensorBoardLog(run / "tensorboard", purge)])
            opened.pop_all()

    @staticmethod
    def check(run: Run, positions: Mapping[str, Any]) -> None:
        """Refuse positions to which the logs cannot be cut back.

        Args:
            run: Run folder of the files.
            positions: From `sync`.

        Raises:
            DamagedFileError: A log is not there, or has no row that ends there; names it.
        """
        begin = f"{positions['timesteps']}," if positions["timesteps"] else ""
        for name in _LOGS:
            check_position(run / f"{name}.csv", positions[name], "" if name == "monitor" else begin)

    def write(
        self,
        timesteps: int,
        figures: Mapping[str, Any],
        ends: Sequence[Mapping[str, Any]],
        spent: Spent,
    ) -> None:
        """Log one update.

        Args:
            timesteps: Age of the run [steps].
            figures: Values by name, beside those that SB3 recorded itself.
            ends: Episodes that ended in the update.
            spent: Time spent on the run.
        """
        for name, value in figures.items():
            self.logger.record(name, value)
        self.logger.record(_STEPS, timesteps, exclude="tensorboard")
        speed = self._speed(timesteps, spent.seconds)
        self.logger.record("time/fps", speed)
        self._csv["progress"].write([self.logger.name_to_value])
        self.logger.dump(timesteps)
        self._csv["monitor"].write(ends)
        times = {name: round(value, 3) for name, value in spent._asdict().items()}
        self._csv["times"].write([{_STEPS: timesteps, **times, "steps_per_second": speed}])
        self._last = (timesteps, spent.seconds)

    def sync(self, timesteps: int) -> dict[str, Any]:
        """Bring the logs to the disk.

        Args:
            timesteps: Age of the run [steps].

        Returns:
            How far they have come, as JSON values.
        """
        positions = {name: csv.sync() for name, csv in self._csv.items()}
        return {**positions, "timesteps": timesteps, "seconds": self._last[1]}

    def close(self) -> None:
        """Close the files."""
        self.logger.close()
        for csv in self._csv.values():
            csv.close()

    def _speed(self, timesteps: int, seconds: float) -> int:
        return int((timesteps - self._last[0]) / max(seconds - self._last[1], 1e-9))


# How far a training has come: a line in place of the one before, and one for each evaluation.


class Progress:
    """What a training says while it goes on."""

    def __init__(self, quiet: bool) -> None:
        """Say nothing yet.

        Args:
            quiet: Say nothing at all.
        """
        self._quiet = quiet
        self._begun = (0.0, 0, 0)  # time, steps made and to make

    def start(self, total: int, done: int) -> None:
        """The training begins.

        Args:
            total: Steps of the run.
            done: Steps made before.
        """
        self._begun = time.perf_counter(), done, total

    def show(self, timesteps: int, figures: Mapping[str, Any]) -> None:
        """Say how far it has come and how long it will take, and add a line of an evaluation.

        Args:
            timesteps: Steps made.
            figures: Values by name.
        """
        begin, done, total = self._begun
        left = round((total - timesteps) * (time.perf_counter() - begin) / (timesteps - done))
        text = f"{timesteps:,} of {total:,} steps, {left // 60} min {left % 60} s to go"
        if (success := figures.get("rollout/success_rate")) is not None:
            text += f"; success {100 * success:.1f} %"
        if not self._quiet:
            tell(text)
        if "eval/success_rate" in figures:
            self.say(
                f"{timesteps:>12,} steps   held-out starts: success "
                f"{100 * figures['eval/success_rate']:5.1f} %   "
                f"return {figures['eval/mean_reward']:8.3f}   "
                f"length {figures['eval/mean_ep_length']:6.1f}   "
                f"cost {figures['eval/mean_cost']:8.3f}"
            )

    def say(self, line: str) -> None:
        """A line that stays."""
        if not self._quiet:
            say(line)

    def close(self) -> None:
        """The training ends."""
        if not self._quiet:
            tell("")
