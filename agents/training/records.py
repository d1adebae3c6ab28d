"""The logs of a run: progress, episodes, clock, TensorBoard; cut back together when it resumes."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from stable_baselines3.common.logger import Logger

from ..config.by_algorithm import Config
from ..environments.training_rows import EpisodeEnds
from ..storage.logs import CsvLog, ProgressLog, TensorBoardLog, check_position
from ..storage.runs import Run
from .algorithms import progress_columns
from .clock import Spent

__all__ = ["Records"]

_LOGS = ("progress", "monitor", "times")
_STEPS = "time/total_timesteps"  # the first column of the first and of the last


class Records:
    """All logs of a run.

    Attributes:
        logger: SB3's logger, which writes `progress.csv` and TensorBoard events.
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
        self._n_envs = config.n_envs
        self._csv = {
            "progress": CsvLog(
                run / "progress.csv", progress_columns(config), "", at.get("progress")
            ),
            "monitor": CsvLog(
                run / "monitor.csv", ("r", "l", "t", "is_success"), f"#{about}\n", at.get("monitor")
            ),
            "times": CsvLog(
                run / "times.csv", (_STEPS, *Spent._fields, "steps_per_second"), "", at.get("times")
            ),
        }
        self._last = (at.get("timesteps", 0), at.get("seconds", 0.0))
        purge = None if positions is None else at["timesteps"] + 1
        self._tensorboard = TensorBoardLog(run / "tensorboard", purge)
        self.logger = Logger(
            str(run.folder), [ProgressLog(self._csv["progress"]), self._tensorboard]
        )

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
        ends: Sequence[EpisodeEnds],
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
        self.logger.dump(timesteps)
        self._csv["monitor"].write(row for end in ends for row in self._rows(end))
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
        self._tensorboard.close()
        for csv in self._csv.values():
            csv.close()

    def _speed(self, timesteps: int, seconds: float) -> int:
        return int((timesteps - self._last[0]) / max(seconds - self._last[1], 1e-9))

    def _rows(self, end: EpisodeEnds) -> list[dict[str, Any]]:
        n, wins = len(end.rows), end.successes
        successes = [None] * n if wins is None else wins.astype(int).tolist()
        pairs = zip(end.returns.tolist(), end.lengths.tolist(), successes, strict=True)
        age = end.step * self._n_envs
        return [{"r": r, "l": length, "t": age, "is_success": won} for r, length, won in pairs]
