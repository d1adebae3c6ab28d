"""Many trainings on this machine."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import shutil
import signal
import sys
import threading
import traceback
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, NamedTuple

from rigid_envs.base.checks import ConfigError
from rigid_envs.sb3.adapter import NonFiniteError
from rigid_envs.scores.records import Record, read_record, record_file, write_record
from rigid_envs.scores.result import rates_of
from rigid_envs.tools.cli.words import say, tell

from ..config.entries import PLACES, Config, config_from, config_to_dict
from ..environments import import_allowed
from ..storage import runs
from ..training.recording import is_complete, make_record
from ..training.trainer import StopSignals, train_in

if TYPE_CHECKING:
    from .cluster import RayTasks

# One training of a sweep: a config, and the record of what came of it.

DONE, FAILED, IN_USE = 0, 1, 2
"""Statuses of `work`."""


class Training(NamedTuple):
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
        return self.config.folder

    @property
    def file(self) -> Path:
        """File of its record."""
        config = self.config
        return record_file(self.records, config.env_id, config.algo, config.frame, config.seed)

    def is_done(self) -> bool:
        """Whether its record is there."""
        return self._changed_record() == []

    def is_in_use(self) -> bool:
        """Whether a process works in its run."""
        return runs.is_in_use(self.folder)

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
        differing = {self.file: self._changed_record(), self.folder: self._changed_run()}
        for place, changed in differing.items():
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
        with closing(self._open()) as run:
            if self.is_done():  # another process was faster
                return None
            if run.new is not None or not is_complete(run):
                stopped_by = train_in(run, quiet=True).stopped_by
                if stopped_by is not None:
                    return stopped_by
            write_record(self.file, make_record(run, self.n))
            # Nothing is left to go on with, and a replay buffer is large.
            shutil.rmtree(run / "checkpoints", ignore_errors=True)
        return None

    def _open(self) -> runs.Run:
        """Its run: new, as it was left, or anew if it was of another config."""
        changed = self._changed_run()
        if changed == []:
            return runs.open_run(self.folder)
        return runs.create_run(self.config, overwrite=changed is not None)

    def _changed_run(self) -> list[str] | None:
        """What differs between the config and that of the run; None without a run."""
        return self._changed(self.folder / "config.yaml", runs.Run(self.folder).config)

    def _changed_record(self) -> list[str] | None:
        """What differs between the config and that of the record; None without a record."""
        here = {name: getattr(self.config, name) for name in PLACES}
        return self._changed(
            self.file, lambda: config_from({**read_record(self.file).config, **here})
        )

    def _changed(self, file: Path, read: Callable[[], Config]) -> list[str] | None:
        """What differs between the config and one that is read; None without its file."""
        if not file.is_file():
            return None
        try:
            return runs.differences(config_to_dict(read()), config_to_dict(self.config))
        except ConfigError as error:
            return [str(error)]


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
    except runs.RunInUseError as error:
        return IN_USE, str(error)
    except (ConfigError, NonFiniteError, OSError) as error:
        return FAILED, f"{training.config.env_id}: {error}"
    except Exception:
        return FAILED, f"{training.config.env_id}: {traceback.format_exc()}"
    if stopped_by is not None:
        return 128 + stopped_by, ""
    return DONE, _line(read_record(training.file))


def _line(record: Record) -> str:
    found, training = record.evaluation, record.training
    success, _, efficiency, _ = rates_of(found.figures())
    return (
        f"{record.env_id} {record.policy}, seed {record.seed}: success {success}, "
        f"efficiency {efficiency}, cost {found.mean(found.costs):.4g}; "
        f"{training['timesteps']:,} steps, {training['seconds']:.1f} s, "
        f"{training['cpu_seconds']:.1f} s of processors"
    )


# How long trainings that hang are waited for.

PATIENCE = 3600.0
"""Seconds for which a training may write nothing. Each update writes, and takes far less."""

_LONGEST = 5.0
"""Seconds that count between two looks: longer ones are of this process, stopped or asleep too."""


class Patience:
    """Watches what trainings write, and says which have written nothing for too long."""

    def __init__(self, seconds: float) -> None:
        """Watch none yet.

        Args:
            seconds: How long a training may write nothing.
        """
        self._seconds, self._looked = seconds, monotonic()
        self._seen: dict[int, tuple[float, float]] = {}  # time of the last sign, seconds since

    def lost(self, running: Mapping[int, Training]) -> list[int]:
        """Look at them.

        Args:
            running: Those that train now, each with its number.

        Returns:
            Numbers of those that have written nothing for too long, though a process works in their
            run: what waits in a queue is let be. They are counted anew from here on.
        """
        now = monotonic()
        passed, self._looked = min(now - self._looked, _LONGEST), now
        before, self._seen, late = self._seen, {}, []
        for number, training in running.items():
            sign = training.last_sign()
            last, silent = before.get(number, (-1.0, 0.0))
            silent = silent + passed if sign == last else 0.0
            if silent > self._seconds:
                late.append(number)
                silent = 0.0
            self._seen[number] = sign, silent
        return [number for number in late if running[number].is_in_use()]


# All trainings of a sweep, each in a process of its own, until each has its record.

_PAUSE = 5.0  # [s] until a run that other processes work in is looked at again
_SHOWN = 3  # trainings, in the line of progress
_DEATHS = 5  # of the process of a training, with nothing learnt between them

Ended = tuple[int, int | None, str]
"""Number of a training, status of `work` (None: its process died), and what to say of it."""


def train_all(
    trainings: Sequence[Training],
    workers: Processes | RayTasks,
    overwrite: bool = False,
    quiet: bool = False,
    patience: float = PATIENCE,
) -> int:
    """Train each config, or resume its run, and write its record.

    What has a record is left out. A run that another sweep works in is tried again later: several
    sweeps may share the work. A training whose process dies begins again from its last checkpoint;
    one that dies five times without a new checkpoint is given up. One that hangs is killed, and has
    died. No death hurts another training.

    Args:
        trainings: What to train.
        workers: Where; they are closed at the end.
        overwrite: Begin anew what was trained with another config.
        quiet: No progress, only the results.
        patience: How long a training may write nothing until it is killed [s].

    Returns:
        0; 1 if a training failed, which leaves no record; 128 + k if signal k ended it early.

    Raises:
        ConfigError: A run or a record is of another config; names what differs.
    """
    for training in trainings:
        if not overwrite:
            training.refuse_another()
    with StopSignals() as signals:
        try:
            failed = _Sweep(trainings, workers, signals, quiet, Patience(patience)).run()
        finally:
            workers.close()
    if signals.received is not None:
        return 128 + signals.received
    return 1 if failed else 0


@dataclass
class _Sweep:
    _trainings: Sequence[Training]
    _workers: Processes | RayTasks
    _signals: StopSignals
    _quiet: bool
    _patience: Patience

    def __post_init__(self) -> None:
        trainings = self._trainings
        self._running: dict[int, Training] = {}
        self._waiting = deque((k, 0.0) for k, each in enumerate(trainings) if not each.is_done())
        self._n_done = len(trainings) - len(self._waiting)
        self._deaths: dict[int, list[int]] = {}  # ages at which each died
        self._failed = False

    def run(self) -> bool:
        """Train all; whether one failed."""
        asked = False
        if self._n_done:
            say(f"{self._n_done} of {len(self._trainings)} have their record", sys.stdout)
        while self._waiting or self._running:
            if self._signals.stopping():
                self._waiting.clear()
                if not asked:
                    self._workers.stop()
                asked = True
            self._start_due()
            self._show()
            for number, status, text in self._workers.wait():
                del self._running[number]
                self._note(number, status, text)
            for number in self._patience.lost(self._running):
                silent = f"{self._trainings[number].folder}: has written nothing for too long"
                say(silent, sys.stdout)
                self._workers.kill(number)
        return self._failed

    def _show(self) -> None:
        """Show how far all have come."""
        if not self._quiet:
            running = list(self._running.values())
            ages = [f"{each.folder.name} {each.progress()}" for each in running[:_SHOWN]]
            more = len(running) - len(ages)
            rest = [f"{more} more"] if more else []
            tell(f"[{self._n_done}/{len(self._trainings)}] {', '.join([*ages, *rest])}")

    def _start_due(self) -> None:
        """Start what is due while there is room."""
        for _ in range(len(self._waiting)):
            if len(self._running) >= self._workers.room:
                return
            number, due = self._waiting.popleft()
            if due > monotonic():
                self._waiting.append((number, due))
            elif self._trainings[number].is_in_use():
                self._again_later(number)
            else:
                self._workers.start(number, self._trainings[number])
                self._running[number] = self._trainings[number]

    def _note(self, number: int, status: int | None, text: str) -> None:
        """Take note of the end of a process."""
        if status == DONE:
            self._n_done += 1
            say(f"[{self._n_done}/{len(self._trainings)}] {text}", sys.stdout)
        elif status == IN_USE:
            self._again_later(number)
        elif status is None:
            self._note_death(number, text)
        elif status < 128:
            self._fail(text)

    def _note_death(self, number: int, text: str) -> None:
        if self._signals.stopping():
            return
        training = self._trainings[number]
        ages = self._deaths.setdefault(number, [])
        ages.append(training.age())
        if ages[-_DEATHS:] == [ages[-1]] * _DEATHS:
            self._fail(f"{training.folder}: {text} {_DEATHS} times at the same place; given up")
            return
        say(f"{training.folder}: {text}; goes on from its last checkpoint", sys.stdout)
        self._waiting.appendleft((number, 0.0))

    def _fail(self, text: str) -> None:
        say(f"agents: {text}")
        self._failed = True

    def _again_later(self, number: int) -> None:
        self._waiting.append((number, monotonic() + _PAUSE))


# Processes on this machine, one for each training.

_WAIT = 1.0  # [s]


class Processes:
    """Workers of `train_all` on this machine."""

    def __init__(self, jobs: int, imports: Sequence[str] = ()) -> None:
        """Start none yet.

        Args:
            jobs: How many train at the same time.
            imports: Modules that register environments.
        """
        self.room: float = jobs
        self._imports = tuple(imports)
        # Forked from a server that has imported torch and SB3 once, and has no threads.
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload([work.__module__])
        self._running: dict[int, tuple[Connection, BaseProcess]] = {}

    def start(self, number: int, training: Training) -> None:
        """Train in a process of its own.

        Args:
            number: Names the training.
            training: What to train.
        """
        ours, theirs = self._context.Pipe(duplex=False)
        process = self._context.Process(target=_main, args=(theirs, training, self._imports))
        process.start()
        theirs.close()  # now its end is the end of the process
        self._running[number] = ours, process

    def wait(self) -> list[Ended]:
        """The trainings that ended; waits for one, a second at most."""
        ended: list[Ended] = []
        ready = wait([pipe for pipe, _ in self._running.values()], _WAIT)
        for number, (pipe, process) in list(self._running.items()):
            if pipe not in ready:
                continue
            del self._running[number]
            try:
                status, text = pipe.recv()
            except EOFError:
                process.join()
                status, text = None, _cause(process.exitcode)
            pipe.close()
            process.join()
            ended.append((number, status, text))
        return ended

    def kill(self, number: int) -> None:
        """End one that hangs, without a word.

        Args:
            number: Names the training.
        """
        self._running[number][1].kill()

    def stop(self) -> None:
        """Ask all to save and end."""
        for _, process in self._running.values():
            process.terminate()
            assert process.pid is not None
            with contextlib.suppress(ProcessLookupError):
                os.kill(process.pid, signal.SIGCONT)  # one that was paused could not save

    def close(self) -> None:
        """End what is left of them."""
        self.stop()
        for _, process in self._running.values():
            process.join()


def _main(pipe: Connection, training: Training, imports: tuple[str, ...]) -> None:
    """Train; saves and ends with the sweep, even if that is killed."""
    # Ctrl-C reaches all processes of a terminal. The sweep gets it, and asks the others to stop.
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    threading.Thread(target=_end_with_parent, daemon=True).start()
    ended = work(training, imports)
    with contextlib.suppress(BrokenPipeError):  # the sweep was killed
        pipe.send(ended)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os.kill(os.getpid(), signal.SIGTERM)


def _cause(status: int | None) -> str:
    if status is not None and status < 0:
        return f"its process was ended by {signal.Signals(-status).name}"
    return f"its process ended with status {status}"
