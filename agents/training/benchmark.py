"""Trainings of several environments with several seeds, each with a record of what came of it."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from time import sleep

from rigid_envs.errors import ConfigError
from rigid_envs.sb3.finite import NonFiniteError
from rigid_envs.scores.records import Record, read_record, record_file, write_record

from ..config.by_algorithm import Config, config_from, config_to_dict
from ..storage.manifest import differences
from ..storage.runs import Run, RunInUseError, create_run, find_run, open_run
from .recording import frame_of, is_complete, make_record
from .trainer import train_in

__all__ = ["train_all"]

_PAUSE = 5.0  # [s] between two looks at runs that other processes work in


def train_all(
    configs: Sequence[Config], records: Path, n: int, quiet: bool = False, overwrite: bool = False
) -> int:
    """Train each config, or resume its run, and write its record.

    What has a record is left out. A run that another process works in is tried again later: several
    processes may share the work.

    Args:
        configs: Each with a `run_name` of its own.
        records: Folder of the records.
        n: Number of test starts.
        quiet: No progress bar.
        overwrite: Begin anew what was trained with another config.

    Returns:
        0; 1 if a training failed, which leaves no record; 128 + k if signal k ended it early.

    Raises:
        ConfigError: A run or a record is of another config; names what differs.
    """
    for config in configs:
        if not overwrite:
            _refuse_another(config, records)
    waiting, failed = list(configs), False
    while waiting:
        in_use = []
        for config in waiting:
            try:
                stopped_by = _train(config, records, n, quiet)
            except RunInUseError:
                in_use.append(config)
            except NonFiniteError as error:
                print(f"error: {config.env_id}: {error}", file=sys.stderr)
                failed = True
            else:
                if stopped_by is not None:
                    return 128 + stopped_by
        if len(in_use) == len(waiting):
            sleep(_PAUSE)
        waiting = in_use
    return 1 if failed else 0


def _train(config: Config, records: Path, n: int, quiet: bool) -> int | None:
    """Train a config to the end and write its record; the signal that ended it early, or None."""
    if _changed_record(config, records) == []:
        return None
    run = _run(config)
    try:
        if _changed_record(config, records) == []:  # another process was faster
            return None
        if run.new is not None or not is_complete(run):
            outcome = train_in(run, quiet)
            if outcome.stopped_by is not None:
                return outcome.stopped_by
        record = make_record(run, n)
        write_record(_file(config, records), record)
        # Nothing is left to go on with, and a replay buffer is large.
        shutil.rmtree(run / "checkpoints", ignore_errors=True)
        print(_line(record), flush=True)
    finally:
        run.close()
    return None


def _run(config: Config) -> Run:
    """The run of a config: new, as it was left, or anew if it was of another config."""
    folder = _folder(config)
    if not (folder / "config.yaml").is_file():
        return create_run(config)
    if differences(config_to_dict(find_run(folder).config()), config_to_dict(config)):
        return create_run(config, overwrite=True)
    return open_run(folder)


def _refuse_another(config: Config, records: Path) -> None:
    """Refuse a run or a record that is there, of another config."""
    places = [(_file(config, records), _changed_record(config, records))]
    folder = _folder(config)
    if (folder / "config.yaml").is_file():
        before = config_to_dict(find_run(folder).config())
        places.append((folder, differences(before, config_to_dict(config))))
    for place, changed in places:
        if changed:
            raise ConfigError(
                f"{place} is of another config ({'; '.join(changed)}); --overwrite trains it "
                "anew, --out and --records name other folders"
            )


def _changed_record(config: Config, records: Path) -> list[str] | None:
    """What differs between a config and that of its record; None without a record."""
    file = _file(config, records)
    if not file.is_file():
        return None
    here = {"log_dir": config.log_dir, "run_name": config.run_name}
    try:
        before = config_from({**read_record(file).config, **here})
    except ConfigError as error:
        return [str(error)]
    return differences(config_to_dict(before), config_to_dict(config))


def _folder(config: Config) -> Path:
    return Path(config.log_dir) / config.algo / str(config.run_name)


def _file(config: Config, records: Path) -> Path:
    return record_file(records, config.env_id, config.algo, frame_of(config), config.seed)


def _line(record: Record) -> str:
    efficiency = "-" if record.efficiency is None else f"{record.efficiency:.3f}"
    training = record.training
    return (
        f"{record.env_id} {record.policy}, seed {record.seed}: success "
        f"{100 * record.success_rate:.1f} %, efficiency {efficiency}, cost {record.cost_mean:.4g}; "
        f"{training['timesteps']:,} steps, {training['seconds']:.0f} s, "
        f"{training['cpu_seconds']:.0f} s of processors"
    )
