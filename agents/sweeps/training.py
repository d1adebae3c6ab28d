"""One training of a sweep: a config, and the record of what came of it."""

from __future__ import annotations

import contextlib
import shutil
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rigid_envs.errors import ConfigError
from rigid_envs.sb3.finite import NonFiniteError
from rigid_envs.scores.records import Record, read_record, record_file, write_record

from ..config.by_algorithm import Config, config_from, config_to_dict
from ..environments.registering import import_allowed
from ..storage.manifest import differences
from ..storage.runs import Run, RunInUseError, create_run, find_run, is_in_use, open_run
from ..training.recording import frame_of, is_complete, make_record
from ..training.trainer import train_in

__all__ = ["DONE", "FAILED", "IN_USE", "Training", "work"]

DONE, FAILED, IN_USE = 0, 1, 2
"""Statuses of `work`."""


@dataclass(frozen=True)
class Training:
    """A config to train, and where its record goes.

    Attributes:
        config: Its config, with a `run_name` of its own.
        records: Folder of the records.
        n: Number of test starts.
    """

    config: Config
    records: Path
    n: int

    @property
    def folder(self) -> Path:
        """Folder of its run."""
        return Path(self.config.log_dir) / self.config.algo / str(self.config.run_name)

    @property
    def file(self) -> Path:
        """File of its record."""
        config = self.config
        return record_file(self.records, config.env_id, config.algo, frame_of(config), config.seed)

    def is_done(self) -> bool:
        """Whether its record is there."""
        return self._changed_record() == []

    def is_in_use(self) -> bool:
        """Whether a process works in its run."""
        return is_in_use(self.folder)

    def age(self) -> int:
        """Steps at its newest checkpoint."""
        files = (self.folder / "checkpoints").glob("*.safetensors")
        return max((int(file.stem) for file in files), default=0)

    def last_sign(self) -> float:
        """When its run last wrote anything [s since 1970]; 0 before it has."""
        times = [0.0]
        for path in self.folder.rglob("*"):
            with contextlib.suppress(OSError):  # it is gone
                times.append(path.stat().st_mtime)
        return max(times)

    def progress(self) -> str:
        """How far it has come, in a word."""
        return f"{min(self.age() / self.config.total_timesteps, 1.0):.0%}"

    def refuse_another(self) -> None:
        """Refuse a run or a record that is there, of another config.

        Raises:
            ConfigError: There is one; names what differs.
        """
        for place, changed in (
            (self.file, self._changed_record()),
            (self.folder, self._changed_run()),
        ):
            if changed:
                raise ConfigError(
                    f"{place} is of another config ({'; '.join(changed)}); --overwrite trains it "
                    "anew, --out and --records name other folders"
                )

    def run(self) -> int | None:
        """Train to the end without a word, and write the record.

        Returns:
            The signal that ended it early, or None.

        Raises:
            RunInUseError: Another process works in the run.
            NonFiniteError: A NaN came up.
        """
        if self.is_done():
            return None
        run = self._open()
        try:
            if self.is_done():  # another process was faster
                return None
            if run.new is not None or not is_complete(run):
                outcome = train_in(run, quiet=True)
                if outcome.stopped_by is not None:
                    return outcome.stopped_by
            write_record(self.file, make_record(run, self.n))
            # Nothing is left to go on with, and a replay buffer is large.
            shutil.rmtree(run / "checkpoints", ignore_errors=True)
        finally:
            run.close()
        return None

    def line(self) -> str:
        """What came of it, in a line."""
        return _line(read_record(self.file))

    def _open(self) -> Run:
        """Its run: new, as it was left, or anew if it was of another config."""
        changed = self._changed_run()
        if changed is None:
            return create_run(self.config)
        return create_run(self.config, overwrite=True) if changed else open_run(self.folder)

    def _changed_run(self) -> list[str] | None:
        """What differs between the config and that of the run; None without a run."""
        if not (self.folder / "config.yaml").is_file():
            return None
        try:
            before = find_run(self.folder).config()
        except ConfigError as error:
            return [str(error)]
        return differences(config_to_dict(before), config_to_dict(self.config))

    def _changed_record(self) -> list[str] | None:
        """What differs between the config and that of the record; None without a record."""
        if not self.file.is_file():
            return None
        here = {"log_dir": self.config.log_dir, "run_name": self.config.run_name}
        try:
            before = config_from({**read_record(self.file).config, **here})
        except ConfigError as error:
            return [str(error)]
        return differences(config_to_dict(before), config_to_dict(self.config))


def work(training: Training, imports: Sequence[str]) -> tuple[int, str]:
    """What the process of a training does.

    Args:
        training: The training.
        imports: Modules that register its environment.

    Returns:
        A status: `DONE`, `FAILED`, `IN_USE` by another process, or 128 + k if signal k ended it
        early; and what to say of it.
    """
    try:
        import_allowed(imports)
        stopped_by = training.run()
    except RunInUseError as error:
        return IN_USE, str(error)
    except (ConfigError, NonFiniteError, OSError) as error:
        return FAILED, f"{training.config.env_id}: {error}"
    except Exception:
        return FAILED, f"{training.config.env_id}: {traceback.format_exc()}"
    return (DONE, training.line()) if stopped_by is None else (128 + stopped_by, "")


def _line(record: Record) -> str:
    efficiency = "-" if record.efficiency is None else f"{record.efficiency:.3f}"
    training = record.training
    return (
        f"{record.env_id} {record.policy}, seed {record.seed}: success "
        f"{100 * record.success_rate:.1f} %, efficiency {efficiency}, cost {record.cost_mean:.4g}; "
        f"{training['timesteps']:,} steps, {training['seconds']:.0f} s, "
        f"{training['cpu_seconds']:.0f} s of processors"
    )
