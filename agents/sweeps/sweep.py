"""All trainings of a sweep, each in a process of its own, until each has its record."""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Sequence
from time import monotonic
from typing import Protocol

from rigid_envs.cli.progress import tell

from ..training.signals import StopSignals
from .patience import PATIENCE, Patience
from .training import DONE, IN_USE, Training

__all__ = ["Ended", "Workers", "train_all"]

_PAUSE = 5.0  # [s] until a run that other processes work in is looked at again
_SHOWN = 3  # trainings, in the line of progress
_DEATHS = 5  # of the process of a training, with nothing learnt between them

Ended = tuple[int, int | None, str]
"""Number of a training, status of `work` (None: its process died), and what to say of it."""


class Workers(Protocol):
    """Processes that train, here or elsewhere."""

    def has_room(self) -> bool:
        """Whether one more may start."""

    def start(self, number: int, training: Training) -> None:
        """Train in a process of its own.

        Args:
            number: Names the training.
            training: What to train.
        """

    def is_idle(self) -> bool:
        """Whether none trains."""

    def wait(self) -> list[Ended]:
        """The trainings that ended; waits for one, a second at most."""

    def kill(self, number: int) -> None:
        """End one that hangs, without a word; `wait` returns it as one that died.

        Args:
            number: Names the training.
        """

    def stop(self) -> None:
        """Ask all to save and end."""

    def close(self) -> None:
        """End what is left of them."""


def train_all(
    trainings: Sequence[Training],
    workers: Workers,
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
            failed = _Sweep(trainings, workers, signals, quiet, patience).run()
        finally:
            workers.close()
    if signals.received is not None:
        return 128 + signals.received
    return 1 if failed else 0


class _Sweep:
    def __init__(
        self,
        trainings: Sequence[Training],
        workers: Workers,
        signals: StopSignals,
        quiet: bool,
        patience: float,
    ) -> None:
        self._trainings, self._workers, self._signals = trainings, workers, signals
        self._quiet, self._patience = quiet, Patience(patience)
        self._running: dict[int, Training] = {}
        self._waiting = deque((k, 0.0) for k, each in enumerate(trainings) if not each.is_done())
        self._n_done = len(trainings) - len(self._waiting)
        self._deaths: dict[int, list[int]] = {}  # ages at which each died
        self._failed = False

    def run(self) -> bool:
        """Train all; whether one failed."""
        asked = False
        if self._n_done:
            self._say(f"{self._n_done} of {len(self._trainings)} have their record")
        while self._waiting or not self._workers.is_idle():
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
            self._kill_lost()
        return self._failed

    def _show(self) -> None:
        """Show how far all have come."""
        if not self._quiet:
            running = list(self._running.values())
            ages = [f"{each.folder.name} {each.progress()}" for each in running[:_SHOWN]]
            more = len(running) - len(ages)
            rest = [f"{more} more"] if more else []
            tell(f"[{self._n_done}/{len(self._trainings)}] {', '.join([*ages, *rest])}")

    def _say(self, text: str) -> None:
        if not self._quiet:
            tell("")
        print(text, flush=True)

    def _start_due(self) -> None:
        """Start what is due while there is room."""
        for _ in range(len(self._waiting)):
            if not self._workers.has_room():
                return
            number, due = self._waiting.popleft()
            if due > monotonic():
                self._waiting.append((number, due))
            elif self._trainings[number].is_in_use():
                self._again_later(number)
            else:
                self._workers.start(number, self._trainings[number])
                self._running[number] = self._trainings[number]

    def _kill_lost(self) -> None:
        """Kill those that hang."""
        for number in self._patience.lost(self._running):
            self._say(f"{self._trainings[number].folder}: has written nothing for too long")
            self._workers.kill(number)

    def _note(self, number: int, status: int | None, text: str) -> None:
        """Take note of the end of a process."""
        if status == DONE:
            self._n_done += 1
            self._say(f"[{self._n_done}/{len(self._trainings)}] {text}")
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
        self._say(f"{training.folder}: {text}; goes on from its last checkpoint")
        self._waiting.appendleft((number, 0.0))

    def _fail(self, text: str) -> None:
        if not self._quiet:
            tell("")
        print(f"error: {text}", file=sys.stderr, flush=True)
        self._failed = True

    def _again_later(self, number: int) -> None:
        self._waiting.append((number, monotonic() + _PAUSE))
