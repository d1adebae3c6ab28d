"""Processes on this machine, one for each training."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Sequence
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from .sweep import Ended
from .training import Training, work

__all__ = ["Processes"]

_WAIT = 1.0  # [s]


class Processes:
    """Workers of `train_all` on this machine."""

    def __init__(self, jobs: int, imports: Sequence[str] = ()) -> None:
        """Start none yet.

        Args:
            jobs: How many train at the same time.
            imports: Modules that register environments.
        """
        self._jobs, self._imports = jobs, tuple(imports)
        # Forked from a server that has imported torch and SB3 once, and has no threads.
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload([work.__module__])
        self._running: dict[Connection, tuple[int, BaseProcess]] = {}

    def has_room(self) -> bool:
        """Whether one more may start."""
        return len(self._running) < self._jobs

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
        self._running[ours] = number, process

    def is_idle(self) -> bool:
        """Whether none trains."""
        return not self._running

    def wait(self) -> list[Ended]:
        """The trainings that ended; waits for one, a second at most."""
        ended: list[Ended] = []
        for pipe in wait(list(self._running), _WAIT):
            assert isinstance(pipe, Connection)
            number, process = self._running.pop(pipe)
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
        for own, process in self._running.values():
            if own == number:
                process.kill()

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
